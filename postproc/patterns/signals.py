"""What patterns are functions of: channels and what is made of them, each with its values and as text over a state."""

from __future__ import annotations

import json
import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import State

SIGNS = {
    "add": "+",
    "subtract": "-",
    "multiply": "*",
    "divide": "/",
    "power": "**",
    "remainder": "%",
    "bitwise_and": "&",
    "bitwise_or": "|",
    "greater": ">",
    "less": "<",
}
TOOL = "state.T_base_body[:, 6] @ state.robot.link[6] @ state.T_flange_tcp"
FIELDS = {"dir": "approach", "load": "joint_load", "payload": "payload_mass"}
"""Fields of a state that are called otherwise as channels."""


@dataclass(frozen=True, eq=False)
class Signal:
    """A number in each pose that patterns are functions of.

    Args:
        names: channels that it depends on, the leading one first; values: (n,).
        code: expression of a ``state`` that gives the values; empty where a state alone does not.
        unit: channel whose unit it has; label: what it is called, the channel's name for a channel itself.
        bare: whether its expression needs brackets inside another one.
        near: returns similar signals, the closer the higher the level: a moment about an axis nearby.
    """

    names: tuple[str, ...]
    values: Array
    code: str
    unit: str
    label: str
    bare: bool = False
    near: Callable[[int], Sequence[Signal]] | None = field(default=None, repr=False)

    @property
    def size(self) -> Signal:
        """The absolute value of the signal, ``|q2|``."""
        code = written(np.abs, self)
        text = "" if code is None else text_of(code.draft)
        return replace(self, values=np.abs(self.values), code=text, label=f"|{self.label}|", near=None)

    @property
    def of(self) -> str:
        """Words behind the description of a curve of it: `` of <label>``, empty for a channel itself."""
        return "" if self.is_channel else f" of {self.label}"

    @property
    def name(self) -> str:
        """The leading channel that it follows."""
        return self.names[0]

    @property
    def is_channel(self) -> bool:
        """Whether it is a channel itself, and not computed from one."""
        return self.label == self.name

    @property
    def of_table(self) -> bool:
        """Whether it is computed from a column of the table that the program does not know."""
        return "channels[" in self.code

    @property
    def whole(self) -> str:
        """Its channel's name, followed by the word that it stands for in a column of words: ``door open``."""
        return self.name if self.is_channel else f"{self.name} {self.label}"

    @cached_property
    def middle(self) -> float:
        """The median of its values."""
        return float(np.median(self.values))

    @cached_property
    def distinct(self) -> Array:
        """(k,) its distinct values in ascending order."""
        return np.unique(self.values)


def channel_signal(name: str, values: Array, place: str = "") -> Signal:
    """Return the signal of a channel: its values (n,), with the expression of a state that gives them.

    Args:
        place: expression of a state for the tool's position (`place_code`), for the channels x, y and z.
    """
    base = name.rstrip("123456")
    number = name[len(base) :]
    if base in ("q", "v", "a", "dir", "load") and number:
        code = f"state.{FIELDS.get(base, base)}[:, {int(number) - 1}]"
    elif name in ("temperature", "time", "payload", "session"):
        code = f"state.{FIELDS.get(name, name)}"
    elif name in ("fx", "fy", "fz"):
        code = f"state.wrench[:, {'xyz'.index(name[1])}]"
    elif name in ("x", "y", "z"):
        code = f"{place}[:, {'xyz'.index(name)}]" if place else ""
    else:
        code = f"state.channels[{json.dumps(name, ensure_ascii=False)}]"
    return Signal((name,), values, code, name, name)


def added(signals: Sequence[Signal], sign: str = "+") -> Signal:
    """Return the sum of some signals, or the difference of two, with the unit of the first.

    Args:
        sign: ``+`` or ``-``.
    """
    ways = {"+": operator.add, "-": operator.sub}
    names = tuple(s.name for s in signals)
    values = reduce(ways[sign], (s.values for s in signals))
    code = f" {sign} ".join(s.code for s in signals)
    return Signal(names, values, code, names[0], f" {sign} ".join(names), bare=True)


def channels_read(code: str) -> tuple[str, ...]:
    """Return the channels that an expression of a state reads, each once: ``q``, ``load``, ``pose``, own columns.

    Args:
        code: the expression as text.
    """
    fields = {field: name for name, field in FIELDS.items() if name != "dir"}
    fields |= {"body_load": "load", "T_base_body": "pose"}
    found = re.findall(r'state\.(?!channels)(\w+)|channels\[("(?:[^"\\]|\\.)*")\]', code)
    names = (json.loads(own) if own else fields.get(field, field) for field, own in found)
    return tuple(dict.fromkeys(name for name in names if name not in ("T_flange_tcp", "gravity")))


def tool_poses(state: State) -> Array:
    """Return the poses (n, 4, 4) of the tool in base axes, computed as the expression `TOOL` does."""
    flange = np.asarray(state.T_base_body)[:, 6]
    return np.asarray((flange if state.robot is None else flange @ state.robot.link[6]) @ state.T_flange_tcp)


