"""How a row observes the TCP where it is no position, as a smooth function of it and of unknowns of its set-up.

`base` is the contract; one file a kind: `tip`, `plane`, `distance` (from an anchor), `gauge`, `between` (two rows).
`observed` evaluates all rows of a table; nothing else knows the kinds.
"""
