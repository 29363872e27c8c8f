"""Changes of byte spans; everything outside them stays as it was."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


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
