"""Expressions as trees with byte spans."""

from __future__ import annotations

from dataclasses import dataclass

from postproc.diagnostics import Span


@dataclass(frozen=True, slots=True)
class Number:
    span: Span
    value: float


@dataclass(frozen=True, slots=True)
class Text:
    span: Span
    value: str


@dataclass(frozen=True, slots=True)
class Truth:
    span: Span
    value: bool


@dataclass(frozen=True, slots=True)
class Star:
    """``*``: a position stored without a name, invisible in the text."""

    span: Span


@dataclass(frozen=True, slots=True)
class Name:
    """``name`` is in lower case, ``text`` as it is written."""

    span: Span
    name: str
    text: str = ""


@dataclass(frozen=True, slots=True)
class Index:
    span: Span
    base: Expression
    indices: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Component:
    span: Span
    base: Expression
    name: str


@dataclass(frozen=True, slots=True)
class Aggregate:
    span: Span
    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Call:
    """``name`` is in lower case, ``text`` as it is written."""

    span: Span
    name: str
    arguments: tuple[Expression, ...]
    options: tuple[tuple[str, Expression | None], ...] = ()
    text: str = ""


@dataclass(frozen=True, slots=True)
class Unary:
    span: Span
    operator: str
    operand: Expression


@dataclass(frozen=True, slots=True)
class Binary:
    span: Span
    operator: str
    left: Expression
    right: Expression


Expression = Number | Text | Truth | Star | Name | Index | Component | Aggregate | Call | Unary | Binary
