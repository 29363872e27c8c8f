"""Where on the arm curves make sense, and how many places that are: what a curve pays for."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.channels.sight import READINGS
from postproc.effects.terms import FRAMES, LEANS, LOADED, PLACES
from postproc.identification.curves.form import CurveForm

UNNAMED_LOG_PRIOR = 16.0
"""2 log of the odds against a curve without a name: it needs 3000 times the likelihood of a named effect."""
APART = frozenset([*FRAMES, *(f"instrument, {reading}" for reading in READINGS), *LOADED])
"""Where the arm changes nothing but by leaning on it, and what is carried whatever the arm does."""
ROOMS = {None: len(PLACES), "weight": 3, "joint": 6, "instrument": 6, "base": 2, LEANS: 1}
"""How many places there are of each sort, of any other one."""


CLOSER = 4.0
"""As much less likely is a curve for each number that was found closer by: neighbours are hardly different."""
FOLDED = 2.0
"""As much less likely is a curve of the size of a signal: the same as of the signal, where that keeps its sign."""


def off_everywhere(where: str) -> bool:
    """Return whether a place may also be displaced by the same amount in every pose: the far ends of arm bodies.

    Other places need no such constant, since joint offsets, frames and the tool already take it up.

    Args:
        where: name of the place (`suspects.places`).
    """
    return where.startswith("body") and where not in LOADED


def sort_of_place(where: str) -> str:
    """Return the sort that a place is of, a key of `ROOMS` for those sorts with a count of their own.

    All joints are one sort (``joint``), and so is everything about the instrument except its moving frame.

    Args:
        where: name of the place (`suspects.places`).
    """
    if where in LOADED:
        return "weight"
    return where if where in (FRAMES[0], LEANS) else where.partition(",")[0].rstrip(" 123456")


def rarity(pattern: CurveForm) -> float:
    """Return how many times less likely a curve is than others of its kind, as it follows the size of a signal."""
    return float(FOLDED ** sum(signal.folded for signal in pattern.signals))


def odds(pattern: CurveForm, kinds: Mapping[str, float]) -> float:
    """Return the prior odds against a curve at a place: how many equally likely pairs of curve and place there are.

    Every kind of curve is as likely, within a kind every curve of signals that keep their sign, and for a curve every
    place where it makes sense.

    Args:
        kinds: number of curves of each kind, those that are less likely counted as parts.
    """
    closer = CLOSER ** len(pattern.numbers) if pattern.level else 1.0
    of_kind = kinds.get(pattern.kind, 1.0) * rarity(pattern)
    return len(kinds) * of_kind * pattern.tries * closer * ROOMS.get(pattern.where, 1)
