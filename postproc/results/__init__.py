"""What each result says: its values and its blocks, decided once; `postproc/report` draws them.

A file each: `conversion` of a program, `batch`, `difference` of programs and of folders; `fit`, `comparison`,
`diagnosis` (with its `sentences`), `addition`, `plan`; `certificate` is to be signed. `wording` of fitted numbers.
"""
