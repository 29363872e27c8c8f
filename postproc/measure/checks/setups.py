"""What is likely wrong with readings of tips and gauges: names, directions, units, single readings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import GRAVITY, Array
from postproc.diagnostics import Diagnostic
from postproc.measure.kinds.observed import KINDS, rows_of
from postproc.measure.measurements import Measurements
from postproc.measure.read.cells import Cells
from postproc.robot.arm import Robot
from postproc.robot.kinematics import forward, jacobian

APART_M = 0.010
"""Distance by which rows of one tip lie apart that no arm explains."""
SAME_RAD = 1e-4
LEAST_CHANGE_M = 1e-4
"""Change of a reading under load below which its sign and its size say nothing."""
TIMES_TYPE = 12.0
"""So many times as soft, or as stiff, as its type no arm is."""
SURE = 0.1
"""Share of the joints' deflections that may go the other way where the sign of their sum is sure."""
ROUNDS = 30
FEWEST_CHANGES = 6
"""Changes under load from which on one that differs from the others stands out; at most one in so many may."""
DIAL_M, LOOSE = 2e-5, 0.7
"""Usual miss [m] of a change, and deviation of the logarithm of a compliance about its type's."""


Odd = tuple[Diagnostic, NDArray[np.intp]]
"""A finding, and the rows that are not used for it."""


def check_setups(data: Measurements, robot: Robot, cells: Cells) -> tuple[list[Diagnostic], frozenset[tuple[int, int]]]:
    """Return findings about rows of tips and gauges, and rows (0, number) that cannot have been read as they say."""
    odd, changes = [*_check_tips(data, robot, cells)], _changes(data, robot)
    if changes is not None:
        sizes = [*_check_sizes(changes, robot, cells)]
        turned = [] if sizes else [*_check_signs(changes, data, cells)]
        strays = [] if sizes else _check_strays(changes.without([i for _, rows in turned for i in rows]), data, cells)
        odd += [*sizes, *turned, *strays]
    wrong = frozenset((0, data.row[int(i)]) for _, rows in odd for i in rows)
    return [finding for finding, _ in odd], wrong


def _check_tips(data: Measurements, robot: Robot, cells: Cells) -> Iterator[Odd]:
    """Yield DAT041 for rows of a tip that touch another point than most rows of it.

    With p and R the nominal flange and t the TCP on it, p + R t = c in every row: c and t of least absolute misses.
    """
    tips = rows_of(data.state, KINDS[0])
    tips = tips[data.usable[tips]]
    if not len(tips):
        return
    T = forward(robot, data.state.q[tips])
    names, which = np.unique(np.asarray(data.state.setup)[tips], return_inverse=True)
    columns = np.zeros((len(tips), 3, 3 + 3 * len(names)))
    columns[:, :, :3] = T[:, :3, :3]
    for k in range(3):
        columns[np.arange(len(tips)), k, 3 + 3 * which + k] = -1.0
    if 3 * len(tips) < 2 * columns.shape[2]:
        return
    weight = np.ones(len(tips))
    for _ in range(ROUNDS):
        A, y = columns * weight[:, None, None], -T[:, :3, 3] * weight[:, None]
        x = np.linalg.lstsq(A.reshape(-1, columns.shape[2]), y.ravel(), rcond=1e-9)[0]
        off = np.linalg.norm(columns @ x + T[:, :3, 3], axis=1)
        weight = 1.0 / np.sqrt(np.maximum(off, 1e-4))
    for k, name in enumerate(names):
        at = which == k
        far = tips[at & (off > max(APART_M, 10 * float(np.median(off[at]))))]
        if 2 * len(far) > at.sum() or np.median(off[at]) > APART_M:
            message = f"the rows of `{data.state.setup_names[int(name)]}` touch no common point: half of them lie over "
            message += f"{1e3 * np.median(off[at]):.0f} mm from any"
            help_ = "give each point that was touched a name of its own, and check the arm's name"
            yield cells.finding("DAT041", "error", message, help_, int(tips[at][0])), tips[:0]
        elif len(far):
            listed = ", ".join(str(data.row[i]) for i in far[:5]) + (", .." if len(far) > 5 else "")
            message = f"rows {listed} lie over {1e3 * APART_M:.0f} mm from the point of "
            message += f"`{data.state.setup_names[int(name)]}` that its other rows touch: was it another one?"
            help_ = "give another point a name of its own; until then these rows are not used"
            yield cells.finding("DAT041", "warning", message, help_, int(far[0])), far


@dataclass(frozen=True)
class LoadChanges:
    """What gauges show of loads: changes from the first row of a set-up in which the arm stands still.

    Args:
        row: (m,) index of the loaded row. change: (m,) of the reading [m]. by_joint: (m, 6) what the springs of the
            type give of it [m].
    """

    row: NDArray[np.intp]
    change: Array
    by_joint: Array

    def without(self, rows: Sequence[int]) -> LoadChanges:
        """Return the changes but for those of some rows."""
        kept = ~np.isin(self.row, rows)
        return LoadChanges(self.row[kept], self.change[kept], self.by_joint[kept])


