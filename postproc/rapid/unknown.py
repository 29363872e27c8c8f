"""Values that the text alone does not give."""

from __future__ import annotations

from typing import Any

from postproc.diagnostics import Span

Data = Any  # float, bool, str or a tuple of Data


class Unknown(Exception):
    """A value that the text alone does not give.

    Args:
        reason: a phrase that completes "left alone: ...".
        missing: name that is declared nowhere, with the span where it is used.
    """

    def __init__(self, reason: str, missing: str | None = None, span: Span | None = None) -> None:
        super().__init__(reason)
        self.reason = reason
        self.missing = missing
        self.span = span


class Invalid(Unknown):
    """Data that the controller itself refuses: a typing error."""


class PartlyUnknown(Unknown):
    """A record or an array of which some parts are known; ``data`` has a Unknown in the place of every other."""

    def __init__(self, unknown: Unknown, data: Data) -> None:
        super().__init__(unknown.reason, unknown.missing, unknown.span)
        self.data = data


def unknown_part(data: Data) -> Unknown | None:
    """Why data, or a part of it, is not known."""
    if isinstance(data, tuple):
        return next((unknown for item in data if (unknown := unknown_part(item)) is not None), None)
    return data if isinstance(data, Unknown) else None
