"""What an instrument reads of the measured point, azimuth, elevation and distance, and where errors of each move it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.channels.expression import channel
from postproc.channels.sight import Site, measured_point, seen_point
from postproc.channels.state import State
from postproc.channels.units import varies
from postproc.identification.curves.form import Block, block, product_of
from postproc.identification.curves.functions import GEAR, LOW, ORIGIN, fixed, line, of_signal, sways, waves
from postproc.identification.curves.signal import Signal

WRIST = ("q5", "q6", "q4")
"""Channels that turn the tool most."""


def readings(state: State, site: Site, slow: Iterable[Signal] = ()) -> Iterator[Block]:
    """Yield patterns of the instrument's readings and of the beam's direction in tool axes, and a constant error.

    Args:
        state: with the poses of bodies filled in; site: where the measured point and the instrument are.
        slow: channels, such as temperatures, by which the air may bend and stretch the line of sight.
    """
    elevation = posed(state, site, "seen_elevation", ("elevation",), "q", "the instrument's elevation")
    distance = posed(state, site, "seen_distance", ("distance",), "x", "the instrument's distance")
    turn = posed(state, site, _azimuth("seen_azimuth", seen_point(state, site)), ("azimuth",), "q", "")
    for signal in (replace(turn, label="the instrument's azimuth atan2(y, x)"), elevation, distance):
        yield from _shapes(signal, "instrument")
    # Names of channels tell where the arm is on its base alone.
    for axis in "xyz" if state.T_reference_base is None else "":
        for way in ("to", "around"):
            label = f"the beam's angle {way} axis {axis} of the tool"
            yield from _shapes(posed(state, site, f"beam_{way}_{axis}", WRIST, "q", label), "instrument", max(LOW) + 1)
    for air in slow:
        yield product_of(line(replace(air, label=air.full_label)), line(distance), "product", "instrument")
    always = Signal(("x", "y", "z"), np.ones(len(state)), "1", "", "")
    yield block(fixed("line", "the same everywhere", "field", numbers=ORIGIN), always, where="instrument")


def around(state: State, site: Site) -> Iterator[Block]:
    """Yield curves and waves of the tool's azimuth about joint 1, for a footing that turns or tilts with it."""
    name = _azimuth("azimuth", measured_point(state, site))
    return _shapes(posed(state, site, name, ("azimuth",), "q", "the tool's azimuth atan2(y, x)"), "base")


def posed(state: State, site: Site, name: str, leading: tuple[str, ...], unit: str, label: str) -> Signal:
    """Return the signal of a channel of the pose by its name; arguments as in `Signal`."""
    values = channel(name).values(state, site)
    return Signal(leading, np.zeros(len(state)) if values is None else values, name, unit, label)


def _azimuth(name: str, point: Array) -> str:
    """Return the name of an azimuth's channel that jumps by a turn opposite to the mean direction of points (n, 3)."""
    return f"{name}({float(np.arctan2(*point.mean(axis=0)[1::-1])):.4f} rad)"


def _shapes(signal: Signal, where: str, most: int = GEAR) -> Iterator[Block]:
    """Yield the curves of a signal and its waves up to order ``most``, for one place; none of a constant signal."""
    if varies(signal.values):
        some = waves(signal, range(1, most + 1)) if signal.unit == "q" else sways(signal)
        yield from (b.with_(where=where) for b in (*of_signal(signal), some))
