"""What a program makes the robot do: motion statements (text) and motion events (one execution of a statement).

The contract between the reader and every room below it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from postproc.diagnostics import Diagnostic, Source, Span
from postproc.grouping import grouped, shared
from postproc.rapid.data import records
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
        """Origin of the literal numbers: of the target that Offs or the like displaces, else this one."""
        return self if self.root is None else self.root.origin

    @property
    def stands_in_statement(self) -> bool:
        """Whether the target's numbers are written as an aggregate in the motion statement itself."""
        return self.base.kind == "inline" and self.base.handed is None


@dataclass(frozen=True, slots=True)
class Root:
    """The target that ``Offs``, ``RelTool`` and functions like them, one inside the other, displace.

    Args:
        target: its value; origin: where that comes from.
        lever: the part of the displacement that turns with the target, as that of ``RelTool`` [mm], object axes.
    """

    target: records.RobTarget
    origin: Origin
    lever: records.Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a motion statement.

    Args:
        role: ``to``, ``via`` (CirPoint), ``speed``, ``zone``, ``tool``, ``seam``, ``weld``, ``signal``, ``value`` ...;
            optional arguments carry their lower-case name with a backslash: ``\\wobj``, ``\\weave``, ``\\v``,
            ``\\t``, ``\\id``.
        span: the argument's expression (without the comma; for an optional argument without ``\\Name:=``).
        text: the expression as written.
        full_span: from the backslash or expression start to the expression's end.
    """

    role: str
    span: Span
    text: str
    full_span: Span


@dataclass(frozen=True, slots=True)
class Signature:
    """How to read one motion instruction.

    Args:
        name: canonical spelling, ``MoveL``, ``ArcLStart``.
        interpolation: how the controller moves to the target; ``none`` for what does not move the arm.
        roles: of the positional arguments; older: in S4 programs, where they differ.
        phase: of the seam, for arc and cap welding.
        why_not: why its target is never changed, empty if it may be.
        jointed: the target is a jointtarget.
        results: roles of the arguments in which an instruction that measures stores what it finds.
        targets: how many of the first arguments are targets.
    """

    name: str
    interpolation: Interpolation
    roles: tuple[str, ...]
    phase: str = ""
    older: tuple[str, ...] = ()
    why_not: str = ""
    jointed: bool = False
    results: tuple[str, ...] = ()
    targets: int = field(init=False)

    def __post_init__(self) -> None:
        """Set ``targets``: how many of the roles stand before the first one that is neither ``via`` nor ``to``."""
        others = [i for i, role in enumerate(self.roles) if role not in ("via", "to")]
        object.__setattr__(self, "targets", others[0] if others else len(self.roles))


LONGEST_TARGET = 60  # characters of a target's text


@dataclass(frozen=True, slots=True, eq=False)
class StatementShape:
    """What the motion statements of a routine share that read alike but for their targets: thousands have one shape.

    Args:
        signature: of the instruction.
        module: name of the module, routine: name of the routine.
        roles: of the arguments, in the order of the text.
        places: begin and end of each argument's span and of its full span. They are counted from the end of the target
            before, or of the last one; where there is none from the statement's first byte.
        complete: whether there are exactly the positional arguments that the instruction needs, where that is known.
        words: that stand beside the targets, in lower case.
    """

    signature: Signature
    module: str
    routine: str
    roles: tuple[str, ...]
    places: tuple[int, ...]
    complete: bool
    words: frozenset[str]


@dataclass(frozen=True, slots=True)
class MotionStatement:
    """One motion statement as it stands in the file.

    Args:
        source: the file.
        span: from the first byte of the instruction name to the byte after ``;``.
        shape: all but its targets.
        ends: where its targets end, counted from its first byte; they are its first arguments.
        key: what tells it from every other statement of the program.
    """

    source: Source
    span: Span
    shape: StatementShape
    ends: tuple[int, ...]
    key: StatementKey

    instruction: ClassVar[str] = shared("shape.signature.name")
    module: ClassVar[str] = shared("shape.module")
    routine: ClassVar[str] = shared("shape.routine")
    interpolation: ClassVar[Interpolation] = shared("shape.signature.interpolation")
    signature: ClassVar[Signature] = shared("shape.signature")
    roles: ClassVar[tuple[str, ...]] = shared("shape.roles")

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """All arguments of the statement, in the order of the text."""
        return tuple(map(self._argument, range(len(self.roles))))

    def argument(self, role: str) -> Argument | None:
        """The first argument that has this role; None if the statement has none."""
        return self._argument(self.roles.index(role)) if role in self.shape.roles else None

    @property
    def target(self) -> str:
        """Text of its target as written, at most 60 characters; of an aggregate its position."""
        argument = self.argument("to")
        text = "" if argument is None else " ".join(argument.text.split())
        if text.startswith("["):
            text = f"{text.partition(']')[0]}]"  # its position says which it is
        return text if len(text) <= LONGEST_TARGET else f"{text[: LONGEST_TARGET - 1]}\N{HORIZONTAL ELLIPSIS}"

    @property
    def results(self) -> tuple[Argument, ...]:
        """Arguments in which the statement stores what it finds on its way; none if it measures nothing."""
        wanted = self.shape.signature.results
        return tuple(self._argument(i) for i, role in enumerate(self.roles) if role in wanted) if wanted else ()

    def span_of(self, role: str) -> Span:
        """Byte span of the expression of the first argument that has this role.

        Raises:
            ValueError: the statement has no argument of this role.
        """
        return self.spans(self.shape.roles.index(role))[0]

    def spans(self, i: int) -> tuple[Span, Span]:
        """Byte spans in the file of argument number ``i`` (from 0): of its expression, and of the whole argument.

        The full span begins at the backslash of an optional argument; otherwise both spans are equal.
        """
        at, ends = self.span[0], self.ends
        start, end, first, last = self.shape.places[4 * i : 4 * i + 4]
        if i < len(ends):
            before, behind = at + (ends[i - 1] if i else 0), at + ends[i]
        else:
            before = behind = at + (ends[-1] if ends else 0)
        return (before + start, behind + end), (before + first, behind + last)

    def _argument(self, i: int) -> Argument:
        """The argument number ``i``, counted from 0 in the order of the text, with its role, spans and text."""
        span, full_span = self.spans(i)
        return Argument(self.shape.roles[i], span, self.source.data[slice(*span)].decode("latin-1"), full_span)

    @property
    def text(self) -> str:
        """The statement as it stands in the file, on one line."""
        return " ".join(self.source.data[slice(*self.span)].decode("latin-1").split())

    @property
    def line(self) -> int:
        """Line number, from 1, on which the statement begins."""
        return self.source.row(self.span[0])


@dataclass(frozen=True, slots=True, eq=False)
class InForce:
    """What a motion runs with beside its target; one value for all that share it.

    Args:
        duration: ``\\T`` [s]. gripload: in the tool frame. displacement: PDispSet or PDispOn, in the object frame.
        options: ``conf_l``, ``conf_j`` and ``wrist_in_joints`` (SingArea) as far as known.
        velocity_override: VelSet [%]; velocity_limit: VelSet [mm/s]; acceleration: AccSet [%].
        axis_offset: EOffsSet [mm], [deg].
        units: what ActUnit and DeactUnit have done, by name; None: not known.
        total_load: what ``\\TLoad`` says; ``tool`` and ``gripload`` follow it already.
    """

    tool: records.ToolData
    wobj: records.WobjData
    speed: records.SpeedData
    zone: records.ZoneData
    weld: records.Weld | None
    duration: float | None
    gripload: records.LoadData
    displacement: records.Pose
    options: Mapping[str, bool]
    velocity_override: float
    velocity_limit: float | None
    acceleration: float
    axis_offset: records.Ax6
    units: tuple[tuple[str, bool], ...] | None
    total_load: records.LoadData | None = None


@dataclass(frozen=True, slots=True)
class Turn:
    """One turn of a loop.

    Args:
        source: the file. start: byte offset of the loop. word: ``FOR``, ``WHILE``, or ``GOTO`` that goes back.
        number: of the turn, from 1. index: name of the index of a FOR loop, and its value.
    """

    source: Source
    start: int
    word: str
    number: int
    index: tuple[str, float] | None = None


@dataclass(frozen=True, slots=True)
class MotionEvent:
    """One execution of a motion statement, with everything that is in force at that moment.

    ``target`` is None when it is known only at run time; ``reason`` then says why the statement is left alone.
    """

    statement: MotionStatement
    target: records.RobTarget | records.JointTarget | None
    via: records.RobTarget | None
    target_origin: Origin
    via_origin: Origin | None
    in_force: InForce
    conditional: bool = False  # on a branch whose condition is not known
    reason: str | None = None
    diagnostics: tuple[Diagnostic, ...] = ()
    detached: bool = False  # the arm may come from elsewhere than the event before
    has_unresolved_runs: bool = False  # the statement also runs with another target, on ways that are not followed
    start_unknown: bool = False  # where the arm comes from is not known
    unreachable: bool = False  # nothing that is followed leads to the statement: a handler, a routine that nobody calls
    resumes_from: int | None = None  # no motion: the arm stands where that event has brought it, on another way
    one_of_several: bool = False  # its target is an element of an array that only the controller chooses
    way: int = 0  # number of the way by which the arm comes here, where it may come by several
    numbers: tuple[tuple[str, float], ...] = ()  # what the numbers are that the statement names beside its target
    assumed: tuple[str, ...] = ()  # why target, tool, frames or load are not certain: phrases for people
    axes: records.Ax6 | None = field(
        default=None, compare=False
    )  # where external axes stand at the goal [mm, deg], or NaN
    turns: tuple[Turn, ...] = field(default=(), compare=False)  # of the loops around it, the outermost first
    unknowns: tuple[Unknown, ...] = field(default=(), compare=False)  # what ``reason`` says, as values

    tool: ClassVar[records.ToolData] = shared("in_force.tool")
    wobj: ClassVar[records.WobjData] = shared("in_force.wobj")
    speed: ClassVar[records.SpeedData] = shared("in_force.speed")
    zone: ClassVar[records.ZoneData] = shared("in_force.zone")
    weld: ClassVar[records.Weld | None] = shared("in_force.weld")
    duration: ClassVar[float | None] = shared("in_force.duration")
    gripload: ClassVar[records.LoadData] = shared("in_force.gripload")
    displacement: ClassVar[records.Pose] = shared("in_force.displacement")
    options: ClassVar[Mapping[str, bool]] = shared("in_force.options")
    velocity_override: ClassVar[float] = shared("in_force.velocity_override")
    velocity_limit: ClassVar[float | None] = shared("in_force.velocity_limit")
    acceleration: ClassVar[float] = shared("in_force.acceleration")
    axis_offset: ClassVar[records.Ax6] = shared("in_force.axis_offset")
    units: ClassVar[tuple[tuple[str, bool], ...] | None] = shared("in_force.units")

    @property
    def searched(self) -> bool:
        """Whether one of the reasons in ``unknowns`` goes back to a position that a search instruction finds."""
        return any([unknown.root.kind is Kind.SEARCH_RESULT for unknown in self.unknowns])


def executions_of(events: Sequence[MotionEvent]) -> dict[StatementKey, list[int]]:
    """Indices into ``events`` of the executions of each statement, by statement key.

    Events without a motion, which put the arm back to where another way led it (``resumes_from``), are left out.
    """
    return grouped([(event.statement.key, i) for i, event in enumerate(events) if event.resumes_from is None])
