"""Targets to add: the fewest that keep every line and arc within tolerance of its commanded curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.placement import circle_gaps, perpendicular, place_arcs, place_vertices
from postproc.motion.path.samples import Samples
from postproc.motion.values import Flags

SHARE = 0.8  # of the tolerance, for the chords; the rest is rounding and what a circle cannot follow
TRANSIENT = 0.1  # weight of deviations while the speed changes: not worth a target each
SHORTEST_PIECE = 0.002  # [m] of a split arc (MoveC refuses 0.1 mm)
SMALLEST_PIECE = np.radians(6.0)  # of a split arc: its circle point is then seen 1.5 deg from the goal (MoveC: 1 deg)


@dataclass(frozen=True, slots=True)
class Division:
    """The data by which moves are divided.

    Args:
        samples: of the programmed curves.
        tolerance: (m,) allowed deviation along each move [m].
        weight: (n,) factor on a deviation at each sample.
    """

    samples: Samples
    tolerance: Array
    weight: Array

    @staticmethod
    def of(samples: Samples, tolerance: Array, settled: Flags) -> Division:
        """A division with weight 1 at samples where the load of inertia is constant, 0.1 elsewhere.

        Args:
            tolerance: (m,) allowed deviation along each move [m].
            settled: (n,) where the load of inertia is constant.
        """
        return Division(samples, tolerance, np.where(settled, 1.0, TRANSIENT))


def divide_moves(
    division: Division, T_commanded: Array, divisible: Callable[[int], bool]
) -> dict[int, tuple[float, ...]]:
    """By move that needs added targets to stay within tolerance: the fractions of its way at which they are.

    Args:
        T_commanded: (n, 4, 4) commanded poses at the samples.
        divisible: whether statements may be added before the statement of the move with that index; called for arcs and
            for lines that need some.
    """
    samples = division.samples
    shift = T_commanded[:, :3, 3] - samples.T_work_tcp[:, :3, 3]
    bent = _chord_deviations(samples, shift, division.weight) > SHARE * division.tolerance
    bent = (samples.goal > samples.start) & (samples.curves.arc | (bent & ~samples.curves.joint))
    added = {i: _added_samples(division, i, T_commanded) for i in np.flatnonzero(bent).tolist() if divisible(i)}
    return {i: tuple(samples.u[rows].tolist()) for i, rows in added.items() if rows}


def _added_samples(division: Division, i: int, T_commanded: Array) -> list[int]:
    """The samples at which targets are added so that the fewest lines or arcs keep move i within tolerance.

    Args:
        T_commanded: (n, 4, 4) commanded poses at all samples.
    """
    samples, limit = division.samples, SHARE * float(division.tolerance[i])
    begin, curves = int(samples.start[i]), samples.curves
    rows = slice(begin, int(samples.goal[i]) + 1)
    u, weight = samples.u[rows], division.weight[rows]
    allowed = _outside_zones(samples, i, u)
    if curves.arc[i]:
        intervals = len(u) - 1
        part = max(SHORTEST_PIECE / curves.length[i], SMALLEST_PIECE / curves.angle[i], 2 / intervals)
        shortest = int(np.ceil(part * intervals - 1e-9))
        added = place_arcs(T_commanded[rows, :3, 3], limit, shortest, allowed, weight)
    else:
        shift = T_commanded[rows, :3, 3] - samples.T_work_tcp[rows, :3, 3]
        direction = curves.chord[i] / max(curves.length[i], 1e-12)
        added = place_vertices(u, perpendicular(shift, direction), allowed, limit, weight)
    return [begin + k for k in added]


def left_by_targets(division: Division, i: int, T_commanded: Array) -> tuple[int, float]:
    """How many targets on move i keep its tolerance, and the largest weighted distance [m] that these leave.

    Args:
        T_commanded: (n, 4, 4) commanded poses at all samples.
    """
    samples = division.samples
    added = _added_samples(division, i, T_commanded)
    p, left = T_commanded[:, :3, 3], 0.0
    for a, b in pairwise([int(samples.start[i]), *added, int(samples.goal[i])]):
        rows = slice(a, b + 1)
        if samples.curves.arc[i]:
            gaps = circle_gaps(p[rows], p[a], p[(a + b) // 2], p[b])
        else:
            gaps = np.linalg.norm(perpendicular(p[rows] - p[a], (p[b] - p[a]) / np.linalg.norm(p[b] - p[a])), axis=1)
        left = max(left, float((division.weight[rows] * gaps).max()))
    return len(added), left


def _chord_deviations(samples: Samples, shift: Array, weight: Array) -> Array:
    """(m,) largest weighted distance [m] of each move's correction from linear interpolation between its two ends.

    Only the part across the move's own chord counts.

    Args:
        shift: (n, 3) correction of the position at each sample [m].
        weight: (n,) factor on the distance.
    """
    i, u = samples.move, samples.u[:, None]
    first, last = shift[samples.start[i]], shift[samples.goal[i]]
    gap = first + (last - first) * u - shift
    direction = samples.curves.chord / np.maximum(samples.curves.length, 1e-12)[:, None]
    gap -= np.sum(gap * direction[i], axis=1, keepdims=True) * direction[i]
    result = np.zeros(len(samples.moves))
    np.maximum.at(result, i, weight * np.linalg.norm(gap, axis=1))
    return result


def _outside_zones(samples: Samples, i: int, u: Array) -> Flags:
    """Per sample of move i, with fractions u, whether it is at least two zone radii away from start and goal.

    The controller cuts a zone to half the distance to the next target, and an added target would be the next one.
    """
    length = float(samples.curves.length[i])
    near, far = 2 * _zone_in_force(samples, i - 1), 2 * _zone_in_force(samples, i)
    inside = (u > 0) & (u < 1)
    return inside & (u * length >= near - 1e-9) & ((1 - u) * length >= far - 1e-9)


def _zone_in_force(samples: Samples, i: int) -> float:
    """Zone radius [m] at the goal of move i, after the controller has cut it to half of both moves that meet there."""
    move = samples.moves[i]
    if move.fine:
        return 0.0
    meeting = [k for k in (i, i + 1) if k < len(samples.moves) and not samples.moves[k].first]
    return float(min([move.zone, *(samples.curves.length[meeting] / 2)]))
