"""The averaged time law against averaging by hand, and inverted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from postproc.motion.timing.spline import fit_spline
from postproc.motion.timing.timelaw import evaluate, time_law, times_at


def two_runs(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    sizes = rng.integers(2, 12, 2)
    run = np.repeat([0, 1], sizes)
    s = np.cumsum(rng.uniform(0.001, 0.1, len(run)))
    speed = rng.uniform(0.05, 1.0, len(run))
    ends = np.append(True, np.diff(run) > 0) | np.append(np.diff(run) > 0, True)
    if sizes.min() == 2:
        # A run of one interval can only stand at both ends: give it a middle.
        return two_runs(seed + 1000)
    return run, s, np.where(ends, 0.0, speed), rng.uniform(0.02, 0.3, 2)


@given(st.integers(0, 500))
def test_averaging(seed: int) -> None:
    run, s, speed, window = two_runs(seed)
    law = time_law(run, s, speed, window)
    for r in (0, 1):
        W, rows = window[r], run == r
        end = law.t[law.last[r]]
        fine = np.linspace(-W, end + W, 20_001)
        sharp = np.zeros_like(fine)
        for i in np.flatnonzero(rows)[:-1]:
            tau = np.clip(fine - law.t[i], 0.0, law.t[i + 1] - law.t[i])
            sharp += speed[i] * tau + law.acceleration[i] * tau**2 / 2
        area = np.concatenate([[0.0], np.cumsum((sharp[1:] + sharp[:-1]) / 2 * np.diff(fine))])
        t = np.linspace(0.0, end + W, 50)
        by_hand = (np.interp(t, fine, area) - np.interp(t - W, fine, area)) / W
        at, v, a, _ = evaluate(law, np.full(50, r), t)
        assert at == pytest.approx(by_hand, abs=1e-5)
        assert (np.diff(at) >= -1e-12).all()
        assert (v <= speed.max() + 1e-9).all()
        assert (np.abs(a) <= np.abs(law.acceleration).max() + 1e-9).all()
        assert v[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert a[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-6)


@given(st.integers(0, 500))
def test_times_at_distances(seed: int) -> None:
    run, s, speed, window = two_runs(seed)
    law = time_law(run, s, speed, window)
    t = times_at(law, run, law.s)
    at, _, _, _ = evaluate(law, run, t)
    assert at == pytest.approx(law.s, abs=1e-9)
    assert t[law.last] == pytest.approx(law.duration)


def test_splines_of_runs_are_those_of_scipy_inside() -> None:
    """One long run: against scipy's spline with parabolic ends, built from its own slopes at the ends."""
    rng = np.random.default_rng(3)
    s = np.cumsum(rng.uniform(0.5, 1.5, 40))
    q = np.sin(s[:, None] * np.linspace(0.1, 0.4, 6))
    run = np.zeros(40, dtype=np.int64)
    ours = fit_spline(s, q, run)
    ends = ours(np.array([s[0], np.nextafter(s[-1], 0.0)]), 1)
    theirs = CubicSpline(s, q, bc_type=((1, ends[0]), (1, ends[1])))
    x = np.linspace(s[0], s[-1] - 1e-9, 500)
    for order in (0, 1, 2):
        assert np.abs(ours(x, order) - theirs(x, order)).max() < 1e-9
    assert np.abs(ours.c[0][[0, -1]]).max() < 1e-9
    for order, value in enumerate(ours.derivatives(x), start=1):
        assert np.abs(value - theirs(x, order)).max() < 1e-8


def test_runs_do_not_feel_each_other() -> None:
    s = np.array([0.0, 1.0, 2.0, 2.1, 3.0, 3.5, 3.6, 4.0])
    q = np.arange(48.0).reshape(8, 6) ** 1.3
    run = np.array([0, 0, 0, 1, 1, 1, 2, 2])
    whole = fit_spline(s, q, run)
    for r in range(3):
        rows = np.flatnonzero(run == r)
        alone = fit_spline(s[rows], q[rows], run[rows] - r)
        x = np.linspace(s[rows[0]], s[rows[-1]] - 1e-9, 20)
        assert np.abs(whole(x) - alone(x)).max() < 1e-9
    # A run of one interval is a straight line.
    assert np.abs(whole(np.array([3.8]), 2)).max() < 1e-9
