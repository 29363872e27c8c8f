"""CalcRobT and CalcJointT of a program, against the independent arm and frames written by hand."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.motion.path.nominal_arm import NominalArm
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import JointTarget, RobTarget
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import read_program
from postproc.robot.catalogue import load_robot
from postproc.robot.cells.cell import Cell, CellArm, Joint, Unit
from postproc.robot.cells.station import Station
from tests.independent import arm as A
from tests.independent import inverse as I

ARM = A.irb4600()
ROBOT = load_robot("irb4600_60_205")
E9 = "9E9,9E9,9E9,9E9,9E9"
TRACK = Unit("TRACK", (Joint("x", "a", "linear", np.array([1.0, 0.0, 0.0])),))
PLATE = Unit("PLATE", (Joint("c", "b", "rotary"),), T_parent_base=A.shift(1.5, 0.2, 0.5))
CELL = Cell({"track": TRACK, "plate": PLATE}, {"robot": CellArm("robot", "", "TRACK", A.shift(0.0, 0.3))})
STATION = Station(CELL, "robot", ("TRACK", "PLATE"))
HEAD = f"""MODULE M
  PERS tooldata t:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];
  PERS tooldata tStill:=[FALSE,[[900,0,900],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];
  PERS wobjdata w:=[FALSE,TRUE,"",[[400,0,100],[0.965926,0,0,0.258819]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wPlate:=[FALSE,FALSE,"PLATE",[[0,0,0],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wElsewhere:=[FALSE,FALSE,"STN9",[[0,0,0],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST jointtarget j:=[[-30,20,10,50,80,-120],[AXIS,{E9}]];
  CONST jointtarget jBoth:=[[-30,20,10,50,80,-120],[300,40,9E9,9E9,9E9,9E9]];
  VAR robtarget p;
  VAR jointtarget k;
  PROC main()
    BODY
  ENDPROC
ENDMODULE
"""
Q = np.radians([[-30, 20, 10, 50, 80, -120]])
TOOL = A.transform(
    A.rotation(np.array([0.0, 1.0, 0.0]), np.array([2 * np.arctan2(0.300706, 0.953717)])),
    np.array([[-0.0634, 0.0008, 0.3726]]),
)[0]


def last(body: str, axis: str = "9E9", station: Station | None = None) -> MotionEvent:
    text = HEAD.replace("BODY", body).replace("AXIS", axis)
    arm = NominalArm(ROBOT, station or Station())
    return walk(read_program(Source("m.mod", text.encode()), arm=arm))[-1]


def pose(event: MotionEvent) -> np.ndarray:
    assert isinstance(event.target, RobTarget)
    w, *v = event.target.rot
    turn = A.rotation_vector(2 * np.arctan2(np.linalg.norm(v), w) * np.array([v]) / np.linalg.norm(v))
    return A.transform(turn, np.array([event.target.trans]) / 1000)[0]


def turned(degrees: float) -> np.ndarray:
    return A.transform(A.rotation(np.array([0.0, 0.0, 1.0]), np.radians([degrees])), np.zeros((1, 3)))[0]


TCP = ARM.forward(Q, TOOL).tcp[0]
OBJECT = A.shift(0.4, 0.0, 0.1) @ turned(30.0) @ A.shift(0.02, 0.01)
MOVED = A.shift(0.0, 0.05, 0.0)
CASES = {
    "beside the work": (r"p:=CalcRobT(j,t\WObj:=w);", "9E9", None, np.linalg.inv(OBJECT) @ TCP),
    "in the world": ("p:=CalcRobT(j,t);", "9E9", None, TCP),
    "under a displacement": (
        r"PDispSet [[0,50,0],[1,0,0,0]]; p:=CalcRobT(j,t\WObj:=w);", "9E9", None,
        np.linalg.inv(OBJECT @ MOVED) @ TCP,
    ),
    "on a track": ("p:=CalcRobT(j,t);", "1500", STATION, A.shift(1.5, 0.3) @ TCP),
    "on a positioner": (
        r"p:=CalcRobT(jBoth,t\WObj:=wPlate);", "9E9", STATION,
        np.linalg.inv(A.shift(1.5, 0.2, 0.5) @ turned(40.0) @ A.shift(0.02, 0.01)) @ A.shift(0.3, 0.3) @ TCP,
    ),
}  # fmt: skip


@pytest.mark.parametrize("body, axis, station, expected", CASES.values(), ids=CASES)
def test_a_place_is_where_the_joints_put_the_tool(
    body: str, axis: str, station: Station | None, expected: np.ndarray
) -> None:
    event = last(body + "MoveL p,v100,fine,t;", axis, station)
    np.testing.assert_allclose(pose(event), expected, atol=2e-6)
    assert isinstance(event.target, RobTarget)
    assert event.target.robconf == tuple(I.confdata(ARM, Q)[0])
    numbers = [*event.target.trans, *event.target.extax]
    assert all(float(np.float32(x)) == x or x == 9e9 for x in numbers)  # a controller's num


def test_offsets_of_the_external_axes_are_taken_out_and_put_back() -> None:
    event = last("EOffsSet [100,0,0,0,0,0]; p:=CalcRobT(j,t); MoveL p,v100,fine,t;", "1500", STATION)
    assert isinstance(event.target, RobTarget) and event.target.extax[0] == 1400
    event = last("EOffsSet [100,0,0,0,0,0]; k:=CalcJointT(CalcRobT(j,t),t); MoveAbsJ k,v100,fine,t;", "1500", STATION)
    assert isinstance(event.target, JointTarget) and event.target.extax[0] == 1500


@pytest.mark.parametrize("work", ["", r"\WObj:=w"])
def test_joints_are_those_that_lead_there(work: str) -> None:
    event = last(f"k:=CalcJointT(CalcRobT(j,t{work}),t{work}); MoveAbsJ k,v100,fine,t;")
    assert isinstance(event.target, JointTarget)
    np.testing.assert_allclose(event.target.robax, np.degrees(Q[0]), atol=2e-4)


@pytest.mark.parametrize(
    ("call", "axis", "station"),
    [
        (r"CalcRobT(CJointT(),t)", "9E9", None),
        (r"CalcRobT(j,tStill)", "9E9", None),
        (r"CalcRobT(j,t\WObj:=wElsewhere)", "9E9", None),
        (r"CalcRobT(j,t)", "9E9", STATION),  # nobody says where the track stands
        (r"CalcRobT([[9E9,0,0,0,0,0],[0,0,0,0,0,0]],t)", "9E9", None),
    ],
)
def test_what_is_not_known_stays_unknown(call: str, axis: str, station: Station | None) -> None:
    event = last(f"p:={call}; MoveL p,v100,fine,t;", axis, station)
    assert event.target is None and event.reason


def test_a_target_beyond_the_arm_has_no_joints() -> None:
    far = "[[9000,0,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    assert last(f"k:=CalcJointT({far},t); MoveAbsJ k,v100,fine,t;").target is None
