"""Targets to add: the fewest that keep every line and arc within tolerance of its commanded curve.

Between two corrected targets the controller interpolates; the correction in between is then the chord of the exact
correction. Only what is perpendicular to the path counts: a shift along it does not move the seam.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.arrays import Array
from postproc.motion.path.samples import Samples
from postproc.motion.values import Flags

CHORD_SHARE = 0.8  # of the tolerance, for the chords; the rest is rounding and what a circle cannot follow
TRANSIENT = 0.1  # weight of deviations while the speed changes: not worth a target each
SHORTEST_PIECE = 0.002  # [m] of a split arc (MoveC refuses 0.1 mm)
SMALLEST_PIECE = np.radians(6.0)  # of a split arc: its circle point is then seen 1.5 deg from the goal (MoveC: 1 deg)
_PLACING_ROUNDS = 6  # of bisection: the largest deviation is then within 2 % of the smallest possible


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
    bent = _chord_deviations(samples, shift, division.weight) > CHORD_SHARE * division.tolerance
    bent = (samples.goal > samples.start) & (samples.curves.arc | (bent & ~samples.curves.joint))
    added = {i: _added_samples(division, i, T_commanded) for i in np.flatnonzero(bent).tolist() if divisible(i)}
    return {i: tuple(samples.u[rows].tolist()) for i, rows in added.items() if rows}


def _added_samples(division: Division, i: int, T_commanded: Array) -> list[int]:
    """The samples at which targets are added so that the fewest lines or arcs keep move i within tolerance.

    Args:
        T_commanded: (n, 4, 4) commanded poses at all samples.
    """
    samples, limit = division.samples, CHORD_SHARE * float(division.tolerance[i])
    begin, curves = int(samples.start[i]), samples.curves
    rows = slice(begin, int(samples.goal[i]) + 1)
    u, weight = samples.u[rows], division.weight[rows]
    # At least two zone radii from start and goal: the controller cuts a zone to half the distance to the next target,
    # and an added target would be the next one.
    near, far = (2 * _zone_in_force(samples, k) - 1e-9 for k in (i - 1, i))
    length = float(curves.length[i])
    allowed = (u > 0) & (u < 1) & (u * length >= near) & ((1 - u) * length >= far)
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


def error_with_targets(division: Division, i: int, T_commanded: Array) -> tuple[int, float]:
    """How many targets on move i keep its tolerance, and the largest weighted distance [m] that these leave.

    Args:
        T_commanded: (n, 4, 4) commanded poses at all samples.
    """
    samples = division.samples
    added = _added_samples(division, i, T_commanded)
    p, remaining = T_commanded[:, :3, 3], 0.0
    for a, b in pairwise([int(samples.start[i]), *added, int(samples.goal[i])]):
        rows = slice(a, b + 1)
        if samples.curves.arc[i]:
            gaps = circle_gaps(p[rows], p[a], p[(a + b) // 2], p[b])
        else:
            gaps = np.linalg.norm(perpendicular(p[rows] - p[a], (p[b] - p[a]) / np.linalg.norm(p[b] - p[a])), axis=1)
        remaining = max(remaining, float((division.weight[rows] * gaps).max()))
    return len(added), remaining


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


def _zone_in_force(samples: Samples, i: int) -> float:
    """Zone radius [m] at the goal of move i, after the controller has cut it to half of both moves that meet there."""
    move = samples.moves[i]
    if move.fine:
        return 0.0
    meeting = [k for k in (i, i + 1) if k < len(samples.moves) and not samples.moves[k].starts_chain]
    return float(min([move.zone, *(samples.curves.length[meeting] / 2)]))


def perpendicular(vectors: Array, direction: Array) -> Array:
    """Components of vectors (k, 3) perpendicular to unit directions (3,) or (k, 3); unchanged for zero."""
    return vectors - np.sum(vectors * direction, axis=-1, keepdims=True) * direction


def _farthest(deviation: Callable[[int, int], float], a: int, last: int, tolerance: float) -> int:
    """Largest index b in (a, last] for which deviation(a, b) is within tolerance, but at least a + 1.

    It is found by bisection, on the assumption that the deviation grows with b.
    """
    low, high = a + 1, last
    while low < high:
        middle = (low + high + 1) // 2
        if deviation(a, middle) <= tolerance:
            low = middle
        else:
            high = middle - 1
    return low


def _greedy(
    deviation: Callable[[int, int], float], allowed: Flags, last: int, tolerance: float
) -> tuple[list[int], bool]:
    """Indices of the fewest samples as vertices, each as far along as the tolerance allows; whether that is kept.

    Args:
        deviation: function of two sample indices, the deviation [m] of a path without vertices between them.
        allowed: (k,) samples that may be vertices.
        last: index of the last sample.
        tolerance: allowed deviation [m].
    """
    places = np.flatnonzero(allowed[:last])
    places = places[places > 0]
    vertices: list[int] = []
    a, reached = 0, True
    while deviation(a, last) > tolerance:
        reach = _farthest(deviation, a, last, tolerance)
        k = int(np.searchsorted(places, reach, side="right")) - 1
        if k < 0 or places[k] <= a:
            # No target may stand as near as it should: the next one that may.
            reached, k = False, k + 1
            if k >= len(places):
                break
        a = int(places[k])
        vertices.append(a)
    return vertices, reached


def _fewest(deviation: Callable[[int, int], float], allowed: Flags, last: int, tolerance: float) -> list[int]:
    """Indices of the fewest samples as vertices, with the largest deviation made small.

    Args:
        deviation: function of two sample indices, the deviation [m] of a path without vertices between them.
        allowed: (k,) samples that may be vertices.
        last: index of the last sample.
        tolerance: allowed deviation [m].
    """
    best, reached = _greedy(deviation, allowed, last, tolerance)
    low, high = 0.0, tolerance
    for _ in range(_PLACING_ROUNDS if best and reached else 0):
        middle = 0.5 * (low + high)
        tighter, also = _greedy(deviation, allowed, last, middle)
        if also and len(tighter) <= len(best):
            best, high = tighter, middle
        else:
            low = middle
    return best


def place_vertices(u: Array, across: Array, allowed: Flags, tolerance: float, weight: Array) -> list[int]:
    """Indices of the fewest samples at which a line gets an added target, so that all chords deviate about equally.

    Args:
        u: (k,) fractions along the move.
        across: (k, 3) exact correction perpendicular to its direction [m].
        allowed: (k,) bool, samples that may become targets (outside the neighbours' zones).
        tolerance: allowed chord deviation [m].
        weight: (k,) how much a deviation counts.
    """
    last = len(u) - 1

    def deviation(a: int, b: int) -> float:
        """Largest weighted chord deviation [m] between samples a and b."""
        if b - a < 2:
            return 0.0
        w = ((u[a + 1 : b] - u[a]) / (u[b] - u[a]))[:, None]
        gap = (across[a] + (across[b] - across[a]) * w - across[a + 1 : b]) * weight[a + 1 : b, None]
        return math.sqrt(float(np.einsum("ij,ij->i", gap, gap).max()))

    return _fewest(deviation, allowed, last, tolerance)


def circle_gaps(points: Array, a: Array, via: Array, b: Array) -> Array:
    """Distances (k,) [m] of points (k, 3) from the circle through a, via and b (3,), or from their line."""
    ab, av = b - a, via - a
    normal = _cross(av, ab)
    size = float(normal @ normal)
    if size < 1e-24:
        return np.linalg.norm(perpendicular(points - a, ab / np.linalg.norm(ab)), axis=1)
    center = a + (_cross(normal, av) * (ab @ ab) + _cross(ab, normal) * (av @ av)) / (2 * size)
    radius = float(np.linalg.norm(a - center))
    axis = normal / np.sqrt(size)
    height = (points - center) @ axis
    radial = np.linalg.norm(points - center - height[:, None] * axis, axis=1) - radius
    return np.hypot(height, radial)


def _cross(a: Array, b: Array) -> Array:
    """Cross product of two vectors (3,); ``np.cross`` takes twenty times as long for one."""
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def place_arcs(commanded: Array, tolerance: float, shortest: int, beyond: Flags, weight: Array) -> list[int]:
    """Indices of the samples between the fewest arcs whose circles stay within tolerance of the commanded points.

    The circle point of each is its middle sample.

    Args:
        commanded: (k, 3) exact commanded TCP positions along the arc [m].
        tolerance: allowed distance [m].
        shortest: number of intervals that an arc spans at least (MoveC's limits on length and angle).
        beyond: (k,) samples that may become targets (outside the neighbours' zones).
        weight: (k,) how much a deviation counts.
    """
    last = len(commanded) - 1

    def deviation(a: int, b: int) -> float:
        """Largest weighted distance [m] of points a to b from the circle through a, b and the middle one."""
        if b - a < 2:
            return 0.0
        gaps = circle_gaps(commanded[a : b + 1], commanded[a], commanded[(a + b) // 2], commanded[b])
        return float((weight[a : b + 1] * gaps).max())

    allowed = np.arange(last + 1) % shortest == 0
    allowed[max(0, last - shortest + 1) :] = False
    allowed &= beyond
    return _fewest(deviation, allowed, last, tolerance)
