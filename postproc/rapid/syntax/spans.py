"""Byte spans: where the numbers of a robtarget stand in the text, and changes that leave all else as it was."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from postproc.diagnostics import Source, Span
from postproc.rapid.syntax.tokens import BLANK, COMMENT, NUMBER, many

_GAP = rb"[ \t\r\n]*+" + many(BLANK + rb"|" + COMMENT)
_SIGNED_NUMBER = rb"(" + many(rb"[+-]" + _GAP) + rb"(?>" + NUMBER + rb"))"
_COMMA = _GAP + b"," + _GAP


def _list(count: int) -> bytes:
    """A pattern of ``count`` numbers in square brackets, each a group, with any blanks and comments between."""
    return rb"\[" + _GAP + _COMMA.join([_SIGNED_NUMBER] * count) + _GAP + rb"\]"


_LITERAL = re.compile(rb"\[" + _GAP + _COMMA.join(_list(n) for n in (3, 4, 4, 6)) + _GAP + rb"\]" + _GAP)
# The same as nearly everybody writes it, decimals without blanks: found six times as fast.
_DECIMAL = rb"([+-]?\d++(?:\.\d*+)?(?:[eE][+-]?\d++)?)"
_TIGHT = re.compile(rb"\[" + b",".join(rb"\[" + b",".join([_DECIMAL] * n) + rb"\]" for n in (3, 4, 4, 6)) + rb"\]")
_BEHIND = b",".join(rb"\[" + b",".join([_DECIMAL.replace(b"(", b"(?:", 1)] * n) + rb"\]" for n in (4, 4, 6))
_PARTS = re.compile(rb"\[\[" + b",".join([_DECIMAL] * 3) + rb"\],(" + _BEHIND + rb")\]")


def literal(data: bytes, start: int, end: int) -> re.Match[bytes] | None:
    """A match of a robtarget of numbers alone, with each of the 17 numbers a group; None for other text."""
    return _TIGHT.fullmatch(data, start, end) or _LITERAL.fullmatch(data, start, end)


def literal_parts(data: bytes, start: int, end: int) -> re.Match[bytes] | None:
    """A match of a robtarget of plain decimals without blanks: groups x, y, z and the text of the other 14 numbers.

    None for any other text, also for robtargets that are written otherwise.
    """
    return _PARTS.fullmatch(data, start, end)


@dataclass(frozen=True, slots=True)
class TargetSpans:
    """Where a robtarget of literal numbers stands; `literal` finds its numbers again, to keep their spans takes 1.5 kB.

    ``rough``: the length of its quaternion differs from 1 by more than rounding explains.
    """

    source: Source
    span: Span
    rough: bool = False


@dataclass(frozen=True, slots=True, order=True)
class Edit:
    """``data[start:end]`` becomes ``text``; an insertion has ``start == end``."""

    start: int
    end: int
    text: bytes


def edited(data: bytes, edits: Iterable[Edit]) -> list[bytes]:
    """The text with all edits made, as parts to be joined; insertions at one offset keep their order.

    Raises:
        ValueError: edits overlap or reach outside the data.
    """
    parts = []
    at = 0
    for edit in sorted(edits, key=lambda e: (e.start, e.end)):
        if edit.start < at or edit.end < edit.start or edit.end > len(data):
            raise ValueError(f"the edit at {edit.start}:{edit.end} overlaps another or lies outside the text")
        parts += [data[at : edit.start], edit.text]
        at = edit.end
    parts.append(data[at:])
    return parts
