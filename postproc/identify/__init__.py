"""Compare, diagnose, add, predict, and the design of the next measurement.

Named effects, their forms as columns, composed, shaped (hoses, knees), judged, ranked: `forms`, `gains`, `candidate`,
`selection`, `shaped`, `judgement`, `alike`, `ranking`, `refits`. What a fit leaves without a name: `unnamed`. One way
of the search, with what it takes and what the whole is worth, and which way it is: `way`, `taking`, `whole`, `search`.
Back again, names against patterns, and the verdict: `lines`, `backward`, `contest`, `diagnose`. Whether it carries over
to what was changed: `interventions`. What is said: `verdict`, `report`. Other commands: `compare` (with `trends`),
`add`, `predict`, `plan` (with `design` and `room`).
"""
