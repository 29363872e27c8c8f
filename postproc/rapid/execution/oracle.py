"""Answers to what the text of a program leaves open."""

from __future__ import annotations


class Oracle:
    """Answers questions that the program's data does not decide.

    This one has no answers: both ways are followed, and loops for all turns at once.

    Args:
        decides: a subclass has an answer to everything: one way is followed, jump by jump.
    """

    def __init__(self, decides: bool = False) -> None:
        """Make an oracle that knows no answers; ``decides`` says whether a subclass answers every question."""
        self.decides = decides

    def condition(self, question: str) -> bool | None:
        """Answer whether a condition holds that no data of the program decides; None, always here: follow both ways.

        Args:
            question: key of the routine, a space, and the source text of the condition.
        """
        return None

    def turns(self) -> list[float] | None:
        """Return the index values of a FOR loop whose bounds are not known; None, always here: not known either."""
        return None
