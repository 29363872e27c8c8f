"""What a module makes of the targets of a program that are known: its function run as the controller runs it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array, invert
from postproc.diagnostics import Source
from postproc.model.arm import Model
from postproc.motion.path.moves import read_moves
from postproc.motion.values import Move, mounts_of
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import RobTarget
from postproc.rapid.motions.units import target_poses, via_matrix
from postproc.robot.inverse import nearest_solution
from postproc.runtime.programs.statements import WELDING
from postproc.runtime.proof.calls import Caller, FunctionCall

NO_TOOL = 2  # `ppReason` of a tool that the robot does not hold


@dataclass(frozen=True)
class Applied:
    """Events with the targets that the correcting function (``ppCorrected``) returns.

    Args:
        corrected: number of executions whose target it corrects.
        returned: number of those returned unchanged, by the value of `ppReason`.
    """

    events: Sequence[MotionEvent]
    corrected: int
    returned: Mapping[int, int]


def apply_module(
    module: Source, model: Model, events: Sequence[MotionEvent], chosen: Set[int], free_axes: str = ""
) -> Applied:
    """Run the module's correcting function on the targets of chosen events; other targets stay as they are.

    It is calculated in single precision, as on a controller.

    Args:
        module: text of the run-time module; model: the arm that the program drives.
        events: all of a program.
        chosen: indices of the events whose target is corrected.
        free_axes: letters of external axes that carry neither the robot nor its work.

    Raises:
        PostprocError: RUN003, the module holds what cannot be calculated.
    """
    moves, _ = read_moves(model.robot, events, free_axes, model.station)
    mine = [m for m in moves if m.row in chosen and m.resumes_from is None and isinstance(m.event.target, RobTarget)]
    held = [m for m in mine if m.event.tool.robhold and not m.event.wobj.robhold]
    given, reasons = list(events), Counter({NO_TOOL: len(mine) - len(held)})
    if not held:
        return Applied(given, 0, {why: times for why, times in reasons.items() if times})
    caller = Caller(module, model)
    answers = caller.calls([_call(m, m.q) for m in held])
    poses = target_poses([m.event for m in held], _on_work(held, np.array([a.pose for a in answers]).reshape(-1, 4, 4)))
    for move, answer, pose in zip(held, answers, poses, strict=True):
        target, reasons[answer.reason] = move.event.target, reasons[answer.reason] + 1
        assert isinstance(target, RobTarget)
        if answer.reason == 0:
            target = replace(target, trans=pose.trans, rot=pose.rot, robconf=answer.target.robconf)
        given[move.row] = replace(move.event, target=target)
    for move, via in _circle_points(caller, model, held):
        given[move.row] = replace(given[move.row], via=via)
    corrected = reasons.pop(0, 0)
    return Applied(given, corrected, {why: times for why, times in sorted(reasons.items()) if times})


def _call(move: Move, q: Array, end: Array | None = None) -> FunctionCall:
    """Arguments of the correcting function for one target of a move.

    Args:
        q: (6,) joint angles [rad] at the target, or at the circle point of an arc.
        end: (6,) joint angles [rad] at the end of the arc; None if the target is no circle point.
    """
    event = move.event
    welding = event.statement.signature.phase in WELDING
    return FunctionCall(q, event.tool, event.gripload, welding, end, event.in_force.total_load)


def _circle_points(caller: Caller, model: Model, group: Sequence[Move]) -> list[tuple[Move, RobTarget]]:
    """The arcs among the moves whose circle point the function corrects, each with the corrected circle point."""
    found = []
    for move in group:
        via = move.event.via
        if via is None:
            continue
        q = nearest_solution(model.robot, mounts_of([move]).flange(via_matrix(move.event)[None])[0], move.q)
        if not np.isfinite(q).all():
            continue
        answer = caller.call(_call(move, q, move.q))
        if answer.reason == 0:
            (pose,) = target_poses([move.event], _on_work([move], answer.pose[None]))
            found.append((move, replace(via, trans=pose.trans, rot=pose.rot)))
    return found


def _on_work(moves: Sequence[Move], T_base_tcp: Array) -> Array:
    """Convert TCP poses (n, 4, 4) from the base frame to the frame of the work in each of n moves."""
    mounts = mounts_of(moves)
    return mounts.work(T_base_tcp @ invert(mounts.T_mount_tcp))
