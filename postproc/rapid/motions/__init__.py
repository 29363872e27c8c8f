"""Motion events: one execution of a motion statement with everything in force at that moment.

`events_of` makes an event from its `targets`, `settings` (tool, speed, zone, weld), what instructions have set at the
moment, and the numbers that it goes with; `missing` says which names have no value, `doubts` which orientations are
rough and which lines need SingArea. `recorder` keeps the events, and knows where the arm may come from.
`units` (metres and matrices) serves the rooms below.
"""
