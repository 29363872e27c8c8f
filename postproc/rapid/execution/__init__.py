"""A program followed in the order in which it runs.

`interpreter` says what statements do; `abstract_interpreter` follows all paths of control and joins their data.
`walk` starts the routines of a program, with what `cycles` before have left; what only the controller can tell, a
branch that sets data may decide: `path_splitting` follows its arms one by one. `jumps` turns GOTO into branches and
loops, `findings` is what is reported of what was followed. `measured` says which data the program measures, and what
makes it known.
"""
