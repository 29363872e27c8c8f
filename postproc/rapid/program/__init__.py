"""The files of one task.

`program` holds the files and resolves names by their `scopes`; `arguments` reads the arguments of a statement, those of
a motion by the `signatures` of its instruction; `shared_data` is what other tasks declare, and which data they share;
`read_along` what files near it declare of what it lacks.
`statement_effects` says what one statement may write and run, `write_effects` what a piece of program may write with
all that it calls, `function_effects` which functions do so in expressions. `references` says where data is used,
`from_the_arm` which data holds where the arm has stood, `late_binding` what a text may name, `instructions` which ones
the controller has, `spelling` what a name that is nowhere may be a misspelling of.
"""
