"""How a process works: what is imported, how often garbage is looked for, and how much memory a conversion takes."""

from __future__ import annotations

import gc
import os
import subprocess
import sys

import pytest

from postproc.process import COLLECT, seldom_collecting
from tests.conftest import ROOT

LOADING = """
import sys
from postproc.process import spare_scipy
spare_scipy()
import postproc.convert, postproc.motion.timing.constraints
from postproc.cli.app import build
from postproc.cli.run import run
assert run(build(), ["compensate", "samples/hull_seam.mod", "--check"]) == 1
spared = ("numpy.f2py", "matplotlib", "scipy.interpolate", "scipy.linalg._basic", "scipy.optimize", "scipy.sparse")
spared += ("scipy.special", "scipy.stats")
assert not [name for name in spared if name in sys.modules]
import numpy, scipy
numpy.testing.assert_allclose(1.0, 1.0)
assert numpy.f2py.__name__ == "numpy.f2py"
spare_scipy()
assert numpy.testing.__name__ == "numpy.testing"
from scipy.spatial.transform import Rotation, RotationSpline
from scipy.spatial import KDTree, distance
assert Rotation is scipy.spatial.transform.Rotation
assert "solve" in dir(scipy.linalg) and scipy.constants.g == 9.80665
assert KDTree([[0.0, 0], [1, 1]]).query([0.9, 1])[1] == 1
"""
ANOTHER_SCIPY = """
import postproc.process as process

def without_rigid_transforms(name):
    if name.endswith("_rigid_transform"):
        raise ImportError(name)
    return __import__("importlib").import_module(name)

process.import_module = without_rigid_transforms
process.spare_scipy()
import postproc.convert
import scipy
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation, RotationSpline
assert scipy.linalg.solve([[2.0]], [4.0]) == [2.0] and scipy.constants.g == 9.80665
assert Rotation.identity().magnitude() == 0 and KDTree([[0.0, 0], [1, 1]]).query([0.9, 1])[1] == 1
"""
PLOTTING = """
import sys
import postproc.convert, postproc.motion.timing.constraints
assert "matplotlib" not in sys.modules
import matplotlib, matplotlib.pyplot, numpy, toppra
matplotlib.use("Agg")
assert matplotlib.pyplot.figure().axes == []
toppra.algorithm.algorithm.plt.plot([0, 1])
assert len(matplotlib.pyplot.gca().lines) == 1
path = toppra.SplineInterpolator([0, 1, 2], [[0.0], [1], [4]])
assert path(1.0).tolist() == [1.0] and path(1.0, 1).shape == (1,)
assert toppra.SimplePath(numpy.arange(2.0), numpy.ones((2, 1))).dof == 1
"""


def run(program: str, *words: str) -> str:
    """What a program prints in a process of its own, with one thread for linear algebra."""
    env = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-c", program, *words]
    return subprocess.run(command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True, check=True).stdout


@pytest.mark.parametrize("program", [LOADING, ANOTHER_SCIPY, PLOTTING])
def test_what_is_put_off_comes_when_it_is_asked_for(program: str) -> None:
    run(program)


def test_thresholds_are_put_back() -> None:
    before = gc.get_threshold()
    with pytest.raises(ValueError), seldom_collecting():
        assert gc.get_threshold() == COLLECT
        raise ValueError
    assert gc.get_threshold() == before


PEAK = """
import sys
from tests.cost import peak_mb
from postproc import arrays
whole = arrays.blocks
arrays.blocks = lambda n, size=0: whole(n, (size or arrays.BLOCK) // 10)  # so that a short program has many of them
from postproc.compensation.options import Options
from postproc.runtime.passes import correct_program
from postproc.diagnostics import Source
from postproc.model.file import default_model
from tests.bench.programs import program
done = correct_program(Source("long.mod", program(int(sys.argv[1]))), default_model(), Options())
assert done.exit_code == 0, done.diagnostics
print(round(1048576 * peak_mb()))
"""
MOST = 12_500  # bytes a target; 20,000 with the states of a whole program held at once


def test_a_target_costs_a_few_kilobytes() -> None:
    """What is kept of a target is small, and working arrays do not grow with the program."""
    peak = {targets: int(run(PEAK, str(targets))) for targets in (300, 1_000)}
    assert (peak[1_000] - peak[300]) / 700 < MOST
