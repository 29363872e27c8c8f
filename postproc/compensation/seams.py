"""Seams: the weld statements of a program that belong together; a seam is corrected whole, or stays as it is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise

from postproc.rapid.data.events import MotionStatement, StatementKey


def seams_of(statements: Iterable[MotionStatement]) -> list[list[MotionStatement]]:
    """The weld statements of each seam, in text order; a seam stays within one routine.

    Args:
        statements: motion statements in text order.
    """
    motions = list(statements)
    seams: list[list[MotionStatement]] = []
    begins = [True, *(_parts(before, statement) for before, statement in pairwise(motions))]
    for statement, new in zip(motions, begins, strict=True):
        if not statement.signature.phase:
            continue
        if new:
            seams.append([])
        seams[-1].append(statement)
    return seams


def _parts(before: MotionStatement, statement: MotionStatement) -> bool:
    """Whether a statement cannot continue the seam of the statement before it."""
    ended = before.signature.phase in ("", "end") or statement.signature.phase == "start"
    routines = [(s.source.path, s.module, s.routine) for s in (before, statement)]
    return ended or routines[0] != routines[1]


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
