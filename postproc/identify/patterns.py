"""Free patterns of channels: steps, kinks, waves, windows, low powers and products, without a physical name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import State
from postproc.effects.geometry import point_acceleration
from postproc.identify.channels import shown, varies

STEPS, KINKS, HARMONICS = 24, 9, (1, 2, 3)
SWAYS = 12
"""Most periods of a sway in time over the whole measurement."""
GAP = 0.08
"""Share of a channel's range in which nothing was measured: a step there is what any smooth function does as well."""
FINE = 400


@dataclass(frozen=True)
class Pattern:
    """A function of channels, (n,) values without physical unit.

    Args:
        channels: names; text: such as ``step near 22 deg``.
        source: the channel itself, where the pattern has an edge, a knot or a phase that can be moved.
    """

    channels: tuple[str, ...]
    text: str
    values: Array
    source: Array | None = None


def patterns(channels: Mapping[str, Array], state: State) -> list[Pattern]:
    """All patterns of the channels of measured rows, and of where gravity and acceleration pull the tool."""
    found: list[Pattern] = []
    for name, values in channels.items():
        found += _of_one(name, values)
    names = list(channels)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            found += _of_two(first, channels[first], second, channels[second])
    for a, b in pairwise(names):
        if a[0] == b[0] == "q":
            found += _sums(a, channels[a], b, channels[b])
    if {"x", "y"} <= set(names):
        x, y = channels["x"], channels["y"]
        found.append(Pattern(("x", "y"), "grows with the square of the distance from joint 1", _unit(x**2 + y**2)))
    return [*found, *_pulls(state)]


def _of_one(name: str, values: Array) -> Iterator[Pattern]:
    distinct = np.unique(values)
    if len(distinct) <= 4:
        # Approach sides, payloads, sessions: their own value, and being one of them.
        yield Pattern((name,), "proportional", values)
        if len(distinct) > 2:
            for value in distinct:
                yield Pattern((name,), f"at {shown(name, float(value))}", (values == value).astype(float))
        return
    centre, half = float(np.median(values)), 0.5 * float(np.ptp(values))
    scaled = (values - centre) / half
    yield Pattern((name,), "proportional", scaled)
    yield Pattern((name,), "curved", scaled**2)
    yield Pattern((name,), "s-shaped", scaled**3)
    span = np.quantile(values, np.linspace(0.04, 0.96, STEPS))
    across = [0.0] if values.min() < 0 < values.max() else []
    for edge in [*span, *across]:
        if _measured(distinct, float(edge)):
            yield _step(name, values, float(edge))
    for knot in [*np.quantile(values, np.linspace(0.1, 0.9, KINKS)), *across]:
        yield _kink(name, values, float(knot))
    if name.startswith("q"):
        for k in HARMONICS:
            for phase in (0.0, np.pi / 2):
                yield _wave((name,), values, k, phase)
    if name == "time":
        since = (values - values.min()) / max(float(np.ptp(values)), 1e-300)
        for share in (0.05, 0.1, 0.2, 0.4):
            yield Pattern((name,), f"settling within {shown(name, share * 2 * half)}", np.exp(-since / share))
        for k in range(2, 2 * SWAYS + 1):
            for phase in (0.0, np.pi / 2):
                yield _sway(values, k / 2, phase)
    for k in range(1, STEPS - 2, 2):
        for width in (2, 4):
            if k + width < STEPS:
                inside = (values > span[k]) & (values < span[k + width])
                text = f"only between {shown(name, float(span[k]))} and {shown(name, float(span[k + width]))}"
                yield Pattern((name,), text, inside * 1.0)


def _of_two(first: str, a: Array, second: str, b: Array) -> Iterator[Pattern]:
    text = f"product of {first} and {second}"
    names = (first, second)
    yield Pattern(names, text, _unit(a * b))
    yield Pattern(names, text, _unit((a - a.mean()) * (b - b.mean())))
    if first[0] == second[0] == "q":
        for k in HARMONICS:
            for j in HARMONICS:
                for f, g in ((np.sin, np.sin), (np.sin, np.cos), (np.cos, np.sin), (np.cos, np.cos)):
                    yield Pattern(names, f"product of {k} {first} and {j} {second} waves", f(k * a) * g(j * b))
    elif first[0] == "q" and second not in ("x", "y", "z"):
        for k in HARMONICS:
            for f in (np.sin, np.cos):
                yield Pattern(names, f"product of {k} {first} waves and {second}", _unit(f(k * a) * b))
    for sign, size, order in ((a, b, names), (b, a, names[::-1])):
        if order[0].startswith(("dir", "v")) and order[1].startswith("load"):
            value = _unit(np.sign(sign) * np.abs(size))
            yield Pattern(order, f"side of {order[0]} times size of {order[1]}", value)


