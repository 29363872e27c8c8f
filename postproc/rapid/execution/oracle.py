"""Answers to what the text of a program leaves open."""

from __future__ import annotations


class Oracle:
    """This one has no answers: both ways are followed, and loops for all turns at once.

    Args:
        decides: there is an answer to everything: one way is followed, jump by jump.
    """

    def __init__(self, decides: bool = False) -> None:
        """Make an oracle that knows no answers; ``decides`` says whether a subclass answers every question."""
        self.decides = decides

    def condition(self, words: str) -> bool | None:
        """Whether a condition, given by routine and text, holds; None: not known, so that both ways are followed."""
        return None

    def turns(self) -> list[float] | None:
        """Values of the index of a FOR loop whose bounds are not known; None: not known, too."""
        return None
