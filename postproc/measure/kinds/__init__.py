"""How a row observes the TCP where it is no position, as a smooth function of it and of unknowns of its set-up.

`base` is the contract; `tip`, `plane`, `gauge` and `distance` (from an anchor, or between two rows) are the kinds.
`observed` evaluates all rows of a table; nothing else knows the kinds.
"""
