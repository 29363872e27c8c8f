"""The time law s(t) of runs from rest to rest, made jerk-limited by a moving average in time.

The squared speed from toppra is piecewise linear in s: the path acceleration is constant between grid points.
Averaging s(t) over a window W keeps every bound on speed and acceleration, starts and ends at rest with zero
acceleration, and bounds the jerk:

    s_W(t) = (S(t + W/2) - S(t - W/2)) / W,  S the integral of s;   s_W''' = (s''(t + W/2) - s''(t - W/2)) / W.

The path stays the same, each run takes W longer (Biagiotti, Melchiorri 2012: chains of averaging filters).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.motion.values import Index

_ITERATIONS = 120  # Newton ends after about six; every third step halves the bracket, whatever the law looks like


@dataclass(frozen=True, slots=True)
class TimeLaw:
    """Piecewise constant path acceleration, averaged over each run's window.

    Args:
        run: (g,) run of every grid point; first, last: (r,) grid points where each run begins and ends.
        s: (g,) distance from the start of the run [m]; speed: (g,) [m/s]; t: (g,) time in the run [s]; area: (g,)
            integral of s over t [m s]; acceleration: (g,) of the interval behind each grid point [m/s^2].
        window: (r,) averaging time [s].
    """

    run: Index
    first: Index
    last: Index
    s: Array
    speed: Array
    t: Array
    area: Array
    acceleration: Array
    window: Array

    @property
    def duration(self) -> Array:
        """(r,) time from rest to rest, the window included [s]."""
        return self.t[self.last] + self.window


def time_law(run: Index, s: Array, speed: Array, window: Array) -> TimeLaw:
    """The time law of runs from standstill to standstill, through grid points with prescribed path speeds.

    Args:
        run: (g,) run of each grid point, ascending; s: (g,) path parameter [m]; speed: (g,) [m/s], zero at run ends.
        window: (r,) averaging time of each run [s].
    """
    first = np.flatnonzero(np.diff(run, prepend=-1))
    last = np.append(first[1:], len(run))[: len(first)] - 1
    inside = np.append(np.diff(run) == 0, False)
    step = np.append(np.diff(s), 0.0)
    ahead = np.append(speed[1:], 0.0)
    dt = np.where(inside, 2 * step / np.maximum(speed + ahead, 1e-12), 0.0)
    acceleration = np.where(inside, (ahead - speed) / np.maximum(dt, 1e-300), 0.0)
    s = s - s[first][run]
    t = _sum_per_run(dt, first, run)
    piece = s * dt + speed * dt**2 / 2 + acceleration * dt**3 / 6
    return TimeLaw(run, first, last, s, speed, t, _sum_per_run(piece, first, run), acceleration, window)


def _sum_per_run(piece: Array, first: Index, run: Index) -> Array:
    """(g,) sum of ``piece`` (g,) over all earlier grid points of the run (stretch from standstill to standstill).

    Args:
        first: (r,) first grid point of each run.
        run: (g,) run of each grid point.
    """
    total = np.concatenate([[0.0], np.cumsum(piece)[:-1]])
    return total - total[first][run]


def _sharp(law: TimeLaw, run: Index, t: Array) -> tuple[Array, Array, Array, Array]:
    """Integral of distance [m s], distance [m], speed and acceleration along the path before averaging, (n,) each.

    Before and after its run (from standstill to standstill) the arm is at rest.

    Args:
        run, t: (n,) run, and time since it began [s].
    """
    end = law.t[law.last][run]
    inner = np.clip(t, 0.0, end)
    # One ascending key for all runs: the time in the run, runs apart by more than the longest lasts.
    stride = float(law.t.max(initial=0.0)) + 1.0
    i = np.searchsorted(law.run * stride + law.t, run * stride + inner, side="right") - 1
    i = np.clip(i, law.first[run], np.maximum(law.last[run] - 1, law.first[run]))
    tau = inner - law.t[i]
    a = law.acceleration[i]
    speed = law.speed[i] + a * tau
    s = law.s[i] + law.speed[i] * tau + a * tau**2 / 2
    area = law.area[i] + law.s[i] * tau + law.speed[i] * tau**2 / 2 + a * tau**3 / 6
    after = np.maximum(t - end, 0.0)
    moving = (t > 0.0) & (t < end)
    return area + s * after, s, np.where(moving, speed, 0.0), np.where(moving, a, 0.0)


def evaluate(law: TimeLaw, run: Index, t: Array) -> tuple[Array, Array, Array, Array]:
    """Distance [m], speed [m/s], acceleration [m/s^2] and jerk [m/s^3] along the path at times of a law, (n,) each.

    Args:
        run, t: (n,) run (stretch from standstill to standstill), and time since it began [s].
    """
    W = law.window[run]
    area1, s1, v1, a1 = _sharp(law, run, t)
    area0, s0, v0, a0 = _sharp(law, run, t - W)
    return (area1 - area0) / W, (s1 - s0) / W, (v1 - v0) / W, (a1 - a0) / W


def times_at(law: TimeLaw, run: Index, s: Array) -> Array:
    """Times (n,) [s] since the start of ``run`` (n,) at which the arm has covered the distances ``s`` (n,) [m].

    Found by Newton steps, with bisection where these leave the bracket. A run goes from standstill to standstill.
    """
    low, high = np.zeros(len(s)), law.duration[run]
    length = law.s[law.last][run]
    t = high * np.clip(s / np.maximum(length, 1e-300), 0.0, 1.0)
    active = np.arange(len(s))
    for iteration in range(_ITERATIONS):
        if len(active) == 0:
            break
        at, v, _, _ = evaluate(law, run[active], t[active])
        miss = at - s[active]
        low[active] = np.where(miss <= 0, t[active], low[active])
        high[active] = np.where(miss >= 0, t[active], high[active])
        newton = t[active] - miss / np.maximum(v, 1e-300)
        safe = (newton > low[active]) & (newton < high[active]) & (iteration % 3 != 2)
        going = (np.abs(miss) > 1e-12) & (high[active] - low[active] > 1e-12)
        next_t = np.where(safe, newton, 0.5 * (low[active] + high[active]))[going]
        active = active[going]
        t[active] = next_t
    t[s <= 0.0] = 0.0
    ended = s >= length
    t[ended] = law.duration[run][ended]
    return t
