"""What each addition is worth on what a fit leaves, before it is fitted in full.

Of the library: the `forms` of each effect, the best `composition` of them as a `candidate`, its `gain` (a score test),
and what only shapes an effect moved to where it explains most (`nonlinear`). Of `curves`: each at every `place`; what
is told of the best are `suspects`, with the `limits` of their numbers.
"""
