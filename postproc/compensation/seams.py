"""Seams: the weld statements of a program that belong together; a seam is corrected whole, or stays as it is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from postproc.grouping import grouped
from postproc.rapid.data.events import MotionStatement, StatementKey


def seams_of(statements: Iterable[MotionStatement]) -> list[list[MotionStatement]]:
    """The weld statements of each seam, in text order; a seam stays within one routine.

    Args:
        statements: motion statements in text order.
    """
    seams: list[list[MotionStatement]] = []
    burning, routine = False, None  # the seam goes on, in that routine
    for statement in statements:
        phase, place = statement.signature.phase, (statement.source.path, statement.module, statement.routine)
        if phase in ("weld", "end") and burning and place == routine:
            seams[-1].append(statement)
        elif phase:
            seams.append([statement])
        burning, routine = phase in ("start", "weld"), place
    return seams


def seam_names(starts: Sequence[MotionStatement]) -> list[str]:
    """A name for each seam, all different: its routine, with the line where that holds several, as in ``rSeam:46``.

    Where routines of two modules have one name, that of the module stands before it; of two seams that begin on one
    line, the column stands behind it.

    Args:
        starts: first statement of each seam.
    """
    modules = grouped((s.routine, s.module) for s in starts)
    names = [f"{s.module}." * (len({*modules[s.routine]}) > 1) + s.routine for s in starts]
    for part in (0, 1):  # line, then column
        often = Counter(names)
        places = (s.source.position(s.span[0])[part] for s in starts)
        names = [f"{name}:{at}" if often[name] > 1 else name for name, at in zip(names, places, strict=True)]
    return names


def seam_mates(lost: Mapping[StatementKey, str], statements: Iterable[MotionStatement]) -> dict[StatementKey, str]:
    """Weld statements to leave since another one of their seam cannot be corrected, with the reason and its line.

    Args:
        lost: statements that cannot be corrected, with the reason.
        statements: motion statements in text order.
    """
    mates: dict[StatementKey, str] = {}
    for seam in seams_of(statements):
        culprit = next((s for s in seam if s.key in lost), None)
        if culprit is not None:
            line, _ = culprit.source.position(culprit.span[0])
            why = f"its seam stays as it is, for line {line} cannot be corrected: {lost[culprit.key]}"
            mates |= {s.key: why for s in seam if s.key not in lost}
    return mates
