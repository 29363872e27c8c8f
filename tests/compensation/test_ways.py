"""Branches on inputs: both ways are followed from where they begin, corrected, and proved."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc import text as text_of
from postproc.compensation.judgement.outcomes import SHARED, SOMETIMES, UNKNOWN_START
from postproc.compensation.text.assignment import ELSEWHERE, WAYS
from postproc.effects.library.joints.backlash import Backlash
from tests.compensation.build import (
    AXES,
    FORCE,
    arm,
    codes,
    convert,
    events,
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


def test_a_way_out_of_a_routine_goes_on_behind_the_call() -> None:
    more = f"  PROC part()\n    MoveL {B},v50,fine,tT;\n    IF DInput(di1)=1 RETURN;\n    MoveL {C},v50,fine,tT;\n  ENDPROC\n"
    found = convert(module("", f"MoveJ {A},v200,fine,tT;\npart;\nMoveL {END},v50,fine,tT;", more))
    assert [o.status for o in found.outcomes] == ["compensated"] * 4
    plan = found.plan
    assert plan is not None
    starts = [tuple(np.round(1e3 * plan.motion.samples.curves.start[i][:2])) for i in (3, 5)]
    assert sorted(starts) == [(1290, -440), (1350, -420)]  # from C, and from B where the routine returned


def test_ways_that_cannot_be_told_apart_need_one_correction() -> None:
    """No lost motion: what a statement needs does not depend on the way by which the arm comes."""
    found = convert(module("", BRANCH))
    assert outcome(found, 4).reason is None and outcome(found, 4).edited == "aggregate"


def test_an_arc_that_begins_nobody_knows_where_moves_as_a_whole() -> None:
    """Its start belongs to whoever calls the routine; the circle point goes with the goal."""
    text = module(
        "", f"MoveJ {A},v200,fine,tT;", f"  PROC service()\n    MoveC {VIA},{ROUND},v50,fine,tT;\n  ENDPROC\n"
    )
    found = convert(text)
    before, after = (events(t)[1] for t in (text, written(found)))
    to, via = (np.subtract(getattr(after, name).trans, getattr(before, name).trans) for name in ("target", "via"))
    assert np.linalg.norm(to) > 0.5
    assert via == pytest.approx(to, abs=1e-3)
    assert outcome(found, 1).reason == UNKNOWN_START


def test_runs_with_a_displacement_that_is_not_known_are_no_part_of_the_promise() -> None:
    """The seam is proved where the routine runs undisplaced; nobody knows what it needs in the loop."""
    head = "  VAR pose shift;\n  PERS num k:=0;\n"
    seam = f"  PROC seam()\n    MoveJ {A},v200,fine,tT;\n    MoveL {B},v50,fine,tT;\n  ENDPROC\n"
    step = "PDispSet shift;\nseam;\nshift:=PoseMult(shift,[[12,5,0],[1,0,0,0]]);\nk:=k+1;"
    found = convert(module(head, f"seam;\nWHILE k<3 DO\n{step}\nENDWHILE\nPDispOff;", seam))
    assert [o.status for o in found.outcomes] == ["compensated"] * 2
    assert found.report["unproved_statements"] == 2
    assert "2 of these statements also run where they cannot be followed" in text_of(found)
    assert "! 2 motion statements also run where what remains is not proved" in written(found)
    proved = convert(module(head, "seam;", seam))
    assert proved.report["unproved_statements"] == 0
    assert "not proved" not in text_of(proved) + written(proved)


def test_runs_that_begin_nobody_knows_where_are_no_part_of_the_promise() -> None:
    """What is read from the controller is not known: the second run of the seam begins there."""
    seam = f"  PROC seam()\n    MoveL {A},v200,fine,tT;\n    MoveL {B},v50,fine,tT;\n  ENDPROC\n"
    body = f"MoveJ {END},v200,fine,tT;\nseam;\nMoveL CRobT(),v50,fine,tT;\nseam;"
    found = convert(module("", body, seam))
    reasons = {outcome(found, i).reason for i in (2, 3)}
    assert [o.status for o in found.outcomes] == ["compensated", "skipped", "compensated", "compensated"]
    assert SOMETIMES in reasons and len(reasons) == 2
    assert (found.report["unproved_statements"], found.report["unmeasured_statements"]) == (1, 1)


LOADS = f"  PERS loaddata part:=[20,[30,10,120],[1,0,0,0],0,0,0];\n  CONST robtarget a:={A};\n"
NAMED = """  PROC seam(num number)
    MoveL Offs(a,0,0,50),v50,fine,tT;
    TPWrite "",\\Num:=number;
  ENDPROC