def _changes(data: Measurements, robot: Robot) -> LoadChanges | None:
    """Return the changes of gauges under load; None where there are none, or the arm's stiffness is not known."""
    state, readings = data.state, data.readings
    gauges = [i for kind in KINDS if kind.column == "gauge" for i in rows_of(state, kind) if data.usable[i]]
    if readings is None or robot.joint_compliance is None or state.payload_mass is None or not gauges:
        return None
    first: dict[int, int] = {}
    pairs = []
    for i in gauges:
        start = first.setdefault(int(np.asarray(state.setup)[i]), i)
        if start != i and np.abs(state.q[i] - state.q[start]).max() < SAME_RAD:
            pairs.append((start, i))
    if not pairs:
        return None
    before, row = np.array(pairs).T
    torque = np.zeros((len(row), 6))
    for rows, sign in ((row, 1.0), (before, -1.0)):
        centre = np.zeros((len(rows), 3)) if state.payload_center is None else state.payload_center[rows]
        T = np.tile(np.eye(4), (len(rows), 1, 1))
        T[:, :3, 3] = centre
        torque -= sign * (state.payload_mass[rows] * GRAVITY)[:, None] * jacobian(robot, state.q[rows], T)[:, 2]
    tool = state.T_flange_tcp if state.T_flange_tcp.ndim == 2 else state.T_flange_tcp[row]
    moved = np.einsum("mi,mij->mj", readings.direction[row], jacobian(robot, state.q[row], tool)[:, :3])
    change = readings.numbers[row, 0] - readings.numbers[before, 0]
    return LoadChanges(row, change, moved * torque * robot.joint_compliance)


def _check_sizes(changes: LoadChanges, robot: Robot, cells: Cells) -> Iterator[Odd]:
    """Yield DAT009 where readings change many times more, or less, than loads can make the arm give."""
    predicted = changes.by_joint.sum(axis=1)
    clear = np.abs(predicted) > LEAST_CHANGE_M
    if not clear.any():
        return
    times = float(np.median(np.abs(changes.change[clear]) / np.abs(predicted[clear])))
    if 1 / TIMES_TYPE < times < TIMES_TYPE:
        return
    message = f"the gauges change under load by {times:.3g} times what `{robot.name}` gives by its type's stiffness"
    help_ = "is `reading_mm` in hundredths, or `payload_kg` in another unit? state it in a column map (`factor`)"
    yield cells.finding("DAT009", "error", message, help_, int(changes.row[clear][0])), changes.row[:0]


def _check_signs(changes: LoadChanges, data: Measurements, cells: Cells) -> Iterator[Odd]:
    """Yield DAT041, with rows that are not used, where a gauge moves against its load whatever the springs are like."""
    total = np.abs(changes.by_joint).sum(axis=1)
    against = np.minimum(np.maximum(changes.by_joint, 0).sum(axis=1), np.maximum(-changes.by_joint, 0).sum(axis=1))
    sure = (against < SURE * total) & (total > LEAST_CHANGE_M) & (np.abs(changes.change) > LEAST_CHANGE_M)
    turned = sure & (np.sign(changes.change) != np.sign(changes.by_joint.sum(axis=1)))
    if not turned.any():
        return
    rows = changes.row[turned]
    setups = dict.fromkeys(data.state.setup_of_rows[rows].tolist())
    message = f"{', '.join(f'`{name}`' for name in setups)} read against the load: the direction `nx`, `ny`, `nz`, "
    message += "or the order of their readings, is the other way round"
    if turned.sum() == sure.sum() and turned.sum() > 1:
        help_ = "turn the sign of all directions, or of all readings"
        yield cells.finding("DAT041", "error", message, help_, int(rows[0])), rows
    else:
        help_ = "turn the sign of `nx`, `ny`, `nz` there; until then these rows are not used"
        yield cells.finding("DAT041", "warning", message, help_, int(rows[0])), rows


def _check_strays(changes: LoadChanges, data: Measurements, cells: Cells) -> Iterator[Odd]:
    """Yield DAT041, with rows that are not used, where single changes suit no springs that suit the others.

    The springs are those of least absolute misses, their logarithms near those of the type.
    """
    from scipy.optimize import least_squares

    if len(changes.row) < FEWEST_CHANGES:
        return

    def misses(x: Array) -> Array:
        off = (changes.by_joint @ np.exp(x) - changes.change) / DIAL_M
        return np.concatenate([off, x / LOOSE])

    best = least_squares(misses, np.zeros(6), loss="soft_l1", max_nfev=200).x
    off = np.abs(changes.by_joint @ np.exp(best) - changes.change)
    far = np.flatnonzero(off > np.maximum(LEAST_CHANGE_M, 10 * np.median(off)) + 0.5 * np.abs(changes.change - off))
    for k in far if len(far) <= len(off) // FEWEST_CHANGES else ():
        row = int(changes.row[k])
        message = f"`{data.state.setup_of_rows[row]}` changes by {1e3 * changes.change[k]:.3f} mm under load, "
        message += f"{1e3 * off[k]:.3f} mm from what suits the other readings: a turn of the dial is often 1 mm"
        help_ = "read it again; until then this row is not used"
        yield cells.finding("DAT041", "warning", message, help_, row), np.array([row])
