"""When the arm is where, how fast, and under which acceleration that lasts: the timing of a whole program.

What lasts shorter than the arm's first natural period is no quasi-static load.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array, constant
from postproc.channels.state import State
from postproc.compensation.options import Options
from postproc.diagnostics import Diagnostic, has_errors
from postproc.model.arm import Model
from postproc.model.derivatives.stiffness import natural_frequencies
from postproc.model.equilibrium import carries_load
from postproc.motion.findings import once
from postproc.motion.path.samples import Samples, sample_path
from postproc.motion.timing.jerk_limited import Profile
from postproc.motion.timing.trajectory import changes_speed, cut_legs, retime
from postproc.motion.values import Flags

SWIFT = 0.1  # [m/s]: from here on inertia bends the correction where a move speeds up, slows down or turns
# [m]: a torch that turns about a point this near to its TCP turns in place, as fast as the wrist can: there is no way
# along which targets could follow the load of that.
IN_PLACE = 0.003
_MOST_POSES = 200  # poses at which frequencies are computed; they change slowly along a path


@dataclass(frozen=True, slots=True)
class Timeline:
    """k samples of the programmed path in time, corners cut as the controller cuts them.

    Args:
        place: (k,) ascending, as move index + fraction.
        t: (k,) [s].
        q, v, a: (k, 6) nominal joint angles [rad], speeds, and accelerations that last longer than the arm's first
            natural period (zero while the torch turns in place).
        inertia_transient: (k,) whether the load of inertia changes.
        axes_v, axes_a: (k, 6) speeds and lasting accelerations of the external axes [m or rad per s, s^2].
        legs: rows of every leg (part of the program between two stops), and its profile.
    """

    place: Array
    t: Array
    q: Array
    v: Array
    a: Array
    inertia_transient: Flags
    axes_v: Array
    axes_a: Array
    legs: tuple[tuple[slice, Profile], ...]

    def at(self, values: Array, place: Array) -> Array:
        """Values (k,) or (k, j) of the samples, interpolated at places (n,) (move index + fraction): (n,) or (n, j)."""
        if values.ndim == 1:
            return np.interp(place, self.place, values)
        return np.stack([np.interp(place, self.place, column) for column in values.T], axis=1)

    def steady(self, options: Options, place: Array) -> Flags:
        """(n,) whether the load of inertia stays the same at places (move index + fraction); all true without inertia.

        It changes where the TCP speeds up or slows down, and in zone corners passed faster than 0.1 m/s: within a few
        millimetres, which targets cannot follow.
        """
        if not options.inertia:
            return np.ones(len(place), dtype=bool)
        return self.at(self.inertia_transient.astype(float), place) <= 0.0


def plan_timeline(model: Model, samples: Samples) -> tuple[Timeline | None, list[Diagnostic]]:
    """The timing of a program's moves, and the findings of ``sample_path``; None if one of these is an error.

    Raises:
        PostprocError: MOT010, no speed along the path keeps the limits of a joint.
    """
    findings: list[Diagnostic] = []
    parts: list[tuple[Array, ...]] = []
    transient: list[Flags] = []
    legs: list[tuple[slice, Profile]] = []
    turn = np.linalg.norm(samples.curves.turn, axis=1)
    done, rows, begin = 0, 0, 0.0
    for first, moves in cut_legs(samples.moves, samples.goal - samples.start + 1):
        path, warnings = sample_path(model.robot, moves)
        findings += warnings
        if has_errors(findings):
            continue  # with what is wrong elsewhere
        leg = retime(model.robot, path, first_periods(model, path), model.gravity, model.station)
        known = int(first < done)  # the stop that the leg goes on from
        in_place = (samples.curves.length < IN_PLACE * turn)[first + path.move]
        a = np.where(in_place[:, None], 0.0, leg.a_sustained)
        columns = (first + path.move + path.u, begin + leg.t, path.q, leg.v, a, leg.axes_v, leg.axes_a_sustained)
        parts.append(tuple(column[known:] for column in columns))
        transient.append((changes_speed(leg.tcp_speed) | path.blend & (leg.tcp_speed > SWIFT))[known:])  # fast corners
        legs.append((slice(rows - known, rows - known + len(leg.t)), leg.profile.bare()))
        done, rows, begin = first + len(moves), legs[-1][0].stop, begin + float(leg.t[-1])
    if has_errors(findings):
        return None, once(findings)
    place, t, q, v, a, *axes = (np.concatenate(column) for column in zip(*parts, strict=True))
    axes_v, axes_a = map(constant, axes)
    return Timeline(place, t, q, v, a, np.concatenate(transient), axes_v, axes_a, tuple(legs)), once(findings)


def first_periods(model: Model, path: Samples) -> Array:
    """First natural period (n,) [s] at every sample of a path (Eq. 6 of the source paper), 0 for a rigid arm.

    It is computed at no more than 200 samples and interpolated between them.
    """
    n = len(path.q)
    if n == 0 or not carries_load(model):
        return np.zeros(n)
    rows = np.linspace(0, n - 1, min(n, _MOST_POSES)).round().astype(int)
    moves = [path.moves[i] for i in path.move[rows]]
    state = State(
        q=path.q[rows],
        payload_mass=np.array([m.payload_mass for m in moves]),
        payload_center=np.array([m.payload_center for m in moves]),
        T_flange_tcp=path.mounts_at(rows).flange_tcp(path.T_work_tcp[rows]),
    )
    first = natural_frequencies(model, state)[:, 0]
    period = np.where(np.isfinite(first) & (first > 0), 1.0 / np.maximum(first, 1e-3), 0.0)
    return np.interp(np.arange(n), rows, period)
