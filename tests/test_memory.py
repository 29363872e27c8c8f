"""Memory of a whole conversion: what is kept of a target is small, and working arrays do not grow with the program."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PEAK = """
from tests.cost import peak_mb
import sys
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


def peak(targets: int) -> int:
    """Peak memory [byte] of a process that converts a program of so many targets."""
    env = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", PEAK, str(targets)], cwd=ROOT, env=env, capture_output=True, text=True, check=True
    )
    return int(done.stdout)


def test_a_target_costs_a_few_kilobytes() -> None:
    few, many = 500, 2_000
    assert (peak(many) - peak(few)) / (many - few) < MOST
