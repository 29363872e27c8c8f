"""Compare, diagnose, add, predict, and the design of the next measurement.

Named effects, their forms as columns, composed, shaped (hoses, knees), judged, ranked: `forms`, `gains`, `candidate`,
`selection`, `shaped`, `judgement`, `alike`, `ranking`, `refits`. Forward, back again, names against patterns, and the
verdict: `search`, `whole`, `lines`, `backward`, `contest`, `diagnose`. What is said: `verdict`, `report`. Other
commands: `compare` (with `trends`), `add`, `predict`, `plan` (with `design`).
"""
