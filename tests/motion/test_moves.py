"""From RAPID text to moves: what the rows of ``corpus.txt`` cannot say, and what a program asks of its arm."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.diagnostics import Source
from postproc.motion.path.moves import read_moves
from postproc.motion.path.nominal_arm import NominalArm
from postproc.motion.path.places import place_events
from postproc.motion.path.samples import sample_path
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import JointTarget, RobTarget
from postproc.rapid.execution.walk import walk
from postproc.rapid.motions.units import matrix_pose
from postproc.rapid.program.program import read_program
from postproc.robot.cells.cell import Cell, CellArm, Joint, Unit
from postproc.robot.cells.station import Station
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.motion.build import ROBOT, tcp
from tests.rapid import build

E = build.UNUSED
P1, P2 = (build.target(1000, y, 600, "[0,0,1,0]", "[-1,0,-1,0]") for y in (-200, -100))
T1 = "PERS tooldata t1:=[TRUE,[[0,0,300],[1,0,0,0]],[4,[0,0,100],[1,0,0,0],0,0,0]];"
ARM = A.irb4600()


def codes(body: str) -> list[str]:
    return [d.code for d in read_moves(ROBOT, build.events(body, T1))[1]]


def as_target(T: np.ndarray, conf: str) -> str:
    pose = matrix_pose(T)
    return f"[[{','.join(map(str, pose.trans))}],[{','.join(map(str, pose.rot))}],[{conf}],{E}]"


def test_joint_angles_are_those_of_the_pose() -> None:
    move = read_moves(ROBOT, build.events(f"MoveJ {P1},v200,fine,t1;\nMoveL {P2},v50,z10,t1;", T1))[0][1]
    assert move.T_work_tcp is not None
    assert np.abs(tcp(move.q[None], move.T_mount_tcp)[0] - move.T_work_tcp).max() < 1e-9


def test_a_wrist_with_half_a_turn_to_go_changes_neither_shoulder_nor_elbow() -> None:
    """The torch points down and 25 deg aside; from home every turn of axis 6 leaves the arm in front, elbow up."""
    home = f"MoveAbsJ [[0,-20,20,0,60,0],{E}],v200,fine,t1;\nConfJ\\Off;"
    for turn in np.radians(np.arange(0.0, 360.0, 15.0)):
        w, z = np.cos(turn / 2), np.sin(turn / 2)
        rot = f"[{-0.2164 * z:.7f},{0.9763 * w:.7f},{0.9763 * z:.7f},{0.2164 * w:.7f}]"
        goal = build.target(1000, -400, 600, rot, "[9,9,9,9]")
        moves, findings = read_moves(ROBOT, build.events(f"{home}\nMoveJ {goal},v200,fine,t1;", T1))
        assert findings == []
        assert abs(moves[1].q[0]) < np.pi / 2 and moves[1].q[2] < np.pi / 2


def test_the_place_that_a_kept_configuration_cannot_reach_is_named() -> None:
    """The arm bends over backwards; 1.75 m from axis 1 only an arm that faces the place reaches it."""
    over = as_target(tcp(np.radians([[165.0, -80.0, -60.0, 0.0, 60.0, 0.0]]), A.shift(0, 0, 0.3))[0], "0,0,0,0")
    far = build.target(2185, 0, 495, "[0.707106781,0,0.707106781,0]")
    start = f"MoveAbsJ [[160,-80,-55,0,60,0],{E}],v200,fine,t1;\nConfJ\\Off;\nConfL\\Off;"
    body = f"{start}\nMoveJ {over},v50,fine,t1;\nMoveJ {far},v50,fine,t1;"
    moves, findings = read_moves(ROBOT, build.events(body, T1))
    line = 1 + build.module(body, T1).decode().split(far)[0].count("\n")
    assert [(d.code, d.place.split(":")[1]) for d in findings] == [("KIN002", str(line))]
    assert "configuration in which it comes" in findings[0].message and len(moves) == 2


def test_a_line_that_nobody_monitors_ends_where_its_way_turns_the_wrist() -> None:
    """Past a nearly straight wrist axis 4 turns by 111 deg; from goal to goal it would seem to turn over. Home is free."""
    q = np.radians([5.0, 20.0, 10.0, 60.0, 4.0, -60.0])
    way = np.stack([A.shift(0.0, y, 0.0) @ tcp(q[None], np.eye(4))[0] for y in np.linspace(0.0, 0.2, 401)])
    begin, home = (f"MoveAbsJ [[5,20,10,{wrist}],{E}],v200,fine,tool0;" for wrist in ("60,4,-60", "0,60,0"))
    lines = "".join(f"MoveL {as_target(way[k], '0,0,0,0')},v50,fine,tool0;" for k in (400, 300))
    moves, _ = read_moves(ROBOT, build.events(f"{begin}ConfL\\Off;{lines}{home}", T1))
    true = I.follow(ARM, way, q)
    assert true is not None
    assert np.abs(np.array([m.q for m in moves[1:3]]) - true[[400, 300]]).max() < 1e-5
    assert sample_path(ROBOT, moves)[1] == []


def test_a_flat_arc_points_to_its_target() -> None:
    flat = build.target(1000, -150, 600, "[0,0,1,0]", "[-1,0,-1,0]")
    body = f"MoveJ {P1},v200,fine,t1;\nMoveC {flat},{P2},v50,fine,t1;"
    _, (finding,) = sample_path(ROBOT, read_moves(ROBOT, build.events(body, T1))[0])
    assert finding.code == "MOT001" and finding.span is not None
    assert build.module(body, T1)[slice(*finding.span)].decode() == P2


def test_one_mistyped_target_and_wrong_configurations_are_no_other_arm() -> None:
    """Three statements go to one target that is 2 m off; four of nine state a branch that does not exist."""
    q = np.array([[-0.36, 0.3 + 0.02 * k, 0.1, 0.2, 0.8, 0.1] for k in range(9)])
    T = tcp(q, np.eye(4))
    good = [as_target(t, ",".join(map(str, conf))) for t, conf in zip(T, I.confdata(ARM, q), strict=True)]
    wrong = [as_target(t, "2,0,0,5") for t in T]
    far = [as_target(A.shift(2.0) @ t, "-1,0,0,0") for t in T]

    def located(targets: list[str]) -> list[str]:
        return codes("".join(f"MoveJ {target},v200,fine,tool0;\n" for target in targets))

    assert located(good) == []
    assert located([*good[:6], *[far[6]] * 3]) == ["KIN001"] * 3
    assert located([*good[:5], *wrong[5:]]) == ["KIN002"] * 4
    assert located(far)[-1] == located(wrong)[-1] == "KIN009"


def test_work_that_a_unit_moves_is_left_alone_where_no_cell_describes_it() -> None:
    work = 'PERS wobjdata st:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'
    (event,) = place_events(build.events(f"MoveL {P1},v50,fine,t1\\WObj:=st;", f"{T1}\n{work}"), Station())
    assert event.reason == "the work object `st` is moved by `STN1`, and no cell describes that unit"


def test_an_axis_that_single_precision_leaves_open_is_open() -> None:
    (event,) = build.events("p.extax.eax_a:=9E9*1;\nMoveL p,v50,fine,t1;", f"{T1}\nVAR robtarget p:={P1};")
    assert isinstance(event.target, RobTarget) and event.target.extax == (9e9,) * 6


TRACK = Unit("TRACK", (Joint("x", "a", "linear", np.array([1.0, 0.0, 0.0])),))
PLATE = Unit("PLATE", (Joint("c", "b", "rotary"),), T_parent_base=A.shift(1.5, 0.2, 0.5))
CELL = Cell({"track": TRACK, "plate": PLATE}, {"robot": CellArm("robot", "", "TRACK", A.shift(0.0, 0.3))})
STATION = Station(CELL, "robot", ("TRACK", "PLATE"))
DATA = r"""PERS tooldata t:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];
PERS tooldata tStill:=[FALSE,[[900,0,900],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];
PERS wobjdata w:=[FALSE,TRUE,"",[[400,0,100],[0.965926,0,0,0.258819]],[[20,10,0],[1,0,0,0]]];
PERS wobjdata wPlate:=[FALSE,FALSE,"PLATE",[[0,0,0],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
PERS wobjdata wElsewhere:=[FALSE,FALSE,"STN9",[[0,0,0],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
CONST jointtarget j:=[[-30,20,10,50,80,-120],[AXIS,9E9,9E9,9E9,9E9,9E9]];
CONST jointtarget jBoth:=[[-30,20,10,50,80,-120],[300,40,9E9,9E9,9E9,9E9]];
VAR robtarget p;
VAR jointtarget k;"""
Q = np.radians([[-30, 20, 10, 50, 80, -120]])
BEHIND_P, BEHIND_K = "MoveL p,v100,fine,t;", "MoveAbsJ k,v100,fine,t;"


def last(body: str, axis: str = "9E9", station: Station | None = None) -> MotionEvent:
    """The last motion of a program that asks the arm, which stands on a track at an axis."""
    text = build.module(body, DATA.replace("AXIS", axis))
    return walk(read_program(Source("m.mod", text), arm=NominalArm(ROBOT, station or Station())))[-1]


def turned(degrees: float, about: int = 2) -> np.ndarray:
    return A.transform(A.rotation(np.eye(3)[about], np.radians([degrees])), np.zeros((1, 3)))[0]


TOOL = A.shift(-0.0634, 0.0008, 0.3726) @ turned(np.degrees(2 * np.arctan2(0.300706, 0.953717)), 1)
TCP = ARM.forward(Q, TOOL).tcp[0]
OBJECT, SHIFTED = A.shift(0.4, 0.0, 0.1) @ turned(30.0) @ A.shift(0.02, 0.01), A.shift(0.0, 0.05)
ON_PLATE = A.shift(1.5, 0.2, 0.5) @ turned(40.0) @ A.shift(0.02, 0.01)
PLACES = {
    "beside the work": (r"p:=CalcRobT(j,t\WObj:=w);", "9E9", None, np.linalg.inv(OBJECT) @ TCP),
    "in the world": ("p:=CalcRobT(j,t);", "9E9", None, TCP),
    "under a displacement": (
        r"PDispSet [[0,50,0],[1,0,0,0]]; p:=CalcRobT(j,t\WObj:=w);", "9E9", None,
        np.linalg.inv(OBJECT @ SHIFTED) @ TCP,
    ),
    "on a track": ("p:=CalcRobT(j,t);", "1500", STATION, A.shift(1.5, 0.3) @ TCP),
    "on a positioner": (
        r"p:=CalcRobT(jBoth,t\WObj:=wPlate);", "9E9", STATION, np.linalg.inv(ON_PLATE) @ A.shift(0.3, 0.3) @ TCP,
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "axis", "station", "expected"), PLACES.values(), ids=PLACES)
def test_calcrobt_is_where_the_joints_put_the_tool(
    body: str, axis: str, station: Station | None, expected: np.ndarray
) -> None:
    target = last(body + BEHIND_P, axis, station).target
    assert isinstance(target, RobTarget)
    np.testing.assert_allclose(np.array(target.trans) / 1000, expected[:3, 3], atol=2e-6)
    rotation = Rotation.from_quat(target.rot, scalar_first=True).as_matrix()
    np.testing.assert_allclose(rotation, expected[:3, :3], atol=2e-6)
    assert target.robconf == tuple(I.confdata(ARM, Q)[0])
    assert all(float(np.float32(x)) == x or x == 9e9 for x in (*target.trans, *target.extax))  # a controller's num


@pytest.mark.parametrize(
    ("body", "axis"),
    [("p:=CalcRobT(j,t);" + BEHIND_P, 1400), ("k:=CalcJointT(CalcRobT(j,t),t);" + BEHIND_K, 1500)],
)
def test_offsets_of_the_external_axes_are_taken_out_and_put_back(body: str, axis: float) -> None:
    target = last("EOffsSet [100,0,0,0,0,0];" + body, "1500", STATION).target
    assert target is not None and target.extax[0] == axis


def test_the_external_axes_stand_where_target_and_offset_say() -> None:
    """EOffs counts for axes that a target states; one that it leaves open stays."""
    goals = "".join(f"MoveL {P1.replace(E, f'[{axes},9E9,9E9,9E9,9E9]')},v50,fine,t1;\n" for axes in ("5,7", "9E9,8"))
    placed = place_events(build.events(f"EOffsSet [100,0,0,0,0,0];\n{goals}", T1), STATION)
    assert [event.axes[:2] for event in placed if event.axes] == [(105.0, 7.0), (105.0, 8.0)]


@pytest.mark.parametrize("work", ["", r"\WObj:=w"])
def test_calcjointt_are_the_joints_that_lead_there(work: str) -> None:
    target = last(f"k:=CalcJointT(CalcRobT(j,t{work}),t{work}); {BEHIND_K}").target
    assert isinstance(target, JointTarget)
    np.testing.assert_allclose(target.robax, np.degrees(Q[0]), atol=2e-4)


@pytest.mark.parametrize(
    ("body", "station"),
    [
        (f"p:=CalcRobT(CJointT(),t); {BEHIND_P}", None),
        (f"p:=CalcRobT(j,tStill); {BEHIND_P}", None),
        (rf"p:=CalcRobT(j,t\WObj:=wElsewhere); {BEHIND_P}", None),
        (f"p:=CalcRobT(j,t); {BEHIND_P}", STATION),  # nobody says where the track stands
        (f"p:=CalcRobT([[9E9,0,0,0,0,0],[0,0,0,0,0,0]],t); {BEHIND_P}", None),
        (f"k:=CalcJointT([[9000,0,900],[0,0,1,0],[0,0,0,0],{E}],t); {BEHIND_K}", None),  # beyond the arm
    ],
)
def test_what_is_not_known_stays_unknown(body: str, station: Station | None) -> None:
    event = last(body, "9E9", station)
    assert event.target is None and event.reason
