"""Many jobs: local processes or an existing cluster, restartable."""
