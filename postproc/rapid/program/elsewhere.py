"""What other tasks of a controller have of a program's data."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Elsewhere:
    """PERS data that other tasks of the controller declare too: lower-case names, and lower-case types.

    Args:
        shared: all of it. written: what another task may write at any time, or declares with another value.
    """

    shared: frozenset[tuple[str, str]] = frozenset()
    written: frozenset[tuple[str, str]] = frozenset()
