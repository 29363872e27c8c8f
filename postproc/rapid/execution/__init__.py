"""A program followed in the order in which it runs, by one interpreter.

`walk` starts routines, `calls` runs them, `flow` follows branches, `path_splitting` those that only set data,
`loops` and `jumps` (GOTO) repeat. What the text leaves open an `oracle` is asked: of one without answers both ways are
followed; `worlds` answer everything, and `follower` keeps the motions of that one way. `measured` says which data the
program measures, and what makes it known.
"""
