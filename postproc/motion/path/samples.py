"""Samples along moves: of the curves that a program states, or of the way with its corners cut.

Zones cut the corners of the original and of the corrected program alike, so targets are corrected for the curves that
the program states (`sample_moves`), while time and speed are those of the way with its corners (`sample_path`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, distinct
from postproc.diagnostics import Diagnostic, Matter, PostprocError, Severity
from postproc.motion.findings import at_move, once
from postproc.motion.mounts import Mounts
from postproc.motion.path.corners import Corners, blended_poses, plan_corners
from postproc.motion.path.curves import ARC_FAULTS, Curves, build_curves, joints_and_poses, pose_in_space
from postproc.motion.path.postures import follow
from postproc.motion.values import Flags, Index, Move, stretches
from postproc.robot.arm import Robot
from postproc.robot.closed_form import inverse
from postproc.robot.inverse import excess_of
from postproc.robot.track import track

CORNER_STEP = np.radians(20.0)  # change of direction between samples in a corner
UNEVEN = np.radians(0.3)  # of the tool from an even turn between the ends of a move
_SHORT = 0.025  # [m] moves below this length get two intervals instead of four
_JUMP = np.radians(60.0)  # between neighbouring samples: no arm turns that fast within one
_GOAL_MISS = 1e-4  # [rad] between the tracked and the programmed joint angles of a goal
_NEAR_SINGULAR = np.radians(0.5)  # |q5| on a path in space


@dataclass(frozen=True, slots=True)
class Steps:
    """Largest steps between samples.

    Args:
        spacing: of the TCP, and of external axes along lines and arcs [m], [rad].
        turn: of the tool; arc: of a circle; joint: of a joint [rad].
        axis: of external axes in joint moves [m], [rad].
    """

    spacing: float
    turn: float
    arc: float
    joint: float
    axis: float

    def intervals(self, curves: Curves) -> Array:
        """(m,) intervals, not yet whole numbers, that every move needs."""
        turn = np.linalg.norm(curves.turn, axis=1)
        travel = np.where(curves.joint | curves.wrist, np.abs(curves.q_change).max(axis=1, initial=0), 0.0)
        axes = np.abs(curves.axes_change).max(axis=1, initial=0)
        most: Array = np.maximum.reduce([
            np.where(curves.joint, 0.0, curves.length / self.spacing), np.where(curves.joint, 0.0, turn / self.turn),
            np.abs(curves.angle) / self.arc, travel / self.joint,
            axes / np.where(curves.joint, self.axis, self.spacing),
        ])  # fmt: skip
        return most


# Of joint moves only the ends are corrected. A correction that bends by 1 mm over 1 m deviates from its chord by 0.4
# micrometres between samples 20 mm apart.
OF_WAYS = Steps(0.010, np.radians(1.0), np.radians(5.0), np.radians(3.0), 0.010)
OF_CURVES = Steps(0.020, np.radians(3.0), np.radians(6.0), np.radians(10.0), np.radians(10.0))


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """n samples along m moves.

    On curves every move has samples from its start (u = 0) to its goal (u = 1), both included, so that two moves that
    meet at a target may have different states there (another tool, the arc just lit). On a way with corners a goal
    belongs to the move that reaches it alone; sample 0 is the first goal, as how the arm gets there is unknown.

    Args:
        move, u: (n,) move index and fraction along it (in a zone corner u runs through the corner).
        T_work_tcp: (n, 4, 4) commanded poses of the TCP on the work.
        q: (n, 6) nominal joint angles [rad], continuous.
        axes: (n, 6) external axes [m], [rad].
        start, goal: (m,) first and last sample of each move; equal for moves whose way is unknown. For a cut corner
            the goal is the closest sample.
        q_reached: (m, 6) joint angles [rad] in which the arm comes to each goal; on curves ``q`` there is what confdata
            selects.
        blend: (n,) True inside a zone corner.
        stop: (m,) True where the arm rests at the goal of move i: fine points, ends of chains, corners without a zone.
    """

    moves: tuple[Move, ...]
    curves: Curves
    move: Index
    u: Array
    T_work_tcp: Array
    q: Array
    axes: Array
    start: Index
    goal: Index
    q_reached: Array
    blend: Flags
    stop: Flags

    def mounts_at(self, rows: slice | Index) -> Mounts:
        """The mounts of tool and work at samples, chosen by a slice or indices."""
        return self.curves.mounts_at(self.move[rows], self.axes[rows])

    def starts_chain(self) -> Flags:
        """(n,) bool: the first sample of a chain of moves, so that how the arm comes to it is not known."""
        starts = np.array([m.starts_chain for m in self.moves], dtype=bool)[self.move]
        return starts & np.append(True, np.diff(self.move) != 0)

    def way(self) -> Array:
        """(n,) length of the TCP's way on the work [m]; changes of tool and work, and reorientations, add nothing."""
        if not len(self.u):
            return np.zeros(0)
        mounts, back = self.mounts_at(slice(None)), self.T_work_tcp[:-1].copy()
        changed = np.flatnonzero(~mounts[1:].same(mounts[:-1]))
        flange_mounts = self.curves.mounts_at(self.move[changed + 1], self.axes[changed])
        back[changed] = flange_mounts.work(mounts[changed].flange(self.T_work_tcp[changed]))
        step = np.linalg.norm(self.T_work_tcp[1:, :3, 3] - back[:, :3, 3], axis=1)
        step[self.starts_chain()[1:]] = 0.0
        return np.concatenate([[0.0], np.cumsum(step)])

    def unevenly_turned(self) -> Index:
        """Indices of moves with interpolated wrist axes on whose way the tool does not turn evenly from start to goal.

        A target in between would not stand on that way, which the controller alone knows.
        """
        rows = np.flatnonzero(self.curves.wrist[self.move])
        even = pose_in_space(self.curves, self.move[rows], self.u[rows])[:, :3, :3]
        turn = Rotation.from_matrix(even).inv() * Rotation.from_matrix(self.T_work_tcp[rows, :3, :3])
        return distinct(self.move[rows[turn.magnitude() > UNEVEN]])


