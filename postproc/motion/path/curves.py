r"""The curve of every move: a function of the fraction u in [0, 1], for any number of (move, u) pairs at once.

On lines and arcs under ``SingArea\Wrist`` axes 4 to 6 go evenly from start to goal while the TCP keeps its curve.

    q_4..6(u) = start + u change + u (1 - u) bend,    p_flange(q_1..6) = p_curve(u)

The bend is zero on a line; on an arc it lets the wrist pass the circle point in the orientation programmed there. What
the tool's orientation is between the targets follows. ABB's manuals say so of every line and arc, near a singular wrist
or not: the wrist axes are interpolated axis by axis, with the TCP on its line or circle (RAPID Overview,
Interpolation with ``SingArea\Wrist``; Technical reference manual RAPID, ``SingArea``). How evenly the wrist goes on an
arc is not published; a parabola is assumed. ``SingArea\LockAxis4`` is read alike: axis 4, at 0 or 180 degrees at both
ends, stays there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, constant
from postproc.motion.mounts import Mounts
from postproc.motion.values import Flags, Index, Move, WorkFrame, frames_at, goal_axes, mounts_of
from postproc.robot.arm import Robot
from postproc.robot.closed_form import inverse
from postproc.robot.kinematics import forward, jacobian

LARGEST_ARC = np.radians(240.0)  # MoveC's own limit
SHORTEST_ARC = 1e-4  # start-goal and start-circle-point distance [m] below which MoveC refuses
SMALLEST_ARC_ANGLE = np.radians(1.0)  # between circle point and goal, seen from the start
_STEPS, _LARGEST_STEP, _REACHED = 20, 0.5, 1e-10  # Newton steps, largest one [rad], distance left [m]
_JOINT_CHORDS = 8  # chords that measure the TCP length of a joint move


@dataclass(frozen=True, slots=True)
class Curves:
    """Curves of m moves; row i leads from the goal of move i - 1 to the goal of move i.

    Args:
        joint: (m,) straight in joint space; arc: (m,) circular; fault: (m,) index into ``ARC_FAULTS`` of why an arc
            cannot be run, 0 for none.
        start: (m, 3) position [m], R_start: (m, 3, 3); chord: (m, 3) goal - start [m].
        turn: (m, 3) rotation vector from start to goal in the start's axes [rad]; for arcs relative to the path.
        center, radial, tangent: (m, 3), angle: (m,) [rad] of arcs: p = center + cos(u angle) radial + sin(u angle)
            tangent.
        wrist: (m,) lines and arcs on which axes 4 to 6 are interpolated as joints (``SingArea``).
        q_start, q_change: (m, 6) [rad]; q_bend: (m, 6) coefficient of u (1 - u) for wrists on arcs.
        mounts: of each move, at its goal; the curve is laid in the work frame.
        length: (m,) TCP path length [m]; zero for the first move of a chain.
        axes_start, axes_change: (m, 6) of the external axes, which are linear in u [m], [rad].
        frames: in which work or tools stand, in the order of the numbers in ``mounts``.
    """

    joint: Flags
    arc: Flags
    fault: Index
    start: Array
    R_start: Array
    chord: Array
    turn: Array
    center: Array
    radial: Array
    tangent: Array
    angle: Array
    wrist: Flags
    q_start: Array
    q_change: Array
    q_bend: Array
    mounts: Mounts
    length: Array
    axes_start: Array
    axes_change: Array
    frames: tuple[WorkFrame | None, ...]

    def axes_at(self, move: Index, u: Array) -> Array:
        """(n, 6) external axes [m], [rad] at fractions ``u`` (n,) of the moves of index ``move`` (n,)."""
        if np.isnan(self.axes_start).all():
            return np.broadcast_to(np.nan, (len(u), 6))
        return self.axes_start[move] + self.axes_change[move] * u[:, None]

    def mounts_at(self, move: Index, axes: Array) -> Mounts:
        """The mounts of moves, with their frames where these stand at other positions of the external axes.

        Args:
            move: (n,) indices of moves.
            axes: (n, 6) positions of the external axes [m], [rad].
        """
        mounts = self.mounts[move]
        if mounts.frame is None:
            return mounts
        return replace(mounts, T_base_frame=frames_at(self.frames, mounts.frame, axes))


ARC_FAULTS = (
    "",
    "start and end point are closer than 0.1 mm",
    "start and circle point are closer than 0.1 mm",
    "start, circle point and end point lie on a line",
    "the arc is longer than 240 degrees",
)


def build_curves(robot: Robot, moves: tuple[Move, ...]) -> Curves:
    """The curve of every move, a line, arc or joint motion from the goal of the move before it to its own goal.

    The first move of a chain has no curve, but its goal alone.
    """
    m = len(moves)
    q = np.array([move.q for move in moves])
    mounts = mounts_of(moves)
    first = np.array([move.starts_chain for move in moves])
    joint = np.array([move.kind in ("joint", "absjoint") for move in moves])
    arc = np.array([move.kind == "arc" for move in moves]) & ~first
    before = np.maximum(np.arange(m) - 1, 0)
    before[first] = np.flatnonzero(first)
    T_flange = forward(robot, q)
    T_end = mounts.work(T_flange)
    for i, move in enumerate(moves):
        if move.T_work_tcp is not None:
            T_end[i] = move.T_work_tcp
    # The start as this move's own tool sees it: the tool, or the work, may have changed since the move before.
    axes = goal_axes(moves)
    axes_start = np.where(np.isnan(axes[before]), axes, axes[before])
    T_start = mounts_of(moves, axes_start).work(T_flange[before])
    same_tool = mounts.same(mounts[before])
    T_start[same_tool] = T_end[before][same_tool]

    chord = T_end[:, :3, 3] - T_start[:, :3, 3]
    R_start = T_start[:, :3, :3]
    turn = Rotation.from_matrix(R_start.transpose(0, 2, 1) @ T_end[:, :3, :3]).as_rotvec()
    wrist = np.array([bool(move.event.options.get("wrist_in_joints")) for move in moves]) & ~joint & ~first
    q_bend = np.zeros((m, 6)) if wrist.any() else np.broadcast_to(0.0, (m, 6))
    rows = np.flatnonzero(arc)
    center, radial, tangent = np.zeros((3, m, 3)) if len(rows) else np.broadcast_to(0.0, (3, m, 3))
    angle, fault = np.zeros(m), np.zeros(m, dtype=int)
    if len(rows):
        T_via = np.array([moves[i].T_work_via for i in rows])
        circle = circle_through(T_start[rows, :3, 3], T_via[:, :3, 3], T_end[rows, :3, 3])
        center[rows], radial[rows], tangent[rows], angle[rows], fraction, fault[rows] = circle
        axis = axes_of(radial[rows], tangent[rows])
        R_via = _carried_back(axis, angle[rows] * fraction, T_via[:, :3, :3])
        R_end = _carried_back(axis, angle[rows], T_end[rows, :3, :3])
        relative = Rotation.from_matrix(R_start[rows].transpose(0, 2, 1) @ R_end).as_rotvec()
        turn[rows] = _turn_past(relative, R_start[rows], R_via, fraction)
        bent = np.flatnonzero(wrist[rows] & (fault[rows] == 0))
        for i, T, share in zip(rows[bent], mounts[rows[bent]].flange(T_via[bent]), fraction[bent], strict=True):
            q_bend[i] = wrist_bend(robot, T, (q[before[i]], q[i]), share)
    length = np.where(arc & (fault == 0), np.linalg.norm(radial, axis=1) * angle, np.linalg.norm(chord, axis=1))
    arc &= fault == 0
    curves = Curves(
        joint, arc, fault, T_start[:, :3, 3], R_start, chord, turn, center, radial, tangent, angle,
        wrist, q[before], q - q[before], q_bend, mounts, length,
        constant(axes_start), constant(np.nan_to_num(axes - axes_start)),
        tuple(dict.fromkeys([move.frame for move in moves])),
    )  # fmt: skip
    rows = np.flatnonzero(joint & ~first)
    if len(rows):
        u = np.linspace(0.0, 1.0, _JOINT_CHORDS + 1)
        p = pose_at(robot, curves, np.repeat(rows, len(u)), np.tile(u, len(rows)))[:, :3, 3].reshape(len(rows), -1, 3)
        length[rows] = np.linalg.norm(np.diff(p, axis=1), axis=2).sum(axis=1)
    return curves


def circle_through(start: Array, via: Array, end: Array) -> tuple[Array, Array, Array, Array, Array, Index]:
    """Circles from start over via to end, (k, 3) each [m].

    Returns:
        center, radial, tangent (k, 3) [m], with points center + cos(phi) radial + sin(phi) tangent; angle (k,) [rad]
        that phi has at end; fraction (k,) of it at via; fault (k,), index into ``ARC_FAULTS`` (0: none).
    """
    to_via, to_end = via - start, end - start
    normal = np.cross(to_via, to_end)
    size = np.sum(normal * normal, axis=1)
    safe = np.where(size > 0, size, 1.0)[:, None]
    lift = np.cross(normal, to_via) * np.sum(to_end**2, axis=1)[:, None]
    lift += np.cross(to_end, normal) * np.sum(to_via**2, axis=1)[:, None]
    center = start + lift / (2 * safe)
    radial = start - center
    tangent = np.cross(normal / np.sqrt(safe), radial)

    def seen(p: Array) -> Array:
        """Angle (k,) [rad] in [0, 2 pi) of points (k, 3) on the circles, from the start in the direction of travel."""
        d = p - center
        return np.arctan2(np.sum(d * tangent, axis=1), np.sum(d * radial, axis=1)) % (2 * np.pi)

    angle, at_via = seen(end), seen(via)
    d_via, d_end = np.linalg.norm(to_via, axis=1), np.linalg.norm(to_end, axis=1)
    sine = np.sqrt(size) / np.maximum(d_via * d_end, 1e-300)
    fault = np.select(
        [d_end < SHORTEST_ARC, d_via < SHORTEST_ARC, sine < np.sin(SMALLEST_ARC_ANGLE), angle > LARGEST_ARC + 1e-6],
        [1, 2, 3, 4],
        0,
    )
    return center, radial, tangent, angle, at_via / np.maximum(angle, 1e-12), fault


def axes_of(radial: Array, tangent: Array) -> Array:
    """Unit normals (k, 3) of circles given by their radial and tangent vectors (k, 3)."""
    normal = np.cross(radial, tangent)
    return normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]


def _carried_back(axis: Array, angle: Array, R: Array) -> Array:
    """Orientations (k, 3, 3) turned by -angle about the axis of the circle, from a place on the arc to its start."""
    return Rotation.from_rotvec(-angle[:, None] * axis).as_matrix() @ R


def _turn_past(turn: Array, R_start: Array, R_via: Array, fraction: Array) -> Array:
    """Rotation vector (k, 3) from start to end, the short or the long way round.

    The long way is chosen only where the orientation at the circle point is clearly nearer to it; the circle point only
    decides the direction (RAPID Reference Manual, Basic Characteristics, MoveC).

    Args:
        turn: (k, 3) the short rotation vector, in start axes [rad].
        R_start: (k, 3, 3) orientation at the start.
        R_via: (k, 3, 3) at the circle point, turned back to the start of the arc.
        fraction: (k,) of the arc at the circle point.
    """
    size = np.linalg.norm(turn, axis=1)
    long_way = turn * ((size - 2 * np.pi) / np.maximum(size, 1e-12))[:, None]
    from_start = Rotation.from_matrix(R_start)
    away = [(Rotation.from_matrix(R_via).inv() * from_start * Rotation.from_rotvec(t * fraction[:, None])).magnitude()
            for t in (turn, long_way)]  # fmt: skip
    # A turn of next to nothing has no axis whose long way round could be meant, and many circle points are taught
    # without care for their orientation: only one that clearly stands on the long way asks for it.
    other = (away[1] < 0.5 * away[0] - 1e-6) & (size > np.radians(5.0))
    return np.where(other[:, None], long_way, turn)


def pose_at(robot: Robot, curves: Curves, move: Index, u: Array) -> Array:
    """T_work_tcp (n, 4, 4) on the curves of ``move`` (n,) at fractions ``u`` (n,)."""
    return joints_and_poses(robot, curves, move, u)[1]


def joints_and_poses(robot: Robot, curves: Curves, move: Index, u: Array) -> tuple[Array, Array]:
    """Joint angles (n, 6) [rad] and T_work_tcp (n, 4, 4) on the curves of ``move`` (n,) at fractions ``u`` (n,).

    Joint angles are NaN where the curve is laid in space, so that inverse kinematics has to find them.
    """
    q, T = np.full((len(u), 6), np.nan), pose_in_space(curves, move, u)
    rows = np.flatnonzero(curves.joint[move] | curves.wrist[move])
    if len(rows):
        q[rows] = joints_at(curves, move[rows], u[rows])
        mounts = curves.mounts_at(move[rows], curves.axes_at(move[rows], u[rows]))
        on_curve = curves.wrist[move[rows]]
        q[rows[on_curve]] = arm_joints(robot, mounts[on_curve], T[rows[on_curve]], q[rows[on_curve]])
        known = np.isfinite(q[rows, 0])
        T[rows[known]] = mounts[known].work(forward(robot, q[rows[known]]))
    return q, T


def pose_in_space(curves: Curves, move: Index, u: Array) -> Array:
    """T_work_tcp (n, 4, 4) on lines and arcs of index ``move`` (n,) at fractions ``u`` (n,), no axis interpolated.

    The orientation turns evenly from start to goal, on arcs relative to the path.
    """
    T = np.zeros((len(u), 4, 4))
    T[:, 3, 3] = 1.0
    T[:, :3, 3] = curves.start[move] + curves.chord[move] * u[:, None]
    on_arc = np.flatnonzero(curves.arc[move])
    if len(on_arc):
        i = move[on_arc]
        phi = (curves.angle[i] * u[on_arc])[:, None]
        T[on_arc, :3, 3] = curves.center[i] + np.cos(phi) * curves.radial[i] + np.sin(phi) * curves.tangent[i]
    turn = Rotation.from_rotvec(curves.turn[move] * u[:, None]).as_matrix()
    T[:, :3, :3] = curves.R_start[move] @ turn
    if len(on_arc):
        # CirPathMode \PathFrame, the default: the tool keeps its attitude to the path but for an even reorientation.
        along = phi * axes_of(curves.radial[i], curves.tangent[i])
        T[on_arc, :3, :3] = Rotation.from_rotvec(along).as_matrix() @ T[on_arc, :3, :3]
    return T


def joints_at(curves: Curves, move: Index, u: Array) -> Array:
    """Joint angles (n, 6) [rad] of joint moves at fractions ``u`` (n,) of ``move`` (n,).

    For a line or arc on which axes 4 to 6 are interpolated as joints, only those three columns are meaningful.
    """
    share = u[:, None]
    return curves.q_start[move] + curves.q_change[move] * share + curves.q_bend[move] * (share * (1 - share))


def arm_joints(robot: Robot, mounts: Mounts, T_work_tcp: Array, q: Array) -> Array:
    """Joint angles (n, 6) [rad] that bring the TCP to its place without changing axes 4 to 6; NaN where none are found.

    Found by Newton steps of axes 1 to 3: a point of the flange (of the carried work, for a stationary tool) is to be at
    a place in the base.

    Args:
        T_work_tcp: (n, 4, 4); only the positions count.
        q: (n, 6), with axes 1 to 3 near the solution.
    """
    on_flange = mounts.flange_tcp(T_work_tcp)
    place = mounts.base_tcp(T_work_tcp)[:, :3, 3]
    q = np.array(q, dtype=float)
    rows = np.arange(len(q))
    for _ in range(_STEPS):
        lacks = place[rows] - (forward(robot, q[rows]) @ on_flange[rows])[:, :3, 3]
        open_ = np.linalg.norm(lacks, axis=1) > _REACHED
        rows, lacks = rows[open_], lacks[open_]
        if not len(rows):
            return q
        J = jacobian(robot, q[rows], on_flange[rows])[:, :3, :3]
        step = (np.linalg.pinv(J) @ lacks[:, :, None])[:, :, 0]
        q[rows, :3] += step * np.minimum(1.0, _LARGEST_STEP / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
    q[rows] = np.nan
    return q


def wrist_bend(robot: Robot, T_base_flange: Array, ends: tuple[Array, Array], share: float) -> Array:
    """(6,) coefficients [rad] of u (1 - u), zero for axes 1 to 3, that let the wrist pass a given orientation.

    They are all zero if the arm cannot reach the pose.

    Args:
        T_base_flange: (4, 4) at the circle point.
        ends: (6,) joint angles at both ends [rad].
        share: fraction u of the way at the circle point.
    """
    even = ends[0] + share * (ends[1] - ends[0])
    solutions = inverse(robot, T_base_flange[None])[0]
    away = (solutions - even + np.pi) % (2 * np.pi) - np.pi
    travel = np.abs(away).max(axis=1)
    if np.isnan(travel).all():
        return np.zeros(6)
    return np.asarray(away[np.nanargmin(travel)] * (0, 0, 0, 1, 1, 1) / (share * (1 - share)))
