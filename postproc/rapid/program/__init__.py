"""The files of one task.

`program` holds the files and resolves names by their `scopes`; `arguments` reads a motion statement by the
`signatures` of its instruction; `events` is the contract with the rooms below: motion statements and their
executions. `predefined` is what every controller has (v100, z10, tool0), `read_only` what other tasks declare.
`references` says where data is used, `write_effects` what a piece of program may write, `function_effects` what
functions do there, `late_binding` which procedures a text may name, `instructions` which ones the controller has.
`records` (what a robtarget or tooldata is), `values` (how it is computed with), `pose` and `builtins` (Offs ..)
are RAPID's own.
"""
