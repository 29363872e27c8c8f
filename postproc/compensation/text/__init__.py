"""How the text gets the correction.

`requests` are the corrected targets of all executions, `slots` the places in the text that can hold them;
`assignment` gives each slot its value and each argument its offset by `laws`, `writer` makes changes of that
(`values`, `expressions`). Added targets: what they follow (`added_targets` with `path_points`), which statement they
get (`insertions`), and where the arm always comes from (`predecessors`).
"""
