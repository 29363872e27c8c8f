"""A correction that travels with the program: a RAPID module that corrects targets that exist only at run time.

`conditions` what it is made for; `tables` what the effects of a model put into its tables; `module` the text, a fixed
one (templates/runtime_module.j2) with the tables filled in; `proof` runs it and compares it with the model; `written`
writes and proves it, `document` says what came out; `programs` sends through it what numbers have left of a program,
and `passes` are both: by numbers, and at run time.
"""
