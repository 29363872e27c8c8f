"""The generator of measured cells: null without an effect, visible with one, the same for the same seed."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.independent import arm as A
from tests.independent import hidden_effects as H
from tests.independent import unknown_effects as U
from tests.independent.cells import Cell, States, base_residual, base_slope, draw_cell, draw_states, measure

KINDS = [*H.LIBRARY, *H.OUTSIDE, U.broadband_map, U.gear_lines]


@pytest.fixture(scope="module")
def clean() -> tuple[Cell, States, np.ndarray, np.ndarray]:
    g = np.random.default_rng(11)
    cell = draw_cell(g, A.irb4600(), ())
    s = draw_states(g, 60, cell.arm, moving=True, session=True)
    return cell, s, measure(cell, s), base_slope(cell, s)


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.__name__)
def test_every_kind_leaves_structure_that_the_base_cannot_fit(
    kind: H.Kind, clean: tuple[Cell, States, np.ndarray, np.ndarray]
) -> None:
    cell, s, places, slope = clean
    hidden = kind(np.random.default_rng(11), cell.arm)
    left = base_residual(measure(replace(cell, hidden=(hidden,)), s) - places, slope)
    assert 3e-6 < np.sqrt((left**2).mean()) < 3e-3


def test_a_set_is_reproducible_and_noisy_as_stated(tmp_path: Path) -> None:
    plan = H.Plan([])
    a = H.make_set(tmp_path / "a", 3, plan, noise_mm=0.05, poses=60)
    H.make_set(tmp_path / "b", 3, plan, noise_mm=0.05, poses=60)
    assert (tmp_path / "a/fit.csv").read_bytes() == (tmp_path / "b/fit.csv").read_bytes()
    assert a["verdict"] == "complete"
    with (tmp_path / "a/fit.csv").open() as f:
        rows = list(csv.DictReader(f))
    groups: dict[str, list[list[float]]] = {}
    for r in rows:
        groups.setdefault(r["pose_id"], []).append([float(r[k]) for k in ("x_mm", "y_mm", "z_mm")])
    spread = [np.var(v, axis=0, ddof=1) for v in groups.values() if len(v) == 3]
    assert len(spread) == 12
    assert np.sqrt(np.mean(spread)) == pytest.approx(0.05, rel=0.3)
    json.dumps(a)
