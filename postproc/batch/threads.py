"""How processes are set up: threads of the linear algebra, and how often Python looks for garbage."""

# The names that numpy's libraries read when they are first loaded.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
COLLECT = (200_000, 20, 20)
"""Thresholds: a long program is a million objects that live to the end; a menu of many parts took twice its time."""