"""


@pytest.mark.parametrize("number", ["5", "200", "asked"])
def test_what_goes_with_a_number_is_no_other_where_nobody_follows(number: str) -> None:
    """The service routine hands over a number of its own, or one that nobody knows: 200 would carry it off by 7 mm."""
    body = f"MoveJ {END},v200,fine,tT;\nGripLoad part;\nseam 5;\nGripLoad load0;\nMoveJ {END},v200,fine,tT;\nseam 9;"
    service = f"  PROC service()\n    MoveJ {END},v200,fine,tT;\n    seam {number};\n  ENDPROC\n"
    found = convert(module(LOADS + "  VAR num asked;\n", body, NAMED + service))
    assert ("*number" in written(found)) is (number == "5")


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


def test_the_load_that_only_one_way_takes() -> None:
    """What is not known after the ways have met leaves the statement alone, with the reason."""
    text = module(
        "PERS loaddata part:=[20,[0,0,100],[1,0,0,0],0,0,0];", BRANCH.replace("ELSE", "  GripLoad part;\nELSE")
    )
    found = convert(text)
    last = outcome(found, 4)
    assert last.status == "skipped" and "payload is not known" in (last.reason or "")
    assert [o.status for o in found.outcomes[:4]] == ["compensated"] * 4


def test_a_line_that_nobody_drives_is_no_obstacle() -> None:
    """From the end of one branch to the start of the other the arm would have to pass through its own column."""
    behind = "[[-1200,300,900],[0,0,1,0],[1,0,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    text = module(
        "",
        f"MoveJ {A},v200,fine,tT;\nIF DInput(di1)=1 THEN\nMoveL {B},v50,fine,tT;\nMoveJ {behind},v500,fine,tT;\n"
        f"ELSE\nMoveL {C},v50,fine,tT;\nENDIF\nMoveJ {A},v200,fine,tT;",
    )
    assert convert(text).outputs, [d.message for d in convert(text).diagnostics]


def test_a_statement_whose_next_run_leads_nobody_knows_where_keeps_its_argument() -> None:
    """The first turn is known, the second depends on what is asked for in the first: one place cannot serve both."""
    text = module(
        "VAR num n;",
        f"MoveJ {A},v200,fine,tT;\nn:=0;\nWHILE n<>-1 DO\nMoveL Offs({B},0,-100*n,0),v50,fine,tT;\n"
        f'MoveL {END},v50,fine,tT;\nTPReadFK n,"?","a","b","","","";\nENDWHILE',
    )
    found = convert(text)
    assert outcome(found, 1).status == "skipped" and str(outcome(found, 1).reason).startswith(ELSEWHERE)
    assert outcome(found, 2).status == "compensated"
    assert f"Offs({B},0,-100*n,0)" in written(found)
    assert found.report["added_targets"] == 0  # the way to END begins there


OLD = """  PROC rOld()
    MoveJ a,v100,fine,{tool};
    MoveL {old},{speed},fine,tT;
    MoveL b,v100,fine,tT;
  ENDPROC
"""


@pytest.mark.parametrize(
    ("values", "code"),
    [
        ({"old": target(9000, 0)}, "KIN001"),
        ({"old": target(1300, -400, conf=(9, 9, 9, 3))}, "KIN002"),
        ({"old": f"[[1300,-400,700],[0,0,0,0.5],[0,0,0,0],{AXES}]"}, "RAP024"),
        ({"old": "a", "speed": "[0,500,5000,1000]"}, "MOT006"),
        ({"old": "a", "tool": "tGone"}, "RAP020"),
    ],
)
def test_what_is_wrong_where_nothing_leads_is_left_and_said(values: dict[str, str], code: str) -> None:
    old = OLD.format(**{"speed": "v100", "tool": "tT", **values})
    data = f"CONST robtarget a:={target(1300, -500)};\nCONST robtarget b:={target(1330, -400)};"
    text = module(data, "MoveJ a,v100,fine,tT;\nMoveL b,v50,fine,tT;", old)
    found = convert(text)
    assert found.exit_code == 0 and found.report["max_error_after_mm"] < 0.01 < found.report["max_error_before_mm"]
    assert {d.severity for d in found.diagnostics if d.code == code} == {"warning"}
    assert sum(o.status == "skipped" for o in found.outcomes) == 1
    reached = module(data, "rOld;", old)
    assert convert(reached).exit_code == 1


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


@pytest.mark.parametrize("set_by", ["PDispOn\\ExeP:=found,s,tT;", "d.trans.x:=found.trans.x-1250;\nPDispSet d;"])
@pytest.mark.parametrize("plain", [True, False])
def test_a_run_that_a_search_displaces_is_not_corrected_in_silence(set_by: str, plain: bool) -> None:
    data = f"CONST robtarget s:={target(1250, -500, 650)};\nVAR robtarget found;\nVAR pose d;"
    seam = f"PROC seam()\nMoveL {A},v50,fine,tT;\nMoveL {B},v50,fine,tT;\nENDPROC\n"
    body = f"MoveJ s,v200,fine,tT;\n{'seam;' * plain}\nSearchL di,found,s,v50,tT;\n{set_by}\nseam;\nPDispOff;"
    found = convert(module(data, body, seam))
    told = [d for d in found.diagnostics if d.code == "CMP018"]
    assert len(told) == plain
    if plain:  # the second run: the arm's error is in what was found, and the targets are corrected for it, too
        most = max(o.shift_mm or 0.0 for o in found.outcomes[-2:])
        assert most > 0.5 and f"`seam` is corrected, by up to {most:.3f} mm" in told[0].message
    else:
        assert [o.status for o in found.outcomes[-2:]] == ["skipped"] * 2


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


@pytest.mark.parametrize(("set_to", "told"), [("", ["RAP036"]), ("wide:=DInput(di2)=1;\n", [])])
def test_a_branch_on_data_that_nothing_writes_is_told(set_to: str, told: list[str]) -> None:
    """Who sets it is not in the file: the other arm is corrected at its targets alone."""
    head = "  PERS bool wide:=FALSE;\n"
    found = convert(module(head, set_to + BRANCH.replace("DInput(di1)=1", "wide")))
    assert [d.code for d in found.diagnostics if d.code.startswith("RAP")] == told
    assert (outcome(found, 1).reason == UNKNOWN_START) is bool(told)
