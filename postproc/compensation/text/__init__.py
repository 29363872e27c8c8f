"""How the text gets the correction.

`requests` are the corrected targets of all executions, `slots` the places in the text that can hold them, and the
offsets that can go around them; `assignment` gives each slot its value and each argument its offset by `laws`, `writer`
makes changes of that (`values`). Added targets: what they follow (`added_targets`), which statement
they get, and where they may be added (`insertions`). `marks` show that a text was compensated before.
"""
