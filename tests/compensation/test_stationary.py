"""The robot carries the work piece to a tool that stands still: the process point goes where it should on the work.

Targets are laid out with the independent arm; the written program drives it with the force at the standing tool.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from postproc.compensation.inspection import inspect_program
from postproc.diagnostics import Source
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.rapid.data.records import Vec3
from postproc.results.convert.conclusion import conclusion
from tests.build import AXES, DATA, FORCE, arm, codes, convert, independent, target, timed, written
from tests.compensation.build import findings
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent.rapid import matrix_quaternion

ARM = A.irb4600()
TOOL = "tStand\\WObj:=wPlate"
SHIFTED = "[[5,-4,3],[1,0,0,0]]"
HELD = f"    MoveJ {target(1350, -300)},v200,fine,tT;\n    MoveL {target(1350, -200)},v50,fine,tT;\n"
HOME = np.radians([10.0, 15.0, 5.0, 5.0, 65.0, 20.0])
# The work object on the flange, turned and 150 mm out; the torch stands where it meets the middle of the plate.
ON_FLANGE = A.transform(A.rotation(np.array([0.0, 0.0, 1.0]), np.array(0.3)), np.array([0.02, -0.03, 0.15]))
DOWN = A.rotation(np.array([1.0, 0.0, 0.0]), np.array(np.pi - 0.4))


def numbers(T: np.ndarray) -> str:
    place = ",".join(f"{1e3 * v:.6f}" for v in T[:3, 3])
    return f"[{place}],[{','.join(f'{v:.9f}' for v in matrix_quaternion(T[:3, :3]))}]"


@cache
def stand() -> np.ndarray:
    """T_base_tcp of the torch, as it is written."""
    T = ARM.forward(HOME[None], np.eye(4)).flange[0] @ ON_FLANGE @ A.transform(DOWN, np.array([0.05, 0.0, 0.0]))
    T[:3, 3] = np.round(T[:3, 3], 9)
    return T


def on_work(x: float, y: float, z: float = 0.0, turn: float = 0.0) -> str:
    """A robtarget on the work object [mm], the torch turned about the plate's normal [rad]."""
    T = A.transform(A.rotation(np.array([0.0, 0.0, 1.0]), np.array(turn)) @ DOWN, 1e-3 * np.array([x, y, z]))
    flange = stand() @ np.linalg.inv(ON_FLANGE @ T)
    branches = I.inverse(ARM, flange[None])[0]
    away = np.abs(I.wrap(branches - HOME)).max(axis=1)
    q = branches[int(np.nanargmin(away))]
    q = HOME + I.wrap(q - HOME)
    return f"[{numbers(T)},[{','.join(map(str, I.confdata(ARM, q)[0]))}],{AXES}]"


def plate(body: str) -> str:
    data = f"""  PERS tooldata tStand:=[FALSE,[{numbers(stand())}],[8,[10,0,60],[1,0,0,0],0,0,0]];
  PERS wobjdata wPlate:=[TRUE,TRUE,"",[{numbers(ON_FLANGE)}],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata wTable:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS loaddata plate:=[12,[40,10,20],[1,0,0,0],0,0,0];
"""
    steps = "".join(f"    {line.strip()}\n" for line in body.strip().splitlines())
    return f"MODULE M\n{DATA}{data}  PROC main()\n    GripLoad plate;\n{steps}  ENDPROC\nENDMODULE\n"


def seam() -> str:
    return plate(
        f"""MoveJ {on_work(-120, -80, 40)},v200,fine,{TOOL};
        MoveL {on_work(-120, -80)},v100,fine,{TOOL};
        ArcLStart {on_work(-110, -80)},v100,sm,wd,fine,{TOOL};
        ArcL {on_work(150, -80)},v100,sm,wd,z5,{TOOL};
        ArcC {on_work(193, -40, 0, 0.1)},{on_work(150, 0, 0, 0.2)},v100,sm,wd,z1,{TOOL};
        ArcLEnd {on_work(-120, 30, 0, 0.3)},v100,sm,wd,fine,{TOOL};
        MoveL {on_work(-120, 30, 50, 0.3)},v200,fine,{TOOL};"""
    )


KEPT = {
    "the force of the process": (seam(), {}, FORCE),
    "the weight of gripper and plate": (seam(), {"force": (0.0, 0.0, 0.0)}, (0.0, 0.0, 0.0)),
    "a program displacement": (
        seam().replace("GripLoad plate;", f"GripLoad plate;\n    PDispSet {SHIFTED};"),
        {},
        FORCE,
    ),
    "a held tool in the same program": (seam().replace("  ENDPROC", f"{HELD}  ENDPROC"), {}, FORCE),
}


