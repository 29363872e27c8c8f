"""The inverse of the model along a path, where to add targets, and the proof.

What is asked: `options`; `applicable` is the part of the model that holds for a program. What the arm does: `reading`
makes a `motion` of `samples` (closer where a joint turns back: `reversals`) and a `timeline` (with the arm's natural
`periods`). What it should be told: `inverse` (the commanded pose), `correction` (along every move).

How the text gets it: `plan` goes round until nothing changes: `wishes` (targets as they should be), `targets` to add
(by `placement`), `decisions` which text changes (`texts`, `sharing` between runs, `values`), `added` statements
(`insertions`, for unequal runs `between`), `following` (what stays or is derived), `circles` (arcs that would suffer).

The proof: `readback` runs the written text, `worlds` follows it where run-time data differs, `proof` measures how
far the real arm is off; `figures`, `outcomes`,
`transitions`, `dynamics` (limits), `accuracy` (what the model itself is sure of) and `belief` say what came out,
`document` as JSON and in a line.
"""
