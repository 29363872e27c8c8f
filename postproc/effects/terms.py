"""What the terms of a curve are made of: the places at which it may act, and functions of one channel."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.channels.sight import READINGS

SHIFT, TURN = (("shift_m", 3),), (("turn_rad", 3),)
WEIGHT = (("mass_kg", 1), ("moment_kgm", 3))
LEANS = "base, as it leans"
"""The base that tilts the way its overturning moment pulls it, about a point that nobody knows."""
FRAMES = ("instrument, shifted and turned", "base, shifted and turned")
"""What stands somewhere else, or leans about a point that nobody knows."""
SEATED = "tool, shifted and turned"
"""What a flange or a changer does that gives way, where orientations are measured."""
LOADED = {"body 2, under a weight": 2, "body 3, under a weight": 3, "tool, under a weight": 6}
"""What carries a weight that nobody modelled: a tank on the arm, a drum, a tool; and the body that it rides on."""
READ = {"azimuth": "turn_rad", "elevation": "turn_rad", "distance": "shift_m", "scale": "share"}
PLACES: Mapping[str, tuple[tuple[str, int], ...]] = {
    **{f"joint {j}": (("turn_rad", 1),) for j in range(1, 7)},
    "base": TURN,
    "instrument": SHIFT,
    "instrument, turned": TURN,
    **dict.fromkeys(FRAMES, SHIFT + TURN),
    LEANS: (("turn_rad", 1), ("shift_m", 1)),
    "tool": SHIFT,
    SEATED: SHIFT + TURN,
    **{f"instrument, {reading}": ((READ[reading], 1),) for reading in READINGS},
    **dict.fromkeys(LOADED, WEIGHT),
    **{f"body {b}{how}": move for b in range(1, 6) for how, move in (("", TURN), (", shifted", SHIFT))},
}
"""Amplitudes of a law at each place: how many of each parameter of `curve`, along the axes of the place. Joints turn;
so do base and far ends of bodies, which also shift; the tool shifts; instruments shift, turn or read wrongly."""


@dataclass(frozen=True)
class Basis:
    """A function of a channel that a few numbers form.

    Args:
        law: f(x, *numbers) of the channel's values (n,); numbers are single, or (P, 1) for P functions at once.
        symbols: the function in symbols: `{x}` the channel, `{0}`, `{1}` .. the numbers as text.
        numbers: what each number is: edge, knot, width, reach, order, phase, start, duty, or a value that stays.
    """

    law: Callable[..., Any]
    symbols: str
    numbers: tuple[str, ...] = ()


def cosine(x: Any, order: Any, phase: Any) -> Any:
    """Return cos(order x - phase): (n,), or (P, n) in single precision for (P, 1) orders and phases."""
    if np.ndim(order) == 0:
        return np.cos(order * x - phase)
    # Of many waves in single precision, which is many times as fast; within half a turn it is exact enough for that.
    share = (order / (2 * np.pi)) * x - phase / (2 * np.pi)
    return np.cos(2 * np.pi * (share - np.rint(share)).astype(np.float32))


def _cycle(x: Any, order: Any, start: Any) -> Any:
    """Return (order x / (2 pi) - start) mod 1, the share of a period that has passed at x; start is one, too."""
    return (order / (2 * np.pi) * x - start) % 1.0


def _above(x: Any, k: Any) -> Any:
    """Return max(x - k, 0)."""
    return np.maximum(x - k, 0.0)


def _below(x: Any, k: Any) -> Any:
    """Return max(k - x, 0)."""
    return np.maximum(k - x, 0.0)


def _hat(x: Any, a: Any, b: Any, c: Any) -> Any:
    """Return the linear B-spline with knots a < b < c: 1 at b, 0 at a and c and beyond."""
    return np.clip(np.minimum((x - a) / np.maximum(b - a, 1e-12), (c - x) / np.maximum(c - b, 1e-12)), 0.0, 1.0)


def _to_its_side(law: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return the law of |x|, with the sign of x."""
    return lambda x, k: law(np.abs(x), k) * np.sign(x)


