"""The rigid motion in the corrections of a work object: closed forms, what is left out, what is said of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.compensation.correction.rigid_shift import fit_rigid
from tests.build import convert, module, target, written

PROGRAMS = Path(__file__).parents[1] / "worlds" / "programs"
D, W = np.array([0.4e-3, -0.6e-3, 1.2e-3]), np.array([1e-3, -0.5e-3, 2e-3])


def moved(points: np.ndarray, w: np.ndarray = W) -> np.ndarray:
    """Shifts (n, 3) of points by a translation and a turn about their centre."""
    x = points - points.mean(axis=0)
    return x @ Rotation.from_rotvec(w).as_matrix().T - x + D


def test_a_rigid_motion_is_found_back() -> None:
    points = np.random.default_rng(1).uniform(-0.3, 0.3, (12, 3))
    center, d, w = fit_rigid(points, moved(points))
    np.testing.assert_allclose(center, points.mean(axis=0))
    np.testing.assert_allclose(d, D, atol=1e-12)
    np.testing.assert_allclose(w, W, atol=3e-6)  # a small turn for a turn


def test_stretch_is_no_part_of_the_motion() -> None:
    points = np.random.default_rng(2).uniform(-0.3, 0.3, (12, 3))
    x = points - points.mean(axis=0)
    _, d, w = fit_rigid(points, 1e-3 * x)
    np.testing.assert_allclose(d, 0.0, atol=1e-15)
    np.testing.assert_allclose(w, 0.0, atol=1e-15)


def test_one_target_says_nothing_of_a_turn() -> None:
    _, d, w = fit_rigid(np.array([[0.1, 0.2, 0.3]]), D[None])
    np.testing.assert_allclose(d, D)
    np.testing.assert_array_equal(w, 0.0)


@pytest.mark.parametrize("bow", [0.0, 0.005])
def test_targets_on_a_line_say_nothing_of_a_turn_about_it(bow: float) -> None:
    """Two axes are determined; about the line the least turn is none, also where it is bowed by a few millimetres."""
    x = np.linspace(-0.2, 0.2, 5)
    points = np.stack([x, 0 * x, bow * (1 - (x / 0.2) ** 2)], axis=1)
    sag = np.stack([0 * x, 1e-4 * np.cos(8 * x), 0 * x], axis=1)  # what a turn about the line could feign
    _, _, w = fit_rigid(points, moved(points, np.array([5e-3, -0.5e-3, 2e-3])) + sag)
    assert abs(w[0]) < 2e-5
    np.testing.assert_allclose(w[1:], [-0.5e-3, 2e-3], atol=5e-5)


BRACKET = module(
    "",
    f"""MoveJ {target(0, 0, 800)},v500,z10,tT\\WObj:=wT;
    ArcLStart {target(0, 0)},v100,sm,wd,fine,tT\\WObj:=wT;
    ArcL {target(150, 0)},v100,sm,wd,z1,tT\\WObj:=wT;
    ArcLEnd {target(150, 120)},v100,sm,wd,fine,tT\\WObj:=wT;
    MoveL {target(150, 120, 800)},v500,fine,tT\\WObj:=wT;""",
)


def test_every_conversion_says_how_much_is_one_rigid_shift() -> None:
    """As the commanded targets are written: their mean shift, and how far the others are from the rigid motion."""
    still = convert(BRACKET, force=(0.0, 0.0, 0.0))
    (row,) = still.report["rigid_shift"]
    assert row["wobj"] == "wT" and not row["left_out"] and row["at_welds"]
    size = np.linalg.norm([row["dx_mm"], row["dy_mm"], row["dz_mm"]])
    welds = [o.shift_mm for o in still.outcomes if o.statement.instruction.startswith("Arc")]
    assert size == pytest.approx(np.mean([w or 0.0 for w in welds]), rel=0.05)
    assert row["rest_mm"] < 0.2 * size
    assert still.report["from_programmed_path"] is None


def test_with_the_shift_left_out_only_the_rest_is_corrected() -> None:
    """The process force did not act while the frame was taught: what it does is corrected as before."""
    whole, force_alone = convert(BRACKET), convert(BRACKET, wobj_taught=("WT",))
    (shift,), (left,) = whole.report["rigid_shift"], force_alone.report["rigid_shift"]
    same = [key for key in shift if key not in ("left_out", "rest_mm")]
    assert {key: shift[key] for key in same} == {key: left[key] for key in same} and left["left_out"]
    assert left["rest_mm"] == pytest.approx(shift["rest_mm"], abs=0.005)
    report = force_alone.report
    assert report["max_arc_error_after_mm"] < 0.01 < report["max_arc_error_before_mm"]
    drawn = report["from_programmed_path"]
    size = np.linalg.norm([shift["dx_mm"], shift["dy_mm"], shift["dz_mm"]])
    assert drawn["after_mm"] == pytest.approx(size, abs=0.1)
    assert drawn["before_mm"] == pytest.approx(whole.report["max_arc_error_before_mm"], abs=1e-5)
    assert "! taught with this arm: wT;" in written(force_alone)


def test_all_names_every_work_object() -> None:
    assert convert(BRACKET, wobj_taught=("all",)).output == convert(BRACKET, wobj_taught=("wT",)).output


def test_a_work_object_is_named_by_its_data_where_a_routine_has_got_it() -> None:
    body = f"MoveJ {target(0, 0)},v500,fine,tT\\WObj:=wT;\nSeam wT;"
    seam = f"""  PROC Seam(PERS wobjdata w)
    ArcLStart {target(0, 0)},v100,sm,wd,fine,tT\\WObj:=w;
    ArcLEnd {target(150, 0)},v100,sm,wd,fine,tT\\WObj:=w;
  ENDPROC
"""
    rows = convert(module("", body, seam)).report["rigid_shift"]
    assert [row["wobj"] for row in rows] == ["wT"]


@pytest.mark.parametrize("name", ["drill_row", "conveyor_shift", "both_ends_follow"])
def test_targets_that_follow_run_time_data_are_written_as_without_it(name: str) -> None:
    """At other places the rest of the correction is another one: it is written all the same."""
    text = (PROGRAMS / f"{name}.mod").read_bytes()
    plain, taught = convert(text, force=(0.0, 0.0, 0.0)), convert(text, force=(0.0, 0.0, 0.0), wobj_taught=("all",))
    assert (plain.exit_code, taught.exit_code) == (0, 0)
    assert [o.status for o in taught.outcomes] == [o.status for o in plain.outcomes]
