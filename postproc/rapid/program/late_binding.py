"""Names that stand in a text: of procedures, in ``%"rPart"+NumToStr(n,0)% a,b;`` and ``CallByVar "rPart",n;``, and of
data, in ``SetDataVal "p"+ValToStr(n),pNew;``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from glob import escape

from postproc.diagnostics import Span
from postproc.rapid.program.arguments import Piece, argument_name, component_path, read_arguments
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.nodes import Declaration, Routine, Statement
from postproc.rapid.syntax.tokens import many

LATE = "a routine that is chosen at run time"
# Instructions that read or write the data whose name is in their first argument, a text.
BY_NAME = ("getdataval", "setdataval", "setalldataval")
STRING_LITERAL = re.compile(b'"(' + many(rb'[^"]++|""') + b')"')
# A text as far as it is written: its literal parts in lower case, None for what is worked out.
Template = tuple[str | None, ...]


@dataclass(frozen=True, slots=True)
class LateCall:
    """A call of a routine by a name that is a string expression: ``%name%`` or ``CallByVar``.

    Args:
        name: span of the string expression.
        number: span of the number that CallByVar appends to it; None for ``%name%``.
        template: of the routine's name, as ``text_template`` gives it; pieces: arguments of the call.
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
    """The template of a string expression: its literals in lower case, None for each part computed at run time.

    A module's name in front (``module:name``) is left out.
    """
    parts: list[str | None] = []
    for i, part in enumerate(STRING_LITERAL.split(expression)):  # every other part is outside quotes: it is worked out
        if i % 2:
            parts.append(part.decode("latin-1").lower())
        elif part.strip() not in (b"", b"+"):
            parts.append(None)
    return _joined(parts)


def _joined(parts: Sequence[str | None]) -> Template:
    """The template with neighbouring literals joined, and without a module's name in front (``module:name``).

    Args:
        parts: literals in lower case, None for each part computed at run time.
    """
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
    """Whether a name (any case) fits a template, in which None stands for any text."""
    pattern = "".join("*" if part is None else escape(part) for part in template)
    return fnmatchcase(name.lower(), pattern)


def named_by_text(statement: Statement, routine: Routine, program: Program) -> Iterator[Declaration]:
    """Module data that a call of GetDataVal, SetDataVal or SetAllDataVal may name by a string expression.

    Its name fits the first argument, and it has the type of the data passed (any type if that is unknown), as in
    ``SetDataVal "p"+ValToStr(n),pNew``. For other statements there is none.
    """
    if statement.kind != "call" or statement.word not in BY_NAME or program.routine(statement.word, routine.module):
        return
    data = routine.source.data
    pieces = [span for _, span, _ in read_arguments(data, statement.span[0] + len(statement.word), statement.span[1])]
    plain = data[slice(*pieces[0])] if pieces else b""
    template, kind = text_template(plain), ""
    if statement.word == "setalldataval":
        template, kind = (None,), plain.decode("latin-1").strip(' "').lower()
    elif len(pieces) > 1 and not component_path(data, pieces[-1]):
        passed = program.declaration(argument_name(data, pieces[-1]), routine.module, routine.name)
        kind = passed.type.lower() if passed is not None else ""
    for declaration in program.declarations:
        if not declaration.routine and kind in ("", declaration.type.lower()) and may_be(template, declaration.name):
            yield program.names.get(declaration.key, declaration)
