"""One text for several: a routine on displaced work, targets inside records."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.text.laws import fit_affine
from tests.build import convert, module, target

A, B, C, D = target(1300, -500), target(1330, -470), target(1350, -430), target(1350, -330)


def test_a_straight_displacement_is_the_plane_through_what_the_runs_ask_for() -> None:
    numbers = [{"i": i, "j": j, "same": 7.0, "idle": i * j} for i in (1.0, 2.0, 4.0) for j in (0.0, 10.0)]
    asked = np.array([(0.1 + 0.5 * n["i"], -0.02 * n["j"], 3.0 + 0.001 * n["i"]) for n in numbers])
    way = fit_affine(numbers, asked, 0.01)
    assert [name for name, _ in way.coefficients] == ["i", "j"]
    assert [way.at(n) for n in numbers] == [pytest.approx(row, abs=1e-9) for row in asked]
    assert fit_affine(numbers[:2], asked[:2], 1.0).coefficients == ()


def test_a_coordinate_that_is_a_rounded_multiple_of_an_index_is_not_told_from_it() -> None:
    """It goes with the index but for its rounding; weighed against each other they would tell chance, hugely."""
    numbers = [{"k": k, "p.trans.y": y} for k, y in ((1.0, -73.17), (2.0, -12.2), (3.0, 48.78))]
    asked = np.array([(0.1, -0.2, 0.0), (0.4, -0.1, 0.1), (0.2, 0.0, 0.1)])
    way = fit_affine(numbers, asked, 0.001)
    touched_up = [{**n, "p.trans.y": n["p.trans.y"] + 1.0} for n in numbers]
    moved = [np.subtract(way.at(b), way.at(a)) for a, b in zip(numbers, touched_up, strict=True)]
    assert np.abs(moved).max() < 0.01
    assert fit_affine(numbers[:2], asked[:2], 1.0).constant == pytest.approx(asked[:2].mean(axis=0))


def test_numbers_that_go_nearly_together_are_not_set_against_each_other() -> None:
    """By both of them every run would get what it asks for, and a hair beside them far more."""
    jitter = np.array([1.0, -1.0, 0.0, 0.0, -1.0, 1.0])
    numbers = [{"i": float(i), "j": float(i + 0.2 * d)} for i, d in enumerate(jitter)]
    asked = np.outer(0.1 * np.arange(6.0) + 0.05 * jitter, [1.0, 0.0, 0.0])
    ((name, slope),) = fit_affine(numbers, asked, 0.001).coefficients
    assert name == "j" and slope == pytest.approx((0.1, 0.0, 0.0), abs=0.01)


def test_a_target_that_serves_with_and_without_the_arc_ends_the_search_for_what_its_runs_share() -> None:
    """Runs of one statement part together: one at a time, each gave the others a reason to try once more."""
    record = "RECORD seamrec\nrobtarget pStart;\nrobtarget pEnd;\nENDRECORD"
    data = f"PERS seamrec r1:=[{A},{C}];\nPERS seamrec r2:=[{target(1300, -390)},{target(1380, -385)}];"
    part = """  PROC part(seamrec r)
    MoveJ Offs(r.pStart,0,0,60),v400,z10,tT;
    FOR i FROM 1 TO 1 DO
      ArcLStart r.pStart,v100,sm,wd,fine,tT;
      ArcLEnd r.pEnd,v100,sm,wd,fine,tT;
      MoveL Offs(r.pStart,0,0,60),v200,z5,tT;
    ENDFOR
  ENDPROC
"""
    text = module(data, "part r1;\npart r2;\nMoveL r1.pEnd,v20,fine,tT;", part)
    found = convert(text.replace("MODULE M\n", f"MODULE M\n{record}\n"), force_on="arc")
    assert found.exit_code == 0
    assert found.report["max_error_after_mm"] < found.report["max_error_before_mm"]


def test_numbers_that_cancel_each_other_are_not_used() -> None:
    """Four runs and four numbers: a plane through all of them, by which a target taught 10 mm higher went 1.5 mm off."""
    places = np.array([(20.0, 10, 0), (240, 40, 0), (320, 180, 10), (60, 220, 5)])
    numbers = [{"i": k + 1.0, "p.trans.x": x, "p.trans.y": y, "p.trans.z": z} for k, (x, y, z) in enumerate(places)]
    noise = [(0.004, -0.003, 0), (-0.003, 0.006, 0.002), (0, -0.004, 0.003), (0.002, 0, -0.004)]
    gradient = np.array([(0.0004, 0.0018, 0.001), (0, 0, 0), (0, 0.003, -0.0005)])
    way = fit_affine(numbers, (0.27, 0.65, 0.5) + places @ gradient + noise, 0.005)
    for axis in "xyz":
        taught = [{**n, f"p.trans.{axis}": n[f"p.trans.{axis}"] + 10.0} for n in numbers]
        moved = [np.subtract(way.at(b), way.at(a)) for a, b in zip(numbers, taught, strict=True)]
        assert np.abs(moved).max() < 0.05


SAME = """  FUNC robtarget same(robtarget q)
    RETURN q;
  ENDFUNC
  FUNC robtarget Offs(robtarget p,num x,num y,num z)
    RETURN p;
  ENDFUNC
"""


@pytest.mark.parametrize(
    ("data", "body", "more", "edited"),
    [
        (
            f"CONST robtarget a:={A};",
            "MoveJ a,v300,fine,tT;\nMoveL same(a),v100,fine,tLong;",
            SAME,
            ("argument", "derived"),
        ),
        (
            f"CONST robtarget p{{2}}:=[{A},{B}];",
            "MoveJ p{1},v300,fine,tLong;\nFOR i FROM 1 TO 2 DO\nMoveL p{i},v100,fine,tT;\nENDFOR",
            "",
            ("argument", "element"),
        ),
    ],
    ids=["cannot be displaced", "runs over several"],
)
def test_who_gets_a_number_that_statements_need_differently(
    data: str, body: str, more: str, edited: tuple[str, str]
) -> None:
    """Not the first in the text, but the one that nothing else could correct as well."""
    found = convert(module(data, body, more))
    assert tuple(o.edited for o in found.outcomes) == edited
    assert max(o.residual_mm or 0.0 for o in found.outcomes) < 0.001
