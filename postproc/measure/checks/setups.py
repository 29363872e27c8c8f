"""What is likely wrong with readings of gauges: directions, units, single readings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import Diagnostic, Matter, Severity, joined
from postproc.measure.checks.tips import Odd, check_tips
from postproc.measure.kinds.gauge import Gauge
from postproc.measure.kinds.observed import kind_of, rows_of
from postproc.measure.measurements import Measurements
from postproc.measure.read.cells import Cells
from postproc.measure.read.setups import scale_step
from postproc.robot.arm import Robot
from postproc.robot.kinematics import jacobian
from postproc.robot.pose import transform

SAME_RAD = 1e-4
LEAST_CHANGE_M = 1e-4
"""Change of a reading under load below which its sign and its size say nothing."""
TIMES_TYPE = 12.0
"""So many times as soft, or as stiff, as its type no arm is."""
APART_M = 0.1
"""Distance of hung loads from the TCP that is worth a word where readings contradict each other."""
SURE = 0.1
"""Share of the joints' deflections that may go the other way where the sign of their sum is sure."""
FEWEST_CHANGES, FEWEST_LEFT = 6, 4
"""At most one change in so many is taken to be wrong, or one of fewer where so many remain."""
DIAL_M, SHARE, COMPLIANCE_LOG = 2e-5, 0.02, 0.7
"""Usual miss of a change, in metres and as a share of it, and deviation of the logarithm of a compliance."""
STRAY, NEARLY = 5.0, 2.0
"""Deviations by which a wrong change misses what the others predict, and by which another one is less likely wrong."""
REPEATED, REPEATED_SHARE = 3.0, 0.01
"""Readings of one state differ by at most so many times the miss of a change and a share of it together."""
MOST_NAMED, MOST_READ = 3, 4
"""Set-ups that a finding names one by one, and readings of one state."""
CONTRADICTION = 3.0
"""Usual misses that changes have in the mean where more than single ones of them are wrong."""
MOST_TRIED = 8
"""Changes that are tried as the wrong one: those that miss most."""


def check_setups(
    data: Measurements, robot: Robot, cells: Cells, tool: Array | None = None
) -> tuple[list[Diagnostic], frozenset[tuple[int, int]]]:
    """Return findings about rows of tips and gauges, and rows (0, number) that cannot have been read as they say.

    Args:
        tool: (4, 4) what gauges touch, in tool0, where the rows do not say it; None for the flange.
    """
    at = data.state.T_flange_tcp if data.tool_known or tool is None else np.broadcast_to(tool, (len(data), 4, 4))
    state_of = _states(data.state)
    odd = [
        *check_tips(data, robot, cells),
        *_check_zeros(data, state_of, cells),
        *_check_repeated(data, state_of, cells),
    ]
    usable = data.usable.copy()
    for _, rows in odd:
        usable[rows] = False
    changes = _changes(data, robot, at, state_of, usable)
    if changes is not None:
        findings = [*_check_sizes(changes, robot, cells)] or [*_check_single(changes, data, cells)]
        odd += [(finding, np.flatnonzero(np.isin(state_of, state_of[rows]))) for finding, rows in findings]
        if not odd:
            odd += _check_once(changes, data, state_of, cells)
    wrong = frozenset((0, data.row[int(i)]) for _, rows in odd for i in rows)
    return [finding for finding, _ in odd], wrong


@dataclass(frozen=True)
class LoadChanges:
    """What gauges show of loads: changes from the first row of a set-up in which the arm stands still.

    Args:
        row: (m,) index of the loaded row. change: (m,) of the reading [m]. by_joint: (m, 6) what the springs of the
            type give of it [m]. apart: usual distance of a hung load from what the gauges touch [m].
    """

    row: NDArray[np.intp]
    change: Array
    by_joint: Array
    apart: float = 0.0

    def some(self, index: NDArray[np.bool_] | NDArray[np.intp]) -> LoadChanges:
        """Return some of the changes, by a mask or by indices."""
        return LoadChanges(self.row[index], self.change[index], self.by_joint[index], self.apart)


def _states(state: State) -> NDArray[np.intp]:
    """Return (n,) the same number for rows of one set-up, at the same posture, reached alike, under the same loads."""
    parts = [np.asarray(state.setup, dtype=float)[:, None], _posture(state)]
    for channel in (state.approach, state.payload_mass, state.payload_center, state.wrench):
        parts += [] if channel is None else [channel.reshape(len(state), -1)]
    return np.asarray(np.unique(np.nan_to_num(np.hstack(parts)).round(6), axis=0, return_inverse=True)[1].ravel())


