"""Corrected programs against the originals in several worlds, by an interpreter that shares nothing with the package.

``python -m tests.worlds [-v] [FILES..]`` prints a table. `interpreter` runs a program in a `world`, `compare` compares
two, `product` is the only contact with the package; `test_judge` shows that relative corrections pass and absolute
ones do not. A program in `programs` says in its first line what it tests, and in comments what values make sense.
"""
