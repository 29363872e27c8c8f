"""Reflectors that stand beside the arm, on its base or on the floor: what they say of the instrument."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, Severity
from postproc.measure.alignment import turning_point
from postproc.measure.checks.readings import PlacedArm
from postproc.measure.consensus import sessions_of
from postproc.measure.errors import CHANCE
from postproc.measure.measurements import Measurements
from postproc.robot.arm import Robot

FEWEST_READINGS = 4
"""Readings of a reflector from which its rest, or the drift of the instrument, is told."""
TRAVEL_M, STILL = 0.1, 0.02
"""Travel [m] of the flange beside which a reflector stands still, and the share of it that it moves at most."""


def with_references(data: Measurements, robot: Robot, named: Iterable[str]) -> tuple[Measurements, list[Diagnostic]]:
    """Return the measurements with the reflectors that stand beside the arm, and DAT040 on what they say.

    They are those that are named, and those whose points stay in place while the flange travels and does not turn about
    one point of its own (as it does where a tip is held in a hole).

    Args:
        named: by the user, in the column map.
    """
    state = data.state
    if state.reflector is None:
        return data, []
    names, sessions = state.reflector_of_rows, sessions_of(data)
    seen = np.isfinite(data.position).all(axis=1)
    clock = np.arange(len(data)) if state.time is None else state.time
    arm, findings, still = PlacedArm(robot, state.T_reference_base), list[Diagnostic](), set[str]()
    for name in dict.fromkeys(names.tolist()):
        rows = np.flatnonzero(seen & (names == name))
        rows = rows[np.lexsort((clock[rows], sessions[rows]))]
        several = dict.fromkeys(sessions[rows].tolist())
        readings = [data.position[rows[sessions[rows] == session]] for session in several]
        moving = rows[np.isfinite(state.q[rows]).all(axis=1)]
        if name in named or _stays(arm.rows(moving).flange(state.q[moving]), readings):
            still.add(name)
            message, drifts = _verdict(name, readings)
            help_ = "rows before and after it belong to a `session` each; or `postproc diagnose` tries `frame_drift`"
            severity: Severity = "warning" if drifts else "info"
            findings.append(Diagnostic("DAT040", severity, message, data.source, help=help_ if drifts else ""))
    return replace(data, references=frozenset(still)), findings


def _stays(T_base_flange: Array, readings: Sequence[Array]) -> bool:
    """Return whether a reflector stays in place in each session while the flange travels and turns about no point.

    Args:
        T_base_flange: (m, 4, 4) [m] in its rows; readings: (n, 3) measured points [m] of each session.
    """
    R, p = T_base_flange[:, :3, :3], T_base_flange[:, :3, 3]
    if len(p) < FEWEST_READINGS:
        return False
    least = STILL * float(np.linalg.norm(p - np.median(p, axis=0), axis=1).max())
    moves = np.concatenate([np.linalg.norm(y - np.median(y, axis=0), axis=1) for y in readings])
    if least < STILL * TRAVEL_M or np.quantile(moves, 0.9) > least:
        return False
    return turning_point(R, p)[1] > least


def _verdict(name: str, readings: Sequence[Array]) -> tuple[str, bool]:
    """Return a sentence on how far a reflector's readings lie apart, and whether they drift or step in their order.

    Readings that scatter by chance differ from the one before by twice their variance (von Neumann 1941, Ann. Math.
    Stat. 12, 367); of three axes and n readings the ratio over two is 1 with the variance (n - 2) / (3 n^2 - 3).

    Args:
        readings: (n, 3) measured points [m] of each session, in their order.
    """
    some = [y for y in readings if len(y) > 1]
    count, dof = sum(map(len, some)), sum(len(y) - 1 for y in some)
    if not dof:
        return f"reflector `{name}` stands beside the arm, and was read once", False
    away = [y - y.mean(axis=0) for y in some]
    square = sum(float(np.sum(y**2)) for y in away) / (3 * dof)
    steps = sum(float(np.sum(np.diff(y, axis=0) ** 2)) for y in some) / (6 * dof)
    apart = max(float(np.linalg.norm(y, axis=1).max()) for y in away)
    deviations = (1 - steps / max(square, 1e-300)) / np.sqrt(max(count - 2, 1) / (3 * count**2 - 3))
    drifts = count >= FEWEST_READINGS and bool(ndtr(-deviations) < CHANCE)
    where = "in each session " if len(some) > 1 else ""
    text = f"reflector `{name}` stands beside the arm: its {count} readings {where}lie within {1e3 * apart:.3f} mm of "
    text += "their mean"
    if drifts:
        return f"{text}, and follow their order: the instrument moved, or what it or the reflector stands on", True
    return f"{text} ({1e3 * np.sqrt(square):.3f} mm per axis), in no order: the instrument stood still", False
