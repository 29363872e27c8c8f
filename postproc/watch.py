"""Who wants to know how far a long conversion, fit or search is."""

from __future__ import annotations

from collections.abc import Callable

Watch = Callable[[str, float], None]
"""Is told what is being done, and the share of the work that lies behind, in [0, 1]."""


def unwatched(what: str, share: float) -> None:
    """Nobody does."""
