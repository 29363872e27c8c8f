"""The library of physical effects, one file each, and the contract they share.

The contract: `base` (the class and its forms), `contract` (state, load, displacement), `parameters` (unit, bounds,
ordinary size), `roles` (what the rest of the package asks for), `sums` (effects of several terms), `asking` (how the
rest of the package asks), `similarity` (sizes on other arms), `geometry` (points, axes and weights that effects
need), `files` (in a model file), `run_time` (in the tables of a controller's function), `terms` (of curves).
Which there are: `library`, and `registry` with those of packages and users; `modules` runs a user's file, `loading`
takes its effects through the `conformance` kit; `findings` are placed where it is written.
"""