def _sums(first: str, a: Array, second: str, b: Array) -> Iterator[Pattern]:
    """Waves of what two neighbouring joints turn together: linkages, and angles against gravity."""
    for k in HARMONICS:
        for sign in (1, -1):
            for phase in (0.0, np.pi / 2):
                yield _wave((first, second), a + sign * b, k, phase, f" of {first} {'+' if sign > 0 else '-'} {second}")


def _pulls(state: State) -> Iterator[Pattern]:
    """Gravity, and the acceleration of the flange, as the tool feels them: along its axes, and by their side."""
    assert state.T_base_body is not None
    body = np.asarray(state.T_base_body)[:, 6]
    wrist = ("q5", "q6", "q4", "q3", "q2")
    pulls = [("gravity", wrist, np.broadcast_to(state.gravity, (len(body), 3)))]
    if state.a is not None and state.v is not None and state.robot is not None:
        a = point_acceleration(state.robot, np.asarray(state.T_base_body), state.v, state.a, 6, body[:, :3, 3])
        pulls.append(("acceleration", ("a1", "a2", "a3", "a4", "a5"), a))
    for what, names, pull in pulls:
        felt = np.einsum("nji,nj->ni", body[:, :3, :3], pull)
        for axis, along in zip("xyz", felt.T, strict=True):
            if varies(along):
                yield Pattern(names, f"{what} along {axis} of the tool", _unit(along))
                yield Pattern(names, f"side to which {what} pulls along {axis} of the tool", np.sign(along))


def sharper(pattern: Pattern) -> list[Pattern]:
    """The same with its edge, knot, period or phase at many finer places; none where nothing can be moved."""
    values, names = pattern.source, pattern.channels
    if values is None:
        return []
    kind, name = pattern.text.split(" ")[0], names[0]
    if kind == "swaying":
        return [_sway(values, k, p) for k in np.arange(0.6, SWAYS, 0.1) for p in np.pi / 4 * np.arange(4)]
    if kind == "wave":
        label = pattern.text.partition(" of ")[2]
        label = f" of {label}" if label else ""
        phases = np.pi / 8 * np.arange(8)
        return [_wave(names, values, k, p, label) for k in np.arange(0.5, 6.01, 0.25) for p in phases]
    distinct = np.unique(values)
    if kind == "step":
        edges = 0.5 * (distinct[1:] + distinct[:-1])
        edges = edges[:: max(1, len(edges) // FINE)]
        return [_step(name, values, float(e)) for e in edges if _measured(distinct, float(e))]
    # A step lies between two rows, a kink anywhere.
    low, high = np.quantile(values, [0.02, 0.98])
    return [_kink(name, values, float(e)) for e in np.linspace(low, high, FINE)]


def _step(name: str, values: Array, edge: float) -> Pattern:
    return Pattern((name,), f"step near {shown(name, edge)}", (values > edge).astype(float), values)


def _kink(name: str, values: Array, knot: float) -> Pattern:
    return Pattern((name,), f"kink near {shown(name, knot)}", _unit(np.abs(values - knot)), values)


def _wave(names: tuple[str, ...], values: Array, order: float, phase: float, label: str = "") -> Pattern:
    value = np.asarray(np.cos(order * values - phase), dtype=np.float64)
    return Pattern(names, f"wave {order:g} times a turn{label}", value, values)


def _sway(values: Array, periods: float, phase: float) -> Pattern:
    span = max(float(np.ptp(values)), 1e-300)
    text = f"swaying with a period of {shown('time', span / periods)}"
    angle = 2 * np.pi * periods * (values - values.min()) / span - phase
    return Pattern(("time",), text, np.asarray(np.cos(angle)), values)


def _measured(distinct: Array, edge: float) -> bool:
    at = int(np.searchsorted(distinct, edge))
    if not 0 < at < len(distinct):
        return False
    return bool(distinct[at] - distinct[at - 1] < GAP * (distinct[-1] - distinct[0]))


def _unit(values: Array) -> Array:
    return np.asarray(values / max(float(np.abs(values).max()), 1e-300))
