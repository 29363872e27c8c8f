"""What a compensation asks for and decides: values of targets, added statements, the outcome of every statement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import Literal

from postproc.diagnostics import Source, Span
from postproc.motion.values import Move
from postproc.rapid.program.events import MotionEvent, MotionStatement, Origin
from postproc.rapid.program.records import Ax6, Pose, RobTarget, Vec3
from postproc.rapid.syntax.spans import TargetSpans

Status = Literal["compensated", "unchanged", "skipped"]
Place = Literal["declaration", "element", "aggregate", "argument", "call", "derived"]
"""Where the new target of a statement is written: the numbers of a declaration, of an array element, of the aggregate
that is the argument; another argument; the argument of the call that hands it to a routine; or nowhere, because it
moves with the target that it is derived from."""

OUT_OF_REACH = "the arm cannot run it as it is programmed: see the finding at this place"
UNCHANGED_MM = 0.0005  # below the last decimal that is written
UNCHANGED_RAD = 1e-7


@dataclass(frozen=True, slots=True)
class Displacement:
    """A displacement that goes straight with numbers: the constant and, by name of the number, what each unit adds."""

    constant: Vec3
    slopes: tuple[tuple[str, Vec3], ...] = ()

    def at(self, numbers: Mapping[str, float]) -> Vec3:
        """What it is where the numbers have these values."""
        x, y, z = self.constant
        for name, (dx, dy, dz) in self.slopes:
            x, y, z = x + numbers[name] * dx, y + numbers[name] * dy, z + numbers[name] * dz
        return x, y, z


@dataclass(frozen=True, slots=True)
class TargetValue:
    """A corrected target in its work object: pose [mm], confdata, external axes, and what displaces it from run to run.

    Args:
        way: of the pose [mm], None where it stays.
    """

    pose: Pose
    robconf: tuple[int, int, int, int]
    extax: Ax6
    way: Displacement | None = None


@dataclass(frozen=True, slots=True)
class Wish:
    """The corrected value that one move asks for, in one argument of its statement (``to`` or ``via``).

    Args:
        apart: the argument is replaced, whatever serves for the target that it names now.
    """

    move: Move
    role: str
    value: TargetValue
    apart: bool = False

    @property
    def event(self) -> MotionEvent:
        return self.move.event

    @property
    def target(self) -> RobTarget:
        """What the argument says now."""
        target = self.event.target if self.role == "to" else self.event.via
        assert isinstance(target, RobTarget)
        return target

    @property
    def origin(self) -> Origin:
        origin = self.event.target_origin if self.role == "to" else self.event.via_origin
        assert origin is not None
        return origin

    @property
    def names(self) -> set[str]:
        """Keys of the declaration and the parameters that the target comes from."""
        handed, declaration = self.origin.handed, self.origin.declaration
        return {*(handed.parameters if handed is not None else ()), *([declaration] if declaration is not None else [])}


@dataclass(frozen=True, slots=True)
class Change:
    """One target to rewrite.

    Args:
        source, span: the text that holds the target: an aggregate, or an argument that leads to one.
        value: the corrected target.
        spans: literal numbers that are replaced in place; None replaces the whole text.
        displacement: of whatever target the text leads to [mm], object frame; None writes an aggregate.
        inner: part of a displaced text that leads to one target in all runs and is replaced by ``value``.
    """

    source: Source
    span: Span
    value: TargetValue
    spans: TargetSpans | None = None
    displacement: Displacement | None = None
    inner: Span | None = None


@dataclass(frozen=True, slots=True)
class Insertion:
    """One statement added directly before ``statement``, derived from it.

    Args:
        instruction: name of the added instruction (``ArcL`` before an ``ArcLEnd``).
        to, via: its targets; base: the text that ``to`` displaces, None where it is a target of its own.
        zone: zone argument, a fly-by zone: an added target never stops.
        duration: what the added statement takes over of the original's ``\\T`` [s], exact in decimals.
    """

    statement: MotionStatement
    instruction: str
    to: TargetValue
    via: TargetValue | None
    zone: str
    duration: Decimal | None = None
    base: str | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """What happened to one motion statement, why, and where it is written; shift and residual at its goal [mm]."""

    statement: MotionStatement
    status: Status
    reason: str | None = None
    shift_mm: float | None = None
    residual_mm: float | None = None
    edited: Place | None = None

    def as_json(self) -> dict[str, object]:
        return {
            "path": self.statement.source.path,
            "line": self.statement.line,
            "module": self.statement.module,
            "routine": self.statement.routine,
            "instruction": self.statement.instruction,
            "status": self.status,
            "reason": self.reason,
            "edited": self.edited,
            "shift_mm": self.shift_mm,
            "residual_mm": self.residual_mm,
        }
