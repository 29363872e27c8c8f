"""What is likely wrong with touches of tips: rows of one name that touch several points."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import Diagnostic
from postproc.measure.kinds.observed import kind_of, rows_of
from postproc.measure.kinds.tip import Tip
from postproc.measure.measurements import Measurements
from postproc.measure.read.cells import Cells
from postproc.robot.arm import Robot
from postproc.robot.kinematics import forward

APART_M = 0.010
"""Distance by which rows of one tip lie apart that no arm explains."""
REWEIGHTINGS = 30

Odd = tuple[Diagnostic, NDArray[np.intp]]
"""A finding, and the rows that are not used for it."""


def check_tips(data: Measurements, robot: Robot, cells: Cells) -> Iterator[Odd]:
    """Yield DAT041 for rows of a tip that touch another point than most rows of it.

    With p and R the nominal flange and t the TCP on it, p + R t = c in every row: c and t of least absolute misses.
    """
    tips = rows_of(data.state, kind_of(Tip.column))
    tips = tips[data.usable[tips]]
    if not len(tips):
        return
    T = forward(robot, data.state.q[tips])
    names, which = np.unique(np.asarray(data.state.setup)[tips], return_inverse=True)
    columns = np.concatenate([T[:, :3, :3], -np.kron(np.eye(len(names))[which, None], np.eye(3))], axis=2)
    if 3 * len(tips) < 2 * columns.shape[2]:
        return
    weight = np.ones(len(tips))
    for _ in range(REWEIGHTINGS):
        A, y = columns * weight[:, None, None], -T[:, :3, 3] * weight[:, None]
        x = np.linalg.lstsq(A.reshape(-1, columns.shape[2]), y.ravel(), rcond=1e-9)[0]
        off = np.linalg.norm(columns @ x + T[:, :3, 3], axis=1)
        weight = 1.0 / np.sqrt(np.maximum(off, 1e-4))
    for k, name in enumerate(data.state.setup_names[i] for i in names):
        at = which == k
        typical = float(np.median(off[at]))
        far = tips[at & (off > max(APART_M, 10 * typical))]
        if 2 * len(far) > at.sum() or typical > APART_M:
            message = f"the rows of `{name}` touch no common point: half of them lie over "
            message += f"{1e3 * typical:.0f} mm from any"
            help_ = "give each point that was touched a name of its own, and check the arm's name"
            yield cells.finding("DAT041", "error", message, help_, int(tips[at][0])), tips[:0]
        elif len(far):
            listed = ", ".join(str(data.row[i]) for i in far[:5]) + (", .." if len(far) > 5 else "")
            message = f"rows {listed} lie over {1e3 * APART_M:.0f} mm from the point of `{name}` "
            message += "that its other rows touch: was it another one?"
            help_ = "give another point a name of its own; until then these rows are not used"
            yield cells.finding("DAT041", "warning", message, help_, int(far[0])), far
