"""Other readings of a table that does not fit the arm: units, signs, zeros and order of its columns, another arm."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.measure.alignment import SAME_SCALE, Alignment, align, huber_weights
from postproc.measure.read.values import UNITS
from postproc.robot.arm import Robot
from postproc.robot.catalogue import list_robots, load_robot
from postproc.robot.kinematics import forward, jacobian, skew
from postproc.robot.pose import transform

SUSPICIOUS_M = 0.010
"""No arm with its zeros set misses its nominal kinematics by more than this in the median row."""
FITTING = (1.0,)
"""Scale of points and arm that fit."""
MISMATCH_M = 0.050
"""Where nothing else explains a residual of so much, the table and the arm do not belong together."""
SAME_LENGTHS_M = 1e-9
"""Arms that a table fits equally well have the same lengths."""
CLEARER = 5.0
"""Another reading of columns is named only where it follows the arm this many times better."""
LENGTH_UNITS: Mapping[str, str] = {
    "mm": "millimetres", "cm": "centimetres", "m": "metres", "um": "micrometres", "in": "inches",
}  # fmt: skip
RENAME = "rename the columns, or give the right ones in a column map"
STRAY = 20.0
STAY = 1e-2
"""Residual [m] of one radian of joint zero: far below what a radian moves (metres), far above what rounding does."""
NOWHERE_M = 100.0
"""Residual [m] of points that no place of the instrument brings to the arm."""
RADIANS_BELOW = np.radians(7.0)
RADIANS = (
    "the joint angles are all below 7 deg: they look like radians, not degrees",
    "give the unit in a column map: q1_deg = {name = .., unit = 'rad'}",
)
MOST_TURNS_RAD = 4 * np.pi
"""No joint turns so far."""
DEGREES = (
    "the joint angles look like degrees, not radians",
    "correct the unit in the column's name, or give it in a column map: q1_deg = {name = .., unit = 'deg'}",
)


@dataclass(frozen=True, eq=False)
class PlacedArm:
    """A nominal arm where it stands.

    Args:
        T_reference_base: (n, 4, 4) [m] its base at each row, in the frame in which points are given; None where that
            is the base frame.
    """

    robot: Robot
    T_reference_base: Array | None = None

    def flange(self, q: Array) -> Array:
        """Return (n, 4, 4) nominal flange poses [m] of joint angles (n, 6) [rad] in the frame of the points."""
        T = forward(self.robot, q)
        return T if self.T_reference_base is None else self.T_reference_base @ T

    def moves(self, q: Array, at: Alignment) -> Array:
        """Return (3 n, 15) derivatives of aligned points [m] by joint angles, instrument frame and measured point.

        Args:
            q: (n, 6) joint angles [rad]; at: the alignment, scale 1.
        """
        T = at.T_instrument_base @ self.flange(q)
        arms = T[:, :3, :3] @ at.tool
        R = at.T_instrument_base[:3, :3] @ (
            np.eye(3) if self.T_reference_base is None else self.T_reference_base[:, :3, :3]
        )
        by_joint = R @ jacobian(self.robot, q, transform(at.tool))[:, :3]
        frame = np.broadcast_to(np.eye(3), by_joint[:, :, :3].shape), -skew(T[:, :3, 3] + arms)
        return np.concatenate([by_joint, *frame, T[:, :3, :3]], axis=2).reshape(-1, 15)

    def rows(self, index: Any) -> PlacedArm:
        """Return the arm at some of the rows, by a mask or by indices."""
        return self if self.T_reference_base is None else PlacedArm(self.robot, self.T_reference_base[index])


def align_arm(arm: PlacedArm, q: Array, position: Array, scales: Sequence[float] = ()) -> Alignment:
    """Return the alignment of the nominal arm at joint angles (n, 6) [rad] with measured points (n, 3) [m].

    Points far from all others (a lost beam, 1e9) are not fitted; residuals are of all points.

    Args:
        scales: as `align` has them.
    """
    return align(arm.flange(q), position, fitted=near(position), scales=scales)


def near(position: Array) -> NDArray[np.bool_]:
    """Return (n,) mask of points (n, 3) within 20 times the median distance from their median; others: lost beams."""
    away = np.linalg.norm(position - np.median(position, axis=0), axis=1)
    return np.asarray(away <= STRAY * np.median(away))


def fits(alignment: Alignment) -> bool:
    """Return whether an alignment fits: within 10 mm in the median row, not mirrored, scale within 5 % of 1."""
    return alignment.typical < SUSPICIOUS_M and not alignment.mirrored and abs(alignment.scale - 1) < SAME_SCALE


def other_lengths(unit: str) -> Iterator[tuple[float, str, str]]:
    """Yield (factor, text, other) of each unit of length but ``unit``.

    Points in the other unit that are read in ``unit`` are too large by the factor.
    """
    for short, name in LENGTH_UNITS.items():
        if UNITS[short] != UNITS[unit]:
            read = next(LENGTH_UNITS[known] for known in LENGTH_UNITS if UNITS[known] == UNITS[unit])
            yield UNITS[unit] / UNITS[short], f"look like {name}, not {read}", short


def other_reading(
    arm: PlacedArm,
    q: Array,
    position: Array,
    as_read: Alignment,
    *,
    unit: str,
    allowed: Callable[[Array], bool],
) -> tuple[str, str] | None:
    """Return (message, help) of another reading of the table that makes the points fit clearly better; None for none.

    Args:
        q: (n, 6) [rad] and position: (n, 3) [m] as they were read; as_read: their alignment.
        unit: unit of length in which the positions were read. allowed: whether joint angles (n, 6) may be proposed.
    """
    best, reading = as_read.typical / CLEARER, None
    mirror = "the points are mirrored: two of `x_mm`, `y_mm`, `z_mm` are swapped, or one has the wrong sign"
    mirrored = align_arm(arm, q, position[:, [1, 0, 2]], FITTING)
    in_mirror = fits(mirrored) and mirrored.typical < best
    lengths = ((1.0, "", ""), *other_lengths(unit))
    for q_other, text, help_ in _joints(q):
        other = align_arm(arm, q_other, position, [factor for factor, _, _ in lengths])
        for factor, look, short in lengths:
            if abs(other.scale / factor - 1) > SAME_SCALE:
                continue
            fit = other if factor == 1.0 else align_arm(arm, q_other, position / factor, FITTING)
            if fits(fit) and fit.typical < best and allowed(q_other):
                best = fit.typical / 2
                length = f"the positions {look}" if look else ""
                unit_help = f"give the unit in a column map: x_mm = {{name = .., unit = '{short}'}}" if look else ""
                # A vendor's sign convention is more common than a left-handed instrument.
                causes = [" and ".join(x for x in (text, length) if x), *([mirror] if in_mirror else [])]
                message = f"{', or '.join(causes)}: the points then fit to {1e3 * fit.typical:.2f} mm"
                reading = message, "; ".join(x for x in (help_, unit_help) if x)
    if reading is None and in_mirror:
        return f"{mirror}: they then fit to {1e3 * mirrored.typical:.2f} mm", f"{RENAME}, or `sign = -1`"
    return reading


def slipped(arm: PlacedArm, q: Array, position: Array) -> tuple[int, int, int] | None:
    """Find the row k before which, or from which on, all points stand beside the joint angles of a neighbouring row.

    A point that was not taken, or taken twice, moves all that follow. The first third of the rows, or the last, tells
    where the instrument stands.

    Returns:
        (before, after, k): 1 where points belong to the angles of the row before, -1 for those of the next, 0 where
        they stand right. None unless nine rows of ten then fit, and half of those that do not as they stand.
    """
    n, flange = len(q), arm.flange(q)
    right = np.linalg.norm(align_arm(arm, q, position).residual, axis=1) < MISMATCH_M
    most, slip = max(0.9 * n, 0.5 * (n + right.sum())), None
    for first, (step, other) in product((True, False), ((0, 1), (0, -1), (1, 0), (-1, 0))):
        fitted = np.zeros(2 * n, dtype=bool)
        fitted[: n // 3] = first
        fitted[n - n // 3 : n] = not first
        both = np.concatenate([np.roll(flange, shift, axis=0) for shift in (step, other)])
        known = align(both, np.tile(position, (2, 1)), fitted=fitted, scales=FITTING)
        near = (np.linalg.norm(known.residual, axis=1) < MISMATCH_M).reshape(2, n)[:: 1 if first else -1]
        right = np.append(0, np.cumsum(near[0])) + np.append(np.cumsum(near[1, ::-1])[::-1], 0)
        if fits(known) and right.max() > most:
            most, best = right.max(), np.flatnonzero(right == right.max())
            before, after = (step, other) if first else (other, step)
            # Repeats stand right either way: what is wrong goes as far as it can.
            slip = before, after, int(best[-1] if before else best[0])
    return slip


def other_arms(arm: PlacedArm, q: Array, position: Array) -> list[str]:
    """Return names of library arms that the points fit best in place of this one; several of equal lengths."""
    typical_of: dict[str, float] = {}
    for name in list_robots():
        try:
            other = align_arm(replace(arm, robot=load_robot(name)), q, position, FITTING)
        except PostprocError:
            continue
        if fits(other) and name != arm.robot.name:
            typical_of[name] = other.typical
    return [name for name, typical in typical_of.items() if typical <= min(typical_of.values()) + SAME_LENGTHS_M]


def zero_errors(arm: PlacedArm, q: Array, position: Array) -> tuple[Array, float]:
    """Return (6,) offsets of joint angles [rad] that fit the points best, and the median distance [m] left then.

    A joint whose offset is also a turn of the instrument or of the tool (the first, the last) has nothing in the data
    that holds it: a weight of `STAY` per radian keeps it at zero. The distance is infinite where no best offsets are
    reached within 100 evaluations.
    """
    from scipy.optimize import least_squares

    known: dict[bytes, Alignment] = {}

    def aligned(offset: Array) -> Alignment:
        """Return the alignment with joint zeros moved; the last one is kept."""
        at = offset.tobytes()
        if at not in known:
            known.clear()
            known[at] = align_arm(arm, q + offset, position)
        return known[at]

    def error(offset: Array) -> Array:
        """Return the residuals (3 n,) [m] with joint zeros moved, and those (6,) of the offsets themselves."""
        residual = aligned(offset).residual  # NaN where the points have another scale
        return np.append(np.nan_to_num(residual, nan=NOWHERE_M), STAY * offset)

    def slope(offset: Array) -> Array:
        """Return the derivative of `error`: what instrument and tool do not take up of the motion by the joints."""
        at = aligned(offset)
        by_joint = np.zeros((3 * len(q), 6))
        if np.isfinite(at.typical):
            moves = arm.moves(q + offset, at)
            weight = np.where(near(position), huber_weights(np.linalg.norm(at.residual, axis=1)), 0.0)
            root = np.repeat(np.sqrt(weight), 3)[:, None]
            taken = np.linalg.lstsq(root * moves[:, 6:], root * moves[:, :6], rcond=1e-10)[0]
            by_joint = moves[:, 6:] @ taken - moves[:, :6]
        return np.vstack([by_joint, STAY * np.eye(6)])

    best = least_squares(error, np.zeros(6), slope, loss="soft_l1", f_scale=1e-3, max_nfev=100)
    return np.asarray(best.x), align_arm(arm, q + best.x, position).typical if best.success else np.inf


def _joints(q: Array) -> Iterator[tuple[Array, str, str]]:
    """Yield readings of joint angles, the simplest first: (angles (n, 6) [rad], message, help).

    The first are the angles as they were read, without a text.
    """
    yield q, "", ""
    if np.nanmax(np.abs(q)) < RADIANS_BELOW:
        yield np.rad2deg(q), *RADIANS
    if np.nanmax(np.abs(q)) > MOST_TURNS_RAD:
        yield np.deg2rad(q), *DEGREES
    for i, j in combinations(range(6), 2):
        order = list(range(6))
        order[i], order[j] = j, i
        yield q[:, order], f"columns `q{i + 1}_deg` and `q{j + 1}_deg` look swapped", RENAME
    coupled = q.copy()
    coupled[:, 2] -= q[:, 1]
    yield coupled, "column `q3_deg` looks like the angle of the forearm to the ground (q3 + q2)", RENAME
    yield from _negated(q, [1])
    for j in range(6):
        for turn in (90, -90, 180):
            other = q.copy()
            other[:, j] += np.deg2rad(turn)
            text = f"joint {j + 1} looks counted from a zero {abs(turn)} deg away"
            yield other, text, f"give it in a column map: q{j + 1}_deg = {{name = .., offset = {turn}}}"
    yield from _negated(q, range(2, 7))


def _negated(q: Array, counts: Iterable[int]) -> Iterator[tuple[Array, str, str]]:
    """Yield readings as `_joints` does, with the signs of some joints reversed.

    Args:
        counts: how many joints are reversed at once.
    """
    for count in counts:
        for some in combinations(range(6), count):
            other = q.copy()
            other[:, some] *= -1
            listed = ", ".join(f"`q{j + 1}_deg`" for j in some)
            text = f"column {listed} looks negated" if count == 1 else f"columns {listed} count the other way"
            yield other, text, "give `sign = -1` in a column map"
