"""Tables from files: `table` reads one, `together` several.

`cells` (text to columns, with `numbers` and `times`), `spreadsheet` (workbooks), `join` (joints in a second file),
`layout` (column maps), `columns` and `units` (names and what they are stated in), `lookup` (standard columns in SI),
`external_axes` (where the arm stood), `terms` (what the user says of a table), `own` (channels of the user), `turns`
(orientations), `commanded` (joint angles from poses or from a program).
"""
