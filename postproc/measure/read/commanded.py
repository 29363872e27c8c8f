"""Commanded joint angles from commanded poses, or from the program that was run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Matter, PostprocError, Source
from postproc.measure.read.lookup import Table
from postproc.motion.path.places import UNKNOWN_AXES, place_events, unit_of
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import JointTarget, RobTarget
from postproc.rapid.execution.walk import walk
from postproc.rapid.motions.units import flange_matrix, tool_matrix
from postproc.rapid.program.program import read_program
from postproc.rapid.program.spelling import if_not, meant_name
from postproc.robot.arm import Robot
from postproc.robot.cells.station import Station
from postproc.robot.inverse import joint_solution
from postproc.robot.pose import transform

LARGEST_UNREACHED_SHARE = 0.2
"""Share of poses that cannot be reached beyond which the table does not mean what it says."""


def commanded_joints(
    robot: Robot, position: Array, rotation: Array, configuration: Array | None, table: Table
) -> Array:
    """Return joint angles (n, 6) [rad] of commanded flange poses by the controller's nominal inverse kinematics.

    Args:
        position: (n, 3) [m] and rotation: (n, 3, 3) of tool0 in the base.
        configuration: (n, 4) cf1, cf4, cf6, cfx; zeros where None.
        table: for places in the file; its findings get DAT012 for rows that the arm cannot reach.

    Such rows become NaN.

    Raises:
        PostprocError: DAT012 where they are more than a fifth of all rows.
    """
    T = transform(position, rotation)
    wanted = np.zeros((len(T), 4)) if configuration is None else np.nan_to_num(configuration)
    solution = joint_solution(robot, T, np.rint(wanted).astype(np.int64))
    failures = [failure for failure in solution.failures if np.isfinite(T[failure.index]).all()]
    if len(failures) > LARGEST_UNREACHED_SHARE * len(T):
        message = f"{len(failures)} of {len(T)} commanded poses cannot be reached in their configuration"
        help_ = "`cmd_` is the pose of the flange (tool0) in the base, in mm: are these of the TCP, in a work object, "
        help_ += f"in metres? Does `cmd_qw` come first? Row {failures[0].index + 1}: {failures[0].message}"
        raise PostprocError.of("DAT012", message, table.cells.source, table.cells.span(failures[0].index), help_)
    for failure in failures:
        message = f"row {failure.index + 1}: {failure.message}"
        help_ = failure.help or "check the units, the tool (commanded poses are of tool0) and cf1, cf4, cf6, cfx"
        table.diagnostics.append(table.cells.finding("DAT012", "warning", message, help_, failure.index))
    return solution.q


@dataclass(frozen=True)
class Commanded:
    """What was commanded, row by row.

    Args:
        q: (n, 6) joint angles [rad]; T_flange_tcp: (n, 4, 4) tools, None where nobody tells them.
        extax: (n, 6) external axes as the program states them, mm and deg; None where no program does.
    """

    q: Array
    T_flange_tcp: Array | None = None
    extax: Array | None = None


def program_targets(table: Table, program: Source | Sequence[Source], robot: Robot, station: Station) -> Commanded:
    """Return joint angles, tools and external axes of the program's targets that the table names in column ``target``.

    Pose, work object, displacement, tool and configuration are those in force where the program moves to the target.

    Raises:
        PostprocError: DAT012 where a target is not in the program; RAP020 and its like where a tool or a work object of
            such a motion is declared in no file.
    """
    target, cells, diagnostics = table.text("target"), table.cells, table.diagnostics
    events = _visited(program, station)
    missing = [i for i, name in enumerate(target) if name.lower() not in events]
    if missing:
        names = ", ".join(sorted({f"`{target[i]}`" for i in missing})[:5])
        message = f"the program does not move to {names}"
        help_ = "name the module that was run, and targets as they stand in its motion statements"
        help_ = if_not(meant_name(target[missing[0]], events), help_)
        raise PostprocError.of("DAT012", message, cells.source, cells.span(missing[0]), help_)
    visited = [events[name.lower()] for name in target]
    unknown = dict.fromkeys(d for event in visited for d in event.diagnostics if d.severity == "error")
    if unknown:
        help_ = "give the module that declares it (user.sys, CalibData.mod) beside the program: `--with`"
        raise PostprocError([replace(d, help=help_) if d.matter is Matter.UNDECLARED else d for d in unknown])
    T_flange_tcp = np.array([tool_matrix(event.tool) for event in visited])
    q, extax = np.full((len(visited), 6), np.nan), np.array([event.axes or UNKNOWN_AXES for event in visited])
    free = [i for i, event in enumerate(visited) if isinstance(event.target, RobTarget)]
    for i, event in enumerate(visited):
        if isinstance(event.target, JointTarget):
            q[i] = np.radians(event.target.robax)
    if free:
        # What holds the work stands in the base where the axes have it.
        positions = station.positions(extax)
        T = np.array([station.frame(unit_of(visited[i]), positions[i])[0] @ flange_matrix(visited[i]) for i in free])
        conf = np.array([visited[i].target.robconf for i in free])  # type: ignore[union-attr]
        solution = joint_solution(robot, T, conf)
        q[free] = solution.q
        for failure in solution.failures:
            row = free[failure.index]
            message = f"row {row + 1}, `{target[row]}`: {failure.message}"
            diagnostics.append(cells.finding("DAT012", "warning", message, failure.help, row))
    return Commanded(q, T_flange_tcp, extax)


def _visited(program: Source | Sequence[Source], station: Station) -> dict[str, MotionEvent]:
    """Return the first motion to every named target of a program, by the target's name in lower case."""
    events: dict[str, MotionEvent] = {}
    for event in place_events(walk(read_program(program)), station):
        argument = event.statement.argument("to")
        if argument is not None and event.target is not None:
            events.setdefault(argument.text.strip().lower(), event)
    return events
