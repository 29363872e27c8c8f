"""What differs between two programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from postproc.rapid.data.records import Vec3


@dataclass(frozen=True, slots=True)
class Difference:
    """One statement that differs.

    Args:
        kind: ``changed``, ``added`` (only in the second program) or ``removed`` (only in the first).
        what: ``motion``, ``statement`` or ``declaration``.
        place: ``module.routine``, or ``module`` for data.
        name: the instruction, or the name of the data.
        line_a, line_b: line in each file, as far as it stands there.
        distance_mm: largest distance of the targets (None if not both are known); shift_mm: from the first to the
            second there, in object axes.
        angle_deg: largest angle between their orientations, or between joints.
        conf: configurations of both where they differ.
        arguments: role and both texts of arguments that differ.
        at_circle_point: the circle point of an arc is farther away than its target.
        speed_mm_s: of the TCP in both, where they differ; of a weld that of its welddata.
        target: text of the motion's target, in the second program if it is there.
        text_a, text_b: the motion statement as it stands in each file, empty where it does not.
        position_mm: of the target in both, object axes, where ``shift_mm`` is counted.
    """

    kind: Literal["changed", "added", "removed"]
    what: Literal["motion", "statement", "declaration"]
    place: str
    name: str
    line_a: int | None
    line_b: int | None
    distance_mm: float | None = None
    angle_deg: float | None = None
    conf: tuple[tuple[int, ...], tuple[int, ...]] | None = None
    arguments: tuple[tuple[str, str, str], ...] = ()
    shift_mm: Vec3 | None = None
    speed_mm_s: tuple[float, float] | None = None
    at_circle_point: bool = False
    target: str = ""
    text_a: str = ""
    text_b: str = ""
    position_mm: tuple[Vec3, Vec3] | None = None


@dataclass(frozen=True)
class ProgramDiff:
    """Differences of two programs beyond the tolerance, and the largest ones of all that were compared."""

    differences: tuple[Difference, ...]
    compared: int = 0
    max_distance_mm: float = 0.0
    max_angle_deg: float = 0.0
    tolerance_mm: float = 0.0
    tolerance_deg: float = 0.0

    @property
    def equal(self) -> bool:
        """Whether no difference exceeds the tolerance."""
        return not self.differences

    @property
    def counts(self) -> dict[str, int]:
        """How many differences there are of each kind: changed, added, removed."""
        return {kind: sum(d.kind == kind for d in self.differences) for kind in ("changed", "added", "removed")}


@dataclass(frozen=True, slots=True)
class FileDiff:
    """One file of two folders.

    Args:
        path: below both folders, with ``/``.
        status: ``added`` stands in the second folder alone, ``removed`` in the first; ``unreadable`` has other bytes
            and is no program that can be read.
        reason: why files of both folders were not compared by meaning: the same bytes, no module, or not to be read;
            None where they were.
        difference: what differs, empty where no programs were compared.
    """

    path: str
    status: Literal["equal", "changed", "added", "removed", "unreadable"]
    reason: str | None = None
    difference: ProgramDiff = ProgramDiff(())

    @property
    def compared(self) -> bool:
        """Whether two programs were compared by meaning."""
        return self.reason is None and self.status in ("equal", "changed")
