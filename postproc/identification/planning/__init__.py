"""The next poses to measure: what they would tell, and whether they would tell two effects apart.

`design` chooses poses one after another, `promise` simulates tables with them and searches these, `plan` is the result.
Without a table `setups` chooses what a shop can read first, at postures that `standing` finds. Both may be for the
`weld_targets` of programs. `table` is to be filled in.
"""