def _check_zeros(data: Measurements, state_of: NDArray[np.intp], cells: Cells) -> Iterator[Odd]:
    """Yield DAT041 where set-ups of gauges were read in one state alone; an error where no other row says anything.

    Args:
        state_of: (n,) number of the state of each row.
    """
    setup, gauges = np.asarray(data.state.setup), rows_of(data.state, kind_of(Gauge.column))
    gauges = gauges[data.usable[gauges]]
    alone = [rows for k in np.unique(setup[gauges]) if not np.ptp(state_of[rows := gauges[setup[gauges] == k]])]
    if not alone:
        return
    rows = np.concatenate(alone)
    names = [f"`{data.state.setup_of_rows[each[0]]}`" for each in alone]
    listed = joined(names) if len(names) <= MOST_NAMED else f"{len(names)} set-ups of gauges"
    message = f"{listed} {'were' if names[1:] else 'was'} read in one state alone: how far the arm gives is not known"
    help_ = f"fill in `{Gauge.reading[0]}` without the load and with it; write 0 where the gauge was set to zero"
    severity: Severity = "error" if len(rows) == data.usable.sum() else "warning"
    yield cells.finding("DAT041", severity, message, help_, int(rows[0])), rows[:0]


def _check_repeated(data: Measurements, state_of: NDArray[np.intp], cells: Cells) -> Iterator[Odd]:
    """Yield DAT041, with rows that are not used, where readings of one state of a standing arm differ.

    Of three or more, those far from the median are wrong; of two, nobody knows which.

    Args:
        state_of: (n,) number of the state of each row.
    """
    setup, gauges = np.asarray(data.state.setup), rows_of(data.state, kind_of(Gauge.column))
    gauges = gauges[data.usable[gauges]]
    if data.readings is None:
        return
    value = data.readings.numbers[:, 0]
    q = _posture(data.state)
    sets = [rows for k in np.unique(setup[gauges]) if _stands(q[rows := gauges[setup[gauges] == k]])]
    states = [[rows[state_of[rows] == state] for state in np.unique(state_of[rows])] for rows in sets]
    usual = _usual_miss(value[gauges], [value[same] for some in states for same in some if len(same) > 1])
    for some in states:
        middle = [float(np.median(value[same])) for same in some]
        allowed = REPEATED * np.hypot(usual, REPEATED_SHARE * np.ptp(middle))
        for same, at in zip(some, middle, strict=True):
            far = same[np.abs(value[same] - at) > (allowed if len(same) > 2 else allowed / 2)]
            if not len(far):
                continue
            far = far if 2 * len(far) < len(same) else same
            several = len(same) > MOST_READ  # then those that are far, beside the median
            read = joined([f"{1e3 * value[i]:.3f} (row {data.row[i]})" for i in (far if several else same)[:MOST_READ]])
            message = f"`{data.state.setup_of_rows[same[0]]}` reads {read} mm in one state"
            message += f", and {1e3 * at:.3f} mm in the median of {len(same)} readings" * several
            message += ": one of them was misread, or the gauge has moved"
            numbers = joined([str(data.row[i]) for i in far])
            help_ = f"correct what is wrong, or read that set-up again; until then row{'s' * (len(far) > 1)} {numbers} "
            help_ += f"{'are' if len(far) > 1 else 'is'} not used"
            yield cells.finding("DAT041", "warning", message, help_, int(far[0])), far


def _posture(state: State) -> Array:
    """Return joint angles (n, 6) [rad]; beside them the positions of external axes [m], [rad], if there are any."""
    axes = state.external_axes
    return state.q if axes is None else np.hstack([state.q, np.nan_to_num(axes)])


def _stands(q: Array) -> bool:
    """Return whether the arm stands still in rows (m, 6 or 12) of `_posture`."""
    return bool(np.ptp(q, axis=0).max() < SAME_RAD)


def _usual_miss(every: Array, repeated: list[Array]) -> float:
    """Return the usual difference [m] of two readings: of a dial, of its scale, or what most repeated ones show.

    In pairs half of the readings are within 0.48 standard deviations of the middle: a difference has 3 times that.

    Args:
        every: (m,) readings of gauges; repeated: those of each state that was read several times.
    """
    shown = 0.0
    if len(repeated) >= FEWEST_CHANGES:
        shown = 3.0 * float(np.median(np.concatenate([np.abs(same - np.median(same)) for same in repeated])))
    return max(DIAL_M, scale_step(every), shown)


