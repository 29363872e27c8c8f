"""RAPID's words, and the nodes of a program's tree."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

Expr = tuple[Any, ...]
"""``(kind, ...)``: num text, str, bool, agg items, ref name accessors, call name args, un op a, bin op a b, star."""

_TOKEN = re.compile(
    r"""(?P<blank>\s+|![^\r\n]*|%%%.*?%%%)
    |(?P<str>"(?:[^"\r\n]|"")*")
    |(?P<num>0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
    |(?P<id>[^\W\d]\w*)
    |(?P<op>:=|<>|<=|>=|.)""",
    re.S | re.X,
)


class SyntaxFault(Exception):
    """The text does not follow the grammar."""


@dataclass(frozen=True)
class Token:
    kind: str
    text: str
    line: int

    @property
    def low(self) -> str:
        return self.text.lower()


@dataclass(frozen=True)
class Arg:
    """An argument: ``pos`` expr, ``opt`` name [expr], ``cond`` name parameter, ``named`` name expr."""

    kind: str
    name: str
    value: Expr | None


@dataclass(eq=False)
class Statement:
    """One statement: kind, its parts, its line, its words, its place in the routine (set by the reader)."""

    kind: str
    line: int
    parts: dict[str, Any]
    words: str = ""
    index: int = -1


@dataclass(frozen=True)
class Data:
    """A declaration; scope is ``local``, ``task`` or ``global``, storage ``const``, ``pers`` or ``var``."""

    name: str
    type: str
    storage: str
    scope: str
    dims: tuple[Expr, ...]
    value: Expr | None


@dataclass(frozen=True)
class Parameter:
    """mode is ``in``, ``inout``, ``var``, ``pers`` or ``switch``; dims the number of array dimensions."""

    name: str
    type: str
    mode: str
    optional: bool
    dims: int


@dataclass(eq=False)
class Routine:
    name: str
    kind: str
    type: str | None
    local: bool
    module: str
    parameters: list[Parameter]
    data: list[Data] = field(default_factory=list)
    body: list[Statement] = field(default_factory=list)
    error: list[Statement] | None = None
    error_numbers: list[Expr] = field(default_factory=list)
    flat: list[Statement] = field(default_factory=list)


@dataclass(eq=False)
class Module:
    name: str
    data: list[Data] = field(default_factory=list)
    routines: list[Routine] = field(default_factory=list)
    records: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)


def tokens(text: str) -> list[Token]:
    out, line = [], 1
    for m in _TOKEN.finditer(text.removeprefix("\ufeff")):
        if m.lastgroup != "blank":
            out.append(Token(m.lastgroup or "", m[0], line))
        line += m[0].count("\n")
    return out


def string_value(literal: str) -> str:
    r"""2.7: ``""`` is a quote, ``\\`` a backslash, ``\07`` the character with that code."""
    body = literal[1:-1].replace('""', '"')
    return re.sub(r"\\(\\|[0-9a-fA-F]{2})", lambda m: "\\" if m[1] == "\\" else chr(int(m[1], 16)), body)


def children(s: Statement) -> list[list[Statement]]:
    """The statement lists inside a compound statement."""
    if s.kind == "if":
        return [b for _, b in s.parts["arms"]] + ([s.parts["otherwise"]] if s.parts["otherwise"] else [])
    if s.kind in ("for", "while"):
        return [s.parts["body"]]
    if s.kind == "test":
        return [b for _, b in s.parts["cases"]] + ([s.parts["default"]] if s.parts["default"] else [])
    return []


def number(routine: Routine) -> None:
    """Lists all statements of a routine in the order of its text and numbers them."""

    def collect(statements: list[Statement]) -> None:
        for s in statements:
            s.index = len(routine.flat)
            routine.flat.append(s)
            for inner in children(s):
                collect(inner)

    collect(routine.body)
    collect(routine.error or [])


def annotations(text: str) -> dict[str, list[str]]:
    """What a program's comments ``! world: name = ...`` say of the values that a world may draw."""
    out: dict[str, list[str]] = {}
    for m in re.finditer(r"!\s*world:\s*(.+?)\s*=\s*(.+)", text):
        out[" ".join(m[1].lower().split())] = m[2].split()
    return out
