"""Functions and operators of RAPID against scipy rotations and plain numpy; what has no value is in ``corpus/oddities.txt``."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from postproc.rapid.data.records import RobTarget
from tests.rapid.build import UNUSED, events

ROT, OTHER = "[0.3,-0.5,0.7,0.4]", "[0.1,0.2,0.3,0.9]"
R, S = (Rotation.from_quat(q).as_matrix() for q in ([-0.5, 0.7, 0.4, 0.3], [0.2, 0.3, 0.9, 0.1]))
P1 = f"[[100,200,300],{ROT},[0,-1,2,1],[5,9E9,9E9,9E9,9E9,9E9]]"
DATA = f"CONST robtarget p:={P1}; CONST robtarget q:=[[-50,80,20],{OTHER},[0,0,0,0],{UNUSED}]; VAR robtarget q0;"
DATA += f"CONST pose a:=[[10,20,30],{ROT}]; CONST pose b:=[[-5,7,9],{OTHER}];"
DATA += f"RECORD spot robtarget at; num force; ENDRECORD CONST spot sp:=[{P1},12]; ALIAS num length;"


def moved(expression: str, before: str = "") -> RobTarget:
    """Target of a motion to the value of an expression."""
    event = events(f"{before} MoveL {expression},v5,z0,tool0;", DATA)[0]
    assert isinstance(event.target, RobTarget), event.reason
    return event.target


def at(place: str, rot: str = "[1,0,0,0]") -> str:
    return f"[{place},{rot},[0,0,0,0],{UNUSED}]"


def number(expression: str) -> float:
    return moved(at(f"[{expression},0,0]")).trans[0]


def frame(rotation: np.ndarray, *place: float) -> np.ndarray:
    return np.block([[rotation, np.array(place)[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])


def matrix(target: RobTarget) -> np.ndarray:
    return frame(Rotation.from_quat(target.rot, scalar_first=True).as_matrix(), *target.trans)


def shift(x: float, y: float, z: float) -> np.ndarray:
    return frame(np.eye(3), x, y, z)


P, A, B = frame(R, 100, 200, 300), frame(R, 10, 20, 30), frame(S, -5, 7, 9)
POINTS = np.array([[10.0, 5, 2], [60.0, 25, -8], [20.0, 80, 33]])
OLD = np.array([[0.0, 0, 0], [100, 0, 0], [0, 50, 10]])


def through(origin: int) -> np.ndarray:
    """The frame of DefFrame: x from the first point to the second, the third on the side of +y."""
    x = (POINTS[1] - POINTS[0]) / np.linalg.norm(POINTS[1] - POINTS[0])
    z = np.cross(x, POINTS[2] - POINTS[0])
    z /= np.linalg.norm(z)
    start = {1: POINTS[0], 2: POINTS[1], 3: POINTS[0] + x * (x @ (POINTS[2] - POINTS[0]))}[origin]
    return frame(np.column_stack([x, np.cross(z, x), z]), *start)


def listed(points: np.ndarray) -> str:
    return ",".join(at(str(point)) for point in points.tolist())


def pose(expression: str) -> str:
    return at(f"{expression}.trans", f"{expression}.rot")


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("Offs(p,1,-2,3.5)", shift(1, -2, 3.5) @ P),
        ("Offs(RelTool(p,0,0,-100),0,0,50)", shift(0, 0, 50) @ P @ shift(0, 0, -100)),
        (pose("PoseMult(a,b)"), A @ B),
        (pose("PoseInv(a)"), np.linalg.inv(A)),
        (pose("PoseMult(PoseInv(b),PoseMult(b,a))"), A),
        (at("PoseVect(a,[1,2,3])"), shift(*(A @ [1, 2, 3, 1])[:3])),
        (at("[0,0,0]", "p.rot*q.rot"), frame(R @ S, 0, 0, 0)),
        (at("[1,2,3]+[1,1,1]*2-p.trans*0.5"), shift(-47, -96, -145)),
        (at("[1,2,3]*[4,5,6]"), shift(*np.cross([1, 2, 3], [4, 5, 6]))),
        *((pose(f"DefFrame({listed(POINTS)}\\Origin:={origin})"), through(origin)) for origin in (1, 2, 3)),
        (pose(f"DefDFrame({listed(np.vstack([OLD, OLD @ R.T + A[:3, 3]]))})"), A),
    ],
)
def test_functions_of_poses(expression: str, expected: np.ndarray) -> None:
    np.testing.assert_allclose(matrix(moved(expression)), expected, atol=1e-6 if "DefD" in expression else 1e-9)


def test_a_displaced_target_keeps_configuration_and_external_axes() -> None:
    found = moved("Offs(p,1,-2,3.5)")
    assert (found.robconf, found.extax[0]) == ((0, -1, 2, 1), 5)


ANGLE = st.floats(-179, 179).map(lambda x: round(x, 3))


@given(ANGLE, ANGLE, ANGLE)
def test_angles_turn_a_tool_and_come_back_from_a_quaternion(x: float, y: float, z: float) -> None:
    found = moved(f"RelTool(p,1,-2,3.5\\Rx:={x}\\Ry:={y}\\Rz:={z})")
    step = frame(Rotation.from_euler("XYZ", [x, y, z], degrees=True).as_matrix(), 1, -2, 3.5)
    np.testing.assert_allclose(matrix(found), P @ step, atol=1e-9)
    rot = f"OrientZYX({z},{y / 2.01},{x})"
    expected = Rotation.from_euler("ZYX", [z, y / 2.01, x], degrees=True).as_matrix()
    np.testing.assert_allclose(matrix(moved(at("[0,0,0]", rot)))[:3, :3], expected, atol=1e-9)
    for axis, value in (("Z", z), ("Y", y / 2.01), ("X", x)):
        assert number(f"EulerZYX(\\{axis},{rot})") == pytest.approx(value, abs=1e-5)


@pytest.mark.parametrize("y", [90, -90])
def test_euler_angles_at_the_singularity(y: float) -> None:
    z, y_, x = (f"EulerZYX(\\{axis},OrientZYX(30,{y},20))" for axis in "ZYX")
    expected = Rotation.from_euler("ZYX", [30, y, 20], degrees=True).as_matrix()
    np.testing.assert_allclose(matrix(moved(at("[0,0,0]", f"OrientZYX({z},{y_},{x})")))[:3, :3], expected, atol=1e-6)


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("1+2*3", 7), ("(1+2)*3", 9), ("10-4-3", 3), ("2*3/4", 1.5), ("-2*-3", 6), ("--2", 2), ("7 DIV 2", 3), ("-7 DIV 2", -3),
        ("7 MOD 3", 1), ("-7 MOD 3", -1), ("2+7 MOD 4*2", 8), ("Sqrt(2)", 2**0.5), ("Sin(30)", 0.5), ("Cos(60)", 0.5),
        ("Tan(45)", 1), ("ASin(0.5)", 30), ("ACos(0.5)", 60), ("ATan(1)", 45), ("ATan2(-1,-1)", -135), ("Abs(-3)", 3),
        ("Pow(2,10)", 1024), ("Exp(1)", math.e), ("Round(2.5)", 3), ("Round(-2.345\\Dec:=2)", -2.35), ("Trunc(-2.7)", -2),
        ("Trunc(2.789\\Dec:=1)", 2.7), ("pi", math.pi), ("p.trans.y", 200), ("p.rot.q1", 0.3), ("p.robconf.cf6", 2),
        ("p.extax.eax_a", 5), ("sp.at.trans.z+sp.force", 312), ("Distance([1,2,3],[4,6,3])", 5), ("VectMagn([3,4,0])", 5),
        ("DotProd([1,2,3],[4,5,6])", 32), ("Offs(p,1,0,0).trans.x", 101), ("0x10+0b11", 19), ('StrLen("abc")', 3),
    ],
)  # fmt: skip
def test_numbers_are_single_precision(expression: str, value: float) -> None:
    assert number(expression) == np.float32(value)


def test_orobt_takes_the_displacement_in() -> None:
    into = moved("q0", "PDispSet a; q0:=ORobT(p); PDispOff;")
    np.testing.assert_allclose(matrix(into), A @ matrix(moved("p")), atol=1e-9)
    assert into.robconf == (0, -1, 2, 1)
    assert moved("q0", "PDispSet a; q0:=ORobT(p\\InPDisp); PDispOff;") == moved("p")
    perhaps = events("IF di1=1 PDispSet a; q0:=ORobT(p); PDispOff; MoveL q0,v5,z0,tool0;", DATA)
    assert [event.target for event in perhaps] == [into, moved("p")]