def sample_moves(robot: Robot, moves: Sequence[Move], intervals: Array) -> Samples:
    """Sample the curve of every move at even fractions from its start to its goal.

    Args:
        moves: chains of moves; the first of a chain has its goal only.
        intervals: (m,) least number of intervals of each line or arc; joint moves get as many as they need.

    Raises:
        PostprocError: KIN004, a pose cannot be reached in the branch in which the arm comes.
    """
    moves = tuple(moves)
    curves = build_curves(robot, moves)
    first = np.array([move.starts_chain for move in moves])
    count = np.maximum(np.ceil(OF_CURVES.intervals(curves) - 1e-9), 1)
    arcs = np.maximum(count, 4)
    count = np.where(curves.arc, arcs + arcs % 2, count)  # even: the circle point may be the middle sample
    count = np.where(curves.joint, count, np.maximum(count, intervals + intervals % 2))
    count = np.where(first, 0, count).astype(int)

    size = count + 1
    goal = np.cumsum(size) - 1
    start = goal - count
    move = np.repeat(np.arange(len(moves)), size)
    u = np.where(count[move] > 0, (np.arange(len(move)) - start[move]) / np.maximum(count[move], 1), 1.0)
    q, T = joints_and_poses(robot, curves, move, u)
    known = np.array([m.q for m in moves])
    tracked = np.zeros(len(moves), dtype=bool)
    tracked[move[np.isnan(q[:, 0])]] = True
    for a, b in stretches(tracked & ~first):
        rows = slice(start[a], goal[b - 1] + 1)
        ends = goal[a:b] - start[a], known[a:b]
        q[rows] = follow(robot, curves, move[rows], u[rows], T[rows], q_start=known[a - 1], ends=ends)
    reached = q[goal]
    q[goal] = known  # exactly what the confdata says
    blend, stop = np.broadcast_to(False, len(u)), np.broadcast_to(True, len(moves))
    return Samples(moves, curves, move, u, T, q, curves.axes_at(move, u), start, goal, reached, blend, stop)


def sample_path(robot: Robot, moves: Sequence[Move]) -> tuple[Samples, list[Diagnostic]]:
    """Sample the moves of a program densely enough to see how the deflection of the arm changes along them.

    Args:
        moves: one or more from ``read_moves``; the first of a chain contributes its goal only.

    Returns:
        The path, and findings: MOT001 three points that give no arc, MOT002 joint limit on the way, MOT003 jump of a
        joint, MOT004 goal reached in another configuration, MOT005 wrist singularity.
    """
    moves = tuple(moves)
    curves = build_curves(robot, moves)
    findings = [
        at_move(moves[i], "MOT001", "error", f"MoveC cannot run this arc: {ARC_FAULTS[curves.fault[i]]}",
                "use a line, or move the circle point")
        for i in np.flatnonzero(curves.fault)
    ]  # fmt: skip
    corners = plan_corners(robot, moves, curves)
    move, u, goal = place_samples(moves, curves, corners)
    T, q, axes, blend = blended_poses(robot, curves, corners, move, u)
    lone = np.flatnonzero([m.starts_chain for m in moves])
    q[goal[lone]] = np.array([moves[i].q for i in lone]).reshape(-1, 6)
    in_space = np.isnan(q[:, 0])
    findings += _track(robot, moves, curves.mounts_at(move, axes).flange(T), q, move)
    start = np.append(0, goal[:-1] + 1)[: len(goal)]
    path = Samples(moves, curves, move, u, T, q, axes, start, goal, q[goal], blend, corners.stop)
    findings += _examine(robot, moves, path, in_space & (curves.fault[move] == 0))
    return path, once(findings)