def _changes(
    data: Measurements, robot: Robot, tool: Array, state_of: NDArray[np.intp], usable: NDArray[np.bool_]
) -> LoadChanges | None:
    """Return the changes of gauges under load; None where there are none, or the arm's stiffness is not known.

    Readings of one state count with their mean, by the first of their rows.

    Args:
        tool: (n, 4, 4) what the gauge touches, in tool0.
        state_of: (n,) number of the state of each row; usable: (n,) rows that are used.
    """
    state, readings = data.state, data.readings
    gauges = [int(i) for i in rows_of(state, kind_of(Gauge.column)) if usable[i]]
    if readings is None or robot.joint_compliance is None or not gauges:
        return None
    first: dict[int, int] = {}
    states: dict[int, list[int]] = {}
    pairs, q = [], _posture(state)
    for i in gauges:
        states.setdefault(int(state_of[i]), []).append(i)
        start = first.setdefault(int(np.asarray(state.setup)[i]), i)
        apart = state_of[i] != state_of[start] and states[int(state_of[i])][0] == i
        if apart and _stands(q[[start, i]]):
            pairs.append((start, i))
    if not pairs:
        return None
    before, row = np.array(pairs).T
    at_tcp, torque, apart = jacobian(robot, state.q, tool), np.zeros_like(state.q), 0.0
    if state.payload_mass is not None:
        centre = transform(np.zeros((len(data), 3)) if state.payload_center is None else state.payload_center)
        weight = state.payload_mass[:, None] * state.gravity
        torque += np.einsum("nij,ni->nj", jacobian(robot, state.q, centre)[:, :3], weight)
        off = np.linalg.norm((centre - tool)[row, :3, 3], axis=1)[state.payload_mass[row] > 0]
        apart = float(np.median(off)) if len(off) else 0.0
    if state.wrench is not None:
        torque += np.einsum("nij,ni->nj", at_tcp, state.wrench)
    moved = np.einsum("mi,mij->mj", readings.direction[row], at_tcp[row, :3])
    mean = {k: float(np.mean(readings.numbers[rows, 0])) for k, rows in states.items()}
    change = np.array([mean[int(state_of[i])] - mean[int(state_of[start])] for start, i in pairs])
    return LoadChanges(row, change, moved * (torque[row] - torque[before]) * robot.joint_compliance, apart)


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
    unit = "hundredths" if times > 1 else "inches"
    help_ = f"is `reading_mm` in {unit}, or `payload_kg` in another unit? state it in a column map (`factor`)"
    yield cells.finding("DAT009", "error", message, help_, int(changes.row[clear][0])), changes.row[:0]


def _check_single(changes: LoadChanges, data: Measurements, cells: Cells) -> Iterator[Odd]:
    """Yield DAT041, with rows that are not used, where a gauge moves against its load whatever the springs are like.

    And where single ones of the other changes suit no springs that suit most (`find_strays`).
    """
    total = np.abs(changes.by_joint).sum(axis=1)
    against = 0.5 * (total - np.abs(changes.by_joint.sum(axis=1)))
    sure = (against < SURE * total) & (total > LEAST_CHANGE_M) & (np.abs(changes.change) > LEAST_CHANGE_M)
    turned = sure & (np.sign(changes.change) != np.sign(changes.by_joint.sum(axis=1)))
    if turned.any():
        rows = changes.row[turned]
        setups = dict.fromkeys(data.state.setup_of_rows[rows].tolist())
        message = f"{', '.join(f'`{name}`' for name in setups)} read against the load: the direction `nx`, `ny`, `nz`, "
        message += "or the order of their readings, is the other way round"
        severity: Severity = "error" if turned.sum() == sure.sum() and turned.sum() > 1 else "warning"
        help_ = "turn the sign of `nx`, `ny`, `nz` there; until then these rows are not used"
        if severity == "error":
            help_ = "turn the sign of all directions, or of all readings"
        most = 2 * turned.sum() > sure.sum()
        help_ += "; is the base mounted as stated (`--mounting`, `[mounting]`)?" * bool(most)
        finding = cells.finding("DAT041", severity, message, help_, int(rows[0]))
        yield replace(finding, matter=Matter.CONTRADICTED if most else None), rows
    yield from find_strays(changes.some(~turned), data, cells)


