"""Targets to add: the fewest that keep every line and arc within tolerance of its commanded curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.placement import circle_gaps, perpendicular, place_arcs, place_vertices
from postproc.motion.path.samples import Samples
from postproc.motion.values import Flags
from postproc.rapid.data.events import StatementKey

SHARE = 0.8  # of the tolerance, for the chords; the rest is rounding and what a circle cannot follow
TRANSIENT = 0.1  # weight of deviations while the speed changes: not worth a target each
SHORTEST_PIECE = 0.002  # [m] of a split arc (MoveC refuses 0.1 mm)
SMALLEST_PIECE = np.radians(6.0)  # of a split arc: its circle point is then seen 1.5 deg from the goal (MoveC: 1 deg)


@dataclass(frozen=True, slots=True)
class Pieces:
    """How one move is divided.

    Args:
        move: index of the move.
        goals: samples of the added targets, in order.
        vias: samples of the circle points of an arc, one more than goals.
        reached: the tolerance is kept between the targets.
    """

    move: int
    goals: tuple[int, ...]
    vias: tuple[int, ...]
    reached: bool


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


def divide_moves(division: Division, T_commanded: Array, divisible: Callable[[int], bool]) -> list[Pieces]:
    """Divide all arcs, and the lines whose commanded curve leaves the line through its targets beyond tolerance.

    An arc that needs no added target is one piece with its best circle point.

    Args:
        T_commanded: (n, 4, 4) commanded poses at the samples.
        divisible: whether statements may be added before the statement of the move with that index; called only for
            moves that need some.
    """
    samples = division.samples
    shift = T_commanded[:, :3, 3] - samples.T_work_tcp[:, :3, 3]
    curves = samples.curves
    worst = _chord_deviations(samples, shift, division.weight)
    limit = SHARE * division.tolerance
    result = []
    for i in np.flatnonzero(samples.goal > samples.start).tolist():
        if not curves.arc[i] and (curves.joint[i] or worst[i] <= limit[i]):
            continue
        result.append((_arcs if curves.arc[i] else _vertices)(division, i, T_commanded, divisible(i)))
    return result


def _arcs(division: Division, i: int, T_commanded: Array, divisible: bool) -> Pieces:
    """Division of arc i into the fewest arcs within tolerance; if not divisible, one arc with its best circle point.

    Args:
        T_commanded: (n, 4, 4) commanded poses at all samples.
    """
    samples, limit = division.samples, SHARE * float(division.tolerance[i])
    begin, curves = int(samples.start[i]), samples.curves
    intervals = int(samples.goal[i]) - begin
    rows = slice(begin, begin + intervals + 1)
    part = max(SHORTEST_PIECE / curves.length[i], SMALLEST_PIECE / curves.angle[i], 2 / intervals)
    shortest = int(np.ceil(part * intervals - 1e-9)) if divisible else intervals
    allowed = _outside_zones(samples, i, samples.u[rows])
    arcs, reached = place_arcs(T_commanded[rows, :3, 3], limit, shortest, allowed, division.weight[rows])
    return Pieces(i, tuple(begin + b for _, b in arcs[:-1]), tuple(begin + v for v, _ in arcs), reached)


def _vertices(division: Division, i: int, T_commanded: Array, divisible: bool) -> Pieces:
    """Division of line i into the fewest lines within tolerance; no added target, not ``reached``, if indivisible.

    Args:
        T_commanded: (n, 4, 4) commanded poses at all samples.
    """
    if not divisible:
        return Pieces(i, (), (), False)
    samples, limit = division.samples, SHARE * float(division.tolerance[i])
    begin, curves = int(samples.start[i]), samples.curves
    rows = slice(begin, int(samples.goal[i]) + 1)
    shift = T_commanded[rows, :3, 3] - samples.T_work_tcp[rows, :3, 3]
    direction, u = curves.chord[i] / max(curves.length[i], 1e-12), samples.u[rows]
    allowed = _outside_zones(samples, i, u)
    vertices, reached = place_vertices(u, perpendicular(shift, direction), allowed, limit, division.weight[rows])
    return Pieces(i, tuple(begin + v for v in vertices), (), reached)


def left_by_targets(division: Division, i: int, T_commanded: Array) -> tuple[int, float]:
    """How many targets on move i keep its tolerance, and the largest weighted distance [m] that these leave.

    Args:
        T_commanded: (n, 4, 4) commanded poses at all samples.
    """
    samples = division.samples
    pieces = (_arcs if samples.curves.arc[i] else _vertices)(division, i, T_commanded, True)
    edges = [int(samples.start[i]), *pieces.goals, int(samples.goal[i])]
    p, left = T_commanded[:, :3, 3], 0.0
    for k, (a, b) in enumerate(pairwise(edges)):
        rows = slice(a, b + 1)
        if pieces.vias:
            gaps = circle_gaps(p[rows], p[a], p[pieces.vias[k]], p[b])
        else:
            gaps = np.linalg.norm(perpendicular(p[rows] - p[a], (p[b] - p[a]) / np.linalg.norm(p[b] - p[a])), axis=1)
        left = max(left, float((division.weight[rows] * gaps).max()))
    return len(pieces.goals), left


def divided_alike(samples: Samples, pieces: Sequence[Pieces], divisible: Callable[[int], bool]) -> list[Pieces]:
    """The pieces, with all runs of a statement divided at the fractions of the run that needs most targets.

    A statement runs more than once in a loop or a shared routine, but has one text. A run stays divided as it was if
    its samples do not allow these fractions.

    Args:
        divisible: whether statements may be added before the statement of the move with that index.
    """
    most: dict[StatementKey, Pieces] = {}
    for part in pieces:
        key = samples.moves[part.move].event.statement.key
        if len(part.goals) > len(most[key].goals if key in most else ()):
            most[key] = part
    found = {part.move: part for part in pieces}
    size = samples.goal - samples.start
    for i, move in enumerate(samples.moves if most else ()):
        like = most.get(move.event.statement.key)
        if like is None or i == like.move or not divisible(i) or move.resumes_from is not None:
            continue
        if size[i] == size[like.move]:
            on = int(samples.start[i] - samples.start[like.move])
            goals, vias = (tuple(k + on for k in row) for row in (like.goals, like.vias))
            found[i] = Pieces(i, goals, vias, like.reached)
        elif not like.vias and (goals := _at_shares(samples, i, samples.u[list(like.goals)])):
            found[i] = Pieces(i, goals, (), like.reached)
    return [found[i] for i in sorted(found)]


def _at_shares(samples: Samples, i: int, shares: Array) -> tuple[int, ...]:
    """The samples of line i nearest to fractions ``shares`` of its length.

    Empty if two fall on the same sample, or one falls within the zone at an end.
    """
    rows = slice(int(samples.start[i]), int(samples.goal[i]) + 1)
    u = samples.u[rows]
    nearest = np.abs(u - shares[:, None]).argmin(axis=1) if len(u) > 1 else np.zeros(0, int)
    fit = len({*nearest.tolist()}) == len(shares) and _outside_zones(samples, i, u)[nearest].all()
    return tuple((int(samples.start[i]) + nearest).tolist()) if fit else ()


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
