"""Many jobs: local processes or an existing cluster, restartable.

What there is to do: `discover` (folders and backups), `jobsfile`, `values` of all.
Doing it: `run` hands `jobs` to `executors`, whose workers do `work`, and keeps a `journal` of what is done, in
`lines`. `contradictions`: what settings say against a controller; `backinfo`: its lists of modules. `nearby`: files
that declare what a program lacks. `document`: what is said of a batch, `summary`: of a task, in a line.
`differences`: two folders compared.
"""
