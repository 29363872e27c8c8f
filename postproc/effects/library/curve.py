"""A law without a name: a place of the arm, or what the instrument reads, follows channels by functions of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from postproc.arrays import Array
from postproc.channels.expression import Channel, channel
from postproc.channels.sight import READINGS, Site, moved_by_reading, seen_point
from postproc.channels.state import State
from postproc.channels.tool import leaning, overturning_moment
from postproc.channels.units import unit_of
from postproc.diagnostics import did_you_mean
from postproc.effects.base import Displacement, JointBasis, Load, param, structure
from postproc.effects.files import FieldProblem
from postproc.effects.geometry import weight
from postproc.effects.roles import Role
from postproc.effects.sums import SumOfTerms
from postproc.effects.terms import BASES, GATES, LEANS, LOADED, PLACES, TIMES, law_of, split_name, symbols

WORDS = {"shift_m": "shift", "turn_rad": "turn", "share": "scale", "mass_kg": "mass", "moment_kgm": "first moment"}


@dataclass(frozen=True)
class Term:
    """One term of a curve.

    Args:
        place: a key of `PLACES`; factors: (channel, basis, its numbers) of each; largest: value that counts as one.
        amplitudes: of each parameter, the slice that belongs to the term.
    """

    place: str
    factors: tuple[tuple[Channel, str, tuple[float, ...]], ...]
    largest: float
    amplitudes: Mapping[str, slice]

    def values(self, state: State, site: Site) -> Array:
        """Return (n,) the product of its functions in each state, 1 where it is as large as on the rows it is of."""
        product = np.full(len(state), 1.0 / self.largest)
        for c, basis, numbers in self.factors:
            product = product * law_of(basis)(c.values(state, site), *numbers)
        return product


class _ReadsByTerm:
    """The channels that a curve reads: those of its terms; of the class none, since any may be."""

    def __get__(self, curve: ChannelCurve | None, owner: type[ChannelCurve]) -> tuple[str, ...]:
        return ("q",) if curve is None else curve.channels_read


class ChannelCurve(
    SumOfTerms,
    key="curve",
    role=Role.CURVE,
    unlikely=float("inf"),
    confused_with={
        "joint_error_map": "a fine sweep of one joint: a curve has one shape over its angle, a map any",
        "frame_drift": "reference poses at the start and the end of each session",
    },
):
    """A place moves with a function of one or two channels that no effect of the library explains.

    Equation: xi = sum_k c_k f_k / s_k, with f_k a product of functions of channels (`effects.terms`), s_k the value of
    f_k that counts as one, and c_k the amplitudes along the axes of the place. Source: a diagnosis of measured rows
    (`postproc diagnose`); another table says what it is worth. Typical size: 0.1 mm or 0.1 mrad.

    Channels of a product stand behind each other, ``temperature * q3``, and so do their functions, ``line * harmonic``;
    ``numbers`` are those of all functions in their order, SI, and ``gap`` how far apart the measured values are between
    which an edge lies, 0 for other numbers. ``point_m`` is the measured point in the axes of the
    nominal tool, and ``instrument_m_rad`` the base as the instrument sees it, for channels that depend on these.
    """

    place: tuple[str, ...] = structure(("joint 1",))
    channels: tuple[str, ...] = structure(("q1",))
    basis: tuple[str, ...] = structure(("line",))
    numbers: tuple[float, ...] = structure((0.0,))
    gap: tuple[float, ...] = structure((0.0,), low=0.0)
    largest: tuple[float, ...] = structure((1.0,))
    point_m: tuple[float, ...] = structure((0.0, 0.0, 0.0))
    instrument_m_rad: tuple[float, ...] = structure((0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    turn_rad: Array = param(unit="rad", shape=("turn_rad",), low=-0.2, high=0.2, typical=1e-4)
    shift_m: Array = param(unit="m", shape=("shift_m",), low=-0.2, high=0.2, typical=1e-4)
    share: Array = param(unit="1", shape=("share",), low=-0.01, high=0.01, typical=1e-5)
    mass_kg: Array = param(unit="kg", shape=("mass_kg",), low=-500.0, high=500.0, typical=3.0)
    moment_kgm: Array = param(unit="kg m", shape=("moment_kgm",), low=-500.0, high=500.0, typical=1.0)

    def __post_init__(self) -> None:
        """Fill in the gaps of numbers that are no edges."""
        if not any(self.gap):
            object.__setattr__(self, "gap", (0.0,) * len(self.numbers))
        super().__post_init__()

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the length of a parameter: what the places of all terms have of it."""
        return (sum(count for place in self.place for part, count in PLACES.get(place, ()) if part == name),)

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """The terms, each with its factors and its amplitudes."""
        terms, numbers, start = [], list(self.numbers), dict.fromkeys(self.parameters(), 0)
        for place, channels, basis, largest in zip(self.place, self.channels, self.basis, self.largest, strict=True):
            factors = []
            for c, b in zip(channels.split(TIMES), basis.split(TIMES), strict=True):
                count = len(BASES[split_name(b)[1]].numbers)
                factors.append((channel(c), b, tuple(numbers[:count])))
                numbers = numbers[count:]
            amplitudes = {}
            for part, count in PLACES[place]:
                amplitudes[part] = slice(start[part], start[part] + count)
                start[part] += count
            terms.append(Term(place, tuple(factors), largest, amplitudes))
        return tuple(terms)

    @cached_property
    def site(self) -> Site:
        """Where the measured point is on the tool, and where the instrument stands."""
        return Site(self.point_m, self.instrument_m_rad)

    @cached_property
    def channels_read(self) -> tuple[str, ...]:
        """What the terms read of a state, as effects declare it."""
        channels = [c for t in self.terms for c, *_ in t.factors]
        read = dict.fromkeys(name for c in channels for name in (*c.ordered, *c.reads))
        for t in self.terms:
            read |= dict.fromkeys(("load", "pose", "robot")) if t.place == LEANS else {}
            read |= dict.fromkeys(("pose", "robot")) if t.place in LOADED or t.place[12:] in READINGS else {}
        return tuple(read) or ("q",)

    def follows(self, name: str) -> bool:
        """Return whether the law follows a column itself."""
        return any(c.follows(name) for t in self.terms for c, *_ in t.factors)

    def displacement(self, state: State) -> Displacement:
        """Displacement of joints, bodies, tool and instrument by all terms that carry no weight."""
        n = len(state)
        parts: dict[str, Array] = {}

        def add(part: str, axes: slice | int, moved: Array) -> None:
            """Add a displacement along some axes of a part of the arm."""
            parts.setdefault(part, np.zeros((n, 6)))[:, axes] += moved

        for t in self.terms:
            if t.place in LOADED:
                continue
            f, (part, _, how) = t.values(state, self.site), t.place.partition(", ")
            part = "body 0" if part == "base" else part
            amplitude = {name: np.atleast_1d(getattr(self, name))[at] for name, at in t.amplitudes.items()}
            if part.startswith("joint"):
                add("joint", int(part[6:]) - 1, f * amplitude["turn_rad"][0])
            elif how in READINGS:
                moved = moved_by_reading(seen_point(state, self.site), how)
                add(part, slice(3), (f * next(iter(amplitude.values()))[0])[:, None] * moved)
            elif t.place == LEANS:
                moment = overturning_moment(state)  # None where no model has filled in loads
                turn, shift = np.moveaxis(leaning(np.zeros((len(state), 3)) if moment is None else moment), 2, 0)
                add(part, slice(3, 6), (f * amplitude["turn_rad"][0])[:, None] * turn)
                add(part, slice(3), (f * amplitude["shift_m"][0])[:, None] * shift)
            else:
                for name, axes in (("shift_m", slice(3)), ("turn_rad", slice(3, 6))):
                    if name in amplitude:
                        add(part, axes, np.outer(f, amplitude[name]))
        bodies = {int(part[5:]): moved for part, moved in parts.items() if part.startswith("body")}
        return Displacement(parts.get("joint"), bodies, parts.get("tool"), parts.get("instrument"))

    def load(self, state: State) -> Load | None:
        """Weights (n, 6) [N], [N m] of the terms that carry one, on their bodies."""
        carried: dict[int, list[tuple[Array, Array]]] = {}
        for t in (t for t in self.terms if t.place in LOADED):
            f = t.values(state, self.site)
            mass, moment = self.mass_kg[t.amplitudes["mass_kg"]], self.moment_kgm[t.amplitudes["moment_kgm"]]
            carried.setdefault(LOADED[t.place], []).append((f * mass[0], np.outer(f, moment)))
        return Load(body={b: weight(state, b, masses) for b, masses in carried.items()}) if carried else None

    def joint_basis(self, state: State) -> JointBasis | None:
        """Columns of a curve whose terms all turn joints; None for any other."""
        if not all(t.place.startswith("joint") for t in self.terms):
            return None
        joint = np.array([int(t.place[6:]) - 1 for t in self.terms])
        return JointBasis(joint, np.stack([t.values(state, self.site) for t in self.terms], axis=1))

    def plus(self, term: Self) -> Self:
        """The curve with the terms of another one after its own; where the measured point is, the first one says."""
        fields: dict[str, Any] = {name: (*getattr(self, name), *getattr(term, name)) for name in self.structures()}
        fields |= {name: getattr(self, name) for name in ("point_m", "instrument_m_rad")}
        fields |= {name: np.append(getattr(self, name), getattr(term, name)) for name in self.parameters()}
        return type(self)(**fields)

    def undecided(self) -> Iterator[tuple[Self, Self]]:
        """The curve with each edge at both of the measured values between which it lies."""
        for k, gap in ((k, gap) for k, gap in enumerate(self.gap) if gap > 0):
            ends = (self.numbers[k] - 0.5 * gap, self.numbers[k] + 0.5 * gap)
            low, high = (replace(self, numbers=(*self.numbers[:k], x, *self.numbers[k + 1 :])) for x in ends)
            yield low, high

    def to_file(self) -> dict[str, Any]:
        """Plain numbers and words, seven digits; parameters that no place has and a site that no channel needs go."""
        table = {name: _rounded(value) for name, value in super().to_file().items()}
        needless = {name for name in self.parameters() if not table[name]} | (set() if any(self.gap) else {"gap"})
        needless |= set() if "pose" in self.reads else {"point_m", "instrument_m_rad"}
        return {name: value for name, value in table.items() if name not in needless}

    def symbols(self) -> Iterator[str]:
        """Yield each term in symbols, such as ``delta q2 = 0.12 mrad cos(3 q2 - 0.4)``."""
        for t in self.terms:
            product = " ".join(symbols(b, c.name, _as_text(c, b, numbers)) for c, b, numbers in t.factors)
            for name, at in t.amplitudes.items():
                values = np.atleast_1d(getattr(self, name))[at] / t.largest
                moved = f"delta q{t.place[6:]}" if t.place.startswith("joint") else f"{WORDS[name]} of {t.place}"
                yield f"{moved} = {_size(name, values)} {product}"

    @classmethod
    def problems(cls, table: Mapping[str, Any]) -> list[FieldProblem]:
        """What is wrong with the table of a curve: beside types, its places, channels, functions and their numbers."""
        lists = {name: table.get(name, getattr(cls, name)) for name in ("place", "channels", "basis", "largest")}
        typed = super().problems
        mistyped = [p for name in (*lists, "numbers", "gap") if name in table for p in typed({name: table[name]})]
        if mistyped:
            return mistyped
        if len({len(words) for words in lists.values()}) > 1:
            message = "`place`, `channels`, `basis` and `largest` of `curve` have different lengths"
            return [FieldProblem("EFF022", "place", message, "give one of each for every term")]
        wrong = [p for row in zip(*lists.values(), strict=True) if (p := _problem_of_term(*row)) is not None]
        if wrong:
            return wrong
        count = sum(len(BASES[split_name(b)[1]].numbers) for words in lists["basis"] for b in words.split(TIMES))
        if len(table.get("numbers", cls.numbers)) != count:
            message = f"`numbers` of `curve` has {len(table.get('numbers', cls.numbers))} numbers"
            return [FieldProblem("EFF022", "numbers", message, f"its functions have {count}")]
        if len(table.get("gap", table.get("numbers", cls.numbers))) != count:
            message = "`gap` of `curve` has another length than `numbers`"
            return [FieldProblem("EFF022", "gap", message, "0 for no edge")]
        return typed(table)


