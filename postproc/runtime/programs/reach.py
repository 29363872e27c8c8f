"""Which motion statements of a program the function for run time can correct, and how their targets go through it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from postproc.compensation.plan import search_starts
from postproc.compensation.reading import hidden
from postproc.compensation.text.marks import CORRECTED, CORRECTED_CIRCLE, CORRECTING
from postproc.rapid.data.builtins import FUNCTIONS
from postproc.rapid.data.events import Argument, MotionEvent, MotionStatement, StatementKey
from postproc.rapid.evaluation.evaluate import names_in
from postproc.rapid.program.from_the_arm import STANDING_FUNCTIONS, FromTheArm
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.spans import Edit
from postproc.rapid.syntax.tokens import names_at
from postproc.rapid.syntax.trees import Call, Component, Index, Name, Star, nodes
from postproc.rapid.unknown import Kind, Unknown

SHARED_BY_TASKS = "the target is data that other tasks share: its value in the files is the one of the last run"
# The target holds the arm's error already, or fails at run time, too.
_FROM_THE_ARM = (Kind.SEARCH_RESULT, Kind.DISPLACED_FROM_POSITION)
_WRONG = (Kind.IMPOSSIBLE, Kind.WRONG_TYPE)
POSITIONS = STANDING_FUNCTIONS | {"calcrobt"}
"""Functions that give where the arm stands, or stands with some joint angles."""
WELDING = ("start", "weld", "end")
"""Phases with the force of the process: where a seam starts, the target is that of what follows."""


@dataclass(frozen=True)
class Reach:
    """Decides which statements of a program the run-time function (``ppCorrected``) can correct on the controller.

    Args:
        events: all of the program.
        scope: ``welds`` corrects weld statements only.
    """

    program: Program
    events: Sequence[MotionEvent]
    scope: str = "all"
    _known: dict[StatementKey, tuple[Edit, ...] | None] = field(default_factory=dict)

    def takes(self, key: StatementKey) -> bool:
        """Whether the run-time function can correct the targets of a statement on the controller."""
        return self.edits(key) is not None

    def edits(self, key: StatementKey) -> tuple[Edit, ...] | None:
        """The edits that send a statement's targets through the run-time function; None if it cannot correct it."""
        if key not in self._known:
            self._known[key] = self._edits(self._statements[key])
        return self._known[key]

    def _edits(self, statement: MotionStatement) -> tuple[Edit, ...] | None:
        """As ``edits``, without the cache."""
        key = statement.key
        if statement.source.read_only or key in self._barred:
            return None
        if self.scope == "welds" and self._welds and not statement.signature.phase:
            return None
        edits = run_time_edits(statement)
        if edits is None:
            return None
        spans = [a.span for role in ("to", "via", "\\wobj") if (a := statement.argument(role)) is not None]
        if any(self._measured.holds(statement.source, s, statement.module, statement.routine) for s in spans):
            return None
        return None if self._displaced and key not in self._in_place else edits

    @cached_property
    def _statements(self) -> Mapping[StatementKey, MotionStatement]:
        """The program's motion statements by key."""
        return {s.key: s for s in self.program.statements}

    @cached_property
    def _measured(self) -> FromTheArm:
        """Finds data of the program that may hold a position where the arm has stood."""
        return FromTheArm(self.program, POSITIONS | CORRECTING)

    @cached_property
    def _barred(self) -> frozenset[StatementKey]:
        """Statements that lead to the start of a search, and those with a run to a target that no function may correct.

        Such a target or displacement comes from a search or from where the arm is, is an impossible one, or is reached
        with a soft servo, whose deflection the module does not include.
        """
        kinds = (*_FROM_THE_ARM, *_WRONG)
        wrong = {
            e.statement.key
            for e in self.events
            if any(u.root.kind in kinds or u.kind is Kind.SOFT_SERVO for u in e.unknowns)
        }
        return frozenset(wrong | search_starts(self.events).keys())

    @cached_property
    def _welds(self) -> bool:
        """Whether the program welds."""
        return any(event.weld is not None for event in self.events)

    @cached_property
    def _displaced(self) -> bool:
        """Whether the program sets a displacement from a search or from where the arm stands (PDispOn, PDispSet)."""
        for routine in self.program.all_routines():
            for statement in statements_of(routine):
                if statement.kind != "call" or self.program.routine(statement.word, routine.module) is not None:
                    continue
                # PDispOn displaces by where the arm stands, or where it was when it searched.
                if statement.word == "pdispon" or (
                    statement.word in ("pdispset", "pdispadd")
                    and self._measured.holds(routine.source, statement.span, routine.module, routine.name)
                ):
                    return True
        return False

    @cached_property
    def _in_place(self) -> frozenset[StatementKey]:
        """Keys of statements all of whose runs are followed and have a known displacement."""
        doubtful = {
            e.statement.key
            for e in self.events
            if e.unreachable or e.has_unresolved_runs or any(u.kind is Kind.DISPLACEMENT for u in e.unknowns)
        }
        return frozenset({e.statement.key for e in self.events} - doubtful)


