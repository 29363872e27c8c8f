"""How a process works: what is loaded with scipy, and how often garbage is looked for."""

from __future__ import annotations

import gc
import subprocess
import sys

import pytest

from postproc.process import COLLECT, seldom_collecting

LOADING = """
import sys
from postproc.process import load_scipy
load_scipy()
import postproc.convert
assert "numpy.f2py" not in sys.modules, "a Fortran compiler is loaded"
import numpy
numpy.testing.assert_allclose(1.0, 1.0)
assert numpy.f2py.__name__ == "numpy.f2py"
load_scipy()
assert numpy.testing.__name__ == "numpy.testing"
"""


def test_scipy_comes_without_a_compiler_that_numpy_still_has() -> None:
    subprocess.run([sys.executable, "-c", LOADING], check=True)


def test_thresholds_are_put_back() -> None:
    before = gc.get_threshold()
    with pytest.raises(ValueError), seldom_collecting():
        assert gc.get_threshold() == COLLECT
        raise ValueError
    assert gc.get_threshold() == before
