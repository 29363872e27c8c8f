"""Curves that may be missing: products of functions of channels, without a name.

`signal`: what a function is of, with its values on the rows. `functions`: each function with its grid, its sentence and
what it may become when looked at closer. `form`: products of them, many at once. `families`: all that are tried, with
those of what is `derived` (forces on tool and footing, readings, earlier rows). `prior`: what each costs.
"""
