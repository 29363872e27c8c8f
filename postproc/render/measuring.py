"""A RAPID program that visits poses to be measured, each joint coming from the stated side, and waits there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
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
