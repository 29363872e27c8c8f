"""What differs between two programs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

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

    def render(self) -> str:
        """One line for a terminal."""
        lines = "/".join("-" if line is None else str(line) for line in (self.line_a, self.line_b))
        parts = [f"{self.kind:8}{self.place}:{lines} {self.name}"]
        if self.distance_mm is not None and self.kind == "changed":
            shift = "" if self.shift_mm is None else " (dx {:+.3f}, dy {:+.3f}, dz {:+.3f})".format(*self.shift_mm)
            parts.append(f"{self.distance_mm:.3f} mm{shift}" + " at the circle point" * self.at_circle_point)
        if self.angle_deg is not None and self.kind == "changed":
            parts.append(f"{self.angle_deg:.4f} deg")
        if self.conf is not None:
            parts.append(f"conf {list(self.conf[0])} -> {list(self.conf[1])}")
        if self.speed_mm_s is not None:
            parts.append("speed {:g} -> {:g} mm/s".format(*self.speed_mm_s))
        told = {"speed", "weld"} if self.speed_mm_s is not None else set()
        parts += [f"{role}: {a or '-'} -> {b or '-'}" for role, a, b in self.arguments if role not in told]
        return "  ".join(parts)

    def as_json(self) -> dict[str, Any]:
        """The row of the ``postproc/diff/1`` document."""
        arguments = [{"role": role, "a": a, "b": b} for role, a, b in self.arguments]
        return {**asdict(self), "arguments": arguments}


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
        """Whether nothing differs by more than the tolerance."""
        return not self.differences

    def render(self) -> str:
        """Text for a terminal."""
        return "\n".join([*(d.render() for d in self.differences), self.summary])

    @property
    def counts(self) -> dict[str, int]:
        """How many differences there are of each kind: changed, added, removed."""
        return {kind: sum(d.kind == kind for d in self.differences) for kind in ("changed", "added", "removed")}

    @property
    def summary(self) -> str:
        """One line for people."""
        count = len(self.differences)
        kinds = ", ".join(f"{n} {kind}" for kind, n in self.counts.items() if n)
        return (
            f"{self.compared} motion statements compared, largest distance {self.max_distance_mm:.3f} mm, largest angle"
            f" {self.max_angle_deg:.4f} deg, {count} difference{'s' * (count != 1)} beyond {self.tolerance_mm:g} mm"
            f" and {self.tolerance_deg:g} deg" + (f": {kinds}" if kinds else "")
        )

    def as_json(self) -> dict[str, Any]:
        """The ``postproc/diff/1`` document."""
        return {
            "schema": "postproc/diff/1",
            "equal": self.equal,
            "tolerance_mm": self.tolerance_mm,
            "tolerance_deg": self.tolerance_deg,
            "compared": self.compared,
            "max_distance_mm": self.max_distance_mm,
            "max_angle_deg": self.max_angle_deg,
            "differences": [d.as_json() for d in self.differences],
        }
