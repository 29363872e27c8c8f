"""The paper's formulas: close to the exact equilibrium where they are right, and wrong where the errata say so."""

from __future__ import annotations

import pytest

from tests.bench.paper import measure


@pytest.mark.parametrize("name", ["irb4600_60_205", "irb4600_60_205_seed"])
def test_paper_beside_the_exact_equilibrium(name: str) -> None:
    f = measure(name)
    before = f["error of the real arm before, largest"]
    assert 1.0 < before < 4.0
    assert f["error after the exact inverse"] < 1e-9
    assert f["error after Eqs. 24-25 corrected, 10 sweeps"] < 1e-5
    # As printed the iteration has another fixed point: most of the error stays.
    assert f["error after Eqs. 24-25 as printed, 10 sweeps"] > 0.4 * before
    assert 1e-4 < f["Eq. 23 beside the exact equilibrium, along the seam"] < 0.01
    assert f["Eq. 23 beside the exact equilibrium, 500 poses, largest"] > 0.01
    assert 1e-5 < f["K without K_E, relative"] < 1e-2
