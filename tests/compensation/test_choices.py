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
from tests.compensation.build import findings
from tests.independent import arm as A
from tests.independent import inverse as I

TURN = Rotation.from_quat([0.300294, -0.015738, 0.95241, 0.049914], scalar_first=True)
PLACE, SECOND = np.array([1350.0, -300, 700]), np.array([1390.0, -360, 710])
UP = np.array([0.0, 0, 30])


def seen_from(degrees: float, place: np.ndarray) -> tuple[str, str]:
    """A work object turned about the vertical, and the target that stands at a place of the base in it, both as text."""
    turned = Rotation.from_euler("z", degrees, degrees=True)
    parts = (
        turned.as_quat(scalar_first=True),
        turned.inv().apply(place - (1000.0, -300, 500)),
        (turned.inv() * TURN).as_quat(scalar_first=True),
    )
    q, at, rot = (",".join(f"{v:.9f}" for v in part) for part in parts)
    return f'[FALSE,TRUE,"",[[1000,-300,500],[{q}]],[[0,0,0],[1,0,0,0]]]', f"[[{at}],[{rot}],[-1,0,-1,0],{AXES}]"


def chosen(degrees: float, choice: str, data: str) -> Conversion:
    """The first part or another one, whose work object is turned, by open data; one statement goes to both."""
    (w1, p1), (w2, p2) = seen_from(0, PLACE), seen_from(degrees, SECOND)
    declared = f"{data}\nPERS wobjdata w1:={w1};\nPERS wobjdata w2:={w2};\nPERS wobjdata wNow:={w1};"
    declared += f"\nPERS robtarget p1:={p1};\nPERS robtarget p2:={p2};\nVAR robtarget pNow;"
    for k in "12":
        choice = choice.replace(f"GO{k}", f"pNow:=p{k};\nwNow:=w{k};")
    conversion = convert(module(declared, f"{choice}\nMoveJ Offs(pNow,0,0,30),v200,fine,tT\\WObj:=wNow;"))
    assert conversion.output is not None
    return conversion


TEST = "TEST nPart\nCASE 1:\nGO1\nCASE 2:\nGO2\nENDTEST"
CHOICES = [
    (TEST, "PERS num nPart:=1;", "`nPart` is 2"),
    ("IF nPart>=2 THEN\nGO2\nELSE\nGO1\nENDIF", "PERS num nPart:=1;", "`nPart` is 2"),
    ("IF bLeft THEN\nGO1\nELSE\nGO2\nENDIF", "PERS bool bLeft:=TRUE;", "`bLeft` is FALSE"),
    ('IF stPart="A" THEN\nGO1\nELSEIF stPart="B" THEN\nGO2\nENDIF', 'PERS string stPart:="A";', '`stPart` is "B"'),
]


def off(goal: np.ndarray, commanded: np.ndarray) -> np.ndarray:
    """The elastic arm's TCP [mm], as seen from a goal in the base, where the program commands another place."""
    tool, load = A.shift(0, 0, 0.35), A.Load(5.0, np.array([0, 0, 0.12]), np.array(FORCE))
    T = A.transform(TURN.as_matrix(), commanded / 1000)
    q = I.solve_target(A.irb4600(), T @ np.linalg.inv(tool), (-1, 0, -1, 0))
    assert q is not None
    tcp = A.equilibrium(A.irb4600(), q[None], tool, load, A.joint_springs(A.TABLE_2)).frames.tcp[0]
    return np.asarray(1000 * tcp[:3, 3] - goal)


@pytest.mark.parametrize(("choice", "data", "where"), CHOICES)
def test_a_correction_that_another_value_makes_worse_is_said(choice: str, data: str, where: str) -> None:
    """The other part's work object is turned by half a turn, and the same offset in its axes goes the wrong way."""
    (finding,) = findings(chosen(180, choice, data), "CMP023")
    needs = np.zeros(3)  # what the first part needs: the correction that is written, in axes of its work object
    for _ in range(4):
        needs = needs - off(PLACE + UP, PLACE + UP + needs)
    goal = SECOND + UP
    without, with_it = (np.linalg.norm(off(goal, goal + by)) for by in (np.zeros(3), needs * (-1, -1, 1)))
    assert where in finding.message
    assert f"leaves {with_it:.2f} mm, and none would leave {without:.2f} mm" in finding.message


@pytest.mark.parametrize(("degrees", "choice"), [(0, TEST), (20, TEST), (180, f"nPart:=1;\n{TEST}")])
def test_a_correction_that_helps_or_data_that_the_program_sets_is_not_said(degrees: float, choice: str) -> None:
    assert findings(chosen(degrees, choice, "PERS num nPart:=1;"), "CMP023") == []


def test_the_values_that_a_program_knows() -> None:
    """Of conditions and indices; a number that is compared by size is a bound, beside which others stand."""
    data = "PERS num n:=1;\nPERS num k:=2;\nPERS bool b:=TRUE;\nPERS num other:=5;\nVAR robtarget p{3};"
    body = "IF n<3 THEN\nb:=b;\nENDIF\nIF k=7 Stop;\nMoveL p{k},v10,fine,tT;\nother:=k;"
    program = read_program([Source("m.mod", module(data, body).encode())])
    known = [(d.name, value) for d, value in known_values(program, {"m..b", "m..other"})]
    assert known == [("n", 2.0), ("n", 3.0), ("n", 4.0), ("k", 7.0), ("k", 1.0), ("k", 2.0), ("k", 3.0)]
