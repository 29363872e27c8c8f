"""Which motion statements of a program the function for run time can correct, and why it cannot correct the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property

from postproc.compensation.plan import search_starts
from postproc.diagnostics import Diagnostic, Matter
from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.evaluation.evaluate import names_in
from postproc.rapid.program.from_the_arm import FromTheArm
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.syntax.edits import Edit
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.unknown import Kind, Unknown
from postproc.runtime.programs.statements import CORRECTING, POSITIONS, LeftAlone, run_time_edits

HOLDS = (
    "its target or work object follows where the arm stood or what a search found, and holds the arm's error already"
)
DISPLACED = "the displacement in force may come from a search or from where the arm stood, and holds the arm's error"
OUTSIDE = "it does not weld, and the scope is `welds`"
UNREACHABLE = "what stands in the files for its target cannot be run"
ELSEWHERE = "the target is data that other tasks share: its value in the files is the one of the last run"
NO_PLACE = "what stands there is no place to which the arm can go"
_FOUND = (Kind.FOUND_BY_SEARCH, Kind.DISPLACED_FROM_HERE)
_WRONG = (Kind.IMPOSSIBLE, Kind.WRONG_TYPE)


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
    _known: dict[StatementKey, tuple[Edit, ...] | str] = field(default_factory=dict)

    def takes(self, key: StatementKey) -> bool:
        """Whether the run-time function can correct the targets of a statement on the controller."""
        return not isinstance(self._asked(key), str)

    def edits(self, key: StatementKey) -> tuple[Edit, ...]:
        """The edits that send a statement's targets through the run-time function; none if it cannot correct it."""
        found = self._asked(key)
        return () if isinstance(found, str) else found

    def why_not(self, key: StatementKey) -> str:
        """Why the run-time function cannot correct a statement; empty if it can."""
        found = self._asked(key)
        return found if isinstance(found, str) else ""

    def _asked(self, key: StatementKey) -> tuple[Edit, ...] | str:
        """The edits for a statement, or the reason why it cannot be corrected; cached."""
        if key not in self._known:
            self._known[key] = self._of(self._statements[key])
        return self._known[key]

    def _of(self, statement: MotionStatement) -> tuple[Edit, ...] | str:
        """The edits for a statement, or the reason why it cannot be corrected."""
        if statement.source.read_only:
            return "it stands in a file that is only read along"
        if statement.key in self._barred:
            return self._barred[statement.key]
        if self.scope == "welds" and self._welds and not statement.signature.phase:
            return OUTSIDE
        try:
            edits = run_time_edits(statement)
        except LeftAlone as reason:
            return str(reason)
        spans = [a.span for role in ("to", "via", "\\wobj") if (a := statement.argument(role)) is not None]
        held = any(self._held.holds(statement.source, s, statement.module, statement.routine) for s in spans)
        if held or statement.key in self._found:
            return HOLDS
        if statement.key in self._wrong:
            return NO_PLACE
        if statement.key in self._soft:
            return Kind.SOFT_SERVO.value
        return DISPLACED if self._moved and statement.key not in self._in_place else edits

    @cached_property
    def _statements(self) -> Mapping[StatementKey, MotionStatement]:
        """The program's motion statements by key."""
        return {s.key: s for s in self.program.statements}

    @cached_property
    def _held(self) -> FromTheArm:
        """Finds data of the program that may hold a position where the arm has stood."""
        return FromTheArm(self.program, POSITIONS | CORRECTING)

    @cached_property
    def _barred(self) -> Mapping[StatementKey, str]:
        """Statements, by key, that lead to the start of a search, with the reason why they stay uncorrected."""
        return search_starts(self.events)

    @cached_property
    def _welds(self) -> bool:
        """Whether the program welds."""
        return any(event.weld is not None for event in self.events)

    @cached_property
    def _found(self) -> frozenset[StatementKey]:
        """Keys of statements with a run whose target or displacement comes from a search or from where the arm is."""
        return frozenset(e.statement.key for e in self.events if any(u.root.kind in _FOUND for u in e.unknowns))

    @cached_property
    def _wrong(self) -> frozenset[StatementKey]:
        """Keys of statements whose text is wrong (an impossible target or a wrong type): they fail at run time, too."""
        return frozenset(e.statement.key for e in self.events if any(u.root.kind in _WRONG for u in e.unknowns))

    @cached_property
    def _soft(self) -> frozenset[StatementKey]:
        """Keys of statements that run with a soft servo, whose deflection the module does not include."""
        return frozenset(e.statement.key for e in self.events if any(u.kind is Kind.SOFT_SERVO for u in e.unknowns))

    @cached_property
    def _moved(self) -> bool:
        """Whether the program sets a displacement from a search or from where the arm stands (PDispOn, PDispSet)."""
        for routine in self.program.all_routines():
            for statement in statements_of(routine):
                if statement.kind != "call" or self.program.routine(statement.word, routine.module) is not None:
                    continue
                here = (
                    statement.word == "pdispon"
                )  # displaces by where the arm stands, or where it was when it searched
                if here or (
                    statement.word in ("pdispset", "pdispadd")
                    and self._held.holds(routine.source, statement.span, routine.module, routine.name)
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


def without_shared_values(program: Program, events: Sequence[MotionEvent], reach: Reach) -> list[MotionEvent]:
    """Hide targets that are ``PERS`` data without a value in this task, if ``reach`` can correct them at run time.

    Another task gives such data its value, and the files only state what it was when they were saved.
    """
    names = {d.name.lower() for d in program.declarations if _open(d.storage, d.scope) and d.init is None}
    return [
        hidden(e, ELSEWHERE) if e.reason is None and _names(e) & names and reach.takes(e.statement.key) else e
        for e in events
    ] if names else list(events)  # fmt: skip


def without_unreachable(
    events: Sequence[MotionEvent], findings: Sequence[Diagnostic], reach: Reach, everything: bool
) -> tuple[list[MotionEvent], list[Diagnostic]]:
    """Hide targets that cannot be run as they stand in the files, but that the controller corrects at run time.

    Args:
        findings: of the motion; an error in the text of a statement means that its target cannot be run, unless it is
            one about the cell, which no other target would mend.
        reach: tells which statements the run-time function can correct on the controller.
        everything: for all of these statements; otherwise only for those whose target is ``PERS`` data, since its value
            in the files may belong to no run.

    Returns:
        All events, those targets replaced by ones that are known only at run time; and one RUN009 with the number of
        statements, or none.
    """
    wrong = {(d.source.path, d.span[0]) for d in findings if _of_value(d) and d.source and d.span}
    bad: dict[StatementKey, MotionEvent] = {}
    for event in events:
        statement = event.statement
        path, (start, end) = statement.source.path, statement.span
        if event.reason is not None or not any(p == path and start <= at < end for p, at in wrong):
            continue
        stored = event.target_origin.base.storage == "PERS"
        if (everything or stored) and reach.takes(statement.key):
            bad.setdefault(statement.key, event)
    if not bad:
        return list(events), []
    first = next(iter(bad.values())).statement
    text = f"what stands in the files for the targets of {counted(len(bad), 'motion statement')} cannot be run"
    help_ = "they are corrected on the controller: targets that cannot be reached come back as they came"
    said = Diagnostic("RUN009", "warning", text, first.source, first.span, help_)
    return [hidden(e, UNREACHABLE) if e.statement.key in bad else e for e in events], [said]


def _of_value(finding: Diagnostic) -> bool:
    """Whether a finding is an error that may come from the value of a target: with another one it would be none."""
    return finding.severity == "error" and finding.matter is not Matter.CELL


def would_reach(program: Program, keys: Set[StatementKey]) -> list[Diagnostic]:
    """RUN007 (info) with the number of these statements, which a run-time function could correct; none for none."""
    if not keys:
        return []
    statements = [s for s in program.statements if s.key in keys]
    welds = sum(bool(s.signature.phase) for s in statements)
    burning = f" ({welds} of them weld)" if welds else ""
    text = f"{counted(len(statements), 'motion statement')}{burning} could be corrected on the controller"
    help_ = "numbers cannot correct them: `--run-time where-needed` writes a function beside the program that does"
    first = statements[0]
    return [Diagnostic("RUN007", "info", text, first.source, first.span, help_, Matter.CONTROLLER)]


def counted(number: int, what: str) -> str:
    """A number and a noun, with an s unless the number is 1."""
    return f"{number} {what}{'s' * (number != 1)}"


def hidden(event: MotionEvent, reason: str) -> MotionEvent:
    """The event without its target and circle point, as one whose target is known only at run time, for that reason."""
    return replace(event, target=None, via=None, reason=reason)


def _open(storage: str, scope: str) -> bool:
    """Whether a declaration is ``PERS`` without LOCAL or TASK, so that other tasks may share it."""
    return storage.upper() == "PERS" and not scope


def _names(event: MotionEvent) -> set[str]:
    """Lower-case names in the target and circle point of an event's statement, and of the data that they come from."""
    statement, found = event.statement, set[str]()
    for role, origin in (("to", event.target_origin), ("via", event.via_origin)):
        argument = statement.argument(role)
        if argument is None:
            continue
        try:
            found |= names_in(read_whole_expression(statement.source.data, *argument.span))
        except Unknown:
            continue
        if origin is not None and origin.base.declaration is not None:
            found.add(origin.base.declaration.rpartition(".")[2])
    return found
