"""The value of an expression and the data that a program holds at a moment.

`evaluate` works an expression out; `declared` is what a declaration says, also a target written as numbers, `memory`
what holds at a moment, `assign` and `accessor` write and read it, the latter also binds parameters; `state` is what
instructions set (GripLoad, PDispSet, ConfL ..), `teaching` what calibration routines set.
"""
