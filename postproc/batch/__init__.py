"""Many jobs: local processes or an existing cluster, restartable.

`jobsfile` and `values` say what there is to do, `jobs` checks it and reads what a worker needs. `run` hands jobs to
`executors`, whose workers do `work`, and keeps in `records` what was made from what. `document` says the result.
`differences`: two folders compared.
"""
