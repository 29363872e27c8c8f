"""Text to trees.

`tokens` and `patterns` (pieces larger than a token) serve `statements` and `modules`, which make the `nodes` of a
file; `expressions` are read into `trees`. `spans` are places of numbers, and bytes that change.
"""
