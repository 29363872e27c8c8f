"""RAPID programs that visit poses to be measured, or the set-ups of a plan, and wait there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.identification.planning.setups import BACK_OFF, SetupPlan
from postproc.render.templates import environment, fill, load_template
from postproc.robot.arm import Robot

RUN_UP = np.radians(2.0)  # more than any gearbox plays
SETTLE_S = 1.0


def measuring_module(
    robot: Robot, state: State, labels: Sequence[str], table: str, extax: Array | None = None
) -> bytes:
    """Text of a RAPID program that visits poses to be measured and waits at each.

    Args:
        state: n poses, whose approach sides are the direction in which each joint travels last, -1, 0 (any) or +1, and
            whose payload hangs on the flange; poses with the same payload are visited together.
        labels: (n) name of each pose in the table; table: name of the table.
        extax: (n, 6) external axes [mm], [deg], NaN for axes that are not there.
    """
    q, n = state.q, len(state)
    side = np.zeros_like(q) if state.approach is None else np.sign(state.approach)
    start = np.clip(q - RUN_UP * side, robot.lower, robot.upper)
    axes = np.full((n, 6), np.nan) if extax is None else extax
    cells = [[f"{value:.3f}" if np.isfinite(value) else "9E9" for value in row] for row in axes]
    loads = [None] * n if state.payload_mass is None else state.payload_mass.tolist()
    columns = {"name": [f"j{i + 1:03d}" for i in range(n)], "label": labels, "joints": q, "approach": start}
    poses = sorted(_rows(columns | {"payload_kg": loads, "extax": cells}), key=lambda pose: pose["payload_kg"] or 0.0)
    return _filled("measuring_module", {"module": "MeasurePoses", "table": table, "poses": poses, "wait_s": SETTLE_S})


def setups_module(plan: SetupPlan, table: str, signal: str) -> bytes:
    """Text of a RAPID program that stops at each set-up of a plan for what is to be done there.

    At a gauge it stops for the zero without the load and for the reading with it. Tips are touched by jogging, planes
    by a search; the program then writes the joint angles of each touch into the table itself, on the controller.

    Args:
        table: name of the table. signal: digital input of the search that says when a plane is touched.
    """
    robot, kind, tool = plan.model.robot, plan.kind, plan.model.T_flange_tcp
    run_up = np.clip(plan.begin - RUN_UP, robot.lower, robot.upper)
    columns = {"id": plan.ids, "words": plan.words, "name": plan.names, "joints": plan.begin, "approach": run_up}
    columns |= {"load": plan.loads, "kg": plan.state.payload_mass, "search": -2e3 * BACK_OFF * plan.direction}
    values = {"table": table, "stops": _rows(columns), "kind": kind, "signal": signal, "wait_s": SETTLE_S}
    values |= {"tool": 1e3 * tool[:3, 3], "turn": Rotation.from_matrix(tool[:3, :3]).as_quat(scalar_first=True)}
    return _filled("setups_module", values)


def _rows(columns: Mapping[str, Sequence[Any] | Array]) -> list[dict[str, Any]]:
    """Return columns of n values as n rows by the names of the columns."""
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _filled(template: str, values: Mapping[str, Any]) -> bytes:
    """Return the text of a template of a module."""
    return (fill(load_template(environment(), f"{template}.j2"), values) + "\n").encode("latin-1", "replace")
