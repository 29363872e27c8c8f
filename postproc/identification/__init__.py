"""Compare, diagnose, add, predict, and the design of the next measurement.

What may be missing: `candidates`. What it is worth: `gain`; what comes near the best fitted in full, and whether
that is accepted: `acceptance`. The search, and where it stands: `forward`, `state`; fits with some of
what it found: `refits`; what the data does not tell apart, on parts of it too: `indistinguishable`; laws that turn
joints: `joint_curves`. The verdict and how it is found: `diagnosis`, `diagnose`, with `lack_of_fit` against the noise.
Other commands: `compare` (with `trends`), `add`, `predict`; the next poses: `planning`.
"""
