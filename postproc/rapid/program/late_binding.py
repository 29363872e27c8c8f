"""Procedures that are called by a name in a text: ``%"rPart"+NumToStr(n,0)% a,b;`` and ``CallByVar "rPart",n;``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from postproc.diagnostics import Span
from postproc.rapid.program.arguments import Piece, read_arguments
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.nodes import Statement
from postproc.rapid.syntax.tokens import many

TEXT = re.compile(b'"(' + many(rb'[^"]++|""') + b')"')
# A text as far as it is written: its literal parts in lower case, None for what is worked out.
Template = tuple[str | None, ...]


@dataclass(frozen=True, slots=True)
class LateCall:
    """A call by name.

    Args:
        name: span of the text; number: of what CallByVar puts behind it.
        template: of the routine's name; pieces: arguments of the call.
    """

    name: Span
    number: Span | None
    template: Template
    pieces: tuple[Piece, ...]


def late_call(statement: Statement, data: bytes, program: Program, module: str) -> LateCall | None:
    """The call by name (``%name%`` or ``CallByVar``) that a statement is; None if it is any other statement.

    Args:
        data: bytes of its file; module: name of the module in which it stands.
    """
    start, end = statement.span
    if statement.kind != "call" or statement.word not in ("%", "callbyvar"):
        return None
    if statement.word == "%":
        close = data.find(b"%", start + 1, end)
        close = end if close < 0 else close
        template = text_template(data[start + 1 : close])
        return LateCall((start + 1, close), None, template, read_arguments(data, min(close + 1, end), end))
    if program.routine(statement.word, module) is not None:
        return None
    spans = [span for option, span, _ in read_arguments(data, start + len(statement.word), end) if not option]
    if len(spans) != 2:
        return LateCall((start, start), (start, start), (None,), ())
    number = data[slice(*spans[1])].strip()
    tail = number.decode("latin-1") if number.isdigit() else None
    return LateCall(spans[0], spans[1], _joined((*text_template(data[slice(*spans[0])]), tail)), ())


def text_template(expression: bytes) -> Template:
    """The template of a string expression: its literals in lower case, None for each part computed at run time."""
    parts: list[str | None] = []
    for i, part in enumerate(TEXT.split(expression)):  # every other part is outside quotes: it is worked out
        if i % 2:
            parts.append(part.decode("latin-1").lower())
        elif part.strip() not in (b"", b"+"):
            parts.append(None)
    return _joined(parts)


def _joined(parts: Sequence[str | None]) -> Template:
    """The template with neighbouring literals joined, and without a module's name in front (``module:name``)."""
    joined: list[str | None] = []
    for part in parts:
        if part is not None and ":" in part:
            joined, part = [], part.rpartition(":")[2]
        if part is not None and joined and joined[-1] is not None:
            joined[-1] += part
        elif part is not None or not joined or joined[-1] is not None:
            joined.append(part)
    return tuple(joined)


def may_be(template: Template, name: str) -> bool:
    """Whether a name (any case) fits a template, in which None stands for any text; takes linear time per literal."""
    name, at, free = name.lower(), 0, False
    for i, part in enumerate(template):
        if part is None:
            free = True
            continue
        last = i == len(template) - 1
        if not free:
            found = at if name.startswith(part, at) else -1
        elif last:
            found = max(at, len(name) - len(part)) if name.endswith(part) and len(name) - len(part) >= at else -1
        else:
            found = name.find(part, at)
        if found < 0:
            return False
        at, free = found + len(part), False
    return free or at == len(name)
