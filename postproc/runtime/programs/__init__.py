"""Programs whose targets are corrected on the controller: the second pass over what numbers have left.

`statements` sends targets of a statement through the function; `reach` says which statements it can correct; `program`
what else is written for it; `applied` what it makes of targets that are known; `correct` puts it into a program.
"""
