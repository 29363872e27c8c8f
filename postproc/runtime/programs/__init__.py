"""Programs whose targets are corrected on the controller.

`statements` sends targets of a statement through the function; `reach` says which statements it can correct; `applied`
what it makes of targets that are known; `program` puts it into a program.
"""
