"""A program followed in the order in which it runs.

`interpreter` says what statements do; where a program has several ways, `all_ways` follows all of them and `one_way`
one. `walk` starts the routines of a program, all ways; what only the controller can tell, a branch that sets data may
decide: `path_splitting` follows its arms one by one. `jumps` turns GOTO into branches and loops, `findings` is what is
said on the way. `follower` goes the one way that a world of `worlds` chooses. `measured` says which data the program
measures, and what makes it known.
"""
