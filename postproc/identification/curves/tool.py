"""CurveForms of what the tool and the footing feel: they lie loosely in their seats, or lift off them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from postproc.channels.expression import channel
from postproc.channels.sight import Site
from postproc.channels.state import State
from postproc.channels.tool import FORCES, force_on_tool
from postproc.channels.units import varies
from postproc.effects.places import LEANS
from postproc.identification.curves.form import Block, CurveForm, block, product_of, side_by_side
from postproc.identification.curves.functions import LEVELLING, ORIGIN, ROOT, SQUARE, breaks, fixed, line, of_signal
from postproc.identification.curves.signal import Signal

MOMENT = ("load2", "q1", "x", "y")
"""Channels that the overturning moment follows."""
LEANING = "the overturning moment"
WAYS = 4
"""Horizontal axes about which the footing is asked, half a turn apart in all."""
FELT = {
    "gravity": ("gravity", ("q5", "q6", "q4", "q3", "q2")),
    "acceleration": ("acceleration", ("a1", "a2", "a3", "a4", "a5")),
    "weight": ("payload's weight", ("payload", "q5", "q6", "q4")),
    "force": ("process force", ("fx", "fy", "fz", "q5", "q6")),
}
"""What a tool feels (`channels.tool.FORCES`): its name for people, and the channels that it follows."""


def pulls(state: State, site: Site) -> Iterator[Block]:
    """Yield patterns of each component, along the tool's axes, of gravity, acceleration, weight and process force.

    A tool that is not held firmly moves with them. Components that do not vary are left out, and so is the weight of a
    payload that does not vary, which is that of gravity.

    Args:
        site: where the measured point is on the tool, of which the acceleration is taken.
    """
    for kind in FORCES:
        force = force_on_tool(state, kind, np.array(site.point))
        if force is None or (kind == "weight" and not varies(np.asarray(state.payload_mass))):
            continue
        what, channels = FELT[kind]
        for k, axis in enumerate("xyz"):
            if varies(force[:, k]):
                signal = Signal(channels, force[:, k], f"{kind}_{axis}", what, f"{what} along {axis} of the tool")
                for some in of_signal(signal):
                    # In proportion, it pulls on hoses and joints as well.
                    where = None if some.like.kind == "line" else "tool"
                    yield some.with_(where=where)


def overturning(state: State, others: Iterable[Signal] = ()) -> tuple[list[Block], list[CurveForm]]:
    """Return patterns, with one size and with several, of the moment with which the arm leans on its footing.

    They describe anchors that lift or rock and legs that stiffen; what is proportional to the moment is left to the
    effect `base_compliance`. The moment is taken about `WAYS` horizontal axes, about x and y with a size for each, and
    by its magnitude. Both lists are empty where loads are not known.

    Args:
        others: signals by which a footing may soften, such as a temperature.
    """
    moment = channel("leaning").values(state)
    if moment is None:
        return [], []
    axes = (_moment(state, float(way)) for way in np.pi / WAYS * np.arange(WAYS))
    blocks = [
        b.with_(where="base", kind=f"{b.like.kind} of the moment")
        for signal in axes
        if varies(signal.values)
        for b in of_signal(signal)
        if b.like.kind not in ("line", "window")
    ]
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
        apart = np.pi / (8 * WAYS) / 4**level
        return [_moment(state, float(other)) for other in way + apart * np.arange(-4, 5) if other != way]

    return Signal(MOMENT, values, c.name, "load", f"the overturning moment about {axis}", near=near)
