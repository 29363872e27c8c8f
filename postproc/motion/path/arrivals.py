"""Where nobody monitors the configuration: joint angles of goals as the whole way leads the arm to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.motion.path.curves import build_curves, pose_in_space
from postproc.motion.path.postures import POSTURE_DISTANCE, any_configuration, follow
from postproc.motion.path.samples import OF_CURVES
from postproc.motion.values import Move, mounts_of, stretches
from postproc.robot.arm import Robot
from postproc.robot.track import track


def as_they_arrive(robot: Robot, moves: Sequence[Move]) -> list[Move]:
    """Return the moves with the joint angles in which lines and arcs under ``ConfL\\Off`` lead the arm to their goals.

    From one goal to the next a wrist that becomes straight between them would seem to turn over by half a turn. What is
    not followed to its end stays as it is.
    """
    m = len(moves)
    free = np.array([any_configuration(e.event) and e.kind != "absjoint" and not e.starts_chain for e in moves])
    if not any(f and e.kind in ("line", "arc") for f, e in zip(free, moves, strict=True)):
        return list(moves)
    curves, mounts = build_curves(robot, tuple(moves)), mounts_of(moves)
    in_space = free & ~curves.joint & ~curves.wrist & (curves.fault == 0)
    q = np.array([move.q for move in moves])
    count = np.maximum(np.ceil(OF_CURVES.intervals(curves) - 1e-9), 4).astype(int)
    for a, b in stretches(in_space):
        if (resumed := moves[a - 1].resumes_from) is not None:
            q[a - 1] = q[resumed]
        rows = np.repeat(np.arange(a, b), count[a:b])
        u = np.concatenate([np.arange(1, n + 1) / n for n in count[a:b]])
        ends = np.cumsum(count[a:b]) - 1
        try:
            poses = pose_in_space(curves, rows, u)
            reached = follow(robot, curves, rows, u, poses, q_start=q[a - 1], ends=(ends, q[a:b]))[ends]
            departs = np.abs(reached - q[a:b]).max(axis=1) > POSTURE_DISTANCE
            if not departs.any():
                continue
            first = a + int(np.argmax(departs))
            q[first:b] = reached[first - a :]
            for k in range(b, m):
                goal = moves[k].T_work_tcp
                if not free[k] or in_space[k] or goal is None:
                    break
                q[k] = track(robot, mounts[[k]].flange(goal[None]), q[k - 1])[0]
        except PostprocError:
            continue
    q = np.array([q[k if move.resumes_from is None else move.resumes_from] for k, move in enumerate(moves)])
    return [replace(e, q=x) if np.any(e.q != x) else e for e, x in zip(moves, q, strict=True)]
