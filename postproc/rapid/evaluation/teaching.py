"""Data that calibration and teach routines set, to what stands in the files: the user states so (``--taught``).

A write of what nobody can know before the program runs (a search, a measured frame) then gives the value in the file. A
write of a known value counts as it is: where it is another one and nothing measures again, the program moves the data.
"""

from __future__ import annotations

from collections.abc import Callable

from postproc.diagnostics import Source, Span
from postproc.rapid.data.values import Data
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.unknown import Kind, PartlyUnknown, Unknown, unknown_part, without_causes

MEASURED_MM, MEASURED_TURN = 5.0, 0.01  # what is measured is nearer than that to what it was; numbers of a quaternion

# Why data is not known that no routine has measured: the program sets it, on ways that are not certain.
SET_BY_PROGRAM = frozenset(
    {
        Kind.UNDECIDED, Kind.RESULT_UNDECIDED, Kind.CHANGED_IN_LOOP, Kind.CHANGED_TOO_DEEPLY, Kind.CHANGED_UNFOLLOWED,
        Kind.CHANGED_BEFORE_JUMP, Kind.CHANGED_BY_CYCLE, Kind.LOOP_INDEX, Kind.PARAMETER, Kind.COUNTER, Kind.UNSET,
    }
)  # fmt: skip


def moved_away(now: Data, data: Data) -> bool:
    """Whether two known values differ by more than a new measurement explains (5 mm, 0.01 in a quaternion).

    Texts and truth values differ if they are not equal.
    """
    if isinstance(now, tuple) and isinstance(data, tuple) and len(now) == len(data):
        if len(now) == 4 and all(isinstance(item, float) for item in (*now, *data)):
            return any(abs(a - b) > MEASURED_TURN for a, b in zip(now, data, strict=True))
        return any(map(moved_away, now, data))
    if isinstance(now, bool | str) and isinstance(data, bool | str):
        return now != data
    return isinstance(now, float) and isinstance(data, float) and abs(now - data) > MEASURED_MM


def equal_when_measured(a: Data, b: Data) -> bool:
    """Whether two values, fully known and of one type, agree within what a new measurement may change."""
    return unknown_part(a) is None and unknown_part(b) is None and type(a) is type(b) and not moved_away(a, b)


class Teaching:
    """What becomes of taught data while a program is followed.

    ``names`` are those of the data, in lower case; ``place`` is the statement that is executed. ``moved`` holds the
    keys of data that got another known value, with where that happened; ``kept`` those that a loop or a jump might have
    changed and that were taken as unchanged.
    """

    def __init__(self, names: frozenset[str] = frozenset()) -> None:
        """Start with the lower-case names of the data named by ``--taught``, and nothing moved or kept."""
        self.names = names
        self.place: tuple[Source, Span] | None = None
        self.moved: dict[str, tuple[Declaration, Source, Span]] = {}
        self.kept: set[str] = set()

    def covers(self, declaration: Declaration | None) -> bool:
        """Whether declared data is module data that ``--taught`` names; None and data of routines never are."""
        return declaration is not None and not declaration.routine and declaration.name.lower() in self.names

    def written(self, declaration: Declaration, data: Data, value: Callable[[], Data]) -> Data:
        """The value of ``--taught`` data after ``data`` is written: measured parts keep the value in the file.

        Args:
            value: gives the value in the file.
        """
        try:
            in_file = value()
        except Unknown:
            return data
        filled = _filled(data, in_file)
        if self.place is not None and self.away(in_file, filled):
            self.moved.setdefault(declaration.key, (declaration, *self.place))
        return filled

    def away(self, in_file: Data, data: Data) -> bool:
        """Whether data is unknown in part, or farther from the value in the file than measuring explains."""
        data, _ = without_causes(data)
        data = data.data if isinstance(data, PartlyUnknown) else data
        return unknown_part(data) is not None or moved_away(in_file, data)


def _filled(data: Data, in_file: Data) -> Data:
    """The data with the value in the file in place of parts that are unknown because they are measured at run time."""
    data, _ = without_causes(data)
    if isinstance(data, PartlyUnknown):
        filled = _filled(data.data, in_file)
        return filled if unknown_part(filled) is None else PartlyUnknown(data, filled)
    if isinstance(data, Unknown):
        return data if data.root.kind in SET_BY_PROGRAM else in_file
    if isinstance(data, tuple) and isinstance(in_file, tuple) and len(data) == len(in_file):
        return tuple(map(_filled, data, in_file))
    return data
