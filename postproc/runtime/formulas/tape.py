"""Scalar formulas that are written as RAPID statements and worked out with numpy, from one source.

A formula is built with Python's operators; constants are folded, so that an arm whose axes are those of its base costs
no product with zero or one. What is used more than once becomes a variable of the routine.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from postproc.runtime.formulas.curves import Curve, at

SINGLE = np.float32
Singles = NDArray[np.float32]
LONGEST = 100
"""Characters after which a part of a formula becomes a variable of its own."""
SHORT = 24
"""Characters of a result that need no variable."""
SHORT_SUM = 8
NOTHING = 1e-13
"""Constants below that are rounding of a zero (cosines of right angles)."""


@dataclass(frozen=True, eq=False)
class Scalar:
    """A number of the formula: a constant, an input, or an operation on other numbers."""

    operation: str
    parts: tuple[Scalar, ...] = ()
    value: float = 0.0
    name: str = ""
    curve: Curve | None = None

    def __add__(self, other: Number) -> Scalar:
        a, b = self, scalar(other)
        if a.constant and b.constant:
            return scalar(a.value + b.value)
        if _is(a, 0.0) or _is(b, 0.0):
            return b if _is(a, 0.0) else a
        if b.operation == "negative":
            return Scalar("-", (a, b.parts[0]))
        return Scalar("-", (b, a.parts[0])) if a.operation == "negative" else Scalar("+", (a, b))

    def __sub__(self, other: Number) -> Scalar:
        return self + -scalar(other)

    def __neg__(self) -> Scalar:
        if self.constant:
            return scalar(-self.value)
        return self.parts[0] if self.operation == "negative" else Scalar("negative", (self,))

    def __mul__(self, other: Number) -> Scalar:
        a, b = self, scalar(other)
        if a.constant and b.constant:
            return scalar(a.value * b.value)
        if _is(a, 0.0) or _is(b, 0.0):
            return scalar(0.0)
        for one, rest in ((a, b), (b, a)):
            if _is(one, 1.0):
                return rest
            if _is(one, -1.0):
                return -rest
        if a.constant:
            a, b = b, a
        if b.constant and a.operation == "*" and a.parts[1].constant:
            return a.parts[0] * (a.parts[1].value * b.value)
        if a.operation == "negative":
            return -(a.parts[0] * b)
        return -(a * b.parts[0]) if b.operation == "negative" else Scalar("*", (a, b))

    __radd__, __rmul__ = __add__, __mul__

    @property
    def constant(self) -> bool:
        return self.operation == "constant"


Number = Scalar | float


def _is(one: Scalar, value: float) -> bool:
    return one.constant and one.value == value


def scalar(value: Number) -> Scalar:
    """A number as part of a formula; what is zero but for rounding is zero."""
    if isinstance(value, Scalar):
        return value
    whole = round(float(value))
    return Scalar("constant", value=float(whole) if abs(value - whole) < NOTHING else float(value))


def given(name: str) -> Scalar:
    """A number that the routine has under this name."""
    return Scalar("input", name=name)


def sine(x: Scalar) -> Scalar:
    """The sine of an angle [deg]."""
    return Scalar("Sin", (x,))


def cosine(x: Scalar) -> Scalar:
    """The cosine of an angle [deg]."""
    return Scalar("Cos", (x,))


def along(curve: Curve, x: Scalar) -> Scalar:
    """The value of a curve at x."""
    return Scalar("curve", (x,), curve=curve)


def total(terms: Iterable[Number]) -> Scalar:
    """The sum of numbers; long ones in halves, so that no formula is nested deeply."""
    every = list(terms)
    if len(every) > SHORT_SUM:
        half = len(every) // 2
        return total(every[:half]) + total(every[half:])
    result = scalar(0.0)
    for term in every:
        result = result + term
    return result


@dataclass(frozen=True)
class Written:
    """A formula as statements.

    Args:
        variables: names to declare as num. statements: assignments in order, without semicolon.
        results: one expression for each result.
        operations: additions, subtractions and products; functions: sines and cosines; lookups: values of curves.
    """

    variables: tuple[str, ...]
    statements: tuple[str, ...]
    results: tuple[str, ...]
    operations: int
    functions: int
    lookups: int


@dataclass
class _Writer:
    uses: dict[int, int]
    taken: int
    texts: dict[int, str] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    statements: list[str] = field(default_factory=list)

    def text(self, one: Scalar) -> str:
        if id(one) in self.texts:
            return self.texts[id(one)]
        text = self._formula(one)
        simple = one.operation in ("constant", "input")
        if not simple and (self.uses[id(one)] > 1 or len(text) > LONGEST or one.operation in ("curve", "Sin", "Cos")):
            text = self.variable(text)
        self.texts[id(one)] = text
        return text

    def variable(self, text: str) -> str:
        """The name of a variable that holds a formula."""
        self.names.append(f"a{self.taken + len(self.names) + 1}")
        self.statements.append(f"{self.names[-1]}:={text}")
        return self.names[-1]

    def _formula(self, one: Scalar) -> str:
        if one.constant:
            return number(one.value)
        if one.operation == "input":
            return one.name
        parts = [self.text(part) for part in one.parts]
        if one.operation == "curve":
            assert one.curve is not None
            return f"ppCurve({one.curve.name},{parts[0]},{number(one.curve.low)},{number(one.curve.step)})"
        if one.operation in ("Sin", "Cos"):
            return f"{one.operation}({parts[0]})"
        if one.operation == "negative":
            return f"-{_bracketed(parts[0], '+-')}"
        if one.operation == "*":
            return "*".join(_bracketed(part, "+-") for part in parts)
        right = _bracketed(parts[1], "+-" if one.operation == "-" else "") if one.operation == "-" else parts[1]
        return f"{parts[0]}{one.operation}{_signed(right)}"


def _bracketed(text: str, signs: str) -> str:
    """A part in brackets where a sign stands outside of brackets in it (that of an exponent is none)."""
    depth = 0
    for at_, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if depth == 0 and character in signs and not (at_ and text[at_ - 1] == "E"):
            return f"({text})"
    return text


def _signed(text: str) -> str:
    return f"({text})" if text.startswith("-") else text


def number(value: float) -> str:
    """A constant in single precision as RAPID reads it: the shortest text that gives the same number.

    >>> number(-3.0165913e-07), number(9.81), number(2.0)
    ('-3.0165913E-07', '9.81', '2')
    """
    text = str(SINGLE(value)).upper()
    return text.removesuffix(".0")


def shared(results: Sequence[Scalar]) -> list[Scalar]:
    """The same formulas, with equal parts as one object."""
    known: dict[tuple[object, ...], Scalar] = {}
    done: dict[int, Scalar] = {}

    def one_of(one: Scalar) -> Scalar:
        if id(one) not in done:
            parts = tuple(one_of(part) for part in one.parts)
            key = (one.operation, *map(id, parts), one.value, one.name, id(one.curve))
            done[id(one)] = known.setdefault(key, Scalar(one.operation, parts, one.value, one.name, one.curve))
        return done[id(one)]

    return [one_of(one) for one in results]


def written(results: Sequence[Scalar], taken: int = 0) -> Written:
    """Formulas as RAPID statements; variables are numbered from ``taken`` on."""
    results = shared(results)
    uses: dict[int, int] = {}
    counts = {"operations": 0, "functions": 0, "lookups": 0}
    stack = list(results)
    while stack:
        one = stack.pop()
        uses[id(one)] = uses.get(id(one), 0) + 1
        if uses[id(one)] == 1:
            stack.extend(one.parts)
            kind = {"curve": "lookups", "Sin": "functions", "Cos": "functions"}.get(one.operation, "operations")
            counts[kind] += one.operation not in ("constant", "input")
    writer = _Writer(uses, taken)
    texts = tuple(t if len(t := writer.text(one)) <= SHORT else writer.variable(t) for one in results)
    return Written(tuple(writer.names), tuple(writer.statements), texts, **counts)


def worked_out(results: Sequence[Scalar], inputs: Mapping[str, NDArray[np.floating]]) -> list[Singles]:
    """Values of formulas in single precision, every operation rounded, (n,) each.

    Args:
        inputs: (n,) values of the inputs by name.
    """
    known: dict[int, Singles] = {}

    def value(one: Scalar) -> Singles:
        if id(one) not in known:
            known[id(one)] = np.asarray(_operation(one), dtype=SINGLE)
        return known[id(one)]

    def _operation(one: Scalar) -> Singles | np.float32:
        if one.constant:
            return SINGLE(one.value)
        if one.operation == "input":
            return np.asarray(inputs[one.name], dtype=SINGLE)
        parts = [value(part) for part in one.parts]
        if one.operation == "curve":
            assert one.curve is not None
            return at(one.curve, parts[0])
        if one.operation in ("Sin", "Cos"):
            # A controller works a function out in double precision and keeps a single.
            angle = parts[0].astype(float) * (math.pi / 180.0)
            return (np.sin(angle) if one.operation == "Sin" else np.cos(angle)).astype(SINGLE)
        if one.operation == "negative":
            return -parts[0]
        a, b = parts
        return a * b if one.operation == "*" else a + b if one.operation == "+" else a - b

    count = max(len(np.atleast_1d(x)) for x in inputs.values())
    return [np.broadcast_to(value(one), (count,)) for one in results]
