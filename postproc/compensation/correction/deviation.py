"""The proof: how far the real arm is from the programmed curves, along the whole way, for any program text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.compensation.correction.inverse import reached
from postproc.compensation.path.motion import Motion
from postproc.model.arm import Model
from postproc.motion.mounts import Mounts
from postproc.motion.path.curves import Curves
from postproc.motion.path.samples import Samples
from postproc.motion.values import Flags, Index


@dataclass(frozen=True)
class Deviation:
    """Distance of the real TCP from the programmed curves, at n samples of the program that ran and at m targets.

    Args:
        away: (n, 3) [m] from the nearest point of the programmed line or arc, or from the point at the same fraction
            of a joint move, in work axes.
        parts: (n, 3) the same along the path, sideways and along the stick-out (`in_seam_axes`) [m].
        owner: (n,) index of that move; u: (n,) fraction along it.
        space: (n,) on a line or an arc with a known start, not on a joint move.
        steady: (n,) the load of inertia does not change there.
        goal_away: (m, 3) [m] from the programmed target to the real TCP, in work axes.
        goal_along: (m,) its component along the path, or along the weld that begins there; NaN on joint moves.
        goal_steady: (m,) as ``steady``, at the targets.
    """

    away: Array
    parts: Array
    owner: Index
    u: Array
    space: Flags
    steady: Flags
    goal_away: Array
    goal_along: Array
    goal_steady: Flags

    @cached_property
    def distance(self) -> Array:
        """(n,) length of ``away`` [m]."""
        return np.asarray(np.linalg.norm(self.away, axis=1))

    @cached_property
    def across(self) -> Array:
        """(n,) deviation [m] that the arc sees, sideways and along the stick-out; on joint moves the whole distance."""
        return np.where(self.space, np.linalg.norm(self.parts[:, 1:], axis=1), self.distance)

    @cached_property
    def goal_distance(self) -> Array:
        """(m,) length of ``goal_away`` [m]."""
        return np.asarray(np.linalg.norm(self.goal_away, axis=1))

    @cached_property
    def goal_across(self) -> Array:
        """(m,) length of ``goal_away`` across the path [m]; behind joint moves the whole length."""
        return np.sqrt(np.maximum(self.goal_distance**2 - np.nan_to_num(self.goal_along) ** 2, 0.0))

    def largest(self, rows: Flags) -> float:
        """Largest distance [m] over samples chosen by a mask (n,), 0 where there are none."""
        return float(self.distance[rows].max()) if rows.any() else 0.0

    def largest_of_moves(self, rows: Flags, sizes: Array | None = None) -> Array:
        """(m,) largest size [m] along each programmed move over samples chosen by a mask (n,), 0 without any.

        Args:
            sizes: (n,) of each sample [m]; None for the distance.
        """
        worst = np.zeros(len(self.goal_away))
        np.maximum.at(worst, self.owner[rows], (self.distance if sizes is None else sizes)[rows])
        return worst


@dataclass(frozen=True, slots=True)
class Driven:
    """A part of a program that is run on the modelled arm.

    Args:
        motion: samples and states of that part of the text.
        owner: (moves of ``motion``,) index of the programmed move that each move is, or is a part of.
    """

    motion: Motion
    owner: Index


def measure_deviation(model: Model, programmed: Samples, parts: Iterable[Driven]) -> Deviation:
    """Run a program on the model of the real arm, part by part, and compare with the programmed curves.

    Args:
        programmed: samples of the program as the user wrote it.
        parts: the program to run, in consecutive parts.
    """
    m = len(programmed.moves)
    goal_away, goal_steady = np.zeros((m, 3)), np.zeros(m, dtype=bool)
    again = np.array([move.resumes_from is not None for move in programmed.moves])
    columns: list[tuple[Array, Array, Index, Array, Flags, Flags]] = []
    for part in parts:
        ran, of = part.motion.samples, part.owner[part.motion.samples.move]
        in_joints = programmed.curves.joint[of] | (programmed.start[of] == programmed.goal[of])
        away, torch, reached = np.empty((len(of), 3)), np.empty((len(of), 3)), np.empty((len(ran.goal), 4, 4))
        u = np.empty(len(of))
        for rows in part.motion.blocks():
            once, repeated = part.motion.distinct(rows)
            real = _reached(model, part.motion.at(once), ran.mounts_at(once), ran.T_work_tcp[once])[repeated]
            away[rows], u[rows] = away_from_curves(programmed.curves, of[rows], real[:, :3, 3])
            torch[rows] = real[:, :3, 2]
            joints = rows.start + np.flatnonzero(in_joints[rows])
            # Moves that are not divided have as many samples as in the original.
            size = (programmed.goal - programmed.start)[of[joints]]
            at = programmed.start[of[joints]] + np.round(ran.u[joints] * size).astype(int)
            away[joints] = real[joints - rows.start, :3, 3] - programmed.T_work_tcp[at, :3, 3]
            u[joints] = ran.u[joints]
            goals = slice(*np.searchsorted(ran.goal, [rows.start, rows.stop]))
            reached[goals] = real[ran.goal[goals] - rows.start]
        away[again[of]] = 0.0  # counted where it was reached
        steady = part.motion.steady()
        parts = in_seam_axes(away, path_tangents(programmed.curves, of, u), torch)
        parts[in_joints] = 0.0
        columns.append((away, parts, of, u, ~in_joints, steady))
        # In the order of the moves: the last part of a divided move reaches its goal.
        wanted = programmed.T_work_tcp[programmed.goal[part.owner]]
        goal_away[part.owner] = reached[:, :3, 3] - wanted[:, :3, 3]
        goal_steady[part.owner] = steady[ran.goal]
    away, parts, of, u, space, steady = (np.concatenate(column) for column in zip(*columns, strict=True))
    goal_along = np.sum(goal_away * _at_goals(programmed), axis=1)
    return Deviation(away, parts, of, u, space, steady, goal_away, goal_along, goal_steady)


def _at_goals(programmed: Samples) -> Array:
    """(m, 3) unit tangents at the goals in work axes: of a weld that begins there, else of the line or arc; or NaN."""
    curves, m = programmed.curves, len(programmed.moves)
    starts, tangents = (path_tangents(curves, np.arange(m), np.full(m, u)) for u in (0.0, 1.0))
    tangents[curves.joint | ~tangents.any(axis=1)] = np.nan
    welding = np.array([move.welding for move in programmed.moves])
    lit = np.flatnonzero(welding[1:] & ~welding[:-1] & ~np.array([move.starts_chain for move in programmed.moves])[1:])
    tangents[lit] = starts[lit + 1]
    return tangents


def _reached(model: Model, state: State, mounts: Mounts, T_work_tcp: Array) -> Array:
    """T_work_tcp (n, 4, 4) that the real arm reaches if commanded to the poses passed, under the loads of ``state``."""
    seen = mounts.seen(reached(model, state), T_work_tcp)
    if not mounts.stationary.any():
        return seen
    # A stationary tool pushes where it stands, not where it was commanded to be on the work.
    return mounts.seen(reached(model, state.with_(T_flange_tcp=mounts.flange_tcp(seen))), seen)


def away_from_curves(curves: Curves, move: Index, p: Array) -> tuple[Array, Array]:
    """Vectors (n, 3) [m] from the nearest point of each move's line or arc to p, and that point's fraction (n,).

    Args:
        move: (n,) indices of moves.
        p: (n, 3) positions [m] in work axes.
    """
    chord, length = curves.chord[move], curves.length[move]
    away = p - curves.start[move]
    u = np.clip(np.sum(away * chord, axis=1) / np.maximum(length, 1e-12) ** 2, 0.0, 1.0)
    nearest = curves.start[move] + u[:, None] * chord
    rows = np.flatnonzero(curves.arc[move])
    if len(rows):
        i = move[rows]
        d = p[rows] - curves.center[i]
        phi = np.arctan2(np.sum(d * curves.tangent[i], axis=1), np.sum(d * curves.radial[i], axis=1))
        phi = np.where(phi < curves.angle[i] / 2 - np.pi, phi + 2 * np.pi, phi)  # the gap of the circle is split in two
        phi = np.clip(phi, 0.0, curves.angle[i])
        u[rows] = phi / curves.angle[i]
        nearest[rows] = (
            curves.center[i] + np.cos(phi)[:, None] * curves.radial[i] + np.sin(phi)[:, None] * curves.tangent[i]
        )
    return p - nearest, u


def path_tangents(curves: Curves, move: Index, u: Array) -> Array:
    """(n, 3) unit tangents of lines and arcs, in work axes; zero where a move has no length in space.

    Args:
        move: (n,) indices of moves; u: (n,) fractions along them.
    """
    tangent = curves.chord[move]
    rows = np.flatnonzero(curves.arc[move])
    if len(rows):
        i = move[rows]
        phi = (curves.angle[i] * u[rows])[:, None]
        tangent[rows] = np.cos(phi) * curves.tangent[i] - np.sin(phi) * curves.radial[i]
    return _unit(tangent)


def in_seam_axes(vectors: Array, tangent: Array, torch: Array) -> Array:
    """(n, 3) vectors in the coordinates of a seam: along it, sideways, and along the stick-out.

    Sideways is the direction of ``torch`` x ``tangent``; the stick-out is what is left of the torch's axis across the
    path. Where the torch points along the path these two are any pair of directions across it.

    Args:
        vectors: (n, 3); tangent: (n, 3) of the path, unit; torch: (n, 3) z axis of the tool, unit; in the same axes.
    """
    sideways = _unit(np.cross(torch, tangent))
    along_path = np.flatnonzero(~sideways.any(axis=1))
    if len(along_path):
        least = np.eye(3)[np.argmin(np.abs(tangent[along_path]), axis=1)]
        sideways[along_path] = _unit(np.cross(least, tangent[along_path]))
    axes = np.stack([tangent, sideways, np.cross(tangent, sideways)], axis=1)
    return np.asarray(np.einsum("nij,nj->ni", axes, vectors))


def _unit(vectors: Array) -> Array:
    """(n, 3) vectors of length 1; zero where they are shorter than 1e-9."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 1e-9)
