"""Zone corners: where a move leaves its own curve to pass over into the next.

The two curves are cross-faded: towards the corner the incoming move comes to rest while the outgoing one picks up,

    p(w) = p_in(1 - f_in h(1 - w)) + p_out(f_out h(w)) - p_corner,   h(w) = 2 w^3 - w^4,   w in [0, 1].

With h(w) = w^2 this would be the parabola through entry and exit; the quartic has the same end points and tangents, and
a curvature that starts and ends at zero, so that the joint jerk at the zone border stays finite. Rotations are composed
in the same way over the (larger) orientation zone. A zone reaches at most to the middle of a move (RAPID Reference
Manual, Basic Characteristics, zonedata).

A controller averages its motion in time, so a corner that is passed at speed is longer than its zone: by the way of
`SMOOTHING`, half of it on either side. How fast it can be passed follows from that: over the corner the joint speeds
change by d at a mean acceleration of d / (SMOOTHING + 2 zone / speed), which the drives have to bear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, largest_of_rows
from postproc.motion.inertia import DRIVEN, drive_shares
from postproc.motion.mounts import Mounts
from postproc.motion.path.curves import Curves, arm_joints, joints_and_poses, joints_at, pose_at
from postproc.motion.values import Flags, Index, Move, payloads
from postproc.robot.arm import Robot
from postproc.robot.kinematics import forward, jacobian

SMOOTHING = (
    0.05  # [s] by which a corner takes longer than its zone, from logged corners of an IRB 6640 (docs/motion.md)
)
_PEAK = 1.5  # largest acceleration in a corner over the mean, by h
_STEP = 1e-3  # fraction of a move over which its joint speeds are found
_IN_PLACE = 1e-6  # [m] a move shorter than this only turns the tool
_ROUNDING = 1e-9  # fraction of a move


@dataclass(frozen=True, slots=True)
class Corners:
    """Fractions (m,) of each move that belong to the corners at its start (``after``) and at its goal (``before``).

    Args:
        before, after: of the position, and of joint moves.
        before_turn, after_turn: of the orientation.
        stop: (m,) the arm rests at the goal.
    """

    before: Array
    after: Array
    before_turn: Array
    after_turn: Array
    stop: Flags


def plan_corners(robot: Robot, moves: tuple[Move, ...], curves: Curves) -> Corners:
    """Fractions of each move taken by the corner paths, each cut to half the length of both moves there."""
    m = len(moves)
    before, after, before_turn, after_turn = (np.zeros(m) for _ in range(4))
    length, angle = curves.length, np.linalg.norm(curves.turn, axis=1)
    zone = np.array([move.zone for move in moves])
    zone_rotation = np.maximum(zone, np.array([move.zone_rotation for move in moves]))
    zone_angle = np.array([move.zone_angle for move in moves])
    fly = np.array([not move.fine for move in moves])
    first = np.array([move.starts_chain for move in moves])
    fly[-1:] = False
    fly[:-1] &= ~first[1:]
    turning = np.abs(np.hstack([curves.q_change, curves.axes_change])).max(axis=1, initial=0) > 1e-6
    moving = (length > _IN_PLACE) | (angle > 1e-6) | turning
    fly &= moving & ~first & np.append(moving[1:], False)

    a = np.flatnonzero(fly)
    b = a + 1
    travels_a, travels_b = length[a] > _IN_PLACE, length[b] > _IN_PLACE
    half_a, half_b = np.where(travels_a, length[a] / 2, np.inf), np.where(travels_b, length[b] / 2, np.inf)
    extension, extension_a, extension_b = _smoothing(robot, moves, curves, a)
    for radius, out, into in ((zone, before, after), (zone_rotation, before_turn, after_turn)):
        r = np.where(radius[a] > 0.0, np.minimum(radius[a] + extension, np.minimum(half_a, half_b)), 0.0)
        turned_a, turned_b = _share(zone_angle[a], angle[a], extension_a), _share(zone_angle[a], angle[b], extension_b)
        out[a] = np.where(travels_a, r / np.where(travels_a, length[a], 1.0), turned_a)
        into[b] = np.where(travels_b, r / np.where(travels_b, length[b], 1.0), turned_b)
    # One zone for all where place and orientation cannot be told apart: joint corners, and a tool that changes.
    one = curves.joint[a] & curves.joint[b]
    one |= ~curves.mounts[a].same(curves.mounts[b])
    before_turn[a[one]], after_turn[b[one]] = before[a[one]], after[b[one]]
    stop = ~fly | (before <= 0.0) | (np.append(after[1:], 0.0) <= 0.0)
    for out, into in ((before, after), (before_turn, after_turn)):
        out[stop] = 0.0
        into[1:][stop[:-1]] = 0.0
    return Corners(before, after, before_turn, after_turn, stop)


def _share(zone_angle: Array, angle: Array, extension: Array) -> Array:
    """Fraction (k,), 1/2 at most, of a turn by ``angle`` (k,) [rad] in a zone of ``zone_angle`` (k,) [rad].

    Args:
        extension: (k,) fraction by which the smoothing lengthens it.
    """
    return np.minimum(0.5, np.maximum(zone_angle, 1e-3) / np.maximum(angle, 1e-9) + extension)


def _smoothing(robot: Robot, moves: tuple[Move, ...], curves: Curves, a: Index) -> tuple[Array, Array, Array]:
    """What smoothing adds to the corners between the moves ``a`` (k,) and those after them.

    With sigma the share of the acceleration limits that the change of the joint speeds takes in one second, a corner
    passed at the fraction f of the programmed speed keeps the limits where

        _PEAK sigma f <= ease (SMOOTHING + 2 zone / (f speed)).

    Returns:
        Length (k,) on either side [m]; for moves that only turn the tool, fraction of the move before and of that after
        it, (k,) each.
    """
    b = a + 1
    before, after = _joint_speeds(robot, moves, curves, a, 1.0), _joint_speeds(robot, moves, curves, b, 0.0)
    # Both at the lower of the two speeds: the arm slows down ahead of a slower move.
    travel = [curves.length[a] / before[1], curves.length[b] / after[1]]
    both = (curves.length[a] > _IN_PLACE) & (curves.length[b] > _IN_PLACE)
    speed = np.where(both, np.minimum(*travel), np.maximum(*travel))
    takes = [of[1] * np.where(both, duration / np.maximum(speed, 1e-12), 1.0)
             for of, duration in zip((before, after), travel, strict=True)]  # fmt: skip
    change = after[0] / takes[1][:, None] - before[0] / takes[0][:, None]
    share = np.abs(change) / robot.acceleration
    if robot.drives is not None:
        payload = payloads([moves[i] for i in b])
        q, still = curves.q_start[b], np.zeros_like(change)
        share[:, DRIVEN] = np.abs(drive_shares(robot, robot.drives, (q, still, change), payload))
    sigma = _PEAK * np.maximum(share.max(axis=1, initial=0), 1e-9)
    ease = np.array([min(moves[i].ease, moves[i + 1].ease) for i in a])
    zone = 2 * np.array([moves[i].zone for i in a]) / np.maximum(speed, 1e-9)
    least = ease * SMOOTHING
    f = np.minimum(1.0, (least + np.sqrt(least**2 + 4 * sigma * ease * zone)) / (2 * sigma))
    half = f * SMOOTHING / 2
    return half * speed, half / takes[0], half / takes[1]


def _joint_speeds(robot: Robot, moves: tuple[Move, ...], curves: Curves, i: Index, u: float) -> tuple[Array, Array]:
    """Change (k, 6) of the joint angles [rad] per fraction of the moves ``i`` (k,), and how long these take (k,) [s].

    Args:
        u: end of the moves at which they are taken: 0 start, 1 goal.
    """
    step = _STEP if u == 0.0 else -_STEP
    poses = []
    for fraction in (np.full(len(i), u), np.full(len(i), u + step)):
        mounts = curves.mounts_at(i, curves.axes_at(i, fraction))
        poses.append(mounts.flange(pose_at(robot, curves, i, fraction)))
    turn = Rotation.from_matrix(poses[1][:, :3, :3] @ poses[0][:, :3, :3].transpose(0, 2, 1)).as_rotvec()
    twist = np.hstack([poses[1][:, :3, 3] - poses[0][:, :3, 3], turn]) / step
    J = jacobian(robot, curves.q_start[i] + u * curves.q_change[i])
    rate = (np.linalg.pinv(J) @ twist[:, :, None])[:, :, 0]
    rate[curves.joint[i]] = curves.q_change[i][curves.joint[i]]
    angle = np.linalg.norm(curves.turn[i], axis=1)
    stated = np.array([[moves[k].speed, moves[k].rotation_speed, moves[k].duration or 0.0] for k in i]).reshape(-1, 3)
    programmed = np.maximum(curves.length[i] / stated[:, 0], angle / stated[:, 1])
    programmed = np.where(stated[:, 2] > 0, stated[:, 2], programmed)
    return rate, np.maximum(np.maximum(programmed, largest_of_rows(np.abs(rate) / robot.speed)), 1e-9)


def fade(w: Array) -> Array:
    """Share h(w) = 2 w^3 - w^4 of the outgoing move at w (n,) in [0, 1] through a corner."""
    return w**3 * (2.0 - w)


def _locate(move: Index, u: Array, before: Array, after: Array) -> tuple[Index, Index, Array]:
    """Which samples lie inside a corner, and how far through it they are.

    Args:
        move: (n,) index of each sample's move.
        u: (n,) fraction along it.
        before, after: (m,) fractions of the moves taken by corners at their goal and at their start.

    Returns:
        Rows (k,) of the samples in a corner; index (k,) of the incoming move; w (k,) in [0, 1] through the corner.
    """
    # Samples stand at both ends of a corner: rounding must not say on which side of it they are.
    leaving = (before[move] > 0) & (u > 1.0 - before[move] + _ROUNDING)
    entering = (after[move] > 0) & (u < after[move] - _ROUNDING)
    w = np.where(leaving, 0.5 * (u - 1.0 + before[move]) / np.where(leaving, before[move], 1.0), 0.0)
    w = np.where(entering, 0.5 + 0.5 * u / np.where(entering, after[move], 1.0), w)
    rows = np.flatnonzero(leaving | entering)
    return rows, np.where(entering, move - 1, move)[rows], w[rows]


def _blended_axes(curves: Curves, corners: Corners, move: Index, u: Array) -> Array:
    """External axes (n, 6) [m], [rad] along the path; within zone corners those of both moves are cross-faded.

    Args:
        move: (n,) index of each sample's move.
        u: (n,) fraction along it.
    """
    axes = curves.axes_at(move, u)
    if not curves.axes_change.any():
        return axes
    rows, a, w = _locate(move, u, corners.before, corners.after)
    u_a, u_b = 1.0 - corners.before[a] * fade(1.0 - w), corners.after[a + 1] * fade(w)
    axes[rows] = curves.axes_at(a, u_a) + curves.axes_change[a + 1] * u_b[:, None]
    return axes


def blended_poses(
    robot: Robot, curves: Curves, corners: Corners, move: Index, u: Array
) -> tuple[Array, Array, Array, Flags]:
    """TCP poses along the path with its corners, and joint angles where the path is planned in joint space.

    Args:
        move: (n,) index of each sample's move.
        u: (n,) fraction along it.

    Returns:
        T_work_tcp (n, 4, 4); q (n, 6) with NaN where inverse kinematics has to find it; external axes (n, 6); blend
        (n,) bool, true inside the zone of the position.
    """
    axes = _blended_axes(curves, corners, move, u)
    q, T = joints_and_poses(robot, curves, move, u)
    blend = np.zeros(len(u), dtype=bool)
    pairs = ((corners.before, corners.after), (corners.before_turn, corners.after_turn))
    for part, (before, after) in zip(("place", "turn"), pairs, strict=True):
        rows, a, w = _locate(move, u, before, after)
        if len(rows) == 0:
            continue
        b = a + 1
        u_a, u_b = 1.0 - before[a] * fade(1.0 - w), after[b] * fade(w)
        both = curves.joint[a] & curves.joint[b]
        if part == "place":
            blend[rows] = True
            i = rows[both]
            q[i] = _blended_joints(curves, a[both], b[both], u_a[both], u_b[both])
            T[i] = curves.mounts_at(move[i], axes[i]).work(forward(robot, q[i]))
        rows, a, b = rows[~both], a[~both], b[~both]
        u_a, u_b = u_a[~both], u_b[~both]
        q[rows] = np.nan
        cross = _cross_fade(robot, curves, (a, u_a), (b, u_b), curves.mounts_at(move[rows], axes[rows]))
        if part == "place":
            T[rows, :3, 3] = cross[:, :3, 3]
        else:
            T[rows, :3, :3] = cross[:, :3, :3]
    if curves.wrist.any():
        _blend_wrists(robot, curves, corners, (move, u, axes), (T, q))
    return T, q, axes, blend


def _blend_wrists(
    robot: Robot,
    curves: Curves,
    corners: Corners,
    at: tuple[Index, Array, Array],
    blended: tuple[Array, Array],
) -> None:
    """Fill in, in place, poses and joint angles in the corners where both moves have known wrist angles.

    At least one of the two is a line or arc with axes 4 to 6 interpolated as joints. The wrist is blended within the
    orientation zone, the place of the TCP stays as it is.

    Args:
        at: moves (n,), fractions (n,) and external axes (n, 6).
        blended: T_work_tcp (n, 4, 4) and q (n, 6), which are changed.
    """
    (move, u, axes), (T, q) = at, blended
    rows, a, w = _locate(move, u, corners.before_turn, corners.after_turn)
    known, wrist = curves.joint | curves.wrist, curves.wrist
    chosen = known[a] & known[a + 1] & (wrist[a] | wrist[a + 1])
    rows, a, w = rows[chosen], a[chosen], w[chosen]
    b, mounts = a + 1, curves.mounts_at(move[rows], axes[rows])
    u_a, u_b = 1.0 - corners.before_turn[a] * fade(1.0 - w), corners.after_turn[b] * fade(w)
    solved = arm_joints(robot, mounts, T[rows], _blended_joints(curves, a, b, u_a, u_b))
    reached = np.isfinite(solved[:, 0])
    q[rows] = solved
    T[rows[reached]] = mounts[reached].work(forward(robot, solved[reached]))


def _blended_joints(curves: Curves, a: Index, b: Index, u_a: Array, u_b: Array) -> Array:
    """Joint angles (n, 6) [rad] in corners: of moves a at u_a, cross-faded into the moves b after them at u_b.

    For lines and arcs with interpolated wrist axes only the columns of axes 4 to 6 are meaningful.
    """
    return joints_at(curves, a, u_a) + joints_at(curves, b, u_b) - curves.q_start[b]


def _cross_fade(
    robot: Robot, curves: Curves, incoming: tuple[Index, Array], outgoing: tuple[Index, Array], owner: Mounts
) -> Array:
    """Blended TCP poses (k, 4, 4) in the corners between two moves each.

    They are calculated in the work frame of the incoming move and returned in that of the move that the sample belongs
    to.

    Args:
        incoming, outgoing: moves (k,) and fractions (k,) along them.
        owner: mounts of the moves that the k samples belong to.
    """
    (a, u_a), (b, u_b) = incoming, outgoing
    T_a, T_b = pose_at(robot, curves, a, u_a), pose_at(robot, curves, b, u_b)
    T_corner = pose_at(robot, curves, a, np.ones(len(a)))
    changed = np.flatnonzero(~curves.mounts[a].same(curves.mounts[b]))
    if len(changed):
        out, axes = b[changed], curves.axes_at(b[changed], u_b[changed])
        mounts_a, mounts_b = curves.mounts_at(a[changed], axes), curves.mounts_at(out, axes)
        T_b[changed] = mounts_a.work(mounts_b.flange(T_b[changed]))
    T = np.zeros_like(T_a)
    T[:, 3, 3] = 1.0
    T[:, :3, 3] = T_a[:, :3, 3] + T_b[:, :3, 3] - T_corner[:, :3, 3]
    T[:, :3, :3] = T_a[:, :3, :3] @ T_corner[:, :3, :3].transpose(0, 2, 1) @ T_b[:, :3, :3]
    if len(changed):
        T[changed] = owner[changed].work(mounts_a.flange(T[changed]))
    return T
