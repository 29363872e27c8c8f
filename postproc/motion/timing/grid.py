"""Where toppra decides, and how fast the arm may be there at most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.motion.timing.spline import Runs
from postproc.motion.values import Flags, Index

FASTEST = 20.0  # [m/s] stands for no limit
_CLOSE = 1e-6  # [m] toppra loses its footing between grid points that are closer
_SLOW_RAMP = 0.45  # a ramp longer than this share of its interval needs no grid point of its own


@dataclass(frozen=True, slots=True)
class Grid:
    """Points at which toppra decides on the speed: all knots, and the ends of short ramps between them.

    Args:
        s: (g,) path parameter [m].
        run: (g,) index of the run from standstill to standstill.
        cap, floor: (g,) highest and lowest path speed [m/s]: both zero at stops, equal where the speed is prescribed.
        ease: (g,) share of the joints' acceleration limits that may be used.
    """

    s: Array
    run: Index
    cap: Array
    floor: Array
    ease: Array

    def only(self, rows: Flags | slice) -> Grid:
        """The grid of the chosen points, by a mask (g,) or a slice."""
        return Grid(self.s[rows], self.run[rows], self.cap[rows], self.floor[rows], self.ease[rows])


def programmed_speed(runs: Runs) -> Array:
    r"""Highest path speeds (k - 1,) [m/s] that the program permits between neighbouring knots; zero between runs.

    They follow from the speeds of TCP, reorientation and external axes of each move; with ``\T`` the speed is the
    length of the move over its duration.
    """
    moves, index = runs.path.moves, runs.path.move[runs.sample[1:]]
    h = np.diff(runs.s)
    inside = runs.inside
    speed = np.array([m.speed for m in moves])[index]
    rotation = np.array([m.rotation_speed for m in moves])[index]
    with np.errstate(divide="ignore"):
        cap = np.minimum(speed * h / runs.travel, rotation * h / runs.turn)
        for change, kind in zip(runs.slides.T, runs.kinds, strict=True):
            slide = np.array([m.axis_speed[kind] for m in moves])[index]
            cap = np.minimum(cap, slide * h / change)
    duration = np.array([np.nan if m.duration is None else m.duration for m in moves])
    length = np.bincount(index[inside], h[inside], minlength=len(moves))
    cap = np.where(np.isfinite(duration)[index], (length / duration)[index], cap)
    return np.where(inside, np.minimum(cap, FASTEST), 0.0)


def programmed_ease(runs: Runs) -> Array:
    """Share (k - 1,) of the joints' acceleration limits that AccSet leaves in each interval."""
    ease = np.array([m.ease for m in runs.path.moves])
    return np.where(runs.inside, ease[runs.path.move[runs.sample[1:]]], 1.0)


def smooth_speed(runs: Runs) -> Array:
    """Path speeds (k - 1,) [m/s] at which the curvature of the path alone uses half of a joint's jerk limit.

    The jerk is |q'''| s_dot^3, constant in each interval between knots.
    """
    jerk = (np.abs(6 * runs.curve.c[0]) / runs.limits.jerk).max(axis=1)
    return np.cbrt(0.5 / np.maximum(jerk, 0.5 / FASTEST**3))


def lay_grid(runs: Runs, cap: Array, ease: Array, window: Array) -> Grid:
    """Grid points at all knots, and where a ramp between two speeds starts or ends inside an interval.

    A lower speed is reached half a window early and kept half a window longer, so that averaging does not exceed it.

    Args:
        cap: (k - 1,) highest path speed of each interval between knots [m/s].
        ease: (k - 1,) share of the joints' acceleration limits.
        window: (r,) averaging time of each run [s].
    """
    s, inside = runs.s, runs.inside
    slope = runs.curve.c[2]
    with np.errstate(divide="ignore"):
        joint_cap = (runs.limits.speed / np.abs(slope)).min(axis=1)
        ramp = ease * (runs.limits.acceleration / np.abs(slope)).min(axis=1)
    cap = np.where(inside, np.minimum(cap, joint_cap), 0.0)
    reach = 0.5 * cap * window[runs.run[:-1]]
    wide = _lower_over(s, s[:-1] - reach, s[1:] + reach, cap, runs.run)
    at_knot = np.minimum(np.append(wide, np.inf), np.append(np.inf, wide))
    at_knot[runs.ends] = 0.0
    # The end of each ramp, from either side, where it is well inside the interval.
    h = np.diff(s)
    extra = [(s, at_knot, runs.run, np.minimum(np.append(ease, 1.0), np.append(1.0, ease)))]
    for side, low, sign in ((s[:-1], at_knot[:-1], 1.0), (s[1:], at_knot[1:], -1.0)):
        length = np.maximum(wide**2 - low**2, 0.0) / (2 * ramp)
        wanted = inside & (length > _CLOSE) & (length < _SLOW_RAMP * h) & (low < 0.98 * wide)
        extra.append(((side + sign * length)[wanted], wide[wanted], runs.run[:-1][wanted], ease[wanted]))
    all_s, all_cap, all_run, all_ease = (np.concatenate(column) for column in zip(*extra, strict=True))
    order = np.argsort(all_s, kind="stable")
    return Grid(all_s[order], all_run[order], all_cap[order], np.zeros(len(order)), all_ease[order])


def _lower_over(s: Array, low: Array, high: Array, cap: Array, run: Index) -> Array:
    """Smallest cap (k - 1,) among all intervals of a run whose reach [low, high] touches the interval.

    Found by a sparse table in reverse: every reach is covered by two blocks of a power of two, whose caps are then
    passed down to their halves.

    Args:
        s: (k,) path parameter of the knots [m].
        low, high: (k - 1,) reach of each interval [m].
        run: (k,) run of each knot.
    """
    m = len(cap)
    first = np.searchsorted(run[:-1], run[:-1], side="left")
    last = np.searchsorted(run[:-1], run[:-1], side="right") - 1
    a = np.clip(np.searchsorted(s, low, side="right") - 1, first, np.arange(m))
    b = np.clip(np.searchsorted(s, high, side="left") - 1, np.arange(m), last)
    level = np.frexp((b - a + 1).astype(float))[1] - 1
    table = np.full((int(level.max(initial=0)) + 1, m), np.inf)
    np.minimum.at(table, (level, a), cap)
    np.minimum.at(table, (level, b - (1 << level) + 1), cap)
    for n in range(len(table) - 1, 0, -1):
        half = 1 << (n - 1)
        table[n - 1] = np.minimum(table[n - 1], table[n])
        table[n - 1, half:] = np.minimum(table[n - 1, half:], table[n, :-half])
    return table[0]
