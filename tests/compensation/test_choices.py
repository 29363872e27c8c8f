"""Open data that chooses between known values: a correction that another of them would make worse is said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.compensation.choices import known_values
from postproc.compensation.conversion import Conversion
from postproc.diagnostics import Source
from postproc.rapid.program.program import read_program
from tests.build import AXES, FORCE, convert, module
from tests.independent import arm as A
from tests.independent import inverse as I

TURN = Rotation.from_quat([0.300294, -0.015738, 0.95241, 0.049914], scalar_first=True)
PLACE = np.array([1350.0, -300, 700])
UP = np.array([0.0, 0, 30])
BESIDE = np.array([40.0, -60, 10])  # where the second part stands


def seen_from(degrees: float, place: np.ndarray) -> tuple[str, str]:
    """A work object turned about the vertical, and the target that stands at a place of the base in it, both as text."""
    turned = Rotation.from_euler("z", degrees, degrees=True)
    origin = np.array([1000.0, -300, 500])
    q = turned.as_quat(scalar_first=True)
    wobj = f'[FALSE,TRUE,"",[[1000,-300,500],[{",".join(f"{v:.9f}" for v in q)}]],[[0,0,0],[1,0,0,0]]]'
    at, rot = turned.inv().apply(place - origin), (turned.inv() * TURN).as_quat(scalar_first=True)
    numbers = [",".join(f"{v:.9f}" for v in part) for part in (at, rot)]
    return wobj, f"[[{numbers[0]}],[{numbers[1]}],[-1,0,-1,0],{AXES}]"


def chosen(degrees: float, choice: str, data: str) -> str:
    """The first part or another one, whose work object is turned, by open data; one statement goes to both."""
    (w1, p1), (w2, p2) = seen_from(0, PLACE), seen_from(degrees, PLACE + BESIDE)
    parts = f"{data}\nPERS wobjdata w1:={w1};\nPERS wobjdata w2:={w2};\nPERS wobjdata wNow:={w1};"
    targets = f"PERS robtarget p1:={p1};\nPERS robtarget p2:={p2};\nVAR robtarget pNow;"
    return module(f"{parts}\n{targets}", f"{choice}\nMoveJ Offs(pNow,0,0,30),v200,fine,tT\\WObj:=wNow;")


TEST = "TEST nPart\nCASE 1:\npNow:=p1;\nwNow:=w1;\nCASE 2:\npNow:=p2;\nwNow:=w2;\nENDTEST"
CHOICES = [
    (TEST, "PERS num nPart:=1;", "`nPart` is 2"),
    ("IF nPart>=2 THEN\npNow:=p2;\nwNow:=w2;\nELSE\npNow:=p1;\nwNow:=w1;\nENDIF", "PERS num nPart:=1;", "`nPart` is 2"),
    (
        "IF bLeft THEN\npNow:=p1;\nwNow:=w1;\nELSE\npNow:=p2;\nwNow:=w2;\nENDIF",
        "PERS bool bLeft:=TRUE;",
        "`bLeft` is FALSE",
    ),
    (
        'IF stPart="A" THEN\npNow:=p1;\nwNow:=w1;\nELSEIF stPart="B" THEN\npNow:=p2;\nwNow:=w2;\nENDIF',
        'PERS string stPart:="A";',
        '`stPart` is "B"',
    ),
]


def said(found: Conversion) -> list[str]:
    assert found.output is not None, [d.message for d in found.diagnostics]
    return [d.message for d in found.diagnostics if d.code == "CMP023"]


def real(goal: np.ndarray, commanded: np.ndarray) -> float:
    """Distance [mm] of the elastic arm's TCP from a place in the base where the program commands another one."""
    arm, tool = A.irb4600(), A.shift(0, 0, 0.35)
    T = A.transform(TURN.as_matrix(), commanded / 1000)
    q = I.solve_target(arm, T @ np.linalg.inv(tool), (-1, 0, -1, 0))
    assert q is not None
    load = A.Load(5.0, np.array([0, 0, 0.12]), np.array(FORCE))
    tcp = A.equilibrium(arm, q[None], tool, load, A.joint_springs(A.TABLE_2)).frames.tcp[0]
    return float(np.linalg.norm(1000 * tcp[:3, 3] - goal))


@pytest.mark.parametrize(("choice", "data", "where"), CHOICES)
def test_a_correction_that_another_value_makes_worse_is_said(choice: str, data: str, where: str) -> None:
    """The other part's work object is turned by half a turn, and the same offset in its axes goes the wrong way."""
    found = convert(chosen(180, choice, data))
    messages = said(found)
    assert len(messages) == 1 and where in messages[0]
    goal, first = PLACE + BESIDE + UP, PLACE + UP
    # What the first part needs, by an arm of our own: the correction that is written, in axes of its work object.
    needs = np.zeros(3)
    for _ in range(4):
        needs = needs - _off(first, first + needs)
    there = needs * np.array([-1, -1, 1])
    without, with_ = real(goal, goal), real(goal, goal + there)
    assert f"leaves {with_:.2f} mm, and none would leave {without:.2f} mm" in messages[0]


def _off(goal: np.ndarray, commanded: np.ndarray) -> np.ndarray:
    arm, tool = A.irb4600(), A.shift(0, 0, 0.35)
    q = I.solve_target(arm, A.transform(TURN.as_matrix(), commanded / 1000) @ np.linalg.inv(tool), (-1, 0, -1, 0))
    assert q is not None
    load = A.Load(5.0, np.array([0, 0, 0.12]), np.array(FORCE))
    return np.asarray(
        1000 * A.equilibrium(arm, q[None], tool, load, A.joint_springs(A.TABLE_2)).frames.tcp[0, :3, 3] - goal
    )


@pytest.mark.parametrize("degrees", [0, 20])
def test_a_correction_that_helps_the_other_value_too_is_not_said(degrees: float) -> None:
    assert said(convert(chosen(degrees, TEST, "PERS num nPart:=1;"))) == []


def test_data_that_the_program_sets_is_followed_as_it_is_set() -> None:
    text = chosen(180, f"nPart:=1;\n{TEST}", "PERS num nPart:=1;")
    assert said(convert(text)) == []


def test_the_values_that_a_program_knows() -> None:
    """Of conditions and indices; a number that is compared by size is a bound, beside which others stand."""
    data = "PERS num n:=1;\nPERS num k:=2;\nPERS bool b:=TRUE;\nPERS num other:=5;\nVAR robtarget p{3};"
    body = "IF n<3 THEN\nb:=b;\nENDIF\nIF k=7 Stop;\nMoveL p{k},v10,fine,tT;\nother:=k;"
    program = read_program([Source("m.mod", module(data, body).encode())])
    found = [(d.name, value) for d, value in known_values(program, {"m..b", "m..other"})]
    assert found == [("n", 2.0), ("n", 3.0), ("n", 4.0), ("k", 7.0), ("k", 1.0), ("k", 2.0), ("k", 3.0)]
