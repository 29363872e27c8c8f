"""The files of one task.

`program` holds the files and resolves names by their `scopes`; `arguments` reads a motion statement by the
`signatures` of its instruction; `read_only` is what other tasks declare, and which data they share. `references` says
where data is used, `write_effects` what a piece of program may write, `function_effects` what functions do there,
`late_binding` which procedures a text may name, `instructions` which ones the controller has, `spelling` what a name
that is nowhere may be a misspelling of.
"""
