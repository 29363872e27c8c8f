"""What a program makes the robot do: motion statements (text) and motion events (one execution of a statement).

The contract between the reader and every room below it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from postproc.diagnostics import Diagnostic, Source, Span
from postproc.grouping import grouped
from postproc.rapid.data.records import (
    Ax6,
    JointTarget,
    LoadData,
    Pose,
    RobTarget,
    SpeedData,
    ToolData,
    Vec3,
    Weld,
    WobjData,
    ZoneData,
)
from postproc.rapid.syntax.spans import TargetSpans
from postproc.rapid.unknown import Kind, Unknown

Interpolation = Literal["joint", "line", "arc", "absjoint", "none"]
StatementKey = tuple[str, int]  # path and offset of a motion statement
OriginKind = Literal["inline", "declared", "element", "expression", "runtime", "star"]


@dataclass(frozen=True, slots=True)
class ByValueArgument:
    """A target that a routine got by value: the argument of the call as it stands in the text.

    Args:
        parameters: keys of the parameters (``module.routine.%name``) that carried it on, the called routine's first.
    """

    source: Source
    span: Span
    parameters: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the value of a target argument comes from.

    Args:
        kind: ``inline`` aggregate of literal numbers; ``declared`` name of a declaration with literal numbers;
            ``element`` of an array or a record with literal numbers; ``expression`` (Offs, RelTool, names inside an
            aggregate); ``runtime`` not known before the program runs; ``star`` a hidden position.
        spans: the literal numbers, where there are any.
        declaration: canonical key of the declaration (lower case ``module.routine.name`` or ``module..name``).
        storage: CONST, PERS or VAR of that declaration.
        handed: where a call hands it over, if it comes from a parameter.
        root: what the expression displaces, if it does nothing else.
    """

    kind: OriginKind
    spans: TargetSpans | None = None
    declaration: str | None = None
    storage: str | None = None
    handed: ByValueArgument | None = None
    root: Root | None = None

    @property
    def base(self) -> Origin:
        """The origin of the numbers: of what is displaced, or its own."""
        return self if self.root is None else self.root.origin

    @property
    def stands_in_statement(self) -> bool:
        """Whether the numbers are an aggregate in the motion statement itself."""
        return self.base.kind == "inline" and self.base.handed is None


