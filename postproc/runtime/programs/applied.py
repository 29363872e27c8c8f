"""What a module makes of the targets of a program that are known: its function run as the controller runs it."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

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


def apply_module(
    module: Source, model: Model, events: Sequence[MotionEvent], chosen: Set[int], free_axes: str = ""
) -> list[MotionEvent]:
    """Events with the targets that the module's function gives for chosen ones; other targets stay as they are.

    It is calculated in single precision, as on a controller.

    Args:
        module: text of the run-time module; model: the arm that the program drives.
        events: all of a program.
        chosen: indices of the events whose target is corrected.
        free_axes: letters of external axes that carry neither the robot nor its work.

    Raises:
        PostprocError: RUN003, the module holds what cannot be calculated.
    """
    driven = list(events)
    moves = [
        m
        for m in read_moves(model.robot, events, free_axes, model.station)[0]
        if m.row in chosen and m.resumes_from is None and isinstance(m.event.target, RobTarget)
        if m.event.tool.robhold and not m.event.wobj.robhold  # the function returns other targets as they came
    ]
    if not moves:
        return driven
    caller = Caller(module, model)
    answers = [caller.call(_call(m, m.q)) for m in moves]
    poses = target_poses([m.event for m in moves], _on_work(moves, np.array([a.pose for a in answers])))
    for move, answer, pose in zip(moves, answers, poses, strict=True):
        target = move.event.target
        if answer.reason == 0 and isinstance(target, RobTarget):
            target = replace(target, trans=pose.trans, rot=pose.rot, robconf=answer.target.robconf)
        via = _circle_point(caller, model, move)
        driven[move.row] = replace(move.event, target=target, via=via)
    return driven


def _call(move: Move, q: Array, end: Array | None = None) -> FunctionCall:
    """Arguments of the correcting function for one target of a move.

    Args:
        q: (6,) joint angles [rad] at the target, or at the circle point of an arc.
        end: (6,) joint angles [rad] at the end of the arc; None if the target is no circle point.
    """
    event = move.event
    welding = event.statement.signature.phase in WELDING
    return FunctionCall(q, event.tool, event.gripload, welding, end, event.in_force.total_load)


def _circle_point(caller: Caller, model: Model, move: Move) -> RobTarget | None:
    """The circle point of a move as the function gives it; None without one."""
    via = move.event.via
    if via is None:
        return None
    q = nearest_solution(model.robot, mounts_of([move]).flange(via_matrix(move.event)[None])[0], move.q)
    if not np.isfinite(q).all():
        return via
    answer = caller.call(_call(move, q, move.q))
    if answer.reason != 0:
        return via
    (pose,) = target_poses([move.event], _on_work([move], answer.pose[None]))
    return replace(via, trans=pose.trans, rot=pose.rot)


def _on_work(moves: Sequence[Move], T_base_tcp: Array) -> Array:
    """Convert TCP poses (n, 4, 4) from the base frame to the frame of the work in each of n moves."""
    mounts = mounts_of(moves)
    return mounts.work(T_base_tcp @ invert(mounts.T_mount_tcp))
