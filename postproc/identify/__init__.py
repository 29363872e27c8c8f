"""Compare, diagnose, add, predict, and the design of the next measurement.

What may be missing, as columns: `forms`, `candidate`. What it is worth, and all thresholds: `evidence`. The best
composition of an effect, what only forms it moved to where it explains most, whether a full fit of it is accepted,
every effect so: `composition`, `nonlinear`, `acceptance`, `ranking`. The search, and where it stands: `forward`,
`state`; fits with some of what it found: `refits`; what the data does not tell apart: `indistinguishable`. The verdict,
how it is found and how it is said: `diagnosis`, `diagnose`, `sentences`, `report`; whether it carries over to levels
that no fit has seen: `interventions`. Other commands: `compare` (with `trends`), `add`, `predict`, `plan` (with
`design` and `room`).
"""
