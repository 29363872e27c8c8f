"""A channel by its name: recorded (``q2``, ``temperature``), or derived from others (``lag(temperature, 2640 s)``).

Names are what a table records, one of the arm's own (``load3``, ``x``, ``gravity_z``), or a column of the user's;
``+`` and ``-`` between spaces add and subtract. Functions of one channel: ``abs(q2)``; ``lag(temperature, 2640 s)`` and
``creep(load3, 900 s)`` follow it late, from rest or from zero; ``play(q2, 0.11 mrad)`` is dragged along and slips, in
-1 .. 1; ``before(q2)`` and ``rise(q2)`` are its value in the row before, and its change since. Functions of the pose:
``azimuth(0 rad)`` of the tool about joint 1, ``seen_azimuth(0 rad)`` as an instrument sees it, ``lean(45 deg)``, the
overturning moment about a horizontal axis.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from postproc.arrays import Array
from postproc.channels.memory import lag, play, rows_before
from postproc.channels.sight import Site, azimuth, beam, measured_point, seen_point
from postproc.channels.state import State
from postproc.channels.tool import FORCES, force_on_tool, overturning_moment

UNIT_FACTORS = {
    "": 1.0,
    "rad": 1.0,
    "mrad": 1e-3,
    "deg": np.pi / 180,
    "rad/s": 1.0,
    "rad/s^2": 1.0,
    "N": 1.0,
    "N m": 1.0,
    "m": 1.0,
    "mm": 1e-3,
    "kg": 1.0,
    "K": 1.0,
    "degC": 1.0,
    "s": 1.0,
    "min": 60.0,
    "h": 3600.0,
    "m/s^2": 1.0,
}
"""Units that a number in a name may have, with their factor to SI."""
JOINTED = {"q": "q", "v": "v", "a": "a", "dir": "approach", "load": "joint_load"}
"""Channels with a number of a joint behind them, and the field of a state that holds them."""
SCALARS = {"temperature": "temperature", "time": "time", "payload": "payload_mass", "session": "session"}
SEEN = ("seen_elevation", "seen_distance", *(f"beam_{way}_{axis}" for way in ("to", "around") for axis in "xyz"))
TOOL_FRAME_FORCES = tuple(f"{kind}_{axis}" for kind in FORCES for axis in "xyz")
DIRECTION_FUNCTIONS = ("azimuth", "seen_azimuth", "lean")
"""Functions of an angle alone."""
ORDERED = ("lag", "creep", "play", "before", "rise")
"""Functions that follow the rows in their order."""
CHANNEL_FUNCTIONS = ("abs", *ORDERED, *DIRECTION_FUNCTIONS)
_ATOM = re.compile(r"\"(?:[^\"\\]|\\.)*\"|[^\s(),\"]+")
_NUMBER_WITH_UNIT = re.compile(r"([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)([^(),]*)")


@dataclass(frozen=True)
class Channel:
    """A number in each state.

    Args:
        head: name of a channel, a function, ``+`` or ``-``; a number as text for the same in every state.
        arguments: channels that it is derived from; number: of a function, SI; unit: in which the number is written.
    """

    head: str
    arguments: tuple[Channel, ...] = ()
    number: float | None = None
    unit: str = ""

    @property
    def name(self) -> str:
        """The channel's name, from which `channel` makes it again."""
        if self.head in ("+", "-"):
            return f" {self.head} ".join(c.name for c in self.arguments)
        words = [c.name for c in self.arguments]
        if self.number is not None:
            words.append(f"{self.number / UNIT_FACTORS[self.unit]:.6g} {self.unit}".rstrip())
        if words:
            return f"{self.head}({', '.join(words)})"
        return self.head if _ATOM.fullmatch(self.head) else json.dumps(self.head, ensure_ascii=False)

    @property
    def reads(self) -> tuple[str, ...]:
        """Channels that an effect has to declare for it: ``q``, ``load``, ``pose``, a column of the table."""
        if self.arguments:
            first = dict.fromkeys(name for c in self.arguments for name in c.reads)
            late = {"time": None} if self.head in ("lag", "creep") else {}
            return tuple({**first, **late, **({"q": None} if self.head in ("before", "rise") else {})})
        name, joint = self.head[:-1], self.head[-1:]
        if name in JOINTED and joint in "123456":
            return ("approach" if name == "dir" else name,)
        if self.head in SCALARS:
            return (self.head,)
        if self.head in ("fx", "fy", "fz"):
            return ("wrench",)
        if self.head in ("lean", "leaning"):
            return ("load", "pose", "robot")
        if self.head in TOOL_FRAME_FORCES:
            kind = self.head.partition("_")[0]
            reads = {"gravity": (), "acceleration": ("v", "a"), "weight": ("payload",), "force": ("wrench",)}
            return ("pose", "robot", *reads[kind])
        if self.head in ("x", "y", "z", "radius", "azimuth", "seen_azimuth", *SEEN):
            return ("pose", "robot")
        return () if _is_number(self.head) else (self.head,)

    def follows(self, name: str) -> bool:
        """Return whether the value is that of a column or computed from it, beyond being in the order of its times."""
        return self.head == name or any(c.follows(name) for c in self.arguments)

    @property
    def ordered(self) -> tuple[str, ...]:
        """Names of the channel, and of those inside it, that follow the rows in their order."""
        inside = tuple(name for c in self.arguments for name in c.ordered)
        return (*inside, self.name) if self.head in ORDERED else inside

    def values(self, state: State, site: Site = Site()) -> Array | None:
        """Return (n,) the channel in each state; None where it was not recorded.

        A channel of the rows' order is that of a state at rest, unless `in_order` has filled it in.
        """
        column = self.name if self.arguments or self.number is not None else self.head
        if column in state.channels:
            return np.asarray(state.channels[column], dtype=float)
        if self.arguments:
            inner = [c.values(state, site) for c in self.arguments]
            if any(x is None for x in inner):
                return None
            first, *other = [np.asarray(x) for x in inner]
            if self.head in ("play", "rise"):
                return np.zeros(len(state))
            if self.head in ("+", "-"):
                return first + other[0] if self.head == "+" else first - other[0]
            return np.abs(first) if self.head == "abs" else first
        return _recorded(self, state, site)

    def in_order(self, state: State, site: Site = Site()) -> dict[str, Array]:
        """Return (n,) values by name of the channel, and of those inside it, that follow the rows' order.

        Args:
            state: all rows in the order of measuring, or all samples along a program.
        """
        ordered: dict[str, Array] = {}
        for c in self.arguments:
            ordered |= c.in_order(state.with_(channels={**state.channels, **ordered}), site)
        if self.head not in ORDERED or self.name in state.channels:
            return ordered
        x = self.arguments[0].values(state.with_(channels={**state.channels, **ordered}), site)
        if x is None or (self.head in ("lag", "creep") and state.time is None):
            return ordered
        if self.head == "play":
            values = play(x, float(self.number or 1.0))
        elif self.head in ("lag", "creep"):
            values = lag(x, np.asarray(state.time), float(self.number or 1.0), self.head == "lag")
        else:
            last, before = rows_before(state.q, state.session)
            values = x[before] if self.head == "before" else x[last] - x[before]
        return {**ordered, self.name: values}


