"""A correction that travels with the program: a RAPID module that corrects targets that exist only at run time.

`conditions` what it is made for; `laws` what the effects of the model do; `curves` functions as tables; `tape`
formulas for RAPID and for numpy; `formula` the correction of a target; `fitted` what is no closed form; `correction`
all of it from a model; `module` the text; `execution` runs it, in `lanes`; `check` compares it with the model;
`chord` says what is left between targets; `written` writes and proves it; `statements` sends targets of a statement
through it; `from_the_arm` knows data that hold where the arm has stood; `reach` says which statements it can correct;
`applied` what it makes of targets that are known; `program` puts it into a program.
"""
