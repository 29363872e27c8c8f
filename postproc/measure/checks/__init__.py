"""What a table tells about itself: what is `likely_wrong`, not `plausible`, and which `readings` would fit better.

`setups`: directions, units and single readings of gauges. `tips`: points that are touched. `repeats`: the noise that
repeats of a pose tell. `references`: reflectors beside the arm, which watch the instrument.
"""
