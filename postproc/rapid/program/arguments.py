"""A motion instruction and its arguments, each with role and span."""

from __future__ import annotations

from sys import intern

from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import MotionStatement
from postproc.rapid.program.signatures import SIGNATURES, Signature
from postproc.rapid.syntax import patterns

Piece = tuple[str, Span, Span]


def read_arguments(data: bytes, start: int, end: int) -> tuple[Piece, ...]:
    r"""Arguments of the statement that goes on at ``start``, behind its name, and ends before ``end``, `;` or not.

    Returns:
        For each: ``\name`` of an optional argument or nothing, span of the expression, span of the whole argument.
    """
    found: list[Piece] = []
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
            found.append(
                ("\\" + piece[2].decode("latin-1").lower(), expression if piece[3] else (last, last), (first, last))
            )
        elif expression[0] < expression[1]:
            found.append(("", expression, expression))
        if patterns.PLAIN_REST.fullmatch(data, at, end):  # as most statements go on after their target
            for word in data[at + 1 : end].split(b","):
                span = (at + 1, at + 1 + len(word))
                found.append(("", span, span))
                at = span[1]
            break
    return tuple(found)


def positional_roles(signature: Signature, count: int) -> tuple[str, ...]:
    return signature.older if signature.older and count == len(signature.older) else signature.roles


def read_motion(source: Source, span: Span, word: str, module: str, routine: str) -> MotionStatement | None:
    """The motion statement at ``span``, or None if ``word`` is no motion instruction.

    Positional arguments beyond the signature get the role ``extra``.
    """
    signature = SIGNATURES.get(word)
    if signature is None:
        return None
    pieces = read_arguments(source.data, span[0] + len(word), span[1])
    given = positional_roles(signature, len([1 for name, _, _ in pieces if not name]))
    rest = iter(given)
    roles = tuple([intern(name) if name else next(rest, "extra") for name, _, _ in pieces])
    roles = given if roles == given else roles  # most statements: one tuple for all of them
    begin = span[0]
    places = tuple([place - begin for _, at, whole in pieces for place in (*at, *whole)])
    return MotionStatement(signature.name, source, span, module, routine, roles, places, signature.interpolation)


def fits(statement: MotionStatement, signature: Signature) -> bool:
    """Whether the statement has exactly the positional arguments of its signature."""
    count = len([1 for role in statement.roles if role[0] != "\\"])
    return count == len(signature.roles) or (bool(signature.older) and count == len(signature.older))