def in_order(channels: Iterable[Channel], state: State, site: Site = Site()) -> State:
    """Return the states with the channels of the rows' order filled in that are not there yet."""
    ordered: dict[str, Array] = {}
    for c in channels:
        ordered |= c.in_order(state, site)
    return state.with_(channels={**state.channels, **ordered}) if ordered else state


def follows_order(name: str) -> bool:
    """Return whether a name is that of a channel derived from the rows' order, and not of a column."""
    return name.partition("(")[0] in ORDERED and name.endswith(")")


def with_sources(reads: Iterable[str]) -> tuple[str, ...]:
    """Return the channels that an effect declares, and those from which the derived ones among them are computed."""
    return tuple(
        dict.fromkeys(x for name in reads for x in (name, *(channel(name).reads if follows_order(name) else ())))
    )


def as_stationary(channels: Iterable[Channel], state: State) -> State:
    """Return the states with those channels of the rows' order that are not there as of an arm at rest."""
    resting = {c.name: c.values(state) for c in channels if c.name not in state.channels}
    known = {name: values for name, values in resting.items() if values is not None}
    return state.with_(channels={**state.channels, **known}) if known else state


@cache
def channel(name: str) -> Channel:
    """Return the channel of a name.

    Raises:
        ValueError: the name cannot be read; its text says why.
    """
    parsed, end = _sum(name, 0)
    if name[end:].strip():
        raise ValueError(f"`{name[end:].strip()}` is left over")
    return parsed