@pytest.mark.parametrize(("text", "options", "force"), KEPT.values(), ids=KEPT)
def test_the_process_point_follows_the_path_on_the_work(text: str, options: dict[str, Any], force: Vec3) -> None:
    conversion = convert(text, **options)
    assert {o.status for o in conversion.outcomes} == {"compensated"}
    report = independent(text, conversion, force)
    assert report.violations == []
    assert report.before > (0.5 if any(force) else 0.1)
    assert report.after <= 0.01 and report.goal_after <= 0.003
    assert conversion.report["max_error_after_mm"] == pytest.approx(report.after, abs=3e-4)
    assert conversion.report["max_error_before_mm"] == pytest.approx(report.before, abs=3e-4)


@pytest.mark.parametrize(("options", "how"), [({"inertia": True}, {}), ({"force_on": "arc"}, {"on_arc": True})])
def test_the_promise_holds_while_it_welds(options: dict[str, Any], how: dict[str, Any]) -> None:
    """With inertia at weld speed; with a force that acts on the arc alone, whose transitions are said."""
    conversion = convert(seam(), **options)
    welds = [s for s in independent(seam(), conversion, **how).segments if s.welding]
    assert max(s.after for s in welds) <= 0.01
    on_arc = "force_on" in options
    assert ("CMP007" in codes(conversion)) == on_arc and "CMP008" not in codes(conversion)
    assert not on_arc or conversion.report["max_error_after_mm"] <= 0.01


def test_speed_is_that_of_the_torch_on_the_work() -> None:
    trajectory = timed(seam())
    middle = np.flatnonzero((trajectory.path.move == 3) & (np.abs(trajectory.path.u - 0.5) < 0.2))
    assert trajectory.tcp_speed[middle] == pytest.approx(0.009, rel=1e-4)
    steps = np.linalg.norm(np.diff(trajectory.path.T_work_tcp[middle, :3, 3], axis=0), axis=1)
    assert steps / np.diff(trajectory.t[middle]) == pytest.approx(0.009, rel=1e-4)


def test_the_error_of_a_measured_tool_is_not_that_of_one_that_stands() -> None:
    measured = arm().with_effects(*arm().effects, ToolFrame(shift_m=np.array([1e-3, 0.0, 0.0])))
    conversion = convert(seam(), measured)
    assert "`tStand`" in findings(conversion, "CMP011")[0].message
    assert written(conversion) == written(convert(seam()))


def test_the_function_at_run_time_does_not_correct_a_tool_that_stands() -> None:
    """It returns such targets as they came, and the proof says what remains."""
    conversion = convert(plate(f"MoveJ {on_work(0, 0)},v200,fine,{TOOL};"), run_time="all")
    (outcome,) = conversion.outcomes
    assert outcome.status == "run_time" and (outcome.residual_mm or 0.0) > 1.0
    assert "CMP006" in codes(conversion)


@pytest.mark.parametrize(
    ("tool", "words"),
    [
        ("tStand", "neither the tool `tStand` nor the work object `wobj0` is held by the robot"),
        ("tStand\\WObj:=wTable", "neither the tool `tStand` nor the work object `wTable` is held by the robot"),
        ("tT\\WObj:=wPlate", "both the tool `tT` and the work object `wPlate`"),
    ],
)
def test_tool_and_work_that_do_not_meet(tool: str, words: str) -> None:
    conversion = convert(plate(f"MoveJ {on_work(0, 0)},v200,fine,{tool};"))
    (finding,) = findings(conversion, "MOT007")
    assert words in finding.message and conversion.outputs == {}


def test_inspect_says_what_stands_still() -> None:
    rows = inspect_program(Source("m.mod", seam().encode()), arm().robot).rows
    assert len(rows) == 7
    for row in rows:
        assert row.reason is None and row.payload_mass == 20
        assert row.position_mm == pytest.approx(1e3 * stand()[:3, 3], abs=1e-3)
        assert "stationary tool: the robot carries the work object" in row.notes


def test_a_taught_work_object_on_the_flange_is_left_where_it_was_taught() -> None:
    """The rigid shift is one of the work in its own axes; of the correction without a force little is left."""
    full, remaining = (convert(seam(), force=(0.0, 0.0, 0.0), wobj_taught=names) for names in ((), ("wPlate",)))
    assert remaining.report["max_error_after_mm"] < 0.01
    (row,) = remaining.report["rigid_shift"]
    assert row["wobj"] == "wPlate" and row["left_out"] and row["held"]
    said = "That counts where `wPlate` was taught at the stationary tool, turned as in these targets."
    assert said in conclusion(remaining)[1] and said not in conclusion(full)[1]
    before, after = ([o.shift_mm for o in c.outcomes if o.statement.signature.phase] for c in (full, remaining))
    assert max(after) < 0.5 * min(before)
    assert row["rest_mm"] == pytest.approx(max(after), abs=0.01)
