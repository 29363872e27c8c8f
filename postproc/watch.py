"""Who wants to know how far a long conversion, fit or search is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")
Watch = Callable[[str, float], None]
"""Is told what is being done, and the share of the work that lies behind, in [0, 1]."""


def unwatched(what: str, share: float) -> None:
    """Do nothing: the `Watch` of work whose progress nobody wants to see.

    Args:
        what: the present step. share: the part of the work that is done, 0 to 1.
    """


def reporting_progress(
    parts: Iterable[T], share: Callable[[T], float], watch: Watch, step: tuple[str, float, float]
) -> Iterator[T]:
    """Yield the parts of a step, and report the progress after each.

    Args:
        share: returns which fraction of the step a part is. watch: is told the step and the share done so far.
        step: its name, and the shares of the whole work that are done when it begins and when it ends.
    """
    what, done, end = step
    share_of_step = end - done
    for part in parts:
        yield part
        done = min(done + share_of_step * share(part), end)
        watch(what, done)
