"""What effects, curves and reports read of a state, by name.

`state`: n states of one arm, with the columns that a table or a program gives. `units`: how people read a channel.
`expression`: a channel by its name, recorded or derived (``abs(load2)``, ``lag(temperature, 2640 s)``). `memory`: what
earlier rows leave behind. `tool`: forces on the tool and the moment on the footing. `sight`: what an instrument reads.
"""
