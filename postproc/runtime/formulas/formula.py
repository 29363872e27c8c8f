"""The correction of one target as a formula: where the bodies are, what they carry, how far the arm gives way.

The joint angles theta of a target are those at which the real joints have to stand, but for what the bodies give way.
There the loads are the real ones, so that nothing is iterated: displacements xi and torques tau at theta, the target
moved back by what xi displaces, and the command q = theta - dq(tau, q). What is left out is of second order, 1e-3 of
the correction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.model.arm import Model
from postproc.runtime.formulas.curves import Curve
from postproc.runtime.formulas.laws import BODIES, JOINTS, TOOL, Laws
from postproc.runtime.formulas.tape import Number, Scalar, along, cosine, given, scalar, sine, total

DEGREE = np.pi / 180.0
MM = 1e-3
Vector = Sequence[Number]
Matrix = Sequence[Vector]

ANGLES = tuple(f"j.robax.rax_{k}" for k in range(1, 7))
COMMANDED = tuple(f"k.robax.rax_{k}" for k in range(1, 7))
LOAD = ("lm", "lx", "ly", "lz")
"""Mass [kg] and first moment [kg m] of tool and payload in tool0."""
FORCE = ("fx", "fy", "fz", "mx", "my", "mz")
"""Force [N] and moment [N m] of the process on the TCP, base axes."""
FRAME = tuple(f"t.tframe.{part}" for part in ("trans.x", "trans.y", "trans.z", "rot.q1", "rot.q2", "rot.q3", "rot.q4"))


@dataclass(frozen=True)
class Tables:
    """The functions of one number as tables; of angles and torques in degrees and N m.

    Args:
        of_angle, of_torque: [deg] on joints, [m] or [rad] elsewhere; torque [N m]: as in `Laws`.
    """

    of_angle: Mapping[tuple[int, int], Curve]
    of_torque: Mapping[tuple[int, int], Curve]
    torque: Mapping[tuple[int, int], Curve]

    @property
    def every(self) -> list[Curve]:
        return [*self.of_angle.values(), *self.of_torque.values(), *self.torque.values()]


@dataclass(frozen=True)
class Formula:
    """What the module works out.

    Args:
        moved: displacement of the TCP in its own axes [mm, mm, mm, deg, deg, deg], by bodies and tool; None for none.
        joints: (6,) [deg] how far the joints give way, but for functions of the command; straight: product of the
            directions of axes 4 and 6, one where the wrist is straight.
        commanded: (6,) [deg] functions of the commanded angles, None for none.
    """

    joints: tuple[Scalar, ...]
    straight: Scalar
    moved: tuple[Scalar, ...] | None
    commanded: tuple[Scalar, ...] | None


@dataclass(frozen=True)
class _Arm:
    """Bodies of the arm at theta: rotation (3, 3) and origin (3,) of each, in base axes [m]."""

    R: list[Matrix]
    origin: list[Vector]
    tip: list[Vector]
    axis: list[Vector]


def formula(model: Model, laws: Laws, tables: Tables, rest: Sequence[Scalar] = (), force: bool = True) -> Formula:
    """The correction of a target of a model.

    Args:
        rest: (6,) displacement at the flange [m, rad] in its axes, as formulas of the joint angles `ANGLES` [deg].
        force: whether a process force may act.
    """
    arm = _arm(model)
    flange = _times(arm.R[6], model.robot.link[6][:3, :3].tolist())
    straight = _dot(arm.axis[3], arm.axis[5])
    tcp = _plus(arm.tip[6], _rotate(flange, [given(name) * MM for name in FRAME[:3]]))
    wrenches = _wrenches(model, laws, arm, flange, tcp if force else None)
    tau = [_joint_load(arm, wrenches, j) for j in range(6)]
    for (k, j), curve in tables.torque.items():
        tau[k] = tau[k] + along(curve, given(ANGLES[j]))
    place = [scalar(value) for value in laws.constant]
    used = np.abs(laws.by_load) > 0.0
    body = {b: _body_load(arm, wrenches, b) for b in range(7) if used[:, 6 + 6 * b : 12 + 6 * b].any()}
    loads = {**dict(enumerate(tau)), **{6 + 6 * b + i: body[b][i] for b in body for i in range(6)}}
    for p, load in np.argwhere(used):
        place[p] = place[p] + loads[int(load)] * float(laws.by_load[p, load])
    for (p, j), curve in tables.of_torque.items():
        place[p] = place[p] + along(curve, tau[j]) * (DEGREE if p < 6 else 1.0)
    for (p, j), curve in tables.of_angle.items():
        if p >= 6:
            place[p] = place[p] + along(curve, given(ANGLES[j]))
    for i, part in enumerate(rest):
        place[42 + i] = place[42 + i] + part
    commanded = _commanded(tables)
    moved = _moved(arm, flange, tcp, place)
    return Formula(tuple(x * (1.0 / DEGREE) for x in place[JOINTS]), straight, moved, commanded)


def _commanded(tables: Tables) -> tuple[Scalar, ...] | None:
    """Displacements of joints that follow the commanded angles [deg]."""
    joints = [scalar(0.0)] * 6
    for (p, j), curve in tables.of_angle.items():
        if p < 6:
            joints[p] = joints[p] + along(curve, given(COMMANDED[j]))
    return tuple(joints) if any(not x.constant for x in joints) else None


def _arm(model: Model) -> _Arm:
    """Where the bodies are at the joint angles `ANGLES`."""
    robot = model.robot
    R: list[Matrix] = [np.eye(3).tolist()]
    origin: list[Vector] = [[0.0, 0.0, 0.0]]
    tip: list[Vector] = []
    axis: list[Vector] = []
    for b in range(7):
        tip.append(_plus(origin[b], _rotate(R[b], robot.link[b][:3, 3].tolist())))
        if b < 6:
            turned = _times(R[b], robot.link[b][:3, :3].tolist())
            axis.append(_rotate(turned, robot.axis[b].tolist()))
            angle = given(ANGLES[b])
            R.append(_times(turned, _turn(robot.axis[b], sine(angle), cosine(angle))))
            origin.append(tip[b])
    return _Arm(R, origin, tip, axis)


def _turn(axis: Array, s: Scalar, c: Scalar) -> Matrix:
    """Rotation about an axis, I + s K + (1 - c) K^2 (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    still, bent = np.eye(3) + K @ K, K @ K
    return [[s * K[i, j] - c * bent[i, j] + still[i, j] for j in range(3)] for i in range(3)]


@dataclass(frozen=True)
class _Wrenches:
    """Force on bodies 0 to 6 and on the flange (7), and its moment about the base origin, summed from the outside."""

    force: list[Vector]
    moment: list[Vector]


def _wrenches(model: Model, laws: Laws, arm: _Arm, flange: Matrix, tcp: Vector | None) -> _Wrenches:
    """Weights of links, of what effects add, of tool and payload; and the process force, where a TCP is given."""
    robot, g = model.robot, [float(x) for x in model.gravity]
    mass, first = scalar(0.0), [scalar(0.0)] * 3
    force: list[Vector] = [[0.0] * 3] * 8
    moment: list[Vector] = [[0.0] * 3] * 8
    push, turn = ([given(name) if tcp else scalar(0.0) for name in part] for part in (FORCE[:3], FORCE[3:]))
    turn = _plus(turn, _cross(tcp or [0.0] * 3, push))
    for b in range(7, 0, -1):
        if b == 7:
            m: Number = given(LOAD[0])
            own = _rotate(flange, [given(name) for name in LOAD[1:]])
            about = arm.tip[6]
        else:
            m = float(robot.mass[b] + laws.mass[b])
            own = _rotate(arm.R[b], (robot.mass[b] * robot.center[b] + laws.first_moment[b]).tolist())
            about = arm.origin[b]
        first = _plus(first, _plus(own, [m * x for x in map(scalar, about)]))
        mass = mass + m
        force[b], moment[b] = _plus([mass * x for x in g], push), _plus(_cross(first, g), turn)
    return _Wrenches(force, moment)


def _joint_load(arm: _Arm, wrenches: _Wrenches, joint: int) -> Scalar:
    """Torque about a joint (from 0) of all forces beyond it [N m]."""
    force, moment = wrenches.force[joint + 1], wrenches.moment[joint + 1]
    return _dot(arm.axis[joint], _plus(moment, _negative(_cross(arm.origin[joint + 1], force))))


def _body_load(arm: _Arm, wrenches: _Wrenches, body: int) -> Vector:
    """Force [N] and moment [N m] of all that is beyond the far end of a body, at that end, in its axes."""
    force, moment = wrenches.force[body + 1], wrenches.moment[body + 1]
    about = _plus(moment, _negative(_cross(arm.tip[body], force)))
    back = [list(row) for row in zip(*arm.R[body], strict=True)]
    return [*_rotate(back, force), *_rotate(back, about)]


def _moved(arm: _Arm, flange: Matrix, tcp: Vector, place: Sequence[Scalar]) -> tuple[Scalar, ...] | None:
    """Displacement of the TCP by bodies and tool, in tool axes [mm, deg]; None where nothing but joints moves."""
    if all(x.constant and x.value == 0.0 for x in [*place[BODIES], *place[TOOL]]):
        return None
    slid, turned = [scalar(0.0)] * 3, [scalar(0.0)] * 3
    for b in range(7):
        xi = place[6 + 6 * b : 12 + 6 * b]
        turn = _rotate(arm.R[b], xi[3:])
        arm_of = _plus(tcp, _negative(arm.tip[b]))
        slid = _plus(slid, _plus(_rotate(arm.R[b], xi[:3]), _cross(turn, arm_of)))
        turned = _plus(turned, turn)
    tool = _times(flange, _tool_axes())
    back = [list(row) for row in zip(*tool, strict=True)]
    slid, turned = _plus(_rotate(back, slid), place[48:51]), _plus(_rotate(back, turned), place[51:54])
    return (*(x * (1.0 / MM) for x in slid), *(x * (1.0 / DEGREE) for x in turned))


def _tool_axes() -> Matrix:
    """Rotation of the tool frame, of its unit quaternion."""
    w, x, y, z = (given(name) for name in FRAME[3:])
    one = scalar(1.0)
    return [
        [one - (y * y + z * z) * 2.0, (x * y - w * z) * 2.0, (x * z + w * y) * 2.0],
        [(x * y + w * z) * 2.0, one - (x * x + z * z) * 2.0, (y * z - w * x) * 2.0],
        [(x * z - w * y) * 2.0, (y * z + w * x) * 2.0, one - (x * x + y * y) * 2.0],
    ]


def _dot(a: Vector, b: Vector) -> Scalar:
    return total(scalar(x) * y for x, y in zip(a, b, strict=True))


def _rotate(R: Matrix, v: Vector) -> list[Scalar]:
    return [_dot(row, v) for row in R]


def _times(A: Matrix, B: Matrix) -> Matrix:
    columns = list(zip(*B, strict=True))
    return [[_dot(row, column) for column in columns] for row in A]


def _plus(a: Vector, b: Vector) -> list[Scalar]:
    return [scalar(x) + y for x, y in zip(a, b, strict=True)]


def _negative(a: Vector) -> list[Scalar]:
    return [-scalar(x) for x in a]


def _cross(a: Vector, b: Vector) -> list[Scalar]:
    x, y, z = map(scalar, a)
    u, v, w = map(scalar, b)
    return [y * w - z * v, z * u - x * w, x * v - y * u]
