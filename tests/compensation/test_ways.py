"""Branches on inputs: both ways are followed from where they begin, corrected, and proved."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc import text as text_of
from postproc.compensation.judgement.outcomes import SHARED
from postproc.compensation.text.assignment import WAYS
from postproc.effects.library.joints.backlash import Backlash
from tests.build import (
    AXES,
    FORCE,
    arm,
    codes,
    convert,
    lines_of,
    module,
    outcome,
    target,
    written,
)
from tests.independent.arm import ARMS
from tests.independent.verify import check

A, B, C = target(1350, -500), target(1350, -420), target(1290, -440, 730)
VIA, ROUND, END = target(1330, -480), target(1290, -460), target(1310, -400)
BRANCH = f"""MoveJ {A},v200,fine,tT;
IF DInput(di1)=1 THEN
  MoveL {B},v50,fine,tT;
ELSE
  MoveC {VIA},{ROUND},v50,fine,tT;
  MoveL {C},v50,z1,tT;
ENDIF
MoveL {END},v50,fine,tT;"""


def way(text: str, taken: bool) -> str:
    """The program of one way: the branch that is not taken left out, in the original and in what was written."""
    kept = r"\1" if taken else r"\2"
    return re.sub(r"(?s)\s*IF DInput\(di1\)=1 THEN\n(.*?)\n\s*ELSE\n(.*?)\n\s*ENDIF", "\n" + kept, text)


@pytest.mark.parametrize("taken", [True, False])
def test_each_way_keeps_the_promise(taken: bool) -> None:
    """The independent arm on the statements of one way; the arc of ELSE begins where the IF does."""
    text = module("", BRANCH)
    found = convert(text)
    assert [o.status for o in found.outcomes] == ["compensated"] * 5
    report = check(way(text, taken), way(written(found), taken), ARMS["irb4600_60_205"](), np.array(FORCE))
    assert report.violations == []
    assert report.before > 0.5
    assert report.after <= 0.01 and report.goal_after <= 0.003
    assert found.report["max_error_after_mm"] <= 0.01


@pytest.mark.parametrize("taken", [True, False])
def test_a_station_that_an_input_chooses_keeps_the_promise(taken: bool) -> None:
    """The branch moves nothing: the program is followed once for each station, and one text serves both."""
    data = 'PERS wobjdata wOne:=[FALSE,TRUE,"",[[1250,300,200],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    data += data.replace("wOne", "wTwo").replace("300,200", "420,230") + data.replace("wOne", "wNow")
    weld = "".join(
        f"{move},fine,tT\\WObj:=wNow;\n"
        for move in ("MoveJ q,v500", "ArcLStart p1,v100,sm,wd", "ArcLEnd p2,v100,sm,wd")
    )
    places = {"q": (60, -700, 560), "p1": (60, -700, 500), "p2": (90, -550, 500)}
    data += "".join(f"CONST robtarget {name}:={target(*place)};\n" for name, place in places.items())
    text = module(data, f"IF DInput(di1)=1 THEN\n  wNow:=wTwo;\nELSE\n  wNow:=wOne;\nENDIF\n{weld}")
    found = convert(text)
    assert [o.status for o in found.outcomes] == ["compensated"] * 3
    report = check(way(text, taken), way(written(found), taken), ARMS["irb4600_60_205"](), np.array(FORCE))
    assert report.violations == []
    assert report.before > 0.5
    assert report.after <= found.report["max_error_after_mm"] + 0.001 < 0.02


LEFT, RIGHT, MIDDLE = target(1350, -500), target(1350, -300), target(1350, -400)
SIDES = f"""MoveJ {target(1300, -400, 760)},v200,fine,tT;
IF DInput(di1)=1 THEN
  MoveL {LEFT},v50,fine,tT;
ELSE
  MoveL {RIGHT},v50,fine,tT;
ENDIF
MoveL {MIDDLE},v50,fine,tT;"""


@pytest.mark.parametrize(("gap", "reason"), [(2e-5, SHARED), (2e-3, WAYS)])
def test_the_side_from_which_the_arm_comes(gap: float, reason: str) -> None:
    """Lost motion of axis 1: from the left the middle needs another correction than from the right.

    A small difference is split; beside a large one the statement is left as it is. Both are said.
    """
    lost = arm().with_effects(*arm().effects, Backlash(half_gap_rad=np.array([gap, 0, 0, 0, 0, 0])))
    found = convert(module("", SIDES), lost)
    last = outcome(found, 3)
    assert last.reason == reason
    assert (last.status == "skipped") == (reason == WAYS)
    assert ("CMP005" if reason == WAYS else "CMP006") in codes(found)
    # Each way for itself is no question.
    for side in (LEFT, RIGHT):
        alone = module(
            "", f"MoveJ {target(1300, -400, 760)},v200,fine,tT;\nMoveL {side},v50,fine,tT;\nMoveL {MIDDLE},v50,fine,tT;"
        )
        assert convert(alone, lost).outcomes[2].status == "compensated"


@pytest.mark.parametrize(("more", "measured"), [("", 0), (f"MoveL {A},v50,fine,tT;\nMoveL {B},v50,fine,tT;", 1)])
def test_lines_that_nobody_can_follow_are_in_no_figure(more: str, measured: int) -> None:
    measured_place = "p:=CRobT();\nMoveL p,v50,fine,tT;\n"
    found = convert(module("VAR robtarget p;", f"MoveJ {C},v200,fine,tT;\n{measured_place}{more}"))
    assert found.report["measured_statements"] == measured
    assert found.report["unmeasured_statements"] == 1 + measured  # the line that begins there is right at its target
    for told in (text_of(found), written(found)):
        assert ("no line or arc could be measured" in told) == (measured == 0)
        assert "in no figure" in told
    assert ("CMP017" in codes(found)) == (measured == 0)


def test_what_is_left_while_the_arc_burns_stands_beside_the_ways_in_the_air() -> None:
    """The arm comes to the approach from home, which stays where it is, or from a corrected target: nothing is added."""
    home = f"CONST jointtarget home:=[[-20,0,10,0,60,0],{AXES}];"
    lift = f"MoveL {target(1330, -470, 800)},v300,fine,tT;"
    seam = f"ArcLStart {target(1330, -470)},v100,sm,wd,fine,tT;\nArcLEnd {target(1330, -370)},v100,sm,wd,fine,tT;"
    text = module(home, f"MoveAbsJ home,v500,fine,tT;\nIF di1=1 THEN\n{lift}\nENDIF\n{lift}\n{seam}")
    found = convert(text)
    after, arc = found.report["max_error_after_mm"], found.report["max_arc_error_after_mm"]
    assert after > 0.1 and arc <= 0.01
    before, arc_before = found.report["max_error_before_mm"], found.report["max_arc_error_before_mm"]
    told = f"At most {arc:.3f} mm of deviation remain while the arc burns at steady speed, where there were {arc_before:.3f}"
    assert text_of(found).startswith(told) and "tolerance 0.01 mm, 0.01 mm in the air" in text_of(found)
    assert f"with moves in the air {after:.3f} mm of {before:.3f} mm remain" in text_of(found)
    head = lines_of(written(found))
    assert f"! deviation while the arc burns: {arc_before:.3f} mm before, {arc:.3f} mm after" in head
    assert f"! with moves in the air: {before:.3f} mm before, {after:.3f} mm after" in head
    unwelded = convert(module("", f"{lift}\n{lift}"))
    assert unwelded.report["max_arc_error_after_mm"] is None
    assert "burns" not in text_of(unwelded) + written(unwelded)
