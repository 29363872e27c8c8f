"""What each result says: its values and its blocks, decided once; `postproc/report` draws them.

`convert` for programs, `improve` for models, `certificate` to be signed and what it rests on (`provenance`), `library`
of arms and effects; `wording` of fitted numbers. What a batch says stands in `postproc/batch`, what a module for run
time says in `postproc/runtime`.
"""
