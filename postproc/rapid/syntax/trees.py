"""Expressions as trees with byte spans."""

from __future__ import annotations

from dataclasses import dataclass

from postproc.diagnostics import Span


@dataclass(frozen=True, slots=True)
class Node:
    span: Span


@dataclass(frozen=True, slots=True)
class Number(Node):
    value: float


@dataclass(frozen=True, slots=True)
class Text(Node):
    value: str


@dataclass(frozen=True, slots=True)
class Truth(Node):
    value: bool


@dataclass(frozen=True, slots=True)
class Star(Node):
    """``*``: a position stored without a name, invisible in the text."""


@dataclass(frozen=True, slots=True)
class Name(Node):
    """``name`` is in lower case, ``text`` as it is written."""

    name: str
    text: str = ""


@dataclass(frozen=True, slots=True)
class Index(Node):
    base: Expression
    indices: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Component(Node):
    base: Expression
    name: str


@dataclass(frozen=True, slots=True)
class Aggregate(Node):
    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Call(Node):
    """``name`` is in lower case, ``text`` as it is written."""

    name: str
    arguments: tuple[Expression, ...]
    options: tuple[tuple[str, Expression | None], ...] = ()
    text: str = ""


@dataclass(frozen=True, slots=True)
class Unary(Node):
    operator: str
    operand: Expression


@dataclass(frozen=True, slots=True)
class Binary(Node):
    operator: str
    left: Expression
    right: Expression


Expression = Number | Text | Truth | Star | Name | Index | Component | Aggregate | Call | Unary | Binary
