"""Least squares on measured poses: the fit, what it knows about itself, and what it says about the data.

Measurements beside a model, whitened residuals and columns, ranks, held-out errors, what a fall is worth: `problem`,
`linear`, `errors`, `held_out`, `independent`, `worth`, `channels`. Start without a guess, steps with what the data
determines: `start`, `determined`, `step`, `solve`, `least_squares`. Weights, rounded angles, smoothness of free
functions: `reweight`, `rounding`, `smooth`. The result, and what is left of it: `fitted`, `noise_parts`, `unseen`,
`leftover`, `findings`. What is said and written: `record`, `report`, `wording`; `watch` tells how far a long fit is.
Laws that belong to one session: `session_laws`.
"""
