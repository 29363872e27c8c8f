"""A work object that the bent arm's own torch has taught: what a conversion then does to the weld on the real work."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.runtime.passes import correct_program
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import paths as P
from tests.independent import rapid as R

NAME = "irb4600_60_205"
SPRINGS = A.joint_springs(3.0 * A.TABLE_2)  # a soft arm: some millimetres of sag
TOOL = A.shift(0, 0, 0.35)
TOOL_MASS, TOOL_CENTER = 5.0, np.array([0.0, 0.0, 0.12])
TORCH = R.quaternion_matrix([0.300294, -0.015738, 0.95241, 0.049914])
AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
DATA = """  PERS tooldata tT:=[TRUE,[[0,0,350],[1,0,0,0]],[5,[0,0,120],[1,0,0,0],0,0,0]];
  PERS seamdata sm:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wd:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
"""
PLACES = ([1.15, -0.35, 0.55], [0.95, 0.45, 0.8], [1.35, 0.1, 0.4])


def soft_model() -> Model:
    """The same arm as the package models it."""
    model = default_model(NAME)
    spring = next(e for e in model.effects if e.key == "joint_compliance")
    return model.with_effects(spring.with_vector(3.0 * A.TABLE_2))


def touched(arm: A.Arm, point: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """(3,) where the controller believes the TCP to be while the torch of the bent arm touches a point."""
    command = A.transform(turn, point)
    for _ in range(20):
        flange = command @ np.linalg.inv(TOOL)
        q = I.inverse(arm, flange[None])[0, 0]
        bent = A.equilibrium(arm, q[None], TOOL, A.Load(TOOL_MASS, TOOL_CENTER), SPRINGS).frames.tcp[0]
        command = A.transform(turn, command[:3, 3] + point - bent[:3, 3])
    return command[:3, 3]


def three_points(x1: np.ndarray, x2: np.ndarray, y1: np.ndarray) -> np.ndarray:
    """T (4, 4) of a frame: x from x1 to x2, y towards y1, its origin at x1."""
    x = (x2 - x1) / np.linalg.norm(x2 - x1)
    z = np.cross(x, y1 - x1)
    z /= np.linalg.norm(z)
    return A.transform(np.stack([x, np.cross(z, x), z], axis=1), x1)


def program(arm: A.Arm, T: np.ndarray, points: np.ndarray) -> str:
    """A seam through points (n, 3) [mm] of a work object at T, with moves to it and away from it."""
    turn = R.matrix_quaternion(T[:3, :3].T @ TORCH)

    def target(p: np.ndarray) -> str:
        place = ",".join(f"{v:.3f}" for v in p)
        flange = A.transform(TORCH, T[:3, :3] @ p / 1e3 + T[:3, 3]) @ np.linalg.inv(TOOL)
        conf = I.confdata(arm, I.inverse(arm, flange[None])[:, 0])[0]
        numbers = ",".join(f"{v:.8f}" for v in turn)
        return f"[[{place}],[{numbers}],[{','.join(map(str, conf))}],{AXES}]"

    frame = ",".join(f"{v:.4f}" for v in 1e3 * T[:3, 3])
    quat = ",".join(f"{v:.9f}" for v in R.matrix_quaternion(T[:3, :3]))
    up = np.array([0, 0, 100.0])
    body = [f"MoveJ {target(points[0] + up)},v500,fine,tT\\WObj:=wBracket;"]
    body += [f"ArcLStart {target(points[0])},v100,sm,wd,fine,tT\\WObj:=wBracket;"]
    body += [f"ArcL {target(p)},v100,sm,wd,z1,tT\\WObj:=wBracket;" for p in points[1:-1]]
    body += [f"ArcLEnd {target(points[-1])},v100,sm,wd,fine,tT\\WObj:=wBracket;"]
    body += [f"MoveL {target(points[-1] + up)},v500,fine,tT\\WObj:=wBracket;"]
    steps = "".join(f"    {line}\n" for line in body)
    wobj = f'  PERS wobjdata wBracket:=[FALSE,TRUE,"",[[{frame}],[{quat}]],[[0,0,0],[1,0,0,0]]];\n'
    return f"MODULE M\n{DATA}{wobj}  PROC main()\n{steps}  ENDPROC\nENDMODULE\n"


def weld_error(arm: A.Arm, text: str, T_true: np.ndarray, points: np.ndarray, force: np.ndarray) -> float:
    """Largest distance [mm] of the bent arm's weld from the seam on the true work piece."""
    moves, lost = R.motions(text)
    assert lost == []
    seam = (T_true[:3, :3] @ (points / 1e3).T).T + T_true[:3, 3]
    worst = 0.0
    for leg, move in zip(P.play(arm, moves), moves, strict=True):
        if move.weld:
            assert not leg.problem
            p = P.real(arm, leg.q, move, SPRINGS, force, np.zeros(3))
            worst = max(worst, float(P.polyline_distance(p, seam).max()))
    return 1e3 * worst


def converted(text: str, force: np.ndarray, taught: tuple[str, ...]) -> str:
    options = Options(tolerance_m=1e-5, inertia=False, force=tuple(force), force_on="arc", wobj_taught=taught)  # type: ignore[arg-type]
    done = correct_program(Source("m.mod", text.encode()), soft_model(), options)
    assert done.output is not None, [d.message for d in done.diagnostics]
    return done.output.decode()


@pytest.mark.parametrize("force", [(60.0, -60.0, -60.0)])
@pytest.mark.parametrize("place", PLACES)
def test_a_weld_in_a_taught_work_object_becomes_better(place: list[float], force: tuple[float, ...]) -> None:
    """The frame is found by driving the bent arm to three points of the bracket; the weld is judged on the bracket."""
    arm, push = A.ARMS[NAME](), np.array(force)
    turn = A.rotation(np.array([0.0, 0, 1]), np.array(0.4)) @ A.rotation(np.array([1.0, 0, 0]), np.array(0.1))
    T_true = A.transform(turn, np.array(place))
    corners = np.array([[0, 0, 0], [300, 0, 0], [0, 250, 0]]) / 1e3
    taught = three_points(*(touched(arm, T_true[:3, :3] @ c + T_true[:3, 3], TORCH) for c in corners))
    points = np.array([[20.0, 30, 10], [240, 30, 10], [240, 200, 10], [120, 200, 60]])
    text = program(arm, taught, points)
    as_taught = weld_error(arm, text, T_true, points, push)
    offline = weld_error(arm, converted(text, push, ()), T_true, points, push)
    with_shift = weld_error(arm, converted(text, push, ("wbracket",)), T_true, points, push)
    assert offline > 0.9 and with_shift < 0.15
    assert with_shift <= as_taught
