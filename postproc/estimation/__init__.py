"""Least squares on measured poses: the fit, what it says about its parameters, and what it says about the data.

Measurements and a model as whitened residuals and columns: `problem`, `linear`. The fit: `least_squares` by the steps
in `solving`; what it gives: `solution`, and what that says about noise and uncertainty: `fitted`, with `independent`
and `held_out`; what it is worth beyond its rows: `validation`; what a fall of the residual says: `evidence`. What was
known before the rows: `priors`; what both say together: `posterior`, and of the masses of the links: `link_mass`. What
is written into a model file, unless the nominal arm is nearer: `recorded`; findings on a fit: `findings`, and those by
which nothing can be promised of it: `contradictions`.
"""
