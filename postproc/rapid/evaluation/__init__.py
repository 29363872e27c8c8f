"""The value of an expression and the data that a program holds at a moment.

`evaluate` works an expression out, `literals` reads targets written as numbers; `declared` is what a declaration
says, `memory` what holds at a moment, `assign` and `accessor` write and read it, `call_binding` binds parameters,
`state` is what instructions set (GripLoad, PDispSet, ConfL ..), `teaching` what calibration routines set.
"""
