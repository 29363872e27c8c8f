"""An abstract interpreter: a program followed in the order in which it runs.

`walk` starts routines, `calls` runs them, `flow` follows branches, `path_splitting` those that only set data,
`loops` and `jumps` (GOTO) repeat.
"""
