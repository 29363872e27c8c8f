"""The commands: one thin file each, nothing below imports from here.

`app` lists them, `run` is the boundary to the shell (exit codes). Programs: `compensate` (`finish`), `inspect`,
`batch` (`progress`), `seam`, `runtime` (`made_for`), `diff`. Models: `fit`, `compare`, `diagnose`, `add`, `predict`,
`plan`. To look up: `effects`, `robots`, `explain`. Shared: `options` and `conversion` (what several commands ask),
`inputs` and `programs` (files that are read), `output` (files that are written), `report` (what is printed).
"""
