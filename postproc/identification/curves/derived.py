"""Curves of what is derived from channels: forces on tool and footing, an instrument's readings, earlier rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.channels.expression import channel
from postproc.channels.memory import lag, play, rows_before
from postproc.channels.sight import Site, measured_point, seen_point
from postproc.channels.state import State
from postproc.channels.tool import FORCES, force_on_tool
from postproc.channels.units import varies
from postproc.effects.terms import LEANS
from postproc.identification.curves.form import Block, CurveForm, SignalFunction, block, product_of, side_by_side
from postproc.identification.curves.functions import (
    GEAR,
    LEVELLING,
    LOW,
    ORIGIN,
    ROOT,
    SQUARE,
    breaks,
    fixed,
    line,
    of_signal,
    sways,
    waves,
)
from postproc.identification.curves.signal import Signal

MOMENT = ("load2", "q1", "x", "y")
"""Channels that the overturning moment follows."""
LEANING = "the overturning moment"
MOMENT_AXES = 4
"""Horizontal axes about which the footing is asked, half a turn apart in all."""
TOOL_FORCES = {
    "gravity": ("gravity", ("q5", "q6", "q4", "q3", "q2")),
    "acceleration": ("acceleration", ("a1", "a2", "a3", "a4", "a5")),
    "weight": ("payload's weight", ("payload", "q5", "q6", "q4")),
    "force": ("process force", ("fx", "fy", "fz", "q5", "q6")),
}
"""What a tool feels (`channels.tool.FORCES`): its name for people, and the channels that it follows."""


def pulls(state: State, site: Site) -> Iterator[Block]:
    """Yield curves of each component, along the tool's axes, of gravity, acceleration, weight and process force.

    A tool that is not held firmly moves with them. Components that do not vary are left out, and so is the weight of a
    payload that does not vary, which is that of gravity.

    Args:
        site: where the measured point is on the tool, of which the acceleration is taken.
    """
    for kind in FORCES:
        force = force_on_tool(state, kind, np.array(site.point))
        if force is None or (kind == "weight" and not varies(np.asarray(state.payload_mass))):
            continue
        what, channels = TOOL_FORCES[kind]
        for k, axis in enumerate("xyz"):
            if varies(force[:, k]):
                signal = Signal(channels, force[:, k], f"{kind}_{axis}", what, f"{what} along {axis} of the tool")
                for some in of_signal(signal):
                    # In proportion, it pulls on hoses and joints as well.
                    where = None if some.like.kind == "line" else "tool"
                    yield some.with_(where=where)


def overturning(state: State, others: Iterable[Signal] = ()) -> tuple[list[Block], list[CurveForm]]:
    """Return curves, with one size and with several, of the moment with which the arm leans on its footing.

    They describe anchors that lift or rock and legs that stiffen; what is proportional to the moment is left to the
    effect `base_compliance`. The moment is taken about `MOMENT_AXES` horizontal axes, about x and y with a size for
    each, and by its magnitude. Both lists are empty where loads are not known.

    Args:
        others: signals by which a footing may soften, such as a temperature.
    """
    moment = channel("leaning").values(state)
    if moment is None:
        return [], []
    axes = (_moment(state, float(way)) for way in np.pi / MOMENT_AXES * np.arange(MOMENT_AXES))
    some = [b for s in axes if varies(s.values) for b in of_signal(s) if b.like.kind not in ("line", "window")]
    blocks = [b.with_(where="base", kind=f"{b.like.kind} of the moment") for b in some]
    both, wide = [_moment(state, 0.0), _moment(state, np.pi / 2)], list[CurveForm]()
    if all(varies(s.values) for s in both):
        # Legs and anchors at two sides each, or a footing that is alike all around.
        for word, basis, numbers in (("square", "sided_square", ()), ("cube", "cube", (0.0, 1.0))):
            sentence = f"growing with the {word} of the overturning moment about x and about y, to its side"
            curve = fixed(basis, sentence, "leaning", numbers=numbers)
            wide.append(side_by_side((block(curve, s)[0] for s in both), sentence, "leaning", "base"))
        for other in others:
            sentence = f"the overturning moment about x and about y times {other.full_label}"
            parts = (product_of(line(other), line(s), "leaning")[0] for s in both)
            wide.append(side_by_side(parts, sentence, "leaning", "base"))
    size = Signal(MOMENT, moment, "leaning", "load", LEANING)
    if varies(size.values):
        always = fixed("line", "to the side of {label}, however large", "curve", numbers=ORIGIN)
        one = replace(size, values=np.ones(len(moment)), name="1")
        some = [block(always, one), *(block(curve, size) for curve in (ROOT, SQUARE))]
        some.append(block(LEVELLING, size, [(k,) for k in np.quantile(size.values, np.linspace(0.1, 0.9, 9))]))
        blocks += [b.with_(where=LEANS, kind=f"{b.like.kind} of the moment") for b in (*some, *breaks(size))]
        for other in others:
            blocks.append(product_of(line(size), line(replace(other, label=other.full_label)), "leaning", LEANS))
            if other.values.min() > 0:
                over = fixed("inverse", f"over {other.full_label}", "leaning", f"one over {other.full_label}")
                blocks.append(product_of(line(size), block(over, other), "leaning", LEANS))
    return blocks, wide


def _moment(state: State, way: float) -> Signal:
    """Return the overturning moment [N m] about a horizontal axis at an angle [rad] from x, as a signal."""
    degrees = float(np.degrees(way))
    axis = {0: "x", 90: "y"}.get(round(degrees), f"an axis {degrees:.0f} deg from x")
    c = channel(f"lean({degrees:.6g} deg)")
    values = c.values(state)
    assert values is not None

    def near(level: int) -> list[Signal]:
        """Return moments about eight axes nearby, closer at higher levels."""
        apart = np.pi / (8 * MOMENT_AXES) / 4**level
        return [_moment(state, float(other)) for other in way + apart * np.arange(-4, 5) if other != way]

    return Signal(MOMENT, values, c.name, "load", f"the overturning moment about {axis}", near=near)


WRIST_AXES = ("q5", "q6", "q4")
"""Channels that turn the tool most."""


def readings(state: State, site: Site, slow: Iterable[Signal] = ()) -> Iterator[Block]:
    """Yield curves of the instrument's readings and of the beam's direction in tool axes, and a constant error.

    Args:
        state: with the poses of bodies filled in; site: where the measured point and the instrument are.
        slow: channels, such as temperatures, by which the air may bend and stretch the line of sight.
    """
    elevation = posed(state, site, "seen_elevation", ("elevation",), unit="q", label="the instrument's elevation")
    distance = posed(state, site, "seen_distance", ("distance",), unit="x", label="the instrument's distance")
    turn = posed(state, site, _azimuth("seen_azimuth", seen_point(state, site)), ("azimuth",), unit="q", label="")
    for signal in (replace(turn, label="the instrument's azimuth atan2(y, x)"), elevation, distance):
        yield from _shapes(signal, "instrument")
    # Names of channels tell where the arm is on its base alone.
    for axis in "xyz" if state.T_reference_base is None else "":
        for way in ("to", "around"):
            label = f"the beam's angle {way} axis {axis} of the tool"
            yield from _shapes(
                posed(state, site, f"beam_{way}_{axis}", WRIST_AXES, unit="q", label=label), "instrument", max(LOW) + 1
            )
    for air in slow:
        yield product_of(line(replace(air, label=air.full_label)), line(distance), "product", "instrument")
    always = Signal(("x", "y", "z"), np.ones(len(state)), "1", "", "")
    yield block(fixed("line", "the same everywhere", "field", numbers=ORIGIN), always, where="instrument")


def around(state: State, site: Site) -> Iterator[Block]:
    """Yield curves and waves of the tool's azimuth about joint 1, for a footing that turns or tilts with it."""
    name = _azimuth("azimuth", measured_point(state, site))
    return _shapes(posed(state, site, name, ("azimuth",), unit="q", label="the tool's azimuth atan2(y, x)"), "base")


