"""The files of one task.

`program` holds the files and resolves names by their `scopes`; `arguments` reads the arguments of a statement, those
of a motion by its instruction (`signatures`, with all other instructions that controllers have); `read_along` is what
files near it declare of what it lacks, and which data other tasks share. `statement_effects` says what one statement
and the functions in it may write and run, `write_effects` what a piece of program may write with all that it calls.
`references` says where data is used, `from_the_arm` which data holds where the arm has stood, `late_binding` what a
text may name, `spelling` what a name that is nowhere may be a misspelling of.
"""
