"""What a table tells about itself: what is `likely_wrong`, not `plausible`, and which `readings` would fit better.

`repeats`: the noise that repeats of a pose tell.
"""
