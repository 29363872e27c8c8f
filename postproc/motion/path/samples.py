"""Dense samples along consecutive moves: where to sample, the poses, the joint angles behind them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, Matter, PostprocError, Severity
from postproc.motion.findings import at_move, once
from postproc.motion.path.corners import Corners, blended_poses, plan_corners
from postproc.motion.path.curves import ARC_FAULTS, Curves, build_curves
from postproc.motion.values import Flags, Index, Move, Path, mounts_of, stretches
from postproc.robot.arm import Robot
from postproc.robot.closed_form import inverse
from postproc.robot.inverse import excess_of
from postproc.robot.track import track

SPACING = 0.010  # [m] between samples
TURN = np.radians(1.0)  # reorientation between samples [rad]
ARC_STEP = np.radians(5.0)  # of a circle between samples
JOINT_STEP = np.radians(3.0)  # of the fastest joint in joint moves: only their ends are corrected
CORNER_STEP = np.radians(20.0)  # change of direction between samples in a corner
_SHORT = 0.025  # [m] moves below this length get two intervals instead of four
_JUMP = np.radians(60.0)  # between neighbouring samples: no arm turns that fast within one
_GOAL_MISS = 1e-4  # [rad] between the tracked and the programmed joint angles of a goal
_NEAR_SINGULAR = np.radians(0.5)  # |q5| on a path in space


def sample_path(robot: Robot, moves: Sequence[Move]) -> tuple[Path, list[Diagnostic]]:
    """Sample the moves of a program densely enough to see how the deflection of the arm changes along them.

    Args:
        moves: from ``read_moves``; the first of a chain contributes its goal only.

    Returns:
        The path, and findings: MOT001 three points that give no arc, MOT002 joint limit on the way, MOT003 jump of a
        joint, MOT004 goal reached in another configuration, MOT005 wrist singularity.
    """
    moves = tuple(moves)
    if not moves:
        none, nowhere = np.zeros(0, dtype=np.int64), np.zeros(0)
        return Path(
            (),
            mounts_of(()),
            np.zeros((0, 4, 4)),
            np.zeros((0, 6)),
            np.zeros((0, 6)),
            none,
            nowhere,
            nowhere,
            none,
            none > 0,
        ), []
    curves = build_curves(robot, moves)
    findings = [
        at_move(moves[i], "MOT001", "error", f"MoveC cannot run this arc: {ARC_FAULTS[curves.fault[i]]}",
                "use a line, or move the circle point")
        for i in np.flatnonzero(curves.fault)
    ]  # fmt: skip
    corners = plan_corners(moves, curves)
    move, u, goal = place_samples(moves, curves, corners)
    T, q, axes, blend = blended_poses(robot, curves, corners, move, u)
    lone = np.flatnonzero([m.first for m in moves])
    q[goal[lone]] = [moves[i].q for i in lone]
    in_space = np.isnan(q[:, 0])
    mounts = curves.mounts_at(move, axes)
    findings += _track(robot, moves, mounts.flange(T), q, move)

    # Arc length in the tool of the sample: a change of tool, or of the work, is no travel.
    back = T[:-1].copy()
    changed = np.flatnonzero(~mounts[1:].same(mounts[:-1]))
    back[changed] = curves.mounts_at(move[changed + 1], axes[changed]).work(mounts[changed].flange(T[changed]))
    step = np.linalg.norm(T[1:, :3, 3] - back[:, :3, 3], axis=1)
    step[starts_chain(moves, move)[1:]] = 0.0
    s = np.concatenate([[0.0], np.cumsum(step)])
    path = Path(moves, mounts, T, q, axes, move, u, s, goal, blend, corners.stop)
    findings += _examine(robot, moves, path, in_space & (curves.fault[move] == 0))
    return path, once(findings)


def starts_chain(moves: tuple[Move, ...], move: Index) -> Flags:
    """(n,) bool: the sample is the first of a chain of moves, so the way on which the arm comes to it is not known.

    Args:
        move: (n,) index of each sample's move.
    """
    starts = np.array([m.first for m in moves], dtype=bool)[move]
    return starts & np.append(True, np.diff(move) != 0)


def place_samples(moves: tuple[Move, ...], curves: Curves, corners: Corners) -> tuple[Index, Array, Index]:
    """Move (n,) and fraction (n,) of all samples, and the sample (m,) at the goal of each move.

    Every move has up to three stretches (corner, free, corner), each evenly divided; the sample density is the highest
    that length, reorientation, curvature or joint travel needs.
    """
    m = len(moves)
    turn = np.linalg.norm(curves.turn, axis=1)
    travel = np.where(curves.joint | curves.wrist, np.abs(curves.q_change).max(axis=1), 0.0)
    asked = np.maximum.reduce([
        np.where(curves.joint, 0.0, curves.length / SPACING), np.where(curves.joint, 0.0, turn / TURN),
        np.abs(curves.angle) / ARC_STEP, travel / JOINT_STEP, np.abs(curves.axes_change).max(axis=1) / SPACING,
    ])  # fmt: skip
    least = np.where((curves.length < _SHORT) & (turn < TURN) & (travel < JOINT_STEP), 2, 4)
    bend = np.append(_corner_angles(curves), 0.0)
    half = np.clip(np.ceil(0.5 * bend / CORNER_STEP), 1, 4)
    in_corner = [np.append(0.0, half[:-1]), half]
    share = [corners.after, corners.before]
    stretch = [share[0], 1.0 - share[0] - share[1], share[1]]
    count = np.zeros((m, 3), dtype=int)
    for k, side in ((0, 0), (2, 1)):
        wanted = np.maximum(in_corner[side], np.ceil(asked * share[side] - 1e-9))
        count[:, k] = np.where(share[side] > 0, wanted, 0)
    free = np.maximum(np.ceil(asked * stretch[1] - 1e-9), least - count[:, 0] - count[:, 2])
    count[:, 1] = np.where(stretch[1] > 1e-9, np.maximum(free, 1), 0)
    first = np.array([move.first for move in moves])
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
            found = at_move(where, error.diagnostics[0].code, "error", "the way to this target is out of reach",
                            "move the path into the working range, or pass the place with a joint move")  # fmt: skip
            findings.append(found)
            q[run] = q[a - 1]
    return findings


def _examine(robot: Robot, moves: tuple[Move, ...], path: Path, in_space: Flags) -> list[Diagnostic]:
    """MOT002 to MOT005: joint limits, jumps, goals in another configuration, singular wrists; one per move and kind.

    Args:
        in_space: (n,) samples whose joint angles come from inverse kinematics.
    """
    findings = []

    def report(
        rows: Index, code: str, severity: Severity, message: Callable[[int], str], help: str, joint: str = ""
    ) -> None:
        """Add one finding for each move that has samples among ``rows``, at the first of them.

        Args:
            help: for a way in space; joint: for a joint move, which knows no singularity.
        """
        matter = Matter.UNFOLLOWABLE if severity == "error" else None
        for i in np.unique(path.move[rows], return_index=True)[1]:
            move = moves[path.move[rows[i]]]
            help_ = joint if move.kind in ("joint", "absjoint") else help
            found = at_move(move, code, severity, message(int(rows[i])), help_)
            findings.append(replace(found, matter=matter))

    excess = excess_of(robot, path.q)
    report(
        np.flatnonzero(excess.max(axis=1) > 0.0), "MOT002", "error",
        lambda i: _limit_message(robot, path.q[i], int(np.argmax(excess[i]))),
        "give the target another configuration, or pass the place another way",
        "give this target, or the one before it, other joint angles, or pass another target between them",
    )  # fmt: skip
    step = np.abs(np.diff(path.q, axis=0, prepend=path.q[:1]))
    step[starts_chain(moves, path.move)] = 0.0
    jump = step.max(axis=1) > _JUMP
    q_goal = np.array([m.q for m in moves])[path.move]
    monitored = np.array([m.event.options.get("conf_l") is not False for m in moves])
    at_goal = np.zeros(len(jump), dtype=bool)
    at_goal[path.goal] = path.stop
    missed = at_goal & in_space & monitored[path.move] & (np.abs(path.q - q_goal).max(axis=1) > _GOAL_MISS)
    report(
        np.flatnonzero(jump), "MOT003", "error",
        lambda i: f"joint {np.argmax(step[i]) + 1} would turn by {np.degrees(step[i].max()):.0f} deg at once",
        "the path runs through a singularity: turn the tool a little, or use a joint move",
        "the way before arrives in another configuration than it states: correct the target before this one",
    )  # fmt: skip
    report(
        np.flatnonzero(missed), "MOT004", "error",
        lambda i: _missed_message(path.q[i], q_goal[i]),
        "correct the target's configuration data, or reach it with a joint move",
    )  # fmt: skip
    singular = in_space & (np.abs(np.sin(path.q[:, 4])) < np.sin(_NEAR_SINGULAR)) & (step[:, [3, 5]].max(axis=1) > TURN)
    report(
        np.flatnonzero(singular), "MOT005", "warning",
        lambda i: f"the path passes the wrist singularity (axis 5 at {np.degrees(path.q[i, 4]):.2f} deg)",
        "expect a slow-down there; turn the tool a few degrees to stay clear of it",
    )  # fmt: skip
    return findings


def _limit_message(robot: Robot, q: Array, joint: int) -> str:
    """Text of MOT002: angle of a joint (0 to 5) in posture q (6,) [rad] and the limits of it, in degrees."""
    low, high = np.degrees(robot.lower[joint]), np.degrees(robot.upper[joint])
    return (
        f"joint {joint + 1} reaches {np.degrees(q[joint]):.1f} deg on the way,"
        f" allowed are {round(low, 1):g} to {round(high, 1):g} deg"
    )


def _missed_message(q: Array, q_goal: Array) -> str:
    """Text of MOT004: the joint farthest from its goal, its angle and the wanted one in degrees.

    Args:
        q, q_goal: (6,) joint angles reached and wanted [rad].
    """
    j = int(np.argmax(np.abs(q - q_goal)))
    arrives, wanted = np.degrees(q[j]), np.degrees(q_goal[j])
    return f"the arm arrives in another configuration: joint {j + 1} at {arrives:.0f}, not at {wanted:.0f} deg"
