"""An arc with a point that stays as it is: never farther off than before, however near its circle point lies."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.compensation.plan import BEFORE
from postproc.diagnostics import Source
from postproc.motion.path.moves import read_moves
from postproc.runtime.passes import correct_program
from tests.build import FORCE, arm, convert, events, independent, module, outcome, target, written

RADIUS = 60.0


def at(angle: float) -> str:
    """A target on a circle about (1150, -240, 700), an angle [deg] away from its lowest y."""
    a = np.radians(angle)
    return target(round(1150 + RADIUS * np.sin(a), 3), round(-240 - RADIUS * np.cos(a), 3))


def joints() -> str:
    """The joint target at which the controller stands at the start of the arc."""
    moves, _ = read_moves(arm().robot, events(module("", f"MoveJ {at(0)},v200,fine,tT;")))
    return f"[[{','.join(f'{v:.7f}' for v in np.degrees(moves[0].q))}],[9E9,9E9,9E9,9E9,9E9,9E9]]"


@pytest.mark.parametrize("via, goal", [(2, 90), (60, 200)])
def test_an_arc_from_a_known_start_that_stays_lies_on_one_circle_with_it(via: float, goal: float) -> None:
    body = f"MoveAbsJ {joints()},v200,fine,tT;\nMoveC {at(via)},{at(goal)},v50\\ID:=10,fine,tT;"
    text = module("", body)
    found = convert(text)
    real = independent(text, found)
    (arc,) = [s for s in real.segments if s.kind == "C"]
    assert arc.after <= arc.before + 0.005
    assert arc.goal_after < 0.005
    told = max(found.report["max_error_after_mm"], found.report["max_transition_mm"])
    assert told == pytest.approx(arc.after, abs=0.05)


def around(via: float) -> Conversion:
    """A program that goes to the start of an arc of a file that is only read along."""
    lib = f"MODULE L\n  PROC around()\n    MoveC {at(via)},{at(90)},v50,fine,tT;\n  ENDPROC\nENDMODULE\n"
    text = module(
        f"CONST robtarget pStart:={at(0)};",
        f"MoveJ {target(1150, -300, 760)},v200,fine,tT;\nMoveL pStart,v50,fine,tT;\naround;",
    )
    sources = [Source("m.mod", text.encode()), Source("l.sys", lib.encode(), True)]
    return correct_program(sources, arm(), Options(force=FORCE, inertia=False))


def test_the_start_of_an_arc_that_stays_is_left_where_it_would_spoil_the_arc() -> None:
    near, middle = around(4), around(45)
    assert (outcome(near, 1).status, outcome(near, 1).reason) == ("skipped", BEFORE)
    assert f"pStart:={at(0)};" in written(near)
    assert outcome(middle, 1).status == "compensated"
