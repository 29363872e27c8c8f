"""How a process works: threads of the linear algebra, how often Python looks for garbage, what scipy loads."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

# The names that numpy's libraries read when they are first loaded.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
COLLECT = (200_000, 20, 20)
"""Thresholds: a long program is a million objects that live to the end; a menu of many parts took twice its time."""
SPARED = ("f2py", "testing")


@contextmanager
def seldom_collecting() -> Iterator[None]:
    """Set the thresholds of garbage collection to ``COLLECT`` in a ``with`` block, and restore them after it."""
    before = gc.get_threshold()
    gc.set_threshold(*COLLECT)
    try:
        yield
    finally:
        gc.set_threshold(*before)


def load_scipy() -> None:
    """Import scipy without the parts of numpy for Fortran and tests, which saves a twentieth of a second.

    scipy takes over all names of numpy (`from numpy import *`), and numpy loads these two parts when they are asked
    for. Whoever asks for them later gets them as always.
    """
    import numpy

    absent = [name for name in SPARED if name not in vars(numpy)]
    vars(numpy).update(dict.fromkeys(absent))
    try:
        import scipy.linalg  # noqa: F401
    finally:
        for name in absent:
            if vars(numpy)[name] is None:
                delattr(numpy, name)