def _sum(text: str, at: int) -> tuple[Channel, int]:
    """Return the channel that begins at an index of a text, and the index behind it."""
    first, at = _item(text, at)
    while sign := re.compile(r" ([+-]) ").match(text, at):
        other, at = _item(text, sign.end())
        first = Channel(sign[1], (first, other))
    return first, at


def _item(text: str, at: int) -> tuple[Channel, int]:
    """Return the name or the function that begins at an index of a text, and the index behind it."""
    at = _behind_spaces(text, at)
    atom = _ATOM.match(text, at)
    if atom is None:
        raise ValueError(f"a channel is expected behind `{text[:at].strip()}`" if at else "there is no name")
    word, at = atom[0].strip(), atom.end()
    if word.startswith('"'):
        return Channel(json.loads(word)), at
    if not text.startswith("(", at):
        return Channel(word), at
    if word not in CHANNEL_FUNCTIONS:
        raise ValueError(f"`{word}` is no function: {', '.join(CHANNEL_FUNCTIONS)}")
    arguments: tuple[Channel, ...] = ()
    at += 1
    if word not in DIRECTION_FUNCTIONS:
        inner, at = _sum(text, at)
        arguments = (inner,)
    number, unit = None, ""
    if word in (*DIRECTION_FUNCTIONS, "lag", "creep", "play"):
        if arguments and not text.startswith(",", at):
            raise ValueError(f"`{word}` needs a number behind a comma, as in `lag(temperature, 2640 s)`")
        match = _NUMBER_WITH_UNIT.match(text, _behind_spaces(text, at + bool(arguments)))
        unit = "" if match is None else match[2].strip()
        if match is None or unit not in UNIT_FACTORS:
            raise ValueError(f"`{word}` needs a number with its unit: {', '.join(filter(None, UNIT_FACTORS))}")
        number, at = float(match[1]) * UNIT_FACTORS[unit], match.end()
        if word != "lean" and not arguments and unit not in ("rad", "deg", "mrad"):
            raise ValueError(f"`{word}` needs an angle")
        if word in ("lag", "creep", "play") and number <= 0:
            raise ValueError(f"`{word}` needs a number above zero")
    if not text.startswith(")", at):
        raise ValueError(f"`)` is missing behind `{text[:at]}`")
    return Channel(word, arguments, number, unit), at + 1


def _behind_spaces(text: str, at: int) -> int:
    """Return the index of the first character from an index on that is no space."""
    return len(text) - len(text[at:].lstrip())


def _is_number(word: str) -> bool:
    """Return whether a name is a number: a channel that is the same in every state."""
    return re.fullmatch(r"\d+(?:\.\d*)?", word) is not None