def place_samples(moves: tuple[Move, ...], curves: Curves, corners: Corners) -> tuple[Index, Array, Index]:
    """Move (n,) and fraction (n,) of all samples, and the sample (m,) at the goal of each move.

    Every move has up to three stretches (corner, free, corner), each evenly divided; the sample density is the highest
    that length, reorientation, curvature or joint travel needs.
    """
    m = len(moves)
    turn, travel = np.linalg.norm(curves.turn, axis=1), np.abs(curves.q_change).max(axis=1, initial=0)
    needed = OF_WAYS.intervals(curves)
    still = (travel < OF_WAYS.joint) | ~(curves.joint | curves.wrist)
    least = np.where((curves.length < _SHORT) & (turn < OF_WAYS.turn) & still, 2, 4)
    bend = np.append(_corner_angles(curves), 0.0)
    half = np.clip(np.ceil(0.5 * bend / CORNER_STEP), 1, 4)
    in_corner = [np.append(0.0, half[:-1]), half]
    share = [corners.after, corners.before]
    stretch = [share[0], 1.0 - share[0] - share[1], share[1]]
    count = np.zeros((m, 3), dtype=int)
    for k, side in ((0, 0), (2, 1)):
        wanted = np.maximum(in_corner[side], np.ceil(needed * share[side] - 1e-9))
        count[:, k] = np.where(share[side] > 0, wanted, 0)
    free = np.maximum(np.ceil(needed * stretch[1] - 1e-9), least - count[:, 0] - count[:, 2])
    count[:, 1] = np.where(stretch[1] > 0.01, np.maximum(free, 1), 0)
    first = np.array([move.starts_chain for move in moves])
    count[first] = (0, 1, 0)

    flat = count.ravel()
    owner = np.repeat(np.arange(3 * m), flat)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(flat) - flat, flat) + 1
    begin = np.column_stack([np.zeros(m), share[0], 1.0 - share[1]]).ravel()
    u = begin[owner] + np.column_stack(stretch).ravel()[owner] * within / flat[owner]
    goal = np.cumsum(count.sum(axis=1)) - 1
    u[goal] = 1.0
    return owner // 3, u, goal


def _corner_angles(curves: Curves) -> Array:
    """Change of direction (m - 1,) at each goal [rad]; joint moves and reorientations count as a right angle."""
    leave, arrive = curves.chord.copy(), curves.chord.copy()
    arc = curves.arc
    phi = curves.angle[arc][:, None]
    leave[arc] = curves.tangent[arc]
    arrive[arc] = np.cos(phi) * curves.tangent[arc] - np.sin(phi) * curves.radial[arc]
    a, b = arrive[:-1], leave[1:]
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
    unclear = curves.joint[:-1] | curves.joint[1:] | (np.minimum(curves.length[:-1], curves.length[1:]) < 1e-6)
    return np.where(unclear, np.pi / 2, angle)


def _track(robot: Robot, moves: tuple[Move, ...], T_base_flange: Array, q: Array, move: Index) -> list[Diagnostic]:
    """Fill in, in place, joint angles ``q`` (n, 6) that are NaN, each stretch continuous from the sample before it.

    Args:
        T_base_flange: (n, 4, 4) at the samples.
        move: (n,) index of each sample's move.

    Returns:
        One finding per stretch that is out of reach; its samples keep the joint angles before it.
    """
    findings = []
    for a, b in stretches(np.isnan(q[:, 0])):
        run = slice(a, b)
        try:
            q[run] = track(robot, T_base_flange[run], q[a - 1])
        except PostprocError as error:
            lost = np.isnan(inverse(robot, T_base_flange[run])[..., 0]).all(axis=1)
            where = moves[move[a + int(np.argmax(lost))]]
            finding = at_move(where, error.diagnostics[0].code, "error", "the way to this target is out of reach",
                            "move the path into the working range, or pass the place with a joint move")  # fmt: skip
            findings.append(finding)
            q[run] = q[a - 1]
    return findings


