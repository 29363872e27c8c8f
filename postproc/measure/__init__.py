"""Measurement tables: reading, units, frames, repeats, ISO 9283 figures.

`table` reads one file into `measurements`, `together` several: `cells` (text to columns, with `numbers` and `times`),
`layout` (column maps), `columns` and `units` (names and what they are stated in), `lookup` (standard columns in SI),
`spreadsheet` (workbooks), `join` (joints in a second file), `terms` (what the user says of a table), `observations`
(kinds of measured numbers and their units), `own` (channels of the user), `turns` (orientations), `commanded` (joint
angles from poses or from a program), `trajectory` and `clock` (records of a moving arm).
What is likely wrong: `checks`, `sizes`, and `readings` that would fit better, by `alignment` of points and arm.
`repeat`: the noise that repeats of a pose tell; `iso9283`: accuracy and repeatability.
"""
