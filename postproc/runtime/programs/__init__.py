"""Programs whose targets are corrected on the controller: the second pass over what numbers have left.

`reach` says which statements the function can correct, and sends their targets through it; `program` what else is
written for it; `correct` puts it into a program, and runs it for targets that are known.
"""
