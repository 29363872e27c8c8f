"""The commands: one thin file each, nothing below imports from here.

`app` lists them, `run` is the boundary to the shell (exit codes). `convert` holds commands on programs, `improve` on
models, `look_up` the others; `hooks` runs one for each of many programs (pre-commit, CI), which `hook_files` finds.
Shared: `options` and `program_options` (what several commands ask), `data_names` (options
that name data), `frames` (tool and mounting), `inputs` and `programs` (files that are read),
`versions` of programs, `output` (files that are written), `printing` and `progress` (what is printed).
"""
