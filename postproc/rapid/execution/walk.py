"""A program followed in the order in which it runs, as far as the text tells.

A branch whose condition is not known is followed both ways; what the ways leave different is not known afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from postproc.diagnostics import Diagnostic, PostprocError, Source, did_you_mean
from postproc.rapid.data.events import MotionEvent, StatementKey, executions_of
from postproc.rapid.data.values import Data
from postproc.rapid.evaluation.accessor import unbound_frame
from postproc.rapid.evaluation.assign import forget
from postproc.rapid.evaluation.memory import LOST, Memory
from postproc.rapid.evaluation.state import AT_START, start_without
from postproc.rapid.execution.abstract_interpreter import MAX_STEPS, AbstractInterpreter
from postproc.rapid.execution.cycles import start_cycle
from postproc.rapid.execution.interpreter import AddedMotions
from postproc.rapid.execution.path_splitting import Choice, Place, SplitBranches, combinations
from postproc.rapid.motions.doubts import assume_wrist, rough_frames, rough_orientations
from postproc.rapid.program.late_binding import late_call, may_be
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.unknown import Kind, Unknown


@dataclass(frozen=True)
class Walk:
    """The motions of a program in the order in which they run, and all findings made while it was followed."""

    events: list[MotionEvent]
    diagnostics: tuple[Diagnostic, ...]


def walk(program: Program, entry: str | None = None, added: AddedMotions | None = None) -> list[MotionEvent]:
    """Every motion of a program in the order in which it runs.

    ``main`` is executed if there is one, else every routine that nothing calls, in text order; routines that are never
    reached that way are walked one by one, so that every motion statement has at least one event. Of read-only files
    only what is called is walked.

    Args:
        entry: name of the routine to execute instead of ``main``; then only its motions are returned.
        added: motions and routines that were written into the program: they cost no steps, so that it is followed as
            far as the original; events then lack the names by which the program calls numbers.

    Raises:
        PostprocError: there is no routine ``entry``.
    """
    return walk_program(program, entry, added).events


def walk_program(program: Program, entry: str | None = None, added: AddedMotions | None = None) -> Walk:
    """The motions that ``walk`` gives, with the findings made on the way; the arguments are the same.

    Raises:
        PostprocError: there is no routine ``entry``.
    """
    uncalled = _uncalled(program)
    chosen = program.routine("main" if entry is None else entry)
    if entry is not None and chosen is None:
        names = ", ".join(sorted({r.name for r in program.all_routines()})) or "none"
        help = f"{did_you_mean(entry, (r.name for r in program.all_routines()))} The routines are: {names}".lstrip()
        raise PostprocError.of("RAP030", f"there is no routine `{entry}`", help=help)
    started = uncalled if chosen is None else [chosen]
    run = _followed(program, started, added)
    count, findings = len(run.recorder.events), tuple(run.findings.all)
    run.recorder.only_new = True
    unknown = start_without(run.changes.everything)
    for routine in uncalled:
        if routine.key not in run.entered:
            _start(run, routine, unknown)
    _follow_unreached(run, unknown)
    if entry is not None:  # all after that was for nothing but whether the same statements run with other targets
        targets = {event.statement.key: event.target for event in run.recorder.events[:count]}
        others = {e.statement.key for e in run.recorder.events[count:] if targets.get(e.statement.key) != e.target}
        run.recorder.other_targets |= others
    only_started = count if entry is not None else None
    events, flips = assume_wrist(_marked(run)[:only_started])
    events[count:] = [replace(event, unreachable=True) for event in events[count:]]
    findings += () if entry is not None else tuple(map(forgiven, run.findings.all[len(findings) :]))
    return Walk(events, (*findings, *flips, *rough_orientations(events), *rough_frames(program)))


def _followed(program: Program, started: Sequence[Routine], added: AddedMotions | None) -> AbstractInterpreter:
    """Run the given routines in turn, once for every combination of arms of branches that decide data motions need.

    If the combinations or steps would be too many, no arm is chosen; the data is then unknown.

    Returns:
        What ran them, with the events and findings of all runs.
    """
    branches: dict[Place, tuple[int, ...]] = {}
    path_choices, met = combinations(branches), dict[Place, Choice]()
    while True:
        run = AbstractInterpreter(program, added)
        for forced in path_choices or [{}]:
            run.choices = SplitBranches(forced, met)
            for routine in started:
                run.findings.taught_ends(_start(run, routine, AT_START))
        undecided = run.choices.lacking(run.recorder.events) if path_choices else {}
        if not undecided:
            run.choices = SplitBranches()
            return run
        branches |= undecided
        one = (run.steps + run.spare) // len(path_choices)
        path_choices = combinations(branches)
        if one * len(path_choices) > MAX_STEPS:
            path_choices = []  # of a long program what they set is not known


def forgiven(finding: Diagnostic) -> Diagnostic:
    """The finding with an error turned into a warning, for code that nothing reaches."""
    return replace(finding, severity="warning") if finding.severity == "error" else finding


def _follow_unreached(run: AbstractInterpreter, unknown: Mapping[str, Data]) -> None:
    """Follow traps and handlers, then routines with motions or calls that have not been reached.

    Args:
        unknown: state at their start by ``@`` key, Unknown where the program may set it.
    """
    for routine in run.program.all_routines():
        if not routine.source.read_only:
            _interrupt(run, routine, unknown)
    calls = _calls(run.program)
    for routine in run.program.all_routines():
        incomplete = routine.key in run.passed_over or not calls.get(routine.key, set()) <= run.followed
        if not routine.source.read_only and (incomplete or any(True for _ in _unreached(run, routine))):
            _finish(run, routine, _start(run, routine, unknown, routine.key in run.entered and not incomplete))


def _marked(run: AbstractInterpreter) -> list[MotionEvent]:
    """The recorded events, marked if their statement also runs, to other targets, on ways that are not followed.

    Numbers in them whose values differ on those ways are left out.
    """
    events, recorder = run.recorder.events, run.recorder
    marked, unshared = recorder.other_targets, _unshared(run)
    for i, event in enumerate(events if marked or unshared else ()):
        key = event.statement.key
        if key in marked:
            event = replace(event, has_unresolved_runs=True)
        if key in unshared:
            event = replace(event, numbers=tuple(n for n in event.numbers if n[0] not in unshared[key]))
        events[i] = event
    return events


def _unshared(run: AbstractInterpreter) -> dict[StatementKey, set[str]]:
    """By statement key, names of numbers in its arguments whose values on ways not followed occur in no event.

    No correction may depend on them.
    """
    events, unshared = run.recorder.events, dict[StatementKey, set[str]]()
    rows = executions_of(events) if run.recorder.others else {}
    for key, target, numbers in run.recorder.others:
        now, runs = dict(numbers), [dict(events[i].numbers) for i in rows[key] if events[i].target == target]
        names = {name for run in (now, *runs) for name in run}
        apart = {name for name in names if now.get(name) not in [run.get(name) for run in runs]}
        if {name: now.get(name) for name in names - apart} not in [{n: r.get(n) for n in names - apart} for r in runs]:
            apart = names
        if apart:
            unshared.setdefault(key, set()).update(apart)
    return unshared


def _start(run: AbstractInterpreter, routine: Routine, state: Mapping[str, Data], supposed: bool = False) -> Memory:
    """Run a routine as if it were started from outside, with unknown parameters, and return the memory at its end.

    Args:
        state: at its start by ``@`` key.
        supposed: the routine has been run before: only motion statements without an event are recorded.
    """
    memory = _memory(run, routine, state)
    memory.frame.supposed = supposed
    if not (supposed or run.recorder.only_new):
        start_cycle(run, routine, memory)
    run.enter(routine, memory)
    return memory


def _memory(run: AbstractInterpreter, routine: Routine, state: Mapping[str, Data]) -> Memory:
    """Memory before a routine is started from outside; ``--taught`` data that may be written is as in its file.

    Args:
        state: at its start by ``@`` key.
    """
    frame, values = unbound_frame(routine), dict(state)
    teaching = run.findings.teaching
    memory = Memory(run.program, run.changes, run.constants, frame, run.function, values, teaching=teaching)
    for key in run.changes.may_be_written if teaching.names else ():
        declaration = run.program.names.get(key)
        if declaration is not None and teaching.covers(declaration):
            with suppress(Unknown):
                memory.changed[key] = memory.declared(declaration).data
    return memory


def _interrupt(run: AbstractInterpreter, routine: Routine, state: Mapping[str, Data]) -> None:
    """Follow the handlers of a routine (of a trap also its body) that move the arm, with all written data unknown.

    Args:
        state: at their start by ``@`` key.
    """
    for body in (routine.body, *routine.handlers) if routine.kind == "TRAP" else routine.handlers:
        if "@moves" not in run.changes.of(body, routine):
            continue
        memory = _memory(run, routine, state)
        forget(memory, run.changes.everything, Kind.UNCERTAIN)
        memory.conditional += 1
        run.body(body, memory)


def _finish(run: AbstractInterpreter, routine: Routine, memory: Memory) -> None:
    """Record each motion of a routine that has no event yet, on its own, with written data and arm position unknown."""
    forget(memory, run.changes.everything, Kind.UNCERTAIN)
    for statement in statements_of(routine):
        if statement.kind == "for":
            index = Unknown(Kind.LOOP_INDEX, statement.word)
            memory.frame.bindings[statement.word] = index
    memory.conditional += 1
    for statement in _unreached(run, routine):
        memory.ends = LOST
        run.statement(statement, memory)


def _unreached(run: AbstractInterpreter, routine: Routine) -> Iterator[Statement]:
    """Motion statements of a routine, in text order, that have no event yet."""
    path, known = routine.source.path, run.program.motions
    for statement in statements_of(routine):
        key = (path, statement.span[0])
        if key in known and key not in run.recorder.visited:
            yield statement


def _calls(program: Program) -> dict[str, set[tuple[str, int]]]:
    """Places (path, offset) of the statements that call each routine by its name, by routine key."""
    places: dict[str, set[tuple[str, int]]] = {}
    names = {name for _, name in program.routines}
    for routine in program.all_routines():
        for statement in statements_of(routine):
            named = statement.kind == "call" and statement.word in names
            called = program.routine(statement.word, routine.module) if named else None
            if called is not None and program.motion(routine.source, statement) is None:
                places.setdefault(called.key, set()).add((routine.source.path, statement.span[0]))
    return places


def _uncalled(program: Program) -> list[Routine]:
    """Procedures that no call, CONNECT or motion of the program names, without those of read-only files."""
    named: set[str] = set()
    for motion in program.statements:
        if "procedure" in motion.roles:
            start, end = motion.span_of("procedure")
            named.add(motion.source.data[start:end].decode("latin-1").strip('" ').rpartition(":")[2].lower())
    for routine in program.all_routines():
        for statement in statements_of(routine):
            moves = (routine.source.path, statement.span[0]) in program.motions
            if statement.kind in ("call", "connect") and not moves:
                _add_names(program, routine.source, statement, named)
    procedures = (r for r in program.all_routines() if r.kind == "PROC" and not r.source.read_only)
    return [r for r in procedures if r.name.lower() not in named]


def _add_names(program: Program, source: Source, statement: Statement, named: set[str]) -> None:
    """Add to ``named`` the lower-case names of all routines that a call or CONNECT statement may mean."""
    named.add(statement.word)
    late = late_call(statement, source.data, program, "")
    if late is not None and statement.word == "callbyvar":
        named |= {
            r.name.lower()
            for r in program.all_routines()
            if late.template[:1] != (None,) and may_be(late.template, r.name)
        }
    if late is not None:
        words = source.data[statement.span[0] : statement.span[1]].decode("latin-1").lower()
        named |= set("".join(c if c.isalnum() or c == "_" else " " for c in words).split())
