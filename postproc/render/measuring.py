"""RAPID programs that visit poses to be measured, or the set-ups of a plan, and wait there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.identification.planning.setups import BACK, SetupPlan
from postproc.render.templates import environment, fill, load_template
from postproc.robot.arm import Robot

RUN_UP = np.radians(2.0)  # more than any gearbox plays
SETTLE_S = 1.0


def measuring_module(
    robot: Robot,
    q: Array,
    approach: Array | None,
    labels: Sequence[str],
    table: str,
    *,
    payload_kg: Array | None = None,
    extax: Array | None = None,
) -> bytes:
    """Text of a RAPID program that visits poses to be measured and waits at each.

    Args:
        q: (n, 6) joint angles of the poses [rad].
        approach: (n, 6) direction in which each joint travels last, -1, 0 (any) or +1; None if it does not matter.
        labels: (n) name of each pose in the table; table: name of the table.
        payload_kg: (n,) what hangs on the flange; poses with the same payload are visited together.
        extax: (n, 6) external axes [mm], [deg], NaN for axes that are not there.
    """
    side = np.zeros_like(q) if approach is None else np.sign(approach)
    start = np.clip(q - RUN_UP * side, robot.lower, robot.upper)
    load: list[float | None] = [None] * len(q) if payload_kg is None else [float(x) for x in payload_kg]
    order = sorted(range(len(q)), key=lambda i: load[i] or 0.0)
    axes = np.full((len(q), 6), np.nan) if extax is None else extax
    poses = [
        {
            "extax": [f"{value:.3f}" if np.isfinite(value) else "9E9" for value in axes[i]],
            "name": f"j{i + 1:03d}",
            "label": labels[i],
            "joints": q[i],
            "approach": start[i],
            "payload_kg": load[i],
        }
        for i in order
    ]
    template = load_template(environment(), "measuring_module.j2")
    values = {"module": "MeasurePoses", "table": table, "poses": poses, "wait_s": SETTLE_S}
    return (fill(template, values) + "\n").encode("latin-1", "replace")


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
    columns |= {"load": plan.loads, "kg": plan.state.payload_mass, "search": -2e3 * BACK * plan.direction}
    stops = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    values = {"table": table, "stops": stops, "kind": kind, "signal": signal, "wait_s": SETTLE_S}
    values |= {"tool": 1e3 * tool[:3, 3], "turn": Rotation.from_matrix(tool[:3, :3]).as_quat(scalar_first=True)}
    return (fill(load_template(environment(), "setups_module.j2"), values) + "\n").encode("latin-1", "replace")
