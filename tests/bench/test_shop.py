"""What a shop without a tracker measures gives springs and geometry: judged beside a refit by plain numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.bench.shop.arms import ROBOTS, shop
from tests.bench.shop.judge import diagnosed, faults, judge
from tests.bench.shop.real import BETTER, one
from tests.bench.shop.refit import PRIOR, refit, residual
from tests.bench.shop.sets import KINDS, real_tcp, table

SAMPLES = Path(__file__).parents[2] / "samples" / "measurements"


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "between"])  # its bars take seconds to place
def test_the_true_arm_fits_its_table_to_the_noise(kind: str) -> None:
    s = shop("irb1600_10_145", 3)
    rows = table(kind, s, 3)
    e = residual(rows, real_tcp(s, rows.states), rows.truth)
    assert 0.7 < np.sqrt(np.mean(e**2)) < 1.3
    stated = residual(rows, s.nominal.arm.forward(rows.states.q, s.nominal.tool).tcp[:, :3, 3], rows.truth)
    assert np.sqrt(np.mean(stated**2)) > 5


def test_the_refit_knows_how_sure_it_is() -> None:
    pulls = []
    for robot, kind in zip(ROBOTS, ("gauge+tip", "plane", "distance"), strict=True):
        s = shop(robot, 5)
        fit = refit(s, table(kind, s, 5))
        springs = np.log(s.cell.compliance / s.nominal.compliance)
        true = np.concatenate([s.cell.offset, springs, s.cell.tool[:3, 3] - s.tool])
        pulls.append((fit.x[:15] - true) / np.sqrt(np.diag(fit.covariance))[:15])
        assert np.sqrt(np.diag(fit.covariance) / PRIOR**2).min() < 0.5
    assert 0.5 < np.sqrt(np.mean(np.square(pulls))) < 1.3


def test_a_table_of_a_shop_gives_what_a_perfect_fit_gives(tmp_path: Path) -> None:
    found = judge("gauge", "irb4600_60_205", 0, tmp_path)
    assert faults(found) == []
    assert found["own"]["inside"] > 0.8 and found["own"]["change_inside"] > 0.8
    assert found["own"]["gauge_change"] == pytest.approx(found["own"]["change"], abs=2e-3)
    assert found["own"]["change"] < 0.5 * found["nominal"]["change"]


def test_what_a_table_of_a_shop_hides_is_named(tmp_path: Path) -> None:
    found = diagnosed("distance", "backlash", "ur10", 0, tmp_path)
    assert found["right"], found


def test_derived_readings_of_a_real_arm_give_the_positions_held_out(tmp_path: Path) -> None:
    found = {x["set"]: x["held_mm"] for x in one("ur5_grid", SAMPLES, tmp_path, "anchors")}
    assert found["ur5_grid anchors"] < BETTER * found["ur5_grid positions"] < 0.3 * found["ur5_grid nominal"]
