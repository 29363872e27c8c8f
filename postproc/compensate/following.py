"""Targets that are not written as wished: they stay, or follow what they are derived from and go on from there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from postproc.arrays import Array
from postproc.compensate.correction import Exact
from postproc.compensate.decisions import Decisions
from postproc.compensate.motion import Motion
from postproc.compensate.sharing import fully_wished, straight
from postproc.compensate.values import Change, Displacement, TargetValue, Wish
from postproc.grouping import grouped
from postproc.rapid.motions.units import object_matrices
from postproc.rapid.program.events import MotionEvent, StatementKey
from postproc.rapid.program.records import Pose, RobTarget
from postproc.robot.pose import pose_error

Ways = Mapping[StatementKey, Displacement]


def left_targets(motion: Motion, exact: Exact, wishes: Sequence[Wish], decisions: Decisions) -> dict[int, Array]:
    """Moves whose targets are not written as wished, with the shift (6,) that they get: none, or that of the target
    which they are derived from. ``Offs`` keeps it as it is, ``RelTool`` turns with it.
    """
    samples = motion.samples
    wanted, corrected = samples.T_work_tcp[samples.goal], samples.curves.mounts.work(exact.T_base_flange)
    index = {move.row: i for i, move in enumerate(motion.moves)}
    bases = grouped((name, index[w.move.row]) for w in wishes if w.role == "to" for name in w.names)
    left: dict[int, Array] = {}
    for i, move in enumerate(motion.moves):
        key, origin = move.event.statement.key, move.event.target_origin
        if key in decisions.refused:
            left[i] = np.zeros(6)
        elif key in decisions.following:
            rows = [row for name in decisions.following[key] for row in bases[name]]
            # Of the targets in an array, or in several calls, the one that it is; of several runs the nearest.
            rows = [k for k in rows if motion.moves[k].event.target == origin.root] or rows
            away = np.linalg.norm(wanted[rows, :3, 3] - wanted[i, :3, 3], axis=1)
            base = rows[int(np.argmin(away))]
            shift = pose_error(wanted[base], corrected[base])
            lever = 1e-3 * object_matrices([move.event])[0, :3, :3] @ origin.lever
            left[i] = shift + np.concatenate([np.cross(shift[3:], lever), np.zeros(3)])
    return left


def farther_ways(
    motion: Motion,
    executions: Mapping[int, MotionEvent],
    exact: Exact,
    left: Mapping[int, Array],
    decisions: Decisions,
    least: float,
) -> dict[StatementKey, Displacement]:
    """What statements that follow are displaced by beyond that, where it takes more than half of what they lack.

    Args:
        executions: see ``possible_runs``; left: from ``left_targets``; least: see ``straight`` [mm].
    """
    samples = motion.samples
    keys = ((move.event.statement.key, i) for i, move in enumerate(motion.moves))
    runs = grouped((key, i) for key, i in keys if key in decisions.following)
    whole = fully_wished(executions, {move.row for move in motion.moves})
    shifts = pose_error(samples.T_work_tcp[samples.goal], samples.curves.mounts.work(exact.T_base_flange))
    ways = {}
    for key, rows in runs.items():
        here = [motion.moves[i].event for i in rows]
        if key not in whole or any(e.elsewhere or e.via is not None or e.statement.source.lent for e in here):
            continue
        lacks = 1e3 * (shifts[rows] - [left[i] for i in rows])[:, None, :3] @ object_matrices(here)[:, :3, :3]
        lacks = lacks[:, 0]
        way = straight([dict(event.numbers) for event in here], lacks, least)
        stays = np.linalg.norm(lacks - [way.at(dict(event.numbers)) for event in here], axis=1).max()
        most = np.linalg.norm(lacks, axis=1).max()
        if most > least and stays < most / 2:
            ways[key] = way
    return ways


def carried_on(motion: Motion, left: Mapping[int, Array], ways: Ways) -> dict[int, Array]:
    """The shifts (6,) of moves that follow with what their statements are displaced by beyond that."""
    carried = {}
    for i, shift in left.items():
        event = motion.moves[i].event
        way = ways.get(event.statement.key)
        if way is not None:
            on = object_matrices([event])[0, :3, :3] @ way.at(dict(event.numbers))
            carried[i] = shift + np.concatenate([1e-3 * on, np.zeros(3)])
    return carried


def displaced_on(motion: Motion, ways: Ways) -> tuple[Change, ...]:
    """The texts of these displacements."""
    changes = {}
    for move in motion.moves:
        event = move.event
        key, argument, target = event.statement.key, event.statement.argument("to"), event.target
        if key in ways and key not in changes and argument is not None and isinstance(target, RobTarget):
            value = TargetValue(Pose(target.trans, target.rot), target.robconf, target.extax)
            changes[key] = Change(event.statement.source, argument.span, value, displacement=ways[key])
    return tuple(changes.values())
