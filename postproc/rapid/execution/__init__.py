"""A program followed in the order in which it runs.

`interpreter` says what statements do; where a program has several ways, `all_ways` follows all of them. `walk` starts
the routines of a program, all ways; what only the controller can tell, a branch that sets data may decide:
`path_splitting` follows its arms one by one. `jumps` turns GOTO into branches and loops, `findings` is what is said on
the way. `measured` says which data the program measures, and what makes it known.
"""
