"""Compare, diagnose, add, predict, and plan the next measurement.

What is tried: effects of the library, and `curves` of channels. What each is worth: `screen`. The search adds the best
(`search`, from `state` to state), where rows that were held out confirm it (`acceptance`); `refits` are fits with some
of what it added; `regions` leaves out parts of the joint space, and searches anew without them; `forecast` tells how
far it is; `indistinguishable` says what the data does not tell apart. The result is a `diagnosis`, made by `diagnose`,
with `joint_curves` to be drawn. Other commands: `compare`, `add`, `predict` (with
`readings` of tips, planes and gauges), and `planning` of the next measurement.
"""
