"""A correction that travels with the program: a RAPID module that corrects targets that exist only at run time.

`conditions` what it is made for; `tables` what the effects of a model put into its tables; `module` the text, a fixed
one (templates/runtime_module.j2) with the tables filled in; `proof` runs it and compares it with the model; `written`
writes and proves it; `programs` says which statements it can correct and puts it into a program.
"""
