"""What a diagnosis holds at once: working arrays stay small, whatever the table."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import weakref
from pathlib import Path

from postproc.identification.diagnose import diagnose
from tests.bench.diagnosis.judge import base_fit
from tests.bench.diagnosis.sets import Recipe, drawn
from tests.independent import library_effects as K

ROOT = Path(__file__).resolve().parents[2]
PEAK = """
from tests.cost import peak_mb
from postproc.identification.diagnose import diagnose
from tests.bench.diagnosis.judge import base_fit
from tests.bench.diagnosis.sets import Recipe, drawn
from tests.independent import library_effects as K
one = drawn("size", 2, Recipe((K.backlash, K.arm_load), poses=1974), 222)
found = diagnose(base_fit(one).model, one.data)
print(peak_mb(), *(m.key for m in found.missing))
"""
MOST = 575.0  # MB at 2000 rows; 610 with every switch of a pattern held at once, and all forms until the end


def test_a_diagnosis_of_two_thousand_rows_holds_little():
    env = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", PEAK], cwd=ROOT, env=env, capture_output=True, text=True, check=True)
    peak, *named = done.stdout.split()
    assert float(peak) < MOST and named == ["backlash", "arm_load"]


def test_nothing_of_a_diagnosis_waits_for_garbage_collection():
    """Its arrays are few objects and much memory: collection, which counts objects, would come late."""
    one = drawn("size", 2, Recipe((K.backlash,), poses=60), 222)
    gc.collect()
    gc.disable()
    try:
        found = diagnose(base_fit(one).model, one.data)
        fits = [weakref.ref(fit) for fit in (found.told, found.searched)]
        del found
        assert [fit() for fit in fits] == [None, None]
    finally:
        gc.enable()