def posed(state: State, site: Site, name: str, leading: tuple[str, ...], *, unit: str, label: str) -> Signal:
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


REACHES = np.geomspace(0.03, 0.6, 7)
"""How far something is dragged before it slips, in the range of what drags it."""
LAGS = np.geomspace(0.02, 1.0, 7)
"""How late something follows a channel, in the time of the whole measurement."""
LAGGED_KINDS = ("line", "level", "curve", "step")
"""Kinds of curves of where the arm stood in the row before."""


def memories(signals: Mapping[str, Signal], session: Array | None = None) -> Iterator[Block]:
    """Yield blocks of curves that depend on the row before: channel values there, their change, and what drags along.

    A row in which no joint moved takes its values from the last row in which one did.

    Args:
        signals: channels by name, rows in the order of measuring.
        session: (n,) session of each row; the first row of a session has no row before it.
    """
    angles = [s.values for s in signals.values() if s.leading[0] == "q" and s.leading[1:].isdigit()]
    if not angles:
        return
    last, earlier = rows_before(np.stack(angles, axis=1), session)
    for name, signal in signals.items():
        before = signal.values[earlier]
        way = replace(signal, values=signal.values[last] - before, name=f"rise({signal.name})", column=False)
        yield block(fixed("side", "whether it rose or fell since the row before", "way"), way)
        yield block(fixed("line", "by how much it rose since the row before", "way", numbers=ORIGIN), way)
        yield block(fixed("size", "by how much it rose or fell since the row before", "way"), way)
        if name == "payload" or name[0] == "q":
            label = f"{name} in the row before"
            then = replace(signal, values=before, name=f"before({signal.name})", label=label, column=False)
            some = [b for b in of_signal(then) if b.like.kind in LAGGED_KINDS]
            for one in [*some, waves(then, LOW)] if name[0] == "q" else some:
                yield one.with_(kind="before")
        if name[0] == "q" or name.startswith("load"):
            sentence = f"dragged along by {name}, and slipping after {{n0}} to either side, from row to row"
            unit = "mrad" if name[0] == "q" else "N m"
            curve = SignalFunction("line", sentence, "dragged", ("reach",), derived=("play", unit, play))
            yield block(curve, signal, [(share * np.ptp(signal.values),) for share in REACHES])


