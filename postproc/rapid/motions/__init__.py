"""Motion events: one execution of a motion statement with everything in force at that moment.

`events_of` makes an event from its `targets`, `settings` (tool, speed, zone, weld), what instructions have set at the
moment (`moments`) and `regressors` (numbers it goes with); `missing` and `rough` say what is wrong with them.
`elements` are the cases of a target that a number of the controller chooses. `recorder` keeps the events, and knows
where the arm may come from. `wrist_flips` are lines that need SingArea.
`units` (metres and matrices) serves the rooms below.
"""
