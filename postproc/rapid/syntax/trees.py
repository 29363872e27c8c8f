"""Expressions as trees with byte spans."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from postproc.diagnostics import Span


@dataclass(frozen=True, slots=True)
class Node:
    """Any expression; ``span`` is where it stands."""

    span: Span


@dataclass(frozen=True, slots=True)
class Number(Node):
    """A number with its sign."""

    value: float


@dataclass(frozen=True, slots=True)
class StringNode(Node):
    """A string."""

    value: str


@dataclass(frozen=True, slots=True)
class Truth(Node):
    """TRUE or FALSE."""

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
    """``base{indices}``."""

    base: Expression
    indices: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Component(Node):
    """``base.name``."""

    base: Expression
    name: str


@dataclass(frozen=True, slots=True)
class Aggregate(Node):
    """``[items]``."""

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
    """A sign, ``not``, or ``()`` for parentheses."""

    operator: str
    operand: Expression


@dataclass(frozen=True, slots=True)
class Binary(Node):
    """Two operands; the operator is in lower case."""

    operator: str
    lhs: Expression
    rhs: Expression


Expression = Number | StringNode | Truth | Star | Name | Index | Component | Aggregate | Call | Unary | Binary


def nodes(tree: Expression) -> Iterator[Expression]:
    """An expression and every expression inside it, from outside to inside and from left to right."""
    yield tree
    match tree:
        case Index(_, base, items):
            inside: tuple[Expression, ...] = (base, *items)
        case Component(_, base, _) | Unary(_, _, base):
            inside = (base,)
        case Aggregate(_, items):
            inside = items
        case Binary(_, _, lhs, rhs):
            inside = (lhs, rhs)
        case Call(_, _, arguments, options):
            inside = (*arguments, *(value for _, value in options if value is not None))
        case _:
            inside = ()
    for part in inside:
        yield from nodes(part)
