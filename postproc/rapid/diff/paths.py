"""Where two programs lead the TCP: the targets of each in the order in which they run, beside those of the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from postproc.rapid.data.events import MotionEvent, StatementKey, executions_of
from postproc.rapid.data.records import RobTarget
from postproc.rapid.diff.compare import by_statement, pair_statements
from postproc.rapid.execution.walk import walk
from postproc.rapid.motions.units import object_matrix
from postproc.rapid.program.program import Program

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Stop:
    """One execution of a motion statement.

    Args:
        line: on which the statement begins.
        point, via: target and circle point [mm] in the frame in which the work objects stand, or in the work object
            where the robot holds that; None where it is not known, or there is none.
        joined: the arm comes here from the stop before.
        partner: number of the execution in the other program that this one is paired with, None without one.
    """

    line: int
    point: Point | None
    via: Point | None
    joined: bool
    partner: int | None


def paired_paths(a: Program, b: Program) -> tuple[list[Stop], list[Stop]]:
    """Return the stops of two programs; statements are paired as `compare_programs` does, and their runs in order."""
    events = walk(a), walk(b)
    pairs = pair_statements(a, b, *map(by_statement, events))
    other = {x.key: y.key for some in pairs.values() for x, y in some if x is not None and y is not None}
    back = {y: x for x, y in other.items()}
    runs = executions_of(events[0]), executions_of(events[1])
    return _stops(events[0], runs[0], runs[1], other), _stops(events[1], runs[1], runs[0], back)


Runs = Mapping[StatementKey, Sequence[int]]
"""Numbers of the events of each statement."""


def _stops(
    events: Sequence[MotionEvent], ours: Runs, theirs: Runs, other: Mapping[StatementKey, StatementKey]
) -> list[Stop]:
    """Return a stop for each event, in order.

    Args:
        ours, theirs: runs of the statements of this program and of the other. other: key of each statement's partner.
    """
    partner: dict[int, int] = {}
    for key, numbers in ours.items():
        if key in other:
            partner |= dict(zip(numbers, theirs.get(other[key], ()), strict=False))
    stops = []
    for i, event in enumerate(events):
        joined = not (event.detached or event.start_unknown or event.resumes_from is not None)
        places = _place(event, event.target), _place(event, event.via)
        stops.append(Stop(event.statement.line, *places, joined, partner.get(i)))
    return stops


def _place(event: MotionEvent, target: object) -> Point | None:
    """Return where a target of an event is [mm]; None for joint angles, and for what is not known."""
    if not isinstance(target, RobTarget):
        return None
    if event.wobj.robhold:
        return target.trans
    T = object_matrix(event.wobj, event.displacement)
    x, y, z = (1e3 * T[:3, 3] + T[:3, :3] @ np.array(target.trans)).tolist()
    return x, y, z