def without_shared_values(program: Program, events: list[MotionEvent], reach: Reach) -> list[MotionEvent]:
    """Hide targets that are ``PERS`` data without a value in this task, if ``reach`` can correct them at run time.

    Another task gives such data its value, and the files only state what it was when they were saved.
    """
    shared = {
        d.name.lower() for d in program.declarations if d.storage.upper() == "PERS" and not d.scope and d.init is None
    }
    return [
        hidden(e, SHARED_BY_TASKS) if e.reason is None and _names(e) & shared and reach.takes(e.statement.key) else e
        for e in events
    ] if shared else events  # fmt: skip


def _names(event: MotionEvent) -> set[str]:
    """Lower-case names in the target and circle point of an event's statement, and of the data that they come from."""
    statement, origins = event.statement, (event.target_origin, event.via_origin)
    spans = [a.span for role in ("to", "via") if (a := statement.argument(role)) is not None]
    names = {name for span in spans for name, _ in names_at(statement.source, span)}
    declared = (o.base.declaration for o in origins if o is not None)
    return names | {declaration.rpartition(".")[2] for declaration in declared if declaration is not None}


def counted(number: int, what: str) -> str:
    """A number and a noun, with an s unless the number is 1."""
    return f"{number} {what}{'s' * (number != 1)}"


def run_time_edits(motion: MotionStatement) -> tuple[Edit, ...] | None:
    r"""The edits that send the targets of a statement through the run-time function.

    ``p`` becomes ``ppCorrected(p,tool\WObj:=w)``, a circle point ``ppCorrectedCirc(c,p,tool\WObj:=w)``; with ``\Weld``
    while the arc burns.

    Returns:
        Two edits for each target, around it; none where the statement calls the function already. None if the targets
        must not be corrected: the instruction itself works out where it goes, the target is no place in a work object,
        is where the arm stands or is hidden (``*``), the tool is no data, or a function that may do more than give a
        target would run twice.
    """
    signature, to, via = motion.signature, motion.argument("to"), motion.argument("via")
    tool = motion.argument("tool")
    if signature.why_not or signature.jointed or to is None or tool is None:
        return None
    try:
        end, holder, middle = (
            read_full_expression(motion.source.data, *x.span, what="the target") for x in (to, tool, via or to)
        )
    except Unknown:
        return None
    if not isinstance(holder, (Name, Index, Component)):
        return None
    if isinstance(end, Call) and end.name in CORRECTING:
        return ()
    if any(isinstance(tree, Star) or names_in(tree) & POSITIONS for tree in (end, middle)):
        return None
    weld = "\\Weld" if signature.phase in WELDING else ""
    further = f",{tool.text}{_option(motion, 'WObj')}{weld}{_option(motion, 'TLoad')}"
    edits = _around(to, CORRECTED, further)
    if via is None:
        return edits
    called = {node.name for node in nodes(end) if isinstance(node, Call)}
    return (*_around(via, CORRECTED_CIRCLE, f",{to.text}{further}"), *edits) if called <= FUNCTIONS.keys() else None


def _around(argument: Argument, function: str, further: str) -> tuple[Edit, Edit]:
    """The two edits that put a call of a function around an argument; ``further``: text of its other arguments."""
    start, end = argument.span
    return Edit(start, start, f"{function}(".encode()), Edit(end, end, f"{further})".encode("latin-1"))


def _option(motion: MotionStatement, name: str) -> str:
    r"""An option with its value as the statement writes it, ``\Name:=value`` or ``\Name?value``; empty without one."""
    option = motion.argument(f"\\{name.lower()}")
    if option is None:
        return ""
    sign = "?" if b"?" in motion.source.data[option.full_span[0] : option.span[0]] else ":="
    return f"\\{name}{sign}{option.text}"
