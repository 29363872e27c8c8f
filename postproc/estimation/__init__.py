"""Least squares on measured poses: the fit, what it knows about itself, and what it says about the data.

Measurements beside a model as whitened residuals and columns: `problem`, `linear`. The fit: `least_squares`
by the steps in `solving`; what it found: `solution`, and what that says about noise and uncertainty: `fitted`, with
`held_out`, `independent`, `residual_split`; what a fall of the residual says: `evidence`. What was known before the
rows: `priors`; what both say together: `posterior`.
What is written into a model file: `recorded`, unless it is farther off than the `nominal` arm; what a fit brings to
light: `findings`.
"""