def _recorded(c: Channel, state: State, site: Site) -> Array | None:
    """Return (n,) a channel that is derived from no other one; None where it was not recorded."""
    name, joint = c.head[:-1], c.head[-1:]
    if name in JOINTED and joint in "123456":
        every = getattr(state, JOINTED[name])
        return None if every is None else np.asarray(every)[:, int(joint) - 1]
    if c.head in SCALARS:
        values = getattr(state, SCALARS[c.head])
        return None if values is None else np.asarray(values, dtype=float)
    if c.head in ("fx", "fy", "fz"):
        return None if state.wrench is None else np.asarray(state.wrench)[:, "xyz".index(joint)]
    if _is_number(c.head):
        return np.full(len(state), float(c.head))
    return _POSED[c.head](state, site, c.number or 0.0) if c.head in _POSED else None


def _at_pose(law: Callable[[State, Site, float], Array]) -> Callable[[State, Site, float], Array | None]:
    """Return a law that gives None where no model has filled in the poses of the bodies."""
    return lambda state, site, number: None if state.T_base_body is None else law(state, site, number)


def _force(kind: str, axis: int) -> Callable[[State, Site, float], Array | None]:
    """Return the law of one component of a force on the tool."""

    def law(state: State, site: Site, number: float) -> Array | None:
        """Return (n,) the component in each state; None where the force is not known."""
        force = force_on_tool(state, kind, np.array(site.point))
        return None if force is None else force[:, axis]

    return law


def _beam(way: str, k: int) -> Callable[[State, Site, float], Array]:
    """Return the law of the beam's angle to, or around, an axis of the tool."""

    def law(state: State, site: Site, number: float) -> Array:
        """Return (n,) the angle [rad] in each state."""
        u = beam(state, site)
        if way == "to":
            return np.asarray(np.arccos(np.clip(u[:, k], -1.0, 1.0)))
        return np.asarray(np.arctan2(u[:, (k + 2) % 3], u[:, (k + 1) % 3]))

    return law


def _lean(state: State, site: Site, number: float) -> Array | None:
    """Return (n,) the overturning moment [N m] about the horizontal axis at an angle [rad] from x."""
    moment = overturning_moment(state)
    return None if moment is None else np.asarray(moment[:, :2] @ [np.cos(number), np.sin(number)])


def _leaning(state: State, site: Site, number: float) -> Array | None:
    """Return (n,) the size of the overturning moment [N m]."""
    moment = overturning_moment(state)
    return None if moment is None else np.hypot(moment[:, 0], moment[:, 1])


def _elevation(seen: Array) -> Array:
    """Return (n,) the elevation [rad] of points (n, 3) that an instrument sees."""
    return np.asarray(np.arctan2(seen[:, 2], np.hypot(seen[:, 0], seen[:, 1])))


_POSED: Mapping[str, Callable[[State, Site, float], Array | None]] = {
    "x": _at_pose(lambda s, site, _: measured_point(s, site)[:, 0]),
    "y": _at_pose(lambda s, site, _: measured_point(s, site)[:, 1]),
    "z": _at_pose(lambda s, site, _: measured_point(s, site)[:, 2]),
    "radius": _at_pose(lambda s, site, _: np.hypot(*measured_point(s, site)[:, :2].T)),
    "azimuth": _at_pose(lambda s, site, middle: azimuth(measured_point(s, site), middle)),
    "seen_azimuth": _at_pose(lambda s, site, middle: azimuth(seen_point(s, site), middle)),
    "seen_elevation": _at_pose(lambda s, site, _: _elevation(seen_point(s, site))),
    "seen_distance": _at_pose(lambda s, site, _: np.linalg.norm(seen_point(s, site), axis=1)),
    **{f"beam_{way}_{axis}": _at_pose(_beam(way, k)) for way in ("to", "around") for k, axis in enumerate("xyz")},
    **{f"{kind}_{axis}": _force(kind, k) for kind in FORCES for k, axis in enumerate("xyz")},
    "lean": _lean,
    "leaning": _leaning,
}
