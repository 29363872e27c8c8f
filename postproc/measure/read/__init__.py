"""Tables from files: `table` reads one, `together` several.

`cells` (text to columns), `values` (what stands in one), `spreadsheet` (workbooks), `join` (joints in a second file),
`layout` (column maps), `columns` (names), `lookup` (standard columns in SI), `external_axes` (where the arm stood),
`terms` (what the user says of a table), `own` (channels of the user), `commanded` (joint angles from poses or from a
program).
"""
