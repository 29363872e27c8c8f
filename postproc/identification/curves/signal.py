"""What curves are functions of: channels and what is derived from them, with their values on the searched rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from postproc.arrays import Array
from postproc.channels.expression import Channel
from postproc.channels.state import State

TABLE = frozenset({"row", "session", "temperature", "time", "payload"})
"""Channels of a table that are neither the arm's nor columns of its own."""


@dataclass(frozen=True, eq=False)
class Signal:
    """A number in each pose that curves are functions of.

    Args:
        channels: recorded channels that it depends on, the leading one first; values: (n,).
        name: of the channel (`channels.expression`); unit: channel whose unit it has; label: what people call it.
        column: whether it is computed from a column of the table that a program does not know.
        near: returns similar signals, the closer the higher the level: a moment about an axis nearby.
    """

    channels: tuple[str, ...]
    values: Array
    name: str
    unit: str
    label: str
    column: bool = False
    near: Callable[[int], Sequence[Signal]] | None = field(default=None, repr=False)

    @property
    def size(self) -> Signal:
        """The absolute value of the signal, ``|q2|``."""
        label = f"|{self.label}|"
        return replace(self, values=np.abs(self.values), name=f"abs({self.name})", label=label, near=None)

    @property
    def folded(self) -> bool:
        """Whether it is the absolute value of a signal."""
        return self.name.startswith("abs(")

    @property
    def of(self) -> str:
        """Words behind the description of a curve of it: `` of <label>``, empty for a channel itself."""
        return "" if self.is_channel else f" of {self.label}"

    @property
    def leading(self) -> str:
        """The leading channel that it follows."""
        return self.channels[0]

    @property
    def is_channel(self) -> bool:
        """Whether it is a channel itself, and not computed from one."""
        return self.label == self.leading

    @property
    def full_label(self) -> str:
        """Its channel's name, followed by the word that it stands for in a column of words: ``door open``."""
        return self.leading if self.is_channel else f"{self.leading} {self.label}"

    @cached_property
    def middle(self) -> float:
        """The median of its values."""
        return float(np.median(self.values))

    @cached_property
    def spread(self) -> tuple[float, float]:
        """The 2 % and 98 % quantiles of its values."""
        low, high = np.quantile(self.values, [0.02, 0.98]).tolist()
        return low, high

    @cached_property
    def distinct(self) -> Array:
        """(k,) its distinct values in ascending order."""
        return np.unique(self.values)

    @cached_property
    def between(self) -> tuple[Array, Array]:
        """(k - 1,) the middles between neighbouring distinct values, and how far apart these are."""
        return 0.5 * (self.distinct[:-1] + self.distinct[1:]), np.diff(self.distinct)


def channel_signal(name: str, values: Array, state: State) -> Signal:
    """Return the signal of a recorded channel, (n,) values."""
    quoted = name if name not in state.channels else Channel(name).name
    return Signal((name,), values, quoted, name, name, column=name in state.channels and name not in TABLE)


def added(signals: Sequence[Signal], sign: str = "+") -> Signal:
    """Return the sum of some signals, or the difference of two (sign ``-``), with the unit of the first."""
    leading = tuple(s.leading for s in signals)
    values = sum((s.values if sign == "+" or k == 0 else -s.values for k, s in enumerate(signals)), 0.0)
    name = f" {sign} ".join(s.name for s in signals)
    return Signal(leading, np.asarray(values), name, leading[0], f" {sign} ".join(leading))


def unit(values: Array) -> Array:
    """Return values divided by their largest absolute value."""
    return np.asarray(values / max(float(np.abs(values).max()), 1e-300), dtype=np.float64)
