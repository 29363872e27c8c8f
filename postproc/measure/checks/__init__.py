"""What a table tells about itself: what is `likely_wrong`, by `sizes` and by `readings` that would fit better.

`repeats`: the noise that repeats of a pose tell; `copies`: rows that agree digit by digit.
"""
