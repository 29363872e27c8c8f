"""From a program and a model to the changes of its text, and the proof that they are right.

What the user chose: `options`, `tolerances`. `reading` makes the motion of a program (`path`); `plan` decides what is
changed: which statements stay (`seams`), what is commanded (`correction`), how the program says it (`text`).
`readback` runs the written text, `choices` follows it with the other values that a program knows for open data,
`judgement` says what came out. `conversion`: all of that in one value, a draft until it is written. `verdict`: is the
tolerance kept, in one sentence. `inspection`: what a program moves.
"""