def lags(signals: Mapping[str, Signal]) -> Iterator[Block]:
    """Yield curves that follow a temperature or an own column of the table with a time lag; none without ``time``.

    Args:
        signals: of all channels, by name.
    """
    warm = [s for s in signals.values() if s.leading == "temperature" or s.column]
    for signal in warm if "time" in signals else ():
        time, sentence = signals["time"].values, f"following {signal.leading} with a lag of {{n0}}"
        derived = ("lag", "s", lambda x, constant, time=time: lag(x, time, constant))
        curve = SignalFunction("line", sentence, "late", ("reach",), derived=derived)
        yield block(curve, replace(signal, unit="time"), [(share * np.ptp(time),) for share in LAGS])


def creeps(signals: Mapping[str, Signal]) -> Iterator[Block]:
    """Yield curves that follow a joint's load late, from zero on; none without ``time``.

    Args:
        signals: of all channels, by name.
    """
    for signal in (s for name, s in signals.items() if name.startswith("load")) if "time" in signals else ():
        time, sentence = signals["time"].values, f"creeping after {signal.leading} with a time constant of {{n0}}"
        derived = ("creep", "s", lambda x, constant, time=time: lag(x, time, constant, settled=False))
        curve = SignalFunction("line", sentence, "creep", ("reach",), derived=derived)
        yield block(curve, replace(signal, unit="time"), [(share * np.ptp(time),) for share in LAGS])
