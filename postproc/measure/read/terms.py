"""What a user says of a table: findings that are accepted, whether the order of rows counts, a file beside it."""

from __future__ import annotations

from collections.abc import Iterable, Set
from dataclasses import dataclass, replace

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, Source
from postproc.robot.cells.station import Station

ACCEPTABLE = ("DAT007", "DAT009", "DAT031", "DAT034")
"""Findings that are judgements by the nominal arm or by other data, which the user may know better."""


@dataclass(frozen=True)
class Reading:
    """How a table is read.

    Args:
        rows_in_order: the rows stand in the order of measuring; else `time_s` tells it, for sides also `pose_id`.
        accept: codes of findings that stop nothing.
        station: the arm in its cell, where external axes carry it or its work.
        joints: a table of commanded joint angles that stands beside the one that is read.
        tool: (4, 4) TCP in tool0 of rows that do not say it; None for the flange.
        gravity: (3,) in base axes [m/s^2] of rows in which no turning axis carries the arm; None for a floor.
    """

    rows_in_order: bool = False
    accept: frozenset[str] = frozenset()
    joints: Source | None = None
    station: Station | None = None
    tool: Array | None = None
    gravity: Array | None = None


AS_IT_IS = Reading()


def accepted(findings: Iterable[Diagnostic], accept: Set[str]) -> list[Diagnostic]:
    """Return the findings, accepted errors as warnings; the help of others that may be accepted says how.

    Args:
        accept: codes of the accepted findings.
    """
    result = []
    for one in findings:
        if one.severity == "error" and one.code in accept:
            one = replace(one, severity="warning", help=f"accepted; {one.help}" if one.help else "accepted")
        elif one.severity == "error" and one.code in ACCEPTABLE:
            way = f"`--accept {one.code}` goes on if the table is right"
            one = replace(one, help=f"{one.help}; {way}" if one.help else way)
        result.append(one)
    return result
