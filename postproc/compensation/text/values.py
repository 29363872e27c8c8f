"""What a compensation asks for and decides: values of targets, added statements, the outcome of every statement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from postproc.compensation.text.laws import OffsetLaw
from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import MotionEvent, MotionStatement, Origin
from postproc.rapid.data.pose import subtract
from postproc.rapid.data.records import Ax6, Pose, RobTarget, Vec3

Status = Literal["compensated", "run_time", "unchanged", "skipped"]
"""``run_time``: its targets go through the function that corrects them on the controller."""
Place = Literal["declaration", "element", "aggregate", "argument", "call", "derived", "function"]
"""Where the correction of a statement is written: in the numbers of a declaration, of an array element, of the
aggregate that is the argument; in an offset of the argument; in the argument of the call that hands it to a routine;
nowhere, because it moves with the target that it is derived from; or in a function around the argument."""

Conf = tuple[int, int, int, int]
UNCHANGED_MM = 0.0005  # below the last decimal that is written
UNCHANGED_RAD = 1e-7


def compliant(a: Conf, b: Conf) -> bool:
    """Whether a controller accepts one configuration for the other: cf1, cf4, cf6 differ by 1 at most, cfx is equal."""
    near = -1 <= a[0] - b[0] <= 1 and -1 <= a[1] - b[1] <= 1 and -1 <= a[2] - b[2] <= 1
    return near and a[3] == b[3]


@dataclass(frozen=True, slots=True)
class PathPoint:
    """A target stated as a point at a fraction of the line between two targets, or of the arc through three.

    Args:
        function: name of the routine that calculates it on the controller.
        ends: texts of start and goal, for an arc with the circle point between them.
        share: the fraction of the way.
        offset: displacement of the point [mm], axes of the object.
        turns: quarter turns of axes 1, 4 and 6 from the configuration of the nearer end, and 1 where axis 5 has the
            other sign; None for none.
        length: length [mm] of the line for which the displacement holds, which goes with the square of the length; 0
            where it holds for any.
    """

    function: str
    ends: tuple[str, ...]
    share: float
    offset: Vec3
    turns: Conf | None = None
    length: int = 0

    @property
    def on_arc(self) -> bool:
        """Whether the point is on an arc, not on a line."""
        return len(self.ends) > 2


@dataclass(frozen=True, slots=True)
class TargetValue:
    """A corrected target in its work object: pose [mm], confdata, external axes.

    Args:
        point: what it is written as instead of numbers.
    """

    pose: Pose
    robconf: Conf
    extax: Ax6
    point: PathPoint | None = None


@dataclass(frozen=True, slots=True)
class TargetRequest:
    """The corrected target for one argument in one execution of a statement.

    Args:
        move: index of the move.
        event: the execution.
        role: of the argument, ``to`` or ``via``.
        value: the corrected target.
        turn: rotation vector [rad] from the programmed to the corrected orientation.
        within_mm: how far from ``value`` the target may be written.
    """

    move: int
    event: MotionEvent
    role: str
    value: TargetValue
    turn: Vec3
    within_mm: float

    @property
    def target(self) -> RobTarget:
        """The programmed target of the argument."""
        target = self.event.target if self.role == "to" else self.event.via
        assert isinstance(target, RobTarget)
        return target

    @property
    def origin(self) -> Origin:
        """Where the numbers of the programmed target come from in the text."""
        origin = self.event.target_origin if self.role == "to" else self.event.via_origin
        assert origin is not None
        return origin

    @property
    def shift(self) -> Vec3:
        """Vector from the programmed to the corrected position [mm], object axes."""
        return subtract(self.value.pose.trans, self.target.trans)


Form = Literal["numbers", "amounts", "offset", "components", "point"]
"""How a correction is written: literal numbers in the place of literal numbers; other amounts in ``Offs`` or
``RelTool``; ``Offs`` around the expression; an aggregate of the components of a name, where ``Offs`` is a name of the
program's own; the point of a line or arc in its place."""


@dataclass(frozen=True, slots=True)
class Change:
    """One target expression to rewrite.

    Args:
        source, span: the text that leads to the target; for ``numbers`` the aggregate that holds them.
        form: how it is rewritten.
        value: the corrected target.
        law: formula of what is added to the position [mm], along the axes of the object or, in ``RelTool``, of the
            tool.
    """

    source: Source
    span: Span
    form: Form
    value: TargetValue
    law: OffsetLaw = OffsetLaw()


@dataclass(frozen=True, slots=True)
class Insertion:
    """One statement added directly before ``statement``, derived from it.

    Args:
        instruction: name of the added instruction (``ArcL`` before an ``ArcLEnd``).
        to, via: its targets.
        zone: zone argument, a fly-by zone: an added target never stops.
    """

    statement: MotionStatement
    instruction: str
    to: TargetValue
    via: TargetValue | None
    zone: str


@dataclass(frozen=True, slots=True)
class StatementOutcome:
    """What happened to one motion statement.

    Args:
        status: what happened; reason: why.
        shift_mm: size of the correction at its goal.
        residual_mm: deviation that remains at its goal across the path, which is what the arc sees; along_mm: along it.
            Behind a joint move the first is the whole, and the other is None.
        edited: kind of place in the text where its correction is written.
        conf_changed: its target or circle point has other confdata than the programmer wrote.
    """

    statement: MotionStatement
    status: Status
    reason: str | None = None
    shift_mm: float | None = None
    residual_mm: float | None = None
    along_mm: float | None = None
    edited: Place | None = None
    conf_changed: bool = False
