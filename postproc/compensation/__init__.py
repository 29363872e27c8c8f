"""From a program and a model to the changes of its text, and the proof that they are right.

Asked: `options`, `tolerances`. `reading` makes the motion of a program (`path`), `plan` goes round until nothing
changes: `correction` is what the arm should be told, `text` how the program says it. `readback` runs the written text,
`postures` reads its confdata, `choices` follows it with the other values that a program knows for open data,
`judgement` says what came out. `conversion`: all of that in one value. `inspection`: what a program moves.
"""
