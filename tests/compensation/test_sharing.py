"""One text for several runs: displacements by the numbers that they have in common, who gets a contested number."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.text.laws import fit_affine
from postproc.effects.library.joints.backlash import Backlash
from tests.build import arm, convert
from tests.compensation.build import small


def moved_by(numbers: list[dict[str, float]], asked: np.ndarray, within: float, name: str, step: float) -> float:
    """How far the fitted displacement of any run moves where one of its numbers grows by a step."""
    law = fit_affine(numbers, asked, within)
    grown = [{**n, name: n[name] + step} for n in numbers]
    return float(np.abs([np.subtract(law.at(b), law.at(a)) for a, b in zip(numbers, grown, strict=True)]).max())


def test_a_straight_displacement_is_the_plane_through_what_the_runs_ask_for() -> None:
    numbers = [{"i": i, "j": j, "same": 7.0, "idle": i * j} for i in (1.0, 2.0, 4.0) for j in (0.0, 10.0)]
    asked = np.array([(0.1 + 0.5 * n["i"], -0.02 * n["j"], 3.0 + 0.001 * n["i"]) for n in numbers])
    law = fit_affine(numbers, asked, 0.01)
    assert [name for name, _ in law.coefficients] == ["i", "j"]
    assert [law.at(n) for n in numbers] == [pytest.approx(row, abs=1e-9) for row in asked]
    assert fit_affine(numbers[:2], asked[:2], 1.0).coefficients == ()


def test_a_coordinate_that_is_a_rounded_multiple_of_an_index_is_not_told_from_it() -> None:
    """It goes with the index but for its rounding; weighed against each other they would tell chance, hugely."""
    numbers = [{"k": k, "p.trans.y": y} for k, y in ((1.0, -73.17), (2.0, -12.2), (3.0, 48.78))]
    asked = np.array([(0.1, -0.2, 0.0), (0.4, -0.1, 0.1), (0.2, 0.0, 0.1)])
    assert moved_by(numbers, asked, 0.001, "p.trans.y", 1.0) < 0.01
    assert fit_affine(numbers[:2], asked[:2], 1.0).constant == pytest.approx(asked[:2].mean(axis=0))


def test_numbers_that_go_nearly_together_are_not_set_against_each_other() -> None:
    """By both of them every run would get what it asks for, and a hair beside them far more."""
    jitter = np.array([1.0, -1.0, 0.0, 0.0, -1.0, 1.0])
    numbers = [{"i": float(i), "j": float(i + 0.2 * d)} for i, d in enumerate(jitter)]
    asked = np.outer(0.1 * np.arange(6.0) + 0.05 * jitter, [1.0, 0.0, 0.0])
    ((name, slope),) = fit_affine(numbers, asked, 0.001).coefficients
    assert name == "j" and slope == pytest.approx((0.1, 0.0, 0.0), abs=0.01)


@pytest.mark.parametrize("axis", "xyz")
def test_numbers_that_cancel_each_other_are_not_used(axis: str) -> None:
    """Four runs and four numbers: a plane through all of them, by which a target taught 10 mm higher went 1.5 mm off."""
    places = np.array([(20.0, 10, 0), (240, 40, 0), (320, 180, 10), (60, 220, 5)])
    numbers = [{"i": k + 1.0, "p.trans.x": x, "p.trans.y": y, "p.trans.z": z} for k, (x, y, z) in enumerate(places)]
    noise = [(0.004, -0.003, 0), (-0.003, 0.006, 0.002), (0, -0.004, 0.003), (0.002, 0, -0.004)]
    gradient = np.array([(0.0004, 0.0018, 0.001), (0, 0, 0), (0, 0.003, -0.0005)])
    asked = (0.27, 0.65, 0.5) + places @ gradient + noise
    assert moved_by(numbers, asked, 0.005, f"p.trans.{axis}", 10.0) < 0.05


def test_a_target_that_serves_with_and_without_the_arc_ends_the_search_for_what_its_runs_share() -> None:
    """Runs of one statement part together: one at a time, each gave the others a reason to try once more."""
    text = small(
        "part r1; part r2; MoveL r1.pEnd,v20,fine,tT;",
        data="PERS seamrec r1:=[@{1300,-500},@{1350,-430}]; PERS seamrec r2:=[@{1300,-390},@{1380,-385}];",
        more="PROC part(seamrec r) MoveJ Offs(r.pStart,0,0,60),v400,z10,tT;\nFOR i FROM 1 TO 1 DO\n"
        "ArcLStart r.pStart,v100,sm,wd,fine,tT; ArcLEnd r.pEnd,v100,sm,wd,fine,tT; MoveL Offs(r.pStart,0,0,60),v200,z5,tT;"
        "\nENDFOR\nENDPROC",
    ).replace("MODULE M\n", "MODULE M\nRECORD seamrec\nrobtarget pStart;\nrobtarget pEnd;\nENDRECORD\n")
    conversion = convert(text, force_on="arc")
    assert conversion.exit_code == 0
    assert conversion.report["max_error_after_mm"] < conversion.report["max_error_before_mm"]


SAME = """FUNC robtarget same(robtarget q) RETURN q; ENDFUNC
FUNC robtarget Offs(robtarget p,num x,num y,num z) RETURN p; ENDFUNC"""
CONTESTED = {
    "cannot be displaced": (
        small("MoveJ a,v300,fine,tT; MoveL same(a),v100,fine,tLong;", "a 1300 -500", more=SAME), ("argument", "derived"),
    ),
    "runs over several": (
        small(
            "MoveJ p{1},v300,fine,tLong;\nFOR i FROM 1 TO 2 DO\nMoveL p{i},v100,fine,tT;\nENDFOR",
            data="CONST robtarget p{2}:=[@{1300,-500},@{1330,-470}];",
        ),
        ("argument", "element"),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("text", "edited"), CONTESTED.values(), ids=CONTESTED)
def test_who_gets_a_number_that_statements_need_differently(text: str, edited: tuple[str, str]) -> None:
    """Not the first in the text, but the one that nothing else could correct as well."""
    conversion = convert(text)
    assert tuple(o.edited for o in conversion.outcomes) == edited
    assert max(o.residual_mm or 0.0 for o in conversion.outcomes) < 0.001


@pytest.mark.parametrize("soft", [1.0, 40.0])
def test_what_is_changed_loses_at_least_half_of_its_error(soft: float) -> None:
    """At its target, where that is more than the tolerance: else the program is not changed there."""
    lost = arm().with_effects(*arm().effects, Backlash(half_gap_rad=soft * np.array([1e-5, 0, 0, 0, 0, 0])))
    text = small(
        "MoveJ @{1300,-500,760},v200,fine,tT;\nFOR i FROM 1 TO 3 DO\nseam; seamLong;\nENDFOR",
        "a 1350 -500, b 1350 -300",
        more="\n".join(
            f"PROC {name}() MoveL a,v50,fine,{tool}; MoveL Offs(b,0,0,3),v50,fine,{tool}; ENDPROC"
            for name, tool in (("seam", "tT"), ("seamLong", "tLong"))
        ),
    )
    conversion = convert(text, lost)
    judged = conversion.judged
    assert judged is not None and judged.plan is not None and judged.before is not None and judged.after is not None
    status = {o.statement.key: o.status for o in conversion.outcomes}
    changed = [status[move.event.statement.key] == "compensated" for move in judged.plan.motion.moves]
    before, after = judged.before.goal_distance, judged.after.goal_distance
    assert sum(changed) > 3
    assert (after <= np.maximum(0.55 * before, 1e-5))[changed].all()
