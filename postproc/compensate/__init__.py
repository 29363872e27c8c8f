"""The inverse of the model along a path, where to add targets, what is written, and the proof.

What is asked: `options`, `tolerances`; `applicable` is the part of the model that holds for a program. What the arm
does: `reading` makes a `motion` of `samples` (closer where a joint turns back: `reversals`) and a `timeline` (with the
arm's natural `periods`). What it should be told: `inverse` (the commanded pose), `correction` (along every move).

How the text gets it: `plan` goes round until nothing changes. `requests` are the corrected targets of all executions,
`slots` the places in the text that can hold them; `assignment` gives each slot its value and each argument its offset
by `laws`, `writer` makes changes of that (`values`, `expressions`). Targets to add: how many (`targets`, `placement`),
what they follow (`added_targets` with `bends`, `arcs`), which
statement (`insertions`); `circles` are arcs that would suffer.

The proof: `readback` runs the written text, `worlds` follows it where run-time data differs, `proof` measures how far
the real arm is off; `figures`, `seams`, `outcomes`, `transitions`, `dynamics` (limits), `accuracy` (what the model
itself is sure of) and `belief` say what came out, `document` as JSON and in a line.
"""
