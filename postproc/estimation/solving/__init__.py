"""How a fit is found: steps of least squares with what the data determines.

A `start` without a guess, `setups` of tips, planes and gauges in it; one `step` with what is `determined`; steps until
nothing moves, `solve`. `reweight` excludes rows, `rounding` weighs rounded angles, `smooth` chooses how smooth free
functions are, `session_laws` holds laws that belong to one session. `settle` moves what the rows alone would have to
the posterior.
"""
