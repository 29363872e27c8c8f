"""Least squares on measured poses: the fit, what it knows about itself, and what it says about the data."""
