"""Commanded joint angles from commanded poses, or from the program that was run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.measure.cells import Cells
from postproc.robot.arm import Robot
from postproc.robot.inverse import joint_solution
from postproc.robot.pose import transform


def commanded_joints(
    robot: Robot,
    position: Array,
    rotation: Array,
    configuration: Array | None,
    cells: Cells,
    diagnostics: list[Diagnostic],
) -> Array:
    """Joint angles [rad] (n, 6) that the controller's nominal inverse kinematics gives for commanded flange poses.

    Args:
        position: (n, 3) [m] and rotation: (n, 3, 3) of tool0 in the base; configuration: (n, 4) cf1, cf4, cf6, cfx.

    A row that the arm cannot reach is reported as DAT012 and becomes NaN.
    """
    T = transform(position, rotation)
    wanted = np.zeros((len(T), 4)) if configuration is None else np.nan_to_num(configuration)
    solution = joint_solution(robot, T, np.rint(wanted).astype(np.int64))
    for failure in solution.failures:
        if np.isfinite(T[failure.index]).all():
            message = f"row {failure.index + 1}: {failure.message}"
            help_ = failure.help or "check the units, the tool (commanded poses are of tool0) and cf1, cf4, cf6, cfx"
            span = cells.span(failure.index)
            diagnostics.append(Diagnostic("DAT012", "warning", message, cells.source, span, help_))
    return solution.q


def program_targets(program: Source, robot: Robot, target: Sequence[str], cells: Cells) -> tuple[Array, Array]:
    """Joint angles [rad] (n, 6) and tools (n, 4, 4) of the robtargets that a program visits, by name.

    Raises:
        PostprocError: DAT012 where a target is not in the program.
    """
    raise PostprocError(Diagnostic("DAT012", "error", "not yet", program))
