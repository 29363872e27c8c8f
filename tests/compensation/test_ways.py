"""Branches on inputs, and starts and arcs that stay: every way is corrected, proved, and never farther off than before."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc import text as text_of
from postproc.compensation.judgement.outcomes import SHARED
from postproc.compensation.plan import BEFORE
from postproc.compensation.text.assignment import APPROACHES
from postproc.diagnostics import Source
from postproc.effects.library.joints.backlash import Backlash
from tests.build import AXES, arm, codes, convert, independent, outcome, target, timed, written
from tests.compensation.build import PROCESS, small


@pytest.mark.parametrize(("gap", "reason"), [(2e-5, SHARED), (2e-3, APPROACHES)])
def test_the_side_from_which_the_arm_comes(gap: float, reason: str) -> None:
    """Lost motion of axis 1: from the left the middle needs another correction than from the right.

    A small difference is split; beside a large one the statement is left as it is. Both are said, and each way for
    itself is no question.
    """
    lost = arm().with_effects(*arm().effects, Backlash(half_gap_rad=np.array([gap, 0, 0, 0, 0, 0])))
    left, right, middle = (f"MoveL @{{1350,{y}}},v50,fine,tT;" for y in (-500, -300, -400))
    start = "MoveJ @{1300,-400,760},v200,fine,tT;"
    conversion = convert(small(f"{start}\nIF DInput(di1)=1 THEN\n{left}\nELSE\n{right}\nENDIF\n{middle}"), lost)
    assert outcome(conversion, 3).reason == reason
    assert (outcome(conversion, 3).status == "skipped") == (reason == APPROACHES)
    assert ("CMP005" if reason == APPROACHES else "CMP006") in codes(conversion)
    for finding in (d for d in conversion.diagnostics if d.code == "CMP006"):
        row = conversion.report["statements"][3]
        parts = f"({row['residual_mm']:.3f} mm across the path, {row['along_mm']:.3f} mm along it), tolerance 0.01 mm"
        assert finding.message.startswith("this target itself stays ") and finding.message.endswith(parts)
        assert finding.size == pytest.approx(np.hypot(row["residual_mm"], row["along_mm"]), abs=1e-3)
    for side in (left, right):
        assert convert(small(start + side + middle), lost).outcomes[2].status == "compensated"


@pytest.mark.parametrize(
    ("more", "measured"), [("", 0), ("MoveL @{1350,-500},v50,fine,tT; MoveL @{1350,-420},v50,fine,tT;", 1)]
)
def test_lines_that_nobody_can_follow_are_in_no_figure(more: str, measured: int) -> None:
    body = f"MoveJ @{{1290,-440,730}},v200,fine,tT; p:=CRobT(); MoveL p,v50,fine,tT; {more}"
    conversion = convert(small(body, data="VAR robtarget p;"))
    assert conversion.report["measured_statements"] == measured
    # The line that begins at the measured place is right at its target.
    assert conversion.report["unmeasured_statements"] == 1 + measured
    for text in (text_of(conversion), written(conversion)):
        assert ("no line or arc could be measured" in text) == (measured == 0)
        assert "in no figure" in text or "Not in these figures" in text
    assert ("CMP017" in codes(conversion)) == (measured == 0)


def test_what_remains_while_the_arc_burns_stands_beside_the_ways_in_the_air() -> None:
    """The arm comes to the approach from home, which stays where it is, or from a corrected target: nothing is added."""
    lift = "MoveL @{1330,-470,800},v300,fine,tT;"
    seam = f"ArcLStart @{{1330,-470}},{PROCESS},fine,tT; ArcLEnd @{{1330,-370}},{PROCESS},fine,tT;"
    home = f"CONST jointtarget home:=[[-20,0,10,0,60,0],{AXES}];"
    conversion = convert(small(f"MoveAbsJ home,v500,fine,tT;\nIF di1=1 THEN\n{lift}\nENDIF\n{lift} {seam}", data=home))
    weld, air, *_ = conversion.report["figures"]
    assert (weld["place"], air["place"]) == ("weld", "air") and air["after_mm"] > 0.1 and weld["after_mm"] <= 0.01
    text, head = text_of(conversion), written(conversion)
    for figure in (weld, air):
        lengths = (f"{figure[key]:.3f}" for key in ("before_mm", "after_mm", "tolerance_mm"))
        on_arm = "{:.3f} to {:.3f}".format(*figure["expected_on_arm_mm"])
        row = " +".join((figure["place"], *lengths, on_arm))
        assert re.search(f"^  {row}$", text, re.MULTILINE) and re.search(rf"^ *! {row}\r?$", head, re.MULTILINE)
    unwelded = convert(small(lift + lift))
    assert unwelded.report["max_arc_error_after_mm"] is None
    assert "burns" not in text_of(unwelded) + written(unwelded)


def on_circle(angle: float) -> str:
    """A target on a circle of 60 mm about (1150, -240, 700), an angle [deg] away from its lowest y."""
    a = np.radians(angle)
    return target(round(1150 + 60 * np.sin(a), 3), round(-240 - 60 * np.cos(a), 3))


@pytest.mark.parametrize(("via", "goal"), [(2, 90), (60, 200)])
def test_an_arc_from_a_known_start_that_stays_lies_on_one_circle_with_it(via: float, goal: float) -> None:
    """Never farther off than before, however near its circle point lies."""
    q = timed(small(f"MoveJ {on_circle(0)},v200,fine,tT;")).path.q[0]
    start = f"[[{','.join(f'{v:.7f}' for v in np.degrees(q))}],{AXES}]"
    text = small(f"MoveAbsJ {start},v200,fine,tT; MoveC {on_circle(via)},{on_circle(goal)},v50\\ID:=10,fine,tT;")
    conversion = convert(text)
    (arc,) = [s for s in independent(text, conversion).segments if s.kind == "C"]
    assert arc.after <= arc.before + 0.005
    assert arc.goal_after < 0.005
    claim = max(conversion.report["max_error_after_mm"], conversion.report["max_transition_mm"])
    assert claim == pytest.approx(arc.after, abs=0.05)


@pytest.mark.parametrize(("via", "status", "reason"), [(4, "skipped", BEFORE), (45, "compensated", None)])
def test_the_start_of_an_arc_that_stays_is_left_where_it_would_spoil_the_arc(
    via: float, status: str, reason: str | None
) -> None:
    """The arc stands in a file that is only read along."""
    lib = f"MODULE L\n  PROC around()\n    MoveC {on_circle(via)},{on_circle(90)},v50,fine,tT;\n  ENDPROC\nENDMODULE\n"
    start = f"CONST robtarget pStart:={on_circle(0)};"
    text = small("MoveJ @{1150,-300,760},v200,fine,tT; MoveL pStart,v50,fine,tT; around;", data=start)
    conversion = convert(text, None, [Source("l.sys", lib.encode(), True)], tolerance_m=1e-4, air_tolerance_m=2e-4)
    assert (outcome(conversion, 1).status, outcome(conversion, 1).reason) == (status, reason)
    assert (start in written(conversion)) == (status == "skipped")