ChannelCurve.reads = _ReadsByTerm()  # type: ignore[assignment]


def _problem_of_term(place: str, channels: str, basis: str, largest: float) -> FieldProblem | None:
    """Return what is wrong with one term of a table; None where nothing is."""
    if place not in PLACES:
        return FieldProblem("EFF023", "place", f"`{place}` is no place", did_you_mean(place, PLACES))
    names, functions = channels.split(TIMES), basis.split(TIMES)
    if len(names) != len(functions):
        return FieldProblem("EFF022", "basis", f"`{basis}` has not one function for each channel of `{channels}`")
    for name in names:
        try:
            channel(name)
        except ValueError as error:
            return FieldProblem("EFF023", "channels", f"`{name}` is no channel: {error}")
    for word in functions:
        gate, name = split_name(word)
        if name not in BASES or gate not in ("", *GATES):
            return FieldProblem("EFF023", "basis", f"`{word}` is no function", did_you_mean(name, BASES))
    if largest <= 0:
        return FieldProblem("EFF024", "largest", f"`largest` of `curve` is {largest:g}", "give a number above zero")
    return None


def _as_text(c: Channel, basis: str, numbers: tuple[float, ...]) -> list[str]:
    """Return the numbers of a function as text, in the units in which people read its channel."""
    unit, factor = unit_of(c.name)
    kinds = BASES[split_name(basis)[1]].numbers
    return [
        f"{x * factor:.4g} {unit}".rstrip() if kind in ("value", "knot", "edge", "width", "reach") else f"{x:.4g}"
        for kind, x in zip(kinds, numbers, strict=True)
    ]


def _rounded(value: Any) -> Any:
    """Return the numbers of a list with seven digits; words as they are."""
    return [float(f"{x:.7g}") if isinstance(x, float) else x for x in value] if isinstance(value, list) else value


def _size(name: str, values: Array) -> str:
    """Return amplitudes as text with their unit, ``0.12, -0.03 mrad``."""
    unit, factor = {"turn_rad": ("mrad", 1e3), "shift_m": ("mm", 1e3), "share": ("ppm", 1e6)}.get(name, ("", 1.0))
    unit = unit or {"mass_kg": "kg", "moment_kgm": "kg m"}[name]
    numbers = ", ".join(f"{x * factor:.3g}" for x in values)
    return f"{numbers} {unit}" if len(values) == 1 else f"({numbers}) {unit}"
