"""Effects that no library has: what remains must be called unknown, with the channel it follows."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.independent import arm as A
from tests.independent.cells import DEG, Hidden, States, column


def _unknown(
    kind: str, channels: tuple[str, ...], accept: tuple[str, ...] = (), needs: str = "", note: str = "", **parts: Any
) -> Hidden:
    return Hidden(kind, "unknown", accept=accept, channels=channels, needs=needs, note=note, **parts)


def angle_step(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j = int(g.choice([0, 1, 2, 3]))
    at = {0: g.uniform(-40, 40), 1: g.uniform(-5, 40), 2: g.uniform(-30, 15), 3: g.uniform(-60, 60)}[j] * DEG
    size = g.uniform(0.015, 0.03) * DEG * (1 if j < 3 else 2.5)
    return _unknown(
        "angle_step",
        (f"q{j + 1}",),
        ("joint_error_map",),
        note=f"{size / DEG:.3f} deg at {at / DEG:.0f} deg",
        joint=lambda s, tau: column(j, size * (s.q[:, j] > at)),
    )


def kink(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j = int(g.choice([0, 1, 2]))
    at, k = g.uniform(-20, 20) * DEG, g.uniform(0.03, 0.06) * DEG
    return _unknown(
        "kink",
        (f"q{j + 1}",),
        ("joint_error_map",),
        note=f"{k / DEG:.3f} deg/rad",
        joint=lambda s, tau: column(j, k * np.abs(s.q[:, j] - at)),
    )


def friction_load(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j = int(g.choice([1, 2]))
    c = g.uniform(0.010, 0.02) * DEG / (1500 if j == 1 else 800)
    return _unknown(
        "friction_load", (f"dir{j + 1}", f"load{j + 1}"), note=f"joint {j + 1}: {c:.1e} rad/(N m) times direction",
        joint=lambda s, tau: column(j, -c * s.approach[:, j] * np.abs(tau[:, j])),
    )  # fmt: skip


def quadratic_drift(g: np.random.Generator, arm: A.Arm) -> Hidden:
    way = g.normal(size=3)
    size = way / np.linalg.norm(way) * g.uniform(0.4, 0.7) * 1e-3
    return _unknown(
        "quadratic_drift",
        ("time", "temperature"),
        note="frame",
        world=lambda s, p: size * ((s.time / 2.2e4 - 0.5) ** 2 * 4)[:, None],
    )


def warm_up(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j, size, tau0 = int(g.choice([0, 1, 2])), g.uniform(0.015, 0.03) * DEG, g.uniform(1200, 3000)
    return _unknown(
        "warm_up",
        ("time", "temperature"),
        note=f"joint {j + 1} {size / DEG:.3f} deg, {tau0:.0f} s",
        joint=lambda s, tau: column(j, size * (1 - np.exp(-s.time / tau0))),
    )


def joint_product(g: np.random.Generator, arm: A.Arm) -> Hidden:
    a, b = (int(x) for x in g.choice([0, 1, 2, 3], size=2, replace=False))
    size = g.uniform(0.02, 0.035) * DEG
    return _unknown(
        "joint_product",
        (f"q{a + 1}", f"q{b + 1}"),
        note=f"q{a + 1} q{b + 1}",
        joint=lambda s, tau: column(1, size * np.sin(2 * s.q[:, a]) * np.sin(3 * s.q[:, b])),
    )


def payload_squared(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j, size = int(g.choice([1, 2])), g.uniform(0.015, 0.03) * DEG
    return _unknown(
        "payload_squared",
        ("payload", f"load{j + 1}"),
        note=f"joint {j + 1}",
        joint=lambda s, tau: column(j, size * (s.mass / 60.0) ** 2),
    )


def floor_sway(g: np.random.Generator, arm: A.Arm) -> Hidden:
    period, size = g.uniform(3000, 7000), g.uniform(0.1, 0.2) * 1e-3
    way = np.array([np.cos(a := g.uniform(0, 6)), np.sin(a), 0.0])
    return _unknown(
        "floor_sway",
        ("time",),
        note=f"{period:.0f} s",
        world=lambda s, p: size * way * np.sin(2 * np.pi * s.time / period)[:, None],
    )


def tracker_scale(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k = g.uniform(0.8e-4, 1.6e-4) * g.choice([-1, 1])
    return _unknown("tracker_scale", ("x", "y", "z"), note=f"{k:.1e}", world=lambda s, p: k * p)


def gap_by_angle(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j, h = int(g.choice([0, 1, 2])), g.uniform(0.012, 0.02) * DEG
    return _unknown(
        "gap_by_angle",
        (f"dir{j + 1}", f"q{j + 1}"),
        note=f"joint {j + 1}",
        joint=lambda s, tau: column(j, -h * s.approach[:, j] * np.sin(2 * s.q[:, j])),
    )


def speed_squared(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j, k = int(g.choice([0, 1, 2])), g.uniform(4e-4, 8e-4)

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        assert s.v is not None
        return column(j, k * s.v[:, j] ** 2)

    return _unknown("speed_squared", (f"v{j + 1}",), note=f"joint {j + 1}", needs="moving", joint=joint)


def hot_only(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j, k = int(g.choice([0, 1, 2])), g.uniform(0.002, 0.004) * DEG
    return _unknown(
        "hot_only",
        ("temperature", "time"),
        note=f"joint {j + 1} above 32 degC",
        joint=lambda s, tau: column(j, k * np.maximum(s.temperature - 32, 0)),
    )


def payload_by_angle(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k = g.uniform(0.015, 0.03) * DEG
    return _unknown(
        "payload_by_angle",
        ("payload", "q1", "load1"),
        joint=lambda s, tau: column(0, k * s.mass / 60 * np.sin(2 * s.q[:, 0])),
    )


def elbow_wave(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k = g.uniform(0.015, 0.025) * DEG
    return _unknown("elbow_wave", ("q2", "q3"), joint=lambda s, tau: column(1, k * np.sin(3 * (s.q[:, 1] + s.q[:, 2]))))


def gap_of_another(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k = g.uniform(0.008, 0.014) * DEG
    return _unknown("gap_of_another", ("dir3",), joint=lambda s, tau: column(1, k * s.approach[:, 2]))


def step_in_time(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j, at, size = int(g.choice([0, 1, 2])), g.uniform(7000, 15000), g.uniform(0.01, 0.02) * DEG
    return _unknown(
        "step_in_time", ("time", "temperature"), ("session",), joint=lambda s, tau: column(j, size * (s.time > at))
    )


def joint_sway(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j, period, size = int(g.choice([0, 1, 2])), g.uniform(4000, 8000), g.uniform(0.01, 0.02) * DEG
    return _unknown("joint_sway", ("time",), joint=lambda s, tau: column(j, size * np.sin(2 * np.pi * s.time / period)))


def refraction(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k = g.uniform(0.06, 0.12) * 1e-3
    return _unknown("refraction", ("x", "y", "z"), world=lambda s, p: k * (p[:, :1] ** 2 + p[:, 1:2] ** 2) * [0, 0, 1])


def encoder(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k, phase = g.uniform(0.12, 0.2) * 1e-3, g.uniform(0, 2 * np.pi)

    def world(s: States, p: np.ndarray) -> np.ndarray:
        turned = k * np.sin(2 * np.arctan2(p[:, 1], p[:, 0]) + phase)
        return turned[:, None] * np.stack([-p[:, 1], p[:, 0], 0 * turned], axis=1)

    return _unknown("encoder", ("azimuth",), world=world)


def broadband_map(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """Every joint is off by waves of 40 orders at random, amplitudes as 1 / sqrt(order): no few numbers describe it."""
    orders = np.arange(1, 41)
    w = g.normal(size=(6, 40)) / np.sqrt(orders)
    # Of small arms in use 250 to 430 microradian in every joint are known, which is the upper end.
    rms = np.exp(g.uniform(*np.log([0.003, 0.025]), 6)) * DEG
    w *= (rms * np.sqrt(2) / np.linalg.norm(w, axis=1))[:, None]
    phase = g.uniform(0, 2 * np.pi, (6, 40))
    return _unknown(
        "broadband_map",
        tuple(f"q{j}" for j in range(1, 7)),
        ("joint_error_map", "transmission_error"),
        joint=lambda s, tau: (w * np.sin(orders * s.q[:, :, None] + phase)).sum(axis=2),
    )


def gear_lines(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """Three to five waves of one joint whose orders are no whole numbers: teeth and bearings behind a reduction."""
    j, count = int(g.choice([0, 1, 2, 4])), int(g.integers(3, 6))
    orders, phase = np.exp(g.uniform(*np.log([2.0, 60.0]), count)), g.uniform(0, 2 * np.pi, count)
    size = g.uniform(0.004, 0.012, count) * DEG * (1 if j < 3 else 2)
    return _unknown(
        "gear_lines",
        (f"q{j + 1}",),
        ("joint_error_map", "transmission_error"),
        note=f"joint {j + 1} orders {np.round(np.sort(orders), 2).tolist()}",
        joint=lambda s, tau: column(j, (size * np.sin(orders * s.q[:, j, None] + phase)).sum(axis=1)),
    )