def _examine(robot: Robot, moves: tuple[Move, ...], path: Samples, in_space: Flags) -> list[Diagnostic]:
    """MOT002 to MOT005: joint limits, jumps, goals in another configuration, singular wrists; one per move and kind.

    Args:
        in_space: (n,) samples whose joint angles come from inverse kinematics.
    """
    findings = []

    def report(
        rows: Index, code: str, severity: Severity, message: Callable[[int], str], help: str, *, joint: str = ""
    ) -> None:
        """Add one finding for each move that has samples among ``rows``, at the first of them.

        Args:
            help: for a way in space; joint: for a joint move, which knows no singularity; the same by default.
        """
        matter = Matter.UNFOLLOWABLE if severity == "error" else None
        for i in np.unique(path.move[rows], return_index=True)[1]:
            move = moves[path.move[rows[i]]]
            help_ = joint if joint and move.kind in ("joint", "absjoint") else help
            finding = at_move(move, code, severity, message(int(rows[i])), help_)
            findings.append(replace(finding, matter=matter))

    excess = excess_of(robot, path.q)
    report(
        np.flatnonzero(excess.max(axis=1) > 0.0), "MOT002", "error",
        lambda i: _limit_message(robot, path.q[i], int(np.argmax(excess[i]))),
        "give the target another configuration, or pass the place another way",
        joint="give this target, or the one before it, other joint angles, or pass another target between them",
    )  # fmt: skip
    step = np.abs(np.diff(path.q, axis=0, prepend=path.q[:1]))
    step[path.starts_chain()] = 0.0
    jump = step.max(axis=1) > _JUMP
    q_goal = np.array([m.q for m in moves])[path.move]
    monitored = np.array([m.event.options.get("conf_l") is not False for m in moves])
    at_goal = np.zeros(len(jump), dtype=bool)
    at_goal[path.goal] = path.stop
    missed = at_goal & in_space & monitored[path.move] & (np.abs(path.q - q_goal).max(axis=1) > _GOAL_MISS)
    # A joint move turns any joint by any angle, evenly: where it jumps, the move before it ends elsewhere.
    led = jump & (path.move > 0) & np.array([m.kind in ("joint", "absjoint") for m in moves])[path.move]
    missed[path.goal[path.move[led] - 1]] = True

    report(
        np.flatnonzero(jump & ~led), "MOT003", "error",
        lambda i: f"joint {np.argmax(step[i]) + 1} would turn by {np.degrees(step[i].max()):.0f} deg at once",
        "the path runs through a singularity: turn the tool a little, or use a joint move",
    )  # fmt: skip
    report(
        np.flatnonzero(missed), "MOT004", "error",
        lambda i: _missed_message(path.q[i], q_goal[i]),
        "correct the target's configuration data, or reach it with a joint move",
    )  # fmt: skip
    turning = step[:, [3, 5]].max(axis=1) > OF_WAYS.turn
    singular = in_space & (np.abs(np.sin(path.q[:, 4])) < np.sin(_NEAR_SINGULAR)) & turning
    report(
        np.flatnonzero(singular), "MOT005", "warning",
        lambda i: f"the path passes the wrist singularity (axis 5 at {np.degrees(path.q[i, 4]):.2f} deg)",
        "expect a slow-down there; turn the tool a few degrees to stay clear of it",
    )  # fmt: skip
    return findings


def _limit_message(robot: Robot, q: Array, joint: int) -> str:
    """Text of MOT002: angle of a joint (0 to 5) in posture q (6,) [rad] and the limits of it, in degrees."""
    low, high = np.degrees(robot.lower[joint]), np.degrees(robot.upper[joint])
    allowed = f"allowed are {round(low, 1):g} to {round(high, 1):g} deg"
    return f"joint {joint + 1} reaches {np.degrees(q[joint]):.1f} deg on the way, {allowed}"


def _missed_message(q: Array, q_goal: Array) -> str:
    """Text of MOT004: the joint farthest from its goal; q, q_goal: (6,) joint angles reached and wanted [rad]."""
    j = int(np.argmax(np.abs(q - q_goal)))
    arrives, wanted = np.degrees(q[j]), np.degrees(q_goal[j])
    return f"the arm arrives in another configuration: joint {j + 1} at {arrives:.0f}, not at {wanted:.0f} deg"
