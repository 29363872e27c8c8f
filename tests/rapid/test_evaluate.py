"""Functions and operators of RAPID against scipy rotations and plain numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from postproc.rapid.data.records import RobTarget
from tests.rapid.build import UNUSED, events

P1 = "[[100,200,300],[0.3,-0.5,0.7,0.4],[0,-1,2,1],[5,9E9,9E9,9E9,9E9,9E9]]"
Q1 = Rotation.from_quat([-0.5, 0.7, 0.4, 0.3])
DATA = f"CONST robtarget p:={P1};CONST robtarget q:=[[-50,80,20],[0.1,0.2,0.3,0.9],[0,0,0,0],{UNUSED}];"
DATA += "CONST pose a:=[[10,20,30],[0.3,-0.5,0.7,0.4]];CONST pose b:=[[-5,7,9],[0.1,0.2,0.3,0.9]];"
DATA += "RECORD spot robtarget at; num force; ENDRECORD CONST spot sp:=[" + P1 + ",12];ALIAS num length;"
A, B = np.eye(4), np.eye(4)
A[:3, :3], A[:3, 3] = Q1.as_matrix(), (10, 20, 30)
B[:3, :3], B[:3, 3] = Rotation.from_quat([0.2, 0.3, 0.9, 0.1]).as_matrix(), (-5, 7, 9)


def moved(expression: str, data: str = DATA) -> RobTarget:
    event = events(f"MoveL {expression},v5,z0,tool0;", data)[0]
    assert isinstance(event.target, RobTarget), event.reason
    return event.target


def number(expression: str, data: str = DATA) -> float:
    """Value of an expression, read off the x coordinate of a target."""
    return moved(f"[[{expression},0,0],[1,0,0,0],[0,0,0,0],{UNUSED}]", data).trans[0]


def matrix(target: RobTarget) -> np.ndarray:
    w, x, y, z = target.rot
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = Rotation.from_quat([x, y, z, w]).as_matrix(), target.trans
    return result


def posed(pose: str) -> np.ndarray:
    """Value of a pose expression."""
    data = DATA + f"CONST pose r:={pose};"
    return matrix(moved(f"[r.trans,r.rot,[0,0,0,0],{UNUSED}]", data))


def test_offs_moves_in_the_object_frame() -> None:
    found = moved("Offs(p,1,-2,3.5)")
    assert found.trans == (101, 198, 303.5)
    assert found.robconf == (0, -1, 2, 1)
    assert found.extax[0] == 5
    np.testing.assert_allclose(matrix(found)[:3, :3], Q1.as_matrix(), atol=1e-12)


@given(*[st.floats(-180, 180).map(lambda x: round(x, 3)) for _ in range(3)])
def test_reltool_moves_and_turns_in_the_tool_frame(rx: float, ry: float, rz: float) -> None:
    found = moved(f"RelTool(p,1,-2,3.5\\Rx:={rx}\\Ry:={ry}\\Rz:={rz})")
    step = np.eye(4)
    step[:3, :3], step[:3, 3] = Rotation.from_euler("XYZ", [rx, ry, rz], degrees=True).as_matrix(), (1, -2, 3.5)
    start = np.eye(4)
    start[:3, :3], start[:3, 3] = Q1.as_matrix(), (100, 200, 300)
    np.testing.assert_allclose(matrix(found), start @ step, atol=1e-9)


def test_nested_functions() -> None:
    found = moved("Offs(RelTool(p,0,0,-100),0,0,50)")
    np.testing.assert_allclose(found.trans, np.array([100, 200, 350]) - 100 * Q1.as_matrix()[:, 2], atol=1e-9)


def test_pose_algebra() -> None:
    np.testing.assert_allclose(posed("PoseMult(a,b)"), A @ B, atol=1e-9)
    np.testing.assert_allclose(posed("PoseInv(a)"), np.linalg.inv(A), atol=1e-9)
    np.testing.assert_allclose(posed("PoseMult(PoseInv(b),PoseMult(b,a))"), A, atol=1e-9)
    vector = moved(f"[PoseVect(a,[1,2,3]),[1,0,0,0],[0,0,0,0],{UNUSED}]").trans
    np.testing.assert_allclose(vector, (A @ [1, 2, 3, 1])[:3], atol=1e-9)


@pytest.mark.parametrize("origin", [1, 2, 3])
def test_frame_through_three_points(origin: int) -> None:
    p1, p2, p3 = np.array([10.0, 5, 2]), np.array([60.0, 25, -8]), np.array([20.0, 80, 33])
    names = [f"[[{','.join(map(str, p))}],[1,0,0,0],[0,0,0,0],{UNUSED}]" for p in (p1, p2, p3)]
    found = posed(f"DefFrame({','.join(names)}\\Origin:={origin})")
    x = (p2 - p1) / np.linalg.norm(p2 - p1)
    z = np.cross(x, p3 - p1)
    z /= np.linalg.norm(z)
    start = {1: p1, 2: p2, 3: p1 + x * (x @ (p3 - p1))}[origin]
    np.testing.assert_allclose(found[:3, :3], np.column_stack([x, np.cross(z, x), z]), atol=1e-9)
    np.testing.assert_allclose(found[:3, 3], start, atol=1e-9)


def test_displacement_through_six_points() -> None:
    old = np.array([[0.0, 0, 0], [100, 0, 0], [0, 50, 10]])
    new = (A[:3, :3] @ old.T).T + A[:3, 3]
    names = [f"[[{x},{y},{z}],[1,0,0,0],[0,0,0,0],{UNUSED}]" for x, y, z in np.vstack([old, new])]
    np.testing.assert_allclose(posed(f"DefDFrame({','.join(names)})"), A, atol=1e-6)


@given(*[st.floats(-179, 179).map(lambda x: round(x, 3)) for _ in range(3)])
def test_orient_and_euler_angles(z: float, y: float, x: float) -> None:
    rot = f"OrientZYX({z},{y / 2.01},{x})"
    found = moved(f"[[0,0,0],{rot},[0,0,0,0],{UNUSED}]")
    expected = Rotation.from_euler("ZYX", [z, y / 2.01, x], degrees=True).as_matrix()
    np.testing.assert_allclose(matrix(found)[:3, :3], expected, atol=1e-9)
    assert number(f"EulerZYX(\\Z,{rot})") == pytest.approx(z, abs=1e-5)
    assert number(f"EulerZYX(\\Y,{rot})") == pytest.approx(y / 2.01, abs=1e-5)
    assert number(f"EulerZYX(\\X,{rot})") == pytest.approx(x, abs=1e-5)


@pytest.mark.parametrize("y", [90, -90])
def test_euler_angles_at_the_singularity(y: float) -> None:
    rot = f"OrientZYX(30,{y},20)"
    again = moved(
        f"[[0,0,0],OrientZYX(EulerZYX(\\Z,{rot}),EulerZYX(\\Y,{rot}),EulerZYX(\\X,{rot})),[0,0,0,0],{UNUSED}]"
    )
    expected = Rotation.from_euler("ZYX", [30, y, 20], degrees=True).as_matrix()
    np.testing.assert_allclose(matrix(again)[:3, :3], expected, atol=1e-6)


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
def test_numbers(expression: str, value: float) -> None:
    """As the controller holds them: ``num`` is single precision."""
    assert number(expression) == np.float32(value)


def test_vectors() -> None:
    found = moved(f"[[1,2,3]+[1,1,1]*2-p.trans*0.5,[1,0,0,0],[0,0,0,0],{UNUSED}]").trans
    assert found == (1 + 2 - 50, 2 + 2 - 100, 3 + 2 - 150)
    cross = moved(f"[[1,2,3]*[4,5,6],[1,0,0,0],[0,0,0,0],{UNUSED}]").trans
    np.testing.assert_allclose(cross, np.cross([1, 2, 3], [4, 5, 6]))
    turned = moved(f"[[0,0,0],p.rot*q.rot,[0,0,0,0],{UNUSED}]")
    np.testing.assert_allclose(matrix(turned)[:3, :3], A[:3, :3] @ B[:3, :3], atol=1e-9)


@pytest.mark.parametrize(
    ("condition", "value"),
    [("1=1 AND 2>3", False), ("1<>1 OR 2<=2", True), ("NOT 1=2", True), ("TRUE XOR TRUE", False), ('"a"="A"', False),
     ("NOT (1>=1 AND FALSE)", True), ("unknown=1 OR TRUE", True), ("TRUE OR unknown=1", True),
     ("unknown=1 AND FALSE", False)],
)  # fmt: skip
def test_conditions(condition: str, value: bool) -> None:
    found = events(f"IF {condition} THEN MoveL p,v5,z0,tool0; ELSE MoveL p,v10,z0,tool0; ENDIF", DATA)
    assert [e.speed.v_tcp for e in found if not e.conditional] == [5 if value else 10]


def test_orobt_takes_the_displacement_in() -> None:
    found = events("PDispSet a; q0:=ORobT(p); PDispOff; MoveL q0,v5,z0,tool0;", DATA + "VAR robtarget q0;")[0]
    assert isinstance(found.target, RobTarget)
    np.testing.assert_allclose(matrix(found.target), A @ matrix(moved("p")), atol=1e-9)
    assert (found.target.robconf, found.displacement.trans) == ((0, -1, 2, 1), (0, 0, 0))
    kept = events("PDispSet a; q0:=ORobT(p\\InPDisp); PDispOff; MoveL q0,v5,z0,tool0;", DATA + "VAR robtarget q0;")[0]
    assert kept.target == moved("p")
    choice = "IF di1=1 PDispSet a; q0:=ORobT(p); PDispOff; MoveL q0,v5,z0,tool0;"
    assert [e.target for e in events(choice, DATA + "VAR robtarget q0;")] == [found.target, moved("p")]
    unknown = events(choice.replace("PDispSet a", "PDispOn p,tool0"), DATA + "VAR robtarget q0;")[0]
    assert unknown.reason == "what PDispSet or PDispOn sets depends on a condition that is not known"


@pytest.mark.parametrize(
    ("target", "reason"),
    [
        ("CRobT()", "`CRobT` is known only at run time"),
        ("CRobT(\\Tool:=tool0)", "`CRobT` is known only at run time"),
        (
            "CalcRobT([[0,0,0,0,0,0],[0,0,0,0,0,0]],tool0)",
            "`CalcRobT` is worked out by the controller; here only for an arm that is known, a tool that it holds and work"
            " beside it",
        ),
        ("MyVision(p)", "`MyVision` is a function this version does not know"),
        ("Offs(p,1,0)", "`offs` has no value for these arguments"),
        ("Offs(p,StrLen(NumToStr(1000,0\\Exp)),0,0)", "`numtostr` has no value for these arguments"),
        ("Offs(nowhere,1,0,0)", "`nowhere` is not declared in these files"),
        (f"[[Sqrt(-1),0,0],[1,0,0,0],[0,0,0,0],{UNUSED}]", "`sqrt` has no value for these arguments"),
        (f"[[1/0,0,0],[1,0,0,0],[0,0,0,0],{UNUSED}]", "`/` has no value for these operands"),
        (f"[[1,0],[1,0,0,0],[0,0,0,0],{UNUSED}]", "3 numbers are expected in the data"),
        (f"[[1E999,0,0],[1,0,0,0],[0,0,0,0],{UNUSED}]", "a number in the data is too large"),
        ("a", "the value is not a robtarget"),
        ("p.nonsense", "`.nonsense` is not a known component"),
        ("circle1", "the value of `circle2` depends on itself"),
        ("-w.ufmec", "`-` needs a number"),
        ("row{1E400}", "an array index is not a whole number"),
        ("row{1.5}", "an array index is not a whole number"),
        ("-w", "the types of the expression do not fit each other"),
        ("p +", "the target cannot be read: an expression is missing"),
    ],
)
def test_what_is_not_known_has_a_reason(target: str, reason: str) -> None:
    data = DATA + "CONST robtarget circle1:=circle2;CONST robtarget row{1}:=[p];"
    data += (
        'CONST wobjdata w:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];CONST robtarget circle2:=circle1;'
    )
    event = events(f"MoveL {target},v5,z0,tool0;", data)[0]
    assert event.target is None
    assert event.reason in (reason, reason.replace("circle2", "circle1"))
