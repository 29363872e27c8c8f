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
        owner: (n,) index of that move; u: (n,) fraction along it.
        space: (n,) on a line or an arc with a known start, not on a joint move.
        steady: (n,) the load of inertia does not change there.
        goal_distance: (m,) [m] between the real TCP and the programmed target.
        goal_steady: (m,) as ``steady``, at the targets.
    """

    away: Array
    owner: Index
    u: Array
    space: Flags
    steady: Flags
    goal_distance: Array
    goal_steady: Flags

    @cached_property
    def distance(self) -> Array:
        """(n,) length of ``away`` [m]."""
        return np.asarray(np.linalg.norm(self.away, axis=1))

    def largest(self, rows: Flags) -> float:
        """Largest distance [m] over samples chosen by a mask (n,), 0 where there are none."""
        return float(self.distance[rows].max()) if rows.any() else 0.0

    def largest_of_moves(self, rows: Flags) -> Array:
        """(m,) largest distance [m] along each programmed move over samples chosen by a mask (n,), 0 without any."""
        worst = np.zeros(len(self.goal_distance))
        np.maximum.at(worst, self.owner[rows], self.distance[rows])
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
    goal_distance, goal_steady = np.zeros(m), np.zeros(m, dtype=bool)
    again = np.array([move.resumes_from is not None for move in programmed.moves])
    columns: list[tuple[Array, Index, Array, Flags, Flags]] = []
    for part in parts:
        ran, of = part.motion.samples, part.owner[part.motion.samples.move]
        in_joints = programmed.curves.joint[of] | (programmed.start[of] == programmed.goal[of])
        away, u, reached = np.empty((len(of), 3)), np.empty(len(of)), np.empty((len(ran.goal), 4, 4))
        for rows in part.motion.blocks():
            once, repeated = part.motion.distinct(rows)
            real = _reached(model, part.motion.at(once), ran.mounts_at(once), ran.T_work_tcp[once])[repeated]
            away[rows], u[rows] = away_from_curves(programmed.curves, of[rows], real[:, :3, 3])
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
        columns.append((away, of, u, ~in_joints, steady))
        # In the order of the moves: the last part of a divided move reaches its goal.
        wanted = programmed.T_work_tcp[programmed.goal[part.owner]]
        goal_distance[part.owner] = np.linalg.norm(reached[:, :3, 3] - wanted[:, :3, 3], axis=1)
        goal_steady[part.owner] = steady[ran.goal]
    away, of, u, space, steady = (np.concatenate(column) for column in zip(*columns, strict=True))
    return Deviation(away, of, u, space, steady, goal_distance, goal_steady)


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
