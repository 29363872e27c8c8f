"""Tables from files: `table` reads one, `together` several.

`cells` (text or a workbook to columns), `values` (numbers, units and times in a cell), `turns` (orientations),
`layout` (column maps), `columns` (names), `lookup` (standard columns in SI), `channels` (those of the user),
`external_axes` (where the arm stood), `setups` (tips, planes, gauges), `terms` (what the user says of a table),
`commanded` (joint angles from poses or from a program).
"""