def place_code(state: State, position: Array) -> str:
    """Return an expression of a state for the tool's position in base axes, (n, 4) homogeneous; empty without a robot.

    Args:
        position: (n, 3) [m] at the state's rows; its mean in the axes of the tool becomes a constant point of the
            expression.
    """
    if state.robot is None or state.T_base_body is None:
        return ""
    T = tool_poses(state)
    point = np.mean(np.einsum("nji,nj->ni", T[:, :3, :3], position - T[:, :3, 3]), axis=0)
    return f"({TOOL} @ [{', '.join(f'{x:.4f}' for x in point)}, 1.0])"


_UNITS = {"q": "rad", "v": "rad/s", "a": "rad/s^2", "load": "N m", "temperature": "K", "time": "s", "payload": "kg"}


@dataclass(frozen=True)
class Way:
    """A parameter of an effect that replaces a number of a formula, its fields as text.

    Args:
        kind: of the number (`MOVED`); value, low, high, typical: start, bounds and typical size in the unit.
    """

    kind: str
    value: str
    unit: str
    low: str
    high: str
    typical: str


Draft = tuple[str | Way, ...]
"""An expression of a state in parts: text, and between it the numbers that a fit may move."""


class Movable(float):
    """A number of a formula that a fit may move: a knot, a width, the order or the phase of a wave, or an edge.

    An edge gives the same values on these rows anywhere between the two measured values beside it.
    """

    def __new__(cls, value: float, kind: str, signal: Signal) -> Movable:
        return super().__new__(cls, value)

    def __init__(self, value: float, kind: str, signal: Signal) -> None:
        self.kind, self.signal = kind, signal

    @property
    def way(self) -> Way:
        """The number as a parameter of an effect: value, unit, bounds and typical size as text."""
        low, high = float(self.signal.values.min()), float(self.signal.values.max())
        at = int(np.searchsorted(self.signal.distinct, self).clip(1, len(self.signal.distinct) - 1))
        below, above = self.signal.distinct[at - 1 : at + 1].tolist()
        hair = 1e-3 * (above - below)  # what was measured on one side stays there
        own, apart = _UNITS.get(self.signal.unit.rstrip("123456"), "1"), np.pi / max(high - low, 1e-300)
        unit, low, high, typical = {
            "knot": (own, min(low, self), max(high, self), 0.1 * (high - low)),
            "edge": (own, below + hair, above - hair, 0.3 * (above - below)),
            "width": (own, 0.1 * self, 10.0 * self, 0.3 * self),
            "order": ("1", self - apart, self + apart, 0.3 * apart),
            "phase": ("rad", self - np.pi, self + np.pi, 0.3),
        }[self.kind]
        return Way(self.kind, f"{self:.7g}", unit, f"{low:.7g}", f"{high:.7g}", f"{typical:.2g}")


def text_of(draft: Draft, names: Mapping[Way, str] | None = None) -> str:
    """Return an expression as text.

    Args:
        draft: parts of the expression.
        names: parameter names that replace the movable numbers; without it these are written as they are.
    """
    return "".join(x if isinstance(x, str) else names[x] if names else x.value for x in draft)


class TracedExpression(np.lib.mixins.NDArrayOperatorsMixin):
    """An expression that records as text what is calculated with it."""

    def __init__(self, draft: Draft, bare: bool = False) -> None:
        """Start from an expression.

        Args:
            draft: text and movable numbers; bare: whether it needs brackets inside another expression.
        """
        self.draft, self.bare = draft, bare

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any) -> TracedExpression:
        sign = SIGNS.get(ufunc.__name__)
        if sign is None:
            return TracedExpression((f"np.{ufunc.__name__}(", *_joined(", ", map(_said, inputs)), ")"))
        closed = (("(", *_said(x), ")") if isinstance(x, TracedExpression) and x.bare else _said(x) for x in inputs)
        return TracedExpression(_joined(f" {sign} ", closed), True)


def _said(x: Any) -> Draft:
    """Return an operand as parts of an expression: those of a traced one, a movable number, or a constant as text."""
    return x.draft if isinstance(x, TracedExpression) else (x.way,) if isinstance(x, Movable) else (f"{x:.7g}",)


def _joined(between: str, parts: Iterable[Draft]) -> Draft:
    """Return several expressions as one, with the text ``between`` put between them."""
    return reduce(lambda first, second: (*first, between, *second), parts)


def written(law: Callable[..., Any], signal: Signal, numbers: Sequence[float] = ()) -> TracedExpression | None:
    """Return the expression of a state that a formula of a signal gives; None where the signal has no expression.

    Args:
        law: the formula, called with the traced signal and the numbers.
    """
    return law(TracedExpression((signal.code,), signal.bare), *numbers) if signal.code else None


def unit(values: Array) -> Array:
    """Return values divided by their largest absolute value."""
    return np.asarray(values / max(float(np.abs(values).max()), 1e-300), dtype=np.float64)