def find_strays(changes: LoadChanges, data: Measurements, cells: Cells) -> Iterator[Odd]:
    """Yield DAT041, with rows that are not used, where single changes suit no springs that suit the others.

    With F(S) the least sum of squares that changes S leave (`_misfit`), F(S) - F(S without k) is the square of the
    distance of change k from what the type and the others predict, over the deviation of that prediction. It is
    counted by the scatter of the others where this is more than that of a dial. Where leaving out another change would
    serve nearly as well, both are named.
    """
    rest, steps = np.arange(len(changes.row)), []
    for _ in range(max(1, len(rest) // FEWEST_CHANGES)):
        if len(rest) <= FEWEST_LEFT:
            break
        every, best = _misfit(changes.some(rest))
        off = np.abs(changes.change[rest] - changes.by_joint[rest] @ np.exp(best))
        tried = np.argsort(-off)[:MOST_TRIED]
        remaining = np.array([_misfit(changes.some(np.delete(rest, k)))[0] for k in tried])
        steps.append((rest[tried], every - remaining))
        rest = np.delete(rest, tried[np.argmin(remaining)])
    # Two wrong ones hide each other: all that were taken away are judged by those that remain in the end.
    square, best = _misfit(changes.some(rest))
    scale = max(1.0, square / len(rest))
    off = np.abs(changes.change - changes.by_joint @ np.exp(best))
    if scale > CONTRADICTION**2 and steps:
        missed = float(np.sqrt(np.mean(off**2)))
        message = (
            f"the gauges contradict each other under load: whatever the springs are, they miss by {1e3 * missed:.3f} "
        )
        message += "mm in the mean"
        help_ = "more than one was misread, or the loads, the directions, the mounting or the TCP are not as stated: "
        help_ += "correct that, or read the set-ups again"
        if changes.apart > APART_M:
            help_ = (
                f"the loads hang {1e3 * changes.apart:.0f} mm from the TCP: is `--tool` right, in mm? If so, {help_}"
            )
        finding = cells.finding("DAT041", "warning", message, help_, int(changes.row[0]))
        yield replace(finding, matter=Matter.CONTRADICTED), changes.row[:0]
        return
    for tried, gain in steps:
        if gain.max() < STRAY**2 * scale or off[tried[np.argmax(gain)]] < LEAST_CHANGE_M:
            continue
        order = np.argsort(-gain)
        suspects = tried[order[gain[order] > gain.max() - NEARLY**2 * scale]]
        rows, k = changes.row[suspects], suspects[0]
        names = [f"`{name}`" for name in dict.fromkeys(data.state.setup_of_rows[rows].tolist())]
        message = f"{names[0]} changes by {1e3 * changes.change[k]:.3f} mm under load, {1e3 * off[k]:.3f} mm from what "
        message += "suits the other readings: a turn of the dial is often 1 mm"
        help_ = "read that set-up again; until then its row under load is not used"
        if names[1:]:
            message += f"; or {joined(names[1:], 'or')} was misread"
            help_ = f"read {joined(names)} again; until then their rows under load are not used"
        yield cells.finding("DAT041", "warning", message, help_, int(rows[0])), rows


def _check_once(changes: LoadChanges, data: Measurements, state_of: NDArray[np.intp], cells: Cells) -> Iterator[Odd]:
    """Yield DAT042 where set-ups were read once under load: few set-ups check each other, and springs take up a slip.

    Args:
        state_of: (n,) number of the state of each row.
    """
    once = changes.row[np.bincount(state_of[data.usable], minlength=state_of.max() + 1)[state_of[changes.row]] < 2]
    if not len(once):
        return
    names = [f"`{name}`" for name in dict.fromkeys(data.state.setup_of_rows[once].tolist())]
    listed = joined(names) if len(names) <= MOST_NAMED else f"{len(names)} set-ups of gauges"
    message = f"{listed} {'were' if names[1:] else 'was'} read once under load: a slip of the pen that suits springs "
    message += "gives no finding, and no interval counts it"
    help_ = "take the load off, read, hang it on again and read: a row for each, with the same name in `gauge`"
    yield cells.finding("DAT042", "warning", message, help_, int(once[0])), once[:0]


def _misfit(changes: LoadChanges) -> tuple[float, Array]:
    """Return the least sum of squares of the misses of changes and of logarithms x of compliances, and x (6,) there.

    A change misses by `DIAL_M` and `SHARE` of it, x by `COMPLIANCE_LOG` about the type's.
    """
    from scipy.optimize import least_squares

    sigma = np.hypot(DIAL_M, SHARE * changes.change)

    def misses(x: Array) -> Array:
        """Return (n + 6,) misses of n changes and of the logarithms, in standard deviations."""
        return np.append((changes.by_joint @ np.exp(x) - changes.change) / sigma, x / COMPLIANCE_LOG)

    def slopes(x: Array) -> Array:
        """Return (n + 6, 6) derivatives of the misses by the logarithms."""
        return np.vstack([changes.by_joint * np.exp(x) / sigma[:, None], np.eye(6) / COMPLIANCE_LOG])

    best = least_squares(misses, np.zeros(6), slopes, max_nfev=100)
    return 2 * float(best.cost), np.asarray(best.x)
