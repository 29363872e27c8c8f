"""A correction that travels with the program: a RAPID module that corrects targets that exist only at run time.

`conditions` what it is made for; `formulas` the correction of a target from a model, for RAPID and for numpy; `module`
the text; `proof` runs it and compares it with the model; `written` writes and proves it; `programs` says which
statements it can correct and puts it into a program.
"""
