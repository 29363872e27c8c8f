"""What a module makes of the targets of a program that are known: its function run as the controller runs it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array, invert
from postproc.compensate.text.requests import conf_of
from postproc.compensate.text.values import Conf
from postproc.diagnostics import Source
from postproc.grouping import grouped
from postproc.model.arm import Model
from postproc.motion.path.moves import read_moves
from postproc.motion.values import Move, mounts_of
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import LoadData, RobTarget
from postproc.rapid.motions.units import target_poses, tool_matrix, via_matrix
from postproc.robot.inverse import nearest_solution
from postproc.robot.kinematics import forward
from postproc.robot.pose import transform
from postproc.runtime.programs.statements import CORRECTED, CORRECTED_CIRCLE, WELDING
from postproc.runtime.proof.check import Controller
from postproc.runtime.proof.execution import Execution
from postproc.runtime.proof.lanes import SINGLE, Value

PAYLOAD, REASON = "pppayload", "ppreason"
NO_TOOL = 2  # `ppReason` of a tool that the robot does not hold


@dataclass(frozen=True)
class Applied:
    """Events with the targets that the function gives.

    Args:
        corrected: number of executions whose target it corrects; returned: those that come back, by `ppReason`.
    """

    events: Sequence[MotionEvent]
    corrected: int
    returned: Mapping[int, int]


def apply_module(
    module: Source, model: Model, events: Sequence[MotionEvent], chosen: Set[int], free_axes: str = ""
) -> Applied:
    """Run the function on the targets of chosen events, in single precision; other targets stay.

    Args:
        events: all of a program. chosen: which of them go through the function. free_axes: see ``read_moves``.

    Raises:
        PostprocError: RUN003, the module holds what cannot be calculated.
    """
    moves, _ = read_moves(model.robot, events, free_axes, model.station)
    mine = [m for m in moves if m.row in chosen and m.again is None and isinstance(m.event.target, RobTarget)]
    held = [m for m in mine if m.event.tool.robhold and not m.event.wobj.robhold]
    given = list(events)
    reasons = Counter({NO_TOOL: len(mine) - len(held)})
    for group in grouped((_options(m.event), m) for m in held).values():
        welding = group[0].event.statement.signature.phase in WELDING
        q = np.array([m.q for m in group])
        run = _Run(module, model, [m.event for m in group], q, welding)
        T, conf, reason = run.corrected(q)
        reasons.update(reason.tolist())
        poses = target_poses([m.event for m in group], _on_work(group, T))
        for move, pose, axes, why in zip(group, poses, conf, reason, strict=True):
            target = move.event.target
            assert isinstance(target, RobTarget)
            if why == 0:
                target = replace(target, trans=pose.trans, rot=pose.rot, robconf=axes)
            given[move.row] = replace(move.event, target=target)
        for move, via in _circle_points(run, model, group):
            given[move.row] = replace(given[move.row], via=via)
    corrected = reasons.pop(0, 0)
    return Applied(given, corrected, {why: times for why, times in sorted(reasons.items()) if times})


@dataclass(frozen=True)
class _Run:
    """Calls of a module for several events at once, with the options of one.

    Args:
        q: (n, 6) nominal joint angles at their targets [rad].
    """

    module: Source
    model: Model
    events: Sequence[MotionEvent]
    q: Array
    welding: bool

    def corrected(self, near: Array, circle: Sequence[int] | None = None) -> tuple[Array, list[Conf], Array]:
        """Targets T_base_tcp (n, 4, 4) [m] that the function gives, their configurations, and `ppReason` (n,).

        Args:
            near: (n, 6) joint angles of what is asked for, the targets or the circle points [rad].
            circle: the events whose circle points are asked for; None for the targets of all.
        """
        rows = list(range(len(self.events))) if circle is None else list(circle)
        events = [self.events[row] for row in rows]
        frames = np.array([_frame(e) for e in events])
        controller = Controller(self.model, near)
        run = Execution(self.module, len(events), controller.functions())
        if PAYLOAD in run.data:
            run.data[PAYLOAD].value = _load([e.gripload for e in events])
        robot = self.model.robot
        ends = controller.target(forward(robot, self.q[rows]) @ frames, self.q[rows])
        asked = [ends] if circle is None else [controller.target(forward(robot, near) @ frames, near), ends]
        name = CORRECTED if circle is None else CORRECTED_CIRCLE
        options: dict[str, Value] = {"weld": run.everywhere} if self.welding else {}
        totals = [e.in_force.total_load for e in events if e.in_force.total_load is not None]
        if totals:  # then all of them have it
            options["tload"] = _load(totals)
        answer, raised = run.call(name, [*asked, _tools(events, frames)], options)
        reason = np.where(raised, -1, np.asarray(run.data[REASON].value)).astype(int)
        trans, rot, conf, *_ = answer or asked[0]
        T = transform(1e-3 * np.array(trans, dtype=float).T, controller.rotation(rot))
        confs = [conf_of(row) for row in np.array(conf, dtype=float).T.round().astype(int)]
        return T, confs, reason


def _circle_points(run: _Run, model: Model, group: Sequence[Move]) -> list[tuple[Move, RobTarget]]:
    """The circle points of moves as the function gives them, where it corrects them."""
    near, rows = [], []
    for row, move in enumerate(group):
        if move.event.via is None:
            continue
        flange = mounts_of([move]).flange(via_matrix(move.event)[None])[0]
        q = nearest_solution(model.robot, flange, move.q)
        if np.isfinite(q).all():
            near.append(q)
            rows.append(row)
    if not rows:
        return []
    T, _, reason = run.corrected(np.array(near), rows)
    moved = [group[row] for row in rows]
    poses = target_poses([m.event for m in moved], _on_work(moved, T))
    found = []
    for row, pose, why in zip(rows, poses, reason.tolist(), strict=True):
        via = group[row].event.via
        if why == 0 and via is not None:
            found.append((group[row], replace(via, trans=pose.trans, rot=pose.rot)))
    return found


def _on_work(moves: Sequence[Move], T_base_tcp: Array) -> Array:
    """Poses (n, 4, 4) in the frames in which the work of moves stands."""
    mounts = mounts_of(moves)
    return mounts.work(T_base_tcp @ invert(mounts.T_mount_tcp))


def _options(event: MotionEvent) -> tuple[bool, bool]:
    r"""Which options the call of an event has: ``\Weld``, ``\TLoad``."""
    return event.statement.signature.phase in WELDING, event.in_force.total_load is not None


def _frame(event: MotionEvent) -> Array:
    return tool_matrix(event.tool)


def _tools(events: Sequence[MotionEvent], frames: Array) -> Value:
    """Tooldata by lane."""
    rots = np.array([e.tool.tframe.rot for e in events])
    pose = [_lanes(1e3 * frames[:, :3, 3]), _lanes(rots)]
    return [np.array([e.tool.robhold for e in events]), pose, _load([e.tool.tload for e in events])]


def _load(loads: Sequence[LoadData]) -> Value:
    """Loaddata by lane; the function reads mass and centre alone."""
    count = len(loads)
    aom = _lanes(np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)))
    inertia = [np.zeros(count, dtype=SINGLE) for _ in range(3)]
    return [
        _lanes(np.array([[load.mass] for load in loads]))[0],
        _lanes(np.array([load.cog for load in loads])),
        aom,
        *inertia,
    ]


def _lanes(rows: Array) -> list[Value]:
    return [column.astype(SINGLE) for column in np.asarray(rows, dtype=float).T]