CYCLIC = ("order", "start")
BASES: dict[str, Basis] = {
    "line": Basis(lambda x, o: x - o, "({x} - {0})", ("value",)),
    "side": Basis(np.sign, "sign({x})"),
    "size": Basis(np.abs, "|{x}|"),
    "root": Basis(lambda x: np.sqrt(np.abs(x)), "sqrt(|{x}|)"),
    "square": Basis(lambda x: x * x, "{x}^2"),
    "inverse": Basis(lambda x: 1 / np.where(x == 0, np.inf, x), "1/{x}"),
    "sided_root": Basis(lambda x: np.sign(x) * np.sqrt(np.abs(x)), "sign({x}) sqrt(|{x}|)"),
    "sided_square": Basis(lambda x: x * np.abs(x), "{x} |{x}|"),
    "cube": Basis(lambda x, c, h: ((x - c) / h) ** 3, "(({x} - {0}) / {1})^3", ("value", "value")),
    "bow": Basis(lambda x, k: (x - k) ** 2, "({x} - {0})^2", ("knot",)),
    "step": Basis(lambda x, e: x > e, "[{x} > {0}]", ("edge",)),
    "rise": Basis(lambda x, c, w: np.tanh((x - c) / w), "tanh(({x} - {0}) / {1})", ("knot", "width")),
    "kink": Basis(lambda x, k: np.abs(x - k), "|{x} - {0}|", ("knot",)),
    "above": Basis(_above, "max({x} - {0}, 0)", ("knot",)),
    "below": Basis(_below, "max({0} - {x}, 0)", ("knot",)),
    "above_squared": Basis(lambda x, k: _above(x, k) ** 2, "max({x} - {0}, 0)^2", ("knot",)),
    "below_squared": Basis(lambda x, k: _below(x, k) ** 2, "max({0} - {x}, 0)^2", ("knot",)),
    "sided_above": Basis(_to_its_side(_above), "sign({x}) max(|{x}| - {0}, 0)", ("knot",)),
    "sided_below": Basis(_to_its_side(_below), "sign({x}) max({0} - |{x}|, 0)", ("knot",)),
    "window": Basis(lambda x, a, b: (x > a) & (x < b), "[{0} < {x} < {1}]", ("edge", "edge")),
    "bump": Basis(
        lambda x, c, w: np.exp(-0.5 * ((x - c) / w) ** 2), "exp(-(({x} - {0}) / {1})^2 / 2)", ("knot", "width")
    ),
    "level": Basis(lambda x, near, v: np.abs(x - v) < near, "[|{x} - {1}| < {0}]", ("value", "value")),
    "either_level": Basis(
        lambda x, near, v, w: (np.abs(x - v) < near) | (np.abs(x - w) < near),
        "[|{x} - {1}| < {0} or |{x} - {2}| < {0}]",
        ("value", "value", "value"),
    ),
    # A linear spline is a sum of these, one at each inner knot (de Boor 1978).
    "spline": Basis(_hat, "hat({x}; {0}, {1}, {2})", ("knot", "knot", "knot")),
    "levelling": Basis(lambda x, w: np.tanh(x / w), "tanh({x} / {0})", ("reach",)),
    # A curve is asked for states before the first that was measured, too.
    "settling": Basis(lambda x, s, t: np.exp(-(x - s) / t), "exp(-({x} - {0}) / {1})", ("value", "reach")),
    "logarithm": Basis(
        lambda x, s, t: np.log1p(np.maximum((x - s) / t, 0.0)), "log(1 + ({x} - {0}) / {1})", ("value", "reach")
    ),
    "harmonic": Basis(cosine, "cos({0} {x} - {1})", ("order", "phase")),
    "folded": Basis(
        lambda x, k, s: np.abs(np.cos(0.5 * (k * x - 2 * np.pi * s))), "|cos({0} {x} / 2 - pi {1})|", CYCLIC
    ),
    "halved": Basis(
        lambda x, k, s: np.maximum(np.cos(k * x - 2 * np.pi * s), 0.0), "max(cos({0} {x} - 2 pi {1}), 0)", CYCLIC
    ),
    "triangular": Basis(lambda x, k, s: np.abs(2 * _cycle(x, k, s) - 1), "triangle({0} {x} - 2 pi {1})", CYCLIC),
    "saw_tooth": Basis(lambda x, k, s: 2 * _cycle(x, k, s) - 1, "saw({0} {x} - 2 pi {1})", CYCLIC),
    "pulse": Basis(lambda x, k, s, d: _cycle(x, k, s) < d, "pulse({0} {x} - 2 pi {1}, {2})", (*CYCLIC, "duty")),
}
"""Functions by name. Folded, halved and triangular waves go one way or straight up and down: an eccentric that pushes,
a bearing that gives, magnets; a saw tooth is what an encoder does that repeats on each of its marks."""

TIMES = " * "
"""Between the channels of a product, and between their functions."""
GATES: dict[str, tuple[Callable[[Any], Any], str]] = {
    "only": (lambda g: g, "{g}"),
    "except": (lambda g: 1 - g, "(1 - {g})"),
    "reversed": (lambda g: 1 - 2 * g, "(1 - 2 {g})"),
}
"""What a switch g makes of what it multiplies: it acts only there, only elsewhere, and there the other way round."""


def split_name(basis: str) -> tuple[str, str]:
    """Return the gate (empty for none) and the name of a basis such as ``only step``."""
    gate, _, name = basis.rpartition(" ")
    return gate, name


def law_of(basis: str) -> Callable[..., Any]:
    """Return the law of a basis with its gate: f(x, *numbers)."""
    gate, name = split_name(basis)
    law = BASES[name].law
    if not gate:
        return law
    side = GATES[gate][0]
    return lambda x, *numbers: side(law(x, *numbers))


def symbols(basis: str, channel: str, numbers: Sequence[str]) -> str:
    """Return a basis of a channel in symbols, with its numbers as text."""
    gate, name = split_name(basis)
    at_zero = name == "line" and numbers[0].split()[0] == "0"
    text = channel if at_zero else BASES[name].symbols.format(*numbers, x=channel)
    return GATES[gate][1].format(g=text) if gate else text
