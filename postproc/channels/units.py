"""Which channels vary over some rows, and how people read them: the unit, a value, a range."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from postproc.arrays import Array
from postproc.channels.expression import SCALARS, channel, follows_order
from postproc.channels.sight import Site
from postproc.channels.state import State

CHANNEL_UNITS: Mapping[str, tuple[str, float]] = {
    "q": ("deg", 180 / np.pi),
    "v": ("deg/s", 180 / np.pi),
    "a": ("deg/s^2", 180 / np.pi),
    "dir": ("", 1.0),
    "load": ("N m", 1.0),
    "temperature": ("degC", 1.0),
    "time": ("s", 1.0),
    "payload": ("kg", 1.0),
    "fx": ("N", 1.0),
    "fy": ("N", 1.0),
    "fz": ("N", 1.0),
    "x": ("mm", 1e3),
    "y": ("mm", 1e3),
    "z": ("mm", 1e3),
    "session": ("", 1.0),
    "row": ("rows", 1.0),
    "gravity": ("m/s^2", 1.0),
    "acceleration": ("m/s^2", 1.0),
    "payload's": ("N", 1.0),
    "process": ("N", 1.0),
}
"""Unit shown to people and the factor to it, by the channel's name without its number."""


def recorded(state: State, site: Site) -> dict[str, Array]:
    """Return the channels that vary over the rows, (n,) values by name: ``q1``, ``load6`` (by joint), ``time`` ..

    Args:
        state: with poses and joint loads filled in, if they are to be channels; site: of the measured point.
    """
    names = [f"{name}{joint}" for name in ("q", "v", "a", "dir", "load") for joint in range(1, 7)]
    names += [*SCALARS, "fx", "fy", "fz", "x", "y", "z", *(name for name in state.channels if not follows_order(name))]
    values = {name: channel(name).values(state, site) for name in names if name not in state.channels}
    values |= {name: np.asarray(state.channels[name], dtype=float) for name in names if name in state.channels}
    # Where rows touch something, where the point seems to be is the very error.
    known = {name: x for name, x in values.items() if x is not None and varies(x)}
    return {name: x for name, x in known.items() if not (state.touches and name in "xyz")}


def varies(values: Array) -> bool:
    """Return whether all values are finite and their range is more than rounding."""
    return bool(np.isfinite(values).all() and np.ptp(values) > 1e-9 * (1 + np.abs(values).max()))


def unit_of(channel: str) -> tuple[str, float]:
    """Return the unit in which people read a channel such as ``q2`` ("" if unknown), and the factor from SI to it."""
    return CHANNEL_UNITS.get(channel.rstrip("0123456789"), ("", 1.0))


def shown(channel: str, value: float) -> str:
    """Return a channel's value in SI as text in the unit for people, ``22 deg``; ``q1 + q2`` is an angle, too."""
    unit, factor = unit_of(channel.split(" ")[0])
    value *= factor
    return f"{value:.0f} {unit}".rstrip() if abs(value) >= 1000 else f"{value:.3g} {unit}".rstrip()


def within(channel: str, low: float, high: float) -> str:
    """Return a range of a channel (SI) as text in the unit for people, ``22.41 ± 0.63 deg``.

    A range that contains zero is shown as 0 ± its larger limit, a range that is narrow as one value.
    """
    unit, factor = unit_of(channel.split(" ")[0])
    middle, half = 0.5 * (low + high) * factor, 0.5 * (high - low) * factor
    if low <= 0 <= high:
        middle, half = 0.0, max(-low, high) * factor
    if half <= 1e-3 * abs(middle):
        return shown(channel, 0.5 * (low + high))
    digits = max(0, 1 - int(np.floor(np.log10(half))))
    return f"{middle:.{digits}f} ± {half:.{digits}f} {unit}".rstrip()
