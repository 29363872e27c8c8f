"""The rigid motion in the corrections of a work object: closed forms, what is left out, what is said of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.compensation.correction.rigid_shift import fit_rigid
from postproc.results.convert.conclusion import conclusion
from postproc.results.convert.work_objects import BY_TORCH, TAUGHT, work_object_section
from tests.build import convert, written
from tests.compensation.build import NO_FORCE, PROCESS, small, statuses

PROGRAMS = Path(__file__).parents[1] / "worlds" / "programs"
D, W = np.array([0.4e-3, -0.6e-3, 1.2e-3]), np.array([1e-3, -0.5e-3, 2e-3])
CLOUD = np.random.default_rng(1).uniform(-0.3, 0.3, (12, 3))


def moved(points: np.ndarray, w: np.ndarray = W) -> np.ndarray:
    """Shifts (n, 3) of points by a translation and a turn about their centre."""
    x = points - points.mean(axis=0)
    return x @ Rotation.from_rotvec(w).as_matrix().T - x + D


@pytest.mark.parametrize(
    ("points", "shifts", "d", "w"),
    [
        (CLOUD, moved(CLOUD), D, W),
        (CLOUD, 1e-3 * (CLOUD - CLOUD.mean(axis=0)), 0 * D, 0 * W),  # stretch is no part of the motion
        (CLOUD[:1], D[None], D, 0 * W),  # one target says nothing of a turn
    ],
)
def test_a_rigid_motion_is_found_back(points: np.ndarray, shifts: np.ndarray, d: np.ndarray, w: np.ndarray) -> None:
    center, fitted_d, fitted_w = fit_rigid(points, shifts)
    np.testing.assert_allclose(center, points.mean(axis=0))
    np.testing.assert_allclose(fitted_d, d, atol=1e-12)
    np.testing.assert_allclose(fitted_w, w, atol=3e-6 if w.any() else 1e-15)  # a small turn for a turn


@pytest.mark.parametrize("bow", [0.0, 0.005])
def test_targets_on_a_line_say_nothing_of_a_turn_about_it(bow: float) -> None:
    """Two axes are determined; about the line the least turn is none, also where it is bowed by a few millimetres."""
    x = np.linspace(-0.2, 0.2, 5)
    points = np.stack([x, 0 * x, bow * (1 - (x / 0.2) ** 2)], axis=1)
    sag = np.stack([0 * x, 1e-4 * np.cos(8 * x), 0 * x], axis=1)  # what a turn about the line could feign
    _, _, w = fit_rigid(points, moved(points, np.array([5e-3, -0.5e-3, 2e-3])) + sag)
    assert abs(w[0]) < 2e-5
    np.testing.assert_allclose(w[1:], [-0.5e-3, 2e-3], atol=5e-5)


ON_WT = "tT\\WObj:=wT;"
BRACKET = small(
    f"MoveJ @{{0,0,800}},v500,z10,{ON_WT} ArcLStart @{{0,0}},{PROCESS},fine,{ON_WT} ArcL @{{150,0}},{PROCESS},z1,{ON_WT}"
    f"ArcLEnd @{{150,120}},{PROCESS},fine,{ON_WT} MoveL @{{150,120,800}},v500,fine,{ON_WT}"
)


def test_every_conversion_says_how_much_is_one_rigid_shift() -> None:
    """As the commanded targets are written: their mean shift, and how far the others are from the rigid motion."""
    still = convert(BRACKET, force=NO_FORCE)
    (row,) = still.report["rigid_shift"]
    assert row["wobj"] == "wT" and not row["left_out"] and row["at_welds"]
    size = np.linalg.norm([row["dx_mm"], row["dy_mm"], row["dz_mm"]])
    welds = [o.shift_mm or 0.0 for o in still.outcomes if o.statement.instruction.startswith("Arc")]
    assert size == pytest.approx(np.mean(welds), rel=0.05)
    assert row["rest_mm"] < 0.2 * size
    assert still.report["from_programmed_path"] is None


def test_with_the_shift_left_out_only_the_rest_is_corrected() -> None:
    """The process force did not act while the frame was taught: what it does is corrected as before."""
    full, force_alone = convert(BRACKET), convert(BRACKET, wobj_taught=("WT",))
    (shift,), (omitted,) = full.report["rigid_shift"], force_alone.report["rigid_shift"]
    same = shift.keys() - {"left_out", "rest_mm"}
    assert {key: shift[key] for key in same} == {key: omitted[key] for key in same} and omitted["left_out"]
    assert omitted["rest_mm"] == pytest.approx(shift["rest_mm"], abs=0.005)
    report = force_alone.report
    assert report["max_arc_error_after_mm"] < 0.01 < report["max_arc_error_before_mm"]
    drawn = report["from_programmed_path"]
    size = np.linalg.norm([shift["dx_mm"], shift["dy_mm"], shift["dz_mm"]])
    assert drawn["after_mm"] == pytest.approx(size, abs=0.1)
    assert drawn["before_mm"] == pytest.approx(full.report["figures"][0]["before_mm"], abs=1e-5)
    assert "! taught with this arm: wT;" in written(force_alone)
    assert convert(BRACKET, wobj_taught=("all",)).output == convert(BRACKET, wobj_taught=("wT",)).output


def test_a_work_object_is_named_by_its_data_where_a_routine_has_got_it() -> None:
    weld = f"ArcLStart @{{0,0}},{PROCESS},fine,tT\\WObj:=w; ArcLEnd @{{150,0}},{PROCESS},fine,tT\\WObj:=w;"
    text = small(f"MoveJ @{{0,0}},v500,fine,{ON_WT} Seam wT;", more=f"PROC Seam(PERS wobjdata w) {weld} ENDPROC")
    assert [row["wobj"] for row in convert(text).report["rigid_shift"]] == ["wT"]


def test_two_targets_follow_any_shift_and_nobody_teaches_the_world() -> None:
    """Of two places a rigid motion leaves nothing but their distance: that is no promise for an arm of the type."""
    two = "MoveJ @{0,0},v200,fine,tT\\WObj:=wT; MoveL @{150,0},v200,fine,tT\\WObj:=wT;"
    in_world = small("MoveJ p1,v200,fine,tT; MoveL p2,v200,fine,tT;", "p1 1300 -500, p2 1300 -400")
    programs = (small(two), in_world)
    taught, world = (convert(text, force=NO_FORCE, wobj_taught=("all",)) for text in programs)
    (shift,) = taught.report["rigid_shift"]
    assert shift["left_out"] and shift["places"] == 2 and taught.report["figures"][0]["expected_on_arm_mm"] is None
    assert "what remains beside that of `wT` is not told" in "".join(conclusion(taught)[1])
    assert not world.report["rigid_shift"][0]["left_out"] and world.report["figures"][0]["expected_on_arm_mm"]
    for values, offered in ((taught.report, []), (world.report, []), (convert(programs[0]).report, [TAUGHT])):
        lines = [block for block in work_object_section(values).blocks if isinstance(block, str)]
        assert lines == [line.format("wT", BY_TORCH) for line in offered]


@pytest.mark.parametrize("name", ["drill_row", "conveyor_shift", "both_ends_follow"])
def test_targets_that_follow_run_time_data_are_written_as_without_it(name: str) -> None:
    """At other places the rest of the correction is another one: it is written all the same."""
    text = (PROGRAMS / f"{name}.mod").read_bytes()
    plain, taught = (convert(text, force=NO_FORCE, wobj_taught=names) for names in ((), ("all",)))
    assert (plain.exit_code, taught.exit_code) == (0, 0)
    assert statuses(taught) == statuses(plain)