@dataclass(frozen=True, slots=True)
class Root:
    """The target that ``Offs``, ``RelTool`` and functions like them, one inside the other, displace.

    Args:
        target: its value; origin: where that comes from.
        lever: what of the displacement turns with the target (that of ``RelTool``) [mm], object axes.
    """

    target: RobTarget
    origin: Origin
    lever: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a motion statement.

    Args:
        role: ``to``, ``via`` (CirPoint), ``speed``, ``zone``, ``tool``, ``seam``, ``weld``, ``signal``, ``value`` ...;
            optional arguments carry their lower-case name with a backslash: ``\\wobj``, ``\\weave``, ``\\v``,
            ``\\t``, ``\\id``.
        span: the argument's expression (without the comma; for an optional argument without ``\\Name:=``).
        text: the expression as written.
        whole: from the backslash or expression start to the expression's end.
    """

    role: str
    span: Span
    text: str
    whole: Span


@dataclass(frozen=True, slots=True)
class MotionStatement:
    """One motion statement as it stands in the file.

    Args:
        instruction: canonical spelling, ``MoveL``, ``ArcLStart``.
        source: the file.
        span: from the first byte of the instruction name to the byte after ``;``.
        module: name of the module, routine: name of the routine.
        roles: of the arguments, in the order of the text.
        places: begin and end of each argument's span and of its whole, counted from the statement's first byte: small
            numbers are kept once, however many statements there are.
        interpolation: how the controller moves to the target; ``none`` for statements that do not move the arm.
        key: what tells it from every other statement of the program.
    """

    instruction: str
    source: Source
    span: Span
    module: str
    routine: str
    roles: tuple[str, ...]
    places: tuple[int, ...]
    interpolation: Interpolation
    key: StatementKey = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", (self.source.path, self.span[0]))

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """In the order of the text."""
        return tuple(map(self._argument, range(len(self.roles))))

    def argument(self, role: str) -> Argument | None:
        """The first argument of a role."""
        return self._argument(self.roles.index(role)) if role in self.roles else None

    def span_of(self, role: str) -> Span | None:
        """Where the expression of the first argument of a role stands."""
        if role not in self.roles:
            return None
        at, i = self.span[0], 4 * self.roles.index(role)
        return at + self.places[i], at + self.places[i + 1]

    def _argument(self, i: int) -> Argument:
        at = self.span[0]
        start, end, first, last = self.places[4 * i : 4 * i + 4]
        text = self.source.data[at + start : at + end].decode("latin-1")
        return Argument(self.roles[i], (at + start, at + end), text, (at + first, at + last))

    @property
    def line(self) -> int:
        return self.source.position(self.span[0])[0]


@dataclass(frozen=True, slots=True)
class MotionEvent:
    """One execution of a motion statement, with everything that is in force at that moment.

    ``target`` is None when it is known only at run time; ``reason`` then says why the statement is left alone.
    """

    statement: MotionStatement
    target: RobTarget | JointTarget | None
    via: RobTarget | None
    target_origin: Origin
    via_origin: Origin | None
    tool: ToolData
    wobj: WobjData
    speed: SpeedData
    zone: ZoneData
    weld: Weld | None = None
    duration: float | None = None  # \T [s]
    gripload: LoadData = LoadData()  # GripLoad, in the tool frame
    displacement: Pose = Pose()  # PDispSet / PDispOn, applied in the object frame
    conditional: bool = False  # on a branch whose condition is not known
    reason: str | None = None
    diagnostics: tuple[Diagnostic, ...] = ()
    options: Mapping[str, bool] = field(default_factory=dict)  # conf_l, conf_j, ... as far as known
    detached: bool = False  # the arm may come from elsewhere than the event before
    velocity_override: float = 100.0  # VelSet [%]
    velocity_limit: float | None = None  # VelSet [mm/s]
    acceleration: float = 100.0  # AccSet [%]
    elsewhere: bool = False  # the statement also runs with another target, on ways that are not followed
    first: bool = False  # where the arm comes from is not known
    loose: bool = False  # nothing that is followed leads to the statement: a handler, a routine that nobody calls
    again: int | None = None  # no motion: the arm stands where that event has brought it, and another way goes on
    way: int = 0  # number of the way by which the arm comes here, where it may come by several
    numbers: tuple[tuple[str, float], ...] = ()  # what the numbers are that the statement names beside its target
    start: str | None = None  # what the program calls the target where the arm comes from, if that means the same here
    touched: bool = False  # its frames, or the target before it, may have been written since the arm was there
    assumed: tuple[str, ...] = ()  # why target, tool, frames or load are not certain: phrases for people
    axis_offset: Ax6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # EOffsSet [mm], [deg]
    units: tuple[tuple[str, bool], ...] | None = ()  # what ActUnit and DeactUnit have done, by name; None: unknown
    axes: Ax6 | None = field(default=None, compare=False)  # where external axes stand at the goal [mm, deg], or NaN
    unknowns: tuple[Unknown, ...] = field(default=(), compare=False)  # what ``reason`` says, as values

    @property
    def searched(self) -> bool:
        """Whether it goes with what a search has found."""
        return any(unknown.root.kind is Kind.FOUND_BY_SEARCH for unknown in self.unknowns)


def executions_of(events: Sequence[MotionEvent]) -> dict[StatementKey, list[int]]:
    """Indices of the events of each statement; where the arm only stands ``again`` nothing is executed."""
    return grouped((event.statement.key, i) for i, event in enumerate(events) if event.again is None)
