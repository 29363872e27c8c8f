"""A program followed in the order in which it runs: by an abstract interpreter, or concretely.

`walk` starts routines, `calls` runs them, `flow` follows branches, `path_splitting` those that only set data,
`loops` and `jumps` (GOTO) repeat. `follower` takes one way through the program, in one of the `worlds` that have a
value for all that the text leaves open. `measured` says which data the program measures, and what makes it known.
"""
