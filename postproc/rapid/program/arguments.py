"""Arguments of statements: those of a motion instruction with their roles, those of a call with its parameters."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from sys import intern

from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import MotionStatement, Signature, StatementShape
from postproc.rapid.program.signatures import SIGNATURES
from postproc.rapid.syntax import patterns
from postproc.rapid.syntax.nodes import RoutineParameter
from postproc.rapid.syntax.tokens import identifiers

Piece = tuple[str, Span, Span]
BY_REFERENCE = ("VAR", "PERS", "INOUT")  # modes of parameters that stand for the caller's data
_REFERENCE = re.compile(rb"\s*+([A-Za-z_\x80-\xff][\w\x80-\xff]*+)\s*+(?:[.{].*)?", re.DOTALL)


def read_arguments(data: bytes, start: int, end: int) -> tuple[Piece, ...]:
    r"""The arguments of a statement, in the order of the text.

    Args:
        data: bytes of the file; start: offset behind the instruction's name; end: of the statement, ``;`` included or
            not.

    Returns:
        For each: ``\name`` of an optional argument or an empty text, span of the expression, span of the argument.
    """
    pieces: list[Piece] = []
    end -= data[end - 1 : end] == b";"
    at = start
    match = patterns.PIECE.match
    while at < end:
        piece = match(data, at, end)
        if piece is None or piece.end() == at:
            break
        at = piece.end()
        _, option, _, expression = piece.regs[1:5]
        if expression[0] < expression[1] and (data[expression[1] - 1] <= 32 or b"!" in piece[4]):
            expression = (expression[0], patterns.trimmed(data, *expression))
        if option[0] >= 0:
            first = data.rfind(b"\\", start, option[0])
            last = expression[1] if piece[3] else option[1]
            pieces.append(
                ("\\" + piece[2].decode("latin-1").lower(), expression if piece[3] else (last, last), (first, last))
            )
        elif expression[0] < expression[1]:
            pieces.append(("", expression, expression))
        if patterns.PLAIN_ARGUMENTS.fullmatch(data, at, end):  # as most statements go on after their target
            for word in data[at + 1 : end].split(b","):
                span = (at + 1, at + 1 + len(word))
                pieces.append(("", span, span))
                at = span[1]
            break
    return tuple(pieces)


class MotionReader:
    """Reads the motion statements of one file.

    Statements that differ in their targets alone share one ``StatementShape``, which is made once.
    """

    def __init__(self, source: Source) -> None:
        """Start without shapes; all statements are read from this file."""
        self.source = source
        self.shapes: dict[tuple[object, ...], StatementShape] = {}
        self.ends: dict[tuple[int, ...], tuple[int, ...]] = {}  # one tuple for all that are equal

    def read(self, span: Span, word: str, module: str, routine: str) -> MotionStatement:
        """The motion statement at ``span``, whose instruction is in ``SIGNATURES``.

        Positional arguments beyond the signature get the role ``extra``.

        Args:
            word: the instruction in lower case; module, routine: names of those in which it stands.
        """
        signature = SIGNATURES[word]
        data, start = self.source.data, span[0]
        at = start + len(word)
        ends: tuple[int, ...] = ()
        frames_before: tuple[bytes, ...] = ()
        for _ in range(signature.targets):
            target = patterns.TARGET.match(data, at, span[1])
            if target is None:
                break
            first, last = target.span(1)
            if data[last - 1] <= 32 or b"!" in target[1]:
                last = patterns.trimmed(data, first, last)
            frames_before, ends, at = (*frames_before, data[at:first]), (*ends, last - start), last
        key = (word, module, routine, *frames_before, data[at : span[1]])
        shape = self.shapes.get(key)
        if shape is None:
            pieces = read_arguments(data, start + len(word), span[1])
            names = frozenset(identifiers(b" ".join((*frames_before, data[at : span[1]]))))
            shape = self.shapes[key] = _shape(signature, (module, routine), names, _relative(pieces, start, ends))
        return MotionStatement(self.source, span, shape, self.ends.setdefault(ends, ends), (self.source.path, start))


def _relative(pieces: Sequence[Piece], start: int, ends: Sequence[int]) -> list[Piece]:
    """The arguments with spans relative to the end of the target before each (or to the start of the statement).

    Args:
        pieces: arguments with byte offsets in the file; start: offset of the statement.
        ends: where the targets end, in bytes from ``start``.
    """
    relative = []
    for i, (name, span, full_span) in enumerate(pieces):
        before, behind = (start + (0, *ends)[min(k, len(ends))] for k in (i, i + 1))
        relative.append((name, (span[0] - before, span[1] - behind), (full_span[0] - before, full_span[1] - behind)))
    return relative


def _shape(
    signature: Signature, home: tuple[str, str], names: frozenset[str], pieces: Sequence[Piece]
) -> StatementShape:
    """The common shape of motion statements that differ in their targets alone, with the role of each argument.

    Args:
        home: names of module and routine; names: words beside the targets.
        pieces: arguments with relative spans, as ``_relative`` gives them.
    """
    count = len([1 for name, _, _ in pieces if not name])
    expected_roles = signature.older if signature.older and count == len(signature.older) else signature.roles
    remaining = iter(expected_roles)
    roles = tuple([intern(name) if name else next(remaining, "extra") for name, _, _ in pieces])
    places = tuple([place for _, span, full_span in pieces for place in (*span, *full_span)])
    complete = "to" not in expected_roles or count == len(expected_roles)
    return StatementShape(signature, *home, roles, places, complete, names)


def argument_name(data: bytes, span: Span) -> str:
    """Lower-case name of the data that an argument is, or is a part of; empty for other expressions."""
    match = _REFERENCE.fullmatch(data, *span)
    return match[1].decode("latin-1").lower() if match else ""


def component_path(data: bytes, span: Span) -> tuple[str, ...]:
    """The component names of a reference in lower case, (``b``, ``c``) of ``a.b.c``; empty for anything else."""
    name, *fields = (word.strip() for word in data[slice(*span)].decode("latin-1").lower().split("."))
    return tuple(fields) if name.isidentifier() and all(field.isidentifier() for field in fields) else ()


def paired(parameters: Sequence[RoutineParameter], pieces: Iterable[Piece]) -> Iterator[tuple[RoutineParameter, Span]]:
    """Each parameter that a call passes, with the span of its argument: optional ones by name, others in order.

    Args:
        pieces: arguments of the call, as ``read_arguments`` gives them.
    """
    by_name = {p.name: p for p in parameters if p.optional}
    required = iter(p for p in parameters if not p.optional)
    for option, span, _ in pieces:
        parameter = by_name.get(option[1:]) if option else next(required, None)
        if parameter is not None:
            yield parameter, span
