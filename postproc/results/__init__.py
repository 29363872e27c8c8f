"""What each result says: its values and its blocks, decided once; `postproc/report` draws them.

A file each: `conversion` of a program with its `figures` and `conclusion`, `inspection`, `difference` of programs and
of folders; `fit`, `comparison`, `diagnosis` (with its `sentences`), `addition`, `plan`, `first_plan`, `touchups`;
`certificate` is to be signed, and states what it rests on (`provenance`); `library` of arms and effects,
`work_objects`. `wording` of fitted numbers. That of a batch stands in `postproc/batch`, that of a module for run time
in `postproc/runtime`.
"""
