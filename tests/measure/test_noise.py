"""The noise that repeats of a pose tell, copies among them, and figures of ISO 9283."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.identification.compare import compare
from postproc.measure.checks.repeats import estimate_noise
from postproc.measure.errors import iso9283
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.results.improve.comparison import comparison_values
from tests.measure.tables import ARM, lines, read, repeats, source


def test_repeats_tell_the_noise_and_a_stray_among_them_does_not_count():
    shift = np.random.default_rng(4).normal(0, 0.05, (120, 3))
    noise = estimate_noise(read(repeats(30, 4, shift)), ARM)
    assert noise.origin == "repeats" and noise.dof == 30 * 3 * 3
    assert noise.sigma == pytest.approx(5e-5, rel=0.15)
    shift[9, 1] += 99
    assert estimate_noise(read(repeats(30, 4, shift)), ARM).sigma == pytest.approx(5e-5, rel=0.15)


@pytest.mark.parametrize("names", ["12", ("left", "right")])
@pytest.mark.parametrize(("shift_mm", "dof"), [(0.5, 20 * 2 * 3), (0.0, 20 * 3 * 3)])
def test_repeats_that_differ_in_a_column_of_the_users_are_none_where_it_matters(shift_mm, dof, names):
    """Two docks, each twice at every pose, the points at the second shifted; and docks that do nothing."""
    dock = np.tile([0, 1, 0, 1], 20)
    shift = np.outer(shift_mm * dock, [0, 1, 0]) + np.random.default_rng(8).normal(0, 0.05, (80, 3))
    noise = estimate_noise(read(repeats(20, 4, shift, dock=[names[d] for d in dock])), ARM)
    assert noise.sigma == pytest.approx(5e-5, rel=0.15)
    assert noise.dof == dof


def test_repeats_that_follow_a_number_of_the_users_are_no_noise():
    """A gripper bends by 0.4 um/N, the force another one each time; and it was warmer in the third round."""
    g = np.random.default_rng(5)
    force, warm = g.uniform(0, 800, 72), np.tile([20, 20, 25], 24)
    shift = np.outer(4e-4 * force, [0, 1, 0]) + g.normal(0, 0.02, (72, 3))
    noise = estimate_noise(read(repeats(24, 3, shift, grip_N=force.round(1), temperature_C=warm)), ARM)
    assert noise.sigma == pytest.approx(2e-5, rel=0.2)
    assert noise.dof == 24 * 3


def test_repeats_agree_in_words_where_every_one_of_them_does():
    """Three reflectors seated 0.1 mm apart, three measurements of each pose with one, two or three of them."""
    seat = np.array([k for i in range(30) for k in (i % 3, i // 3 % 3, i // 9 % 3)])
    shift = 0.1 * np.eye(3)[seat] + np.random.default_rng(3).normal(0, 0.02, (90, 3))
    noise = estimate_noise(read(repeats(30, 3, shift, smr=np.array(["A1", "B2", "C3"])[seat])), ARM)
    assert noise.sigma == pytest.approx(2e-5, rel=0.2)


def test_one_coordinate_tells_its_noise():
    """A laser that measures heights: rows measured three times, x and y empty, the poses without names."""
    cells = repeats(20, 3, np.random.default_rng(6).normal(0, 0.05, (60, 3)), x_mm=[""] * 60, y_mm=[""] * 60)
    del cells["pose_id"]
    data = read(cells)
    noise = estimate_noise(data, ARM)
    assert noise.origin == "repeats" and noise.dof == 20 * 2
    assert noise.sigma == pytest.approx(5e-5, rel=0.25)
    assert data.pose_id[:4] == ("1", "1", "1", "4")
    values = comparison_values(compare(Model(ARM), data))
    assert list(values["per_axis_mm"]) == ["z"] and values["mean_mm"] > 0


@pytest.mark.parametrize(("scatter_mm", "rp_mm"), [(0.001, 0.06), (0.001, None), (0.006, 0.06), (0.03, 0.06)])
def test_readings_of_a_standing_arm_do_not_say_how_well_it_comes_back(scatter_mm, rp_mm):
    """Where repeats scatter far less than the data sheet, the noise has the arm's share: RP / 3.62 per axis."""
    g = np.random.default_rng(8)
    away = np.linalg.norm(g.normal(0, 1, (400_000, 3)), axis=1)
    per_axis = (rp_mm or 0.0) / (away.mean() + 3 * away.std())  # RP of ISO 9283, l + 3 S
    head, *rows = lines(repeats(30, 3, g.normal(0, scatter_mm, (90, 3))))
    arm = replace(ARM, repeatability=None if rp_mm is None else 1e-3 * rp_mm)
    expected = np.hypot(scatter_mm, per_axis) if scatter_mm < 0.004 else scatter_mm
    for order in (np.arange(90), g.permutation(90)):
        data = read_measurements(source([head, *(rows[i] for i in order)]), arm)
        assert 1e3 * estimate_noise(data, arm).sigma == pytest.approx(expected, rel=0.15)


def copies(cells) -> int:
    return sum(d.code == "DAT006" for d in read(cells).diagnostics)


@pytest.mark.parametrize("step_mm", [0.001, 0.002, 0.01, 0.1])
def test_a_gauge_reads_the_same_twice_by_chance(step_mm):
    for seed in range(20):
        cells = repeats(12, 3, np.random.default_rng(seed).normal(0, 0.015, (36, 3)))
        gauge = {name: values for name, values in cells.items() if name not in ("x_mm", "y_mm")}
        gauge["z_mm"] = [f"{round(float(z) / step_mm) * step_mm:.4f}" for z in gauge["z_mm"]]
        assert copies(gauge) == 0


def test_a_copied_row_of_a_tracker_is_no_chance():
    again = lines(repeats(12, 2, np.random.default_rng(2).normal(0, 0.015, (24, 3))))
    assert copies(again) == 0
    assert copies([*again, again[3]]) == 1
    assert copies([*again, *again[1:3]]) == 2


# Errors [mm] of one pose, and its accuracy and repeatability by hand.
FIGURES = [
    ([[1, 0, 0]] * 4, 1.0, 0.0),
    ([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], 0.0, 1.0),
    ([[0, 0, 0], [0, 0, 0], [3, 0, 0]], 1.0, 4 / 3 + 3 * np.sqrt(1 / 3)),  # 1, 1, 2 mm from the barycentre
]


@pytest.mark.parametrize(("error_mm", "accuracy", "repeatability"), FIGURES)
def test_iso_figures_are_those_of_the_definition(error_mm, accuracy, repeatability):
    figures = iso9283(1e-3 * np.array(error_mm), np.zeros(len(error_mm), dtype=int))
    assert (figures.accuracy_mean, figures.accuracy_max) == pytest.approx((accuracy, accuracy))
    assert figures.repeatability_median == pytest.approx(repeatability, abs=1e-12)
    assert figures.repeatability_max == pytest.approx(repeatability, abs=1e-12)
