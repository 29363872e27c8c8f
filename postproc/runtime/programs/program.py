"""A program with the function in it: the module, the statements that call it, and the payload that it is told."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.compensation.conversion import RunTimeFigures
from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.options import Options
from postproc.compensation.plan import CorrectionPlan
from postproc.diagnostics import Diagnostic, Source, Span
from postproc.model.arm import Model
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.motions.units import MM, tool_matrix
from postproc.rapid.program.arguments import read_arguments
from postproc.rapid.program.program import Program, names_of, statements_of
from postproc.rapid.syntax.edits import Edit
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.modules import parse
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import names_at
from postproc.rapid.syntax.trees import Call
from postproc.rapid.unknown import Unknown
from postproc.render.lines import line_style
from postproc.runtime.conditions import Conditions
from postproc.runtime.module import MARKER, NAME
from postproc.runtime.programs.applied import Applied, apply_module
from postproc.runtime.programs.reach import Reach
from postproc.runtime.programs.statements import CORRECTING
from postproc.runtime.proof.chord import LINE_M
from postproc.runtime.written import RunTimeModule, write_module

PAYLOAD = "ppPayload"
HEADER = re.compile(rb"^[ \t]*!\s*postproc \d++\.\d++[^\r\n]*compensated", re.MULTILINE)
# The functions that added targets call, of this and earlier versions, stay where somebody takes the header out.
ADDED = re.compile(
    rb"^[ \t]*+(?i:(?:LOCAL[ \t]++)?FUNC[ \t]++\w++[ \t]++"
    rb"pp(?:(?:Line|Arc)Point|(?:Line|Arc|Bend)(?:Keep|Conf)|LineBend)\d*+[ \t]*+\()",
    re.MULTILINE,
)
TRIED, LEVEL = 64, 0.01  # positions of external axes, change of gravity [m/s2] that is none


@dataclass(frozen=True)
class OnTheController:
    """What of a program is corrected on the controller while it runs, by the function ``ppCorrected`` of a module.

    Args:
        name: of the module.
        module: its text and what is known of its errors.
        keys: statements whose targets go through the function.
        edits: that put the function into the statements and pass the payload to it.
        loads: number of `GripLoad` statements behind which the payload is passed.
    """

    name: str
    module: RunTimeModule
    keys: frozenset[StatementKey]
    edits: tuple[tuple[Source, Edit], ...]
    loads: int
    findings: tuple[Diagnostic, ...]

    def apply(self, model: Model, events: Sequence[MotionEvent], chosen: Set[int], options: Options) -> Applied:
        """Events with the targets that the correcting function returns for chosen ones, and how many it corrects.

        Args:
            events: all of a program.
            chosen: indices of the events whose target is corrected.
            options: of the conversion; they name the free axes.
        """
        source = Source(f"{self.name}.sys", self.module.text)
        return apply_module(source, model, events, chosen, options.free_axes)

    def figures(self, mode: str, after: Deviation | None = None, plan: CorrectionPlan | None = None) -> RunTimeFigures:
        """What is known of the function.

        Args:
            mode: value of the option ``--run-time``, where-needed or all.
            after, plan: correction plan and remaining deviation at targets that are known before the program runs; None
                if there are none.
        """
        moves = [] if plan is None else plan.motion.moves
        known = [i for i, move in enumerate(moves) if move.event.statement.key in self.keys]
        checks, chord = [check for _, check in self.module.checks], self.module.chord
        return RunTimeFigures(
            mode=mode,
            module=self.name,
            statements=len(self.keys),
            loads=self.loads,
            known_targets=len(known),
            max_known_error_mm=1e3 * max(float(after.goal_distance[i]) for i in known) if known and after else None,
            region_targets=sum(check.corrected for check in checks),
            max_region_error_mm=1e3 * max(check.largest_m for check in checks),
            max_chord_error_mm=1e3 * chord.largest_m,
            chord_length_mm=1e3 * LINE_M,
            max_chord_error_mm_per_m2=1e3 * chord.per_square_metre,
            cost=self.module.cost,
        )


def say_corrected_before(sources: Iterable[Source]) -> Iterator[Diagnostic]:
    """CMP001, an error, at files that were compensated before: by their header, or functions they hold or call.

    A file without its header in which only numbers were changed is not recognised.
    """
    own = "the program was compensated before", "start from the original, or take the postproc lines out"
    read_only = (
        "the file that is read along was compensated before: its targets hold the correction",
        "lend the original",
    )
    for source in sources:
        span = _mark(source)
        if span is not None:
            text, help_ = read_only if source.read_only else own
            yield Diagnostic("CMP001", "error", text, source, span, help_)


def _mark(source: Source) -> Span | None:
    """The place in a file that shows that it was compensated before: header, added function or call; else None."""
    for marker in (HEADER, ADDED, re.compile(re.escape(MARKER).encode())):
        if (found := marker.search(source.data)) is not None:
            return found.span()
    if b"ppcorrected" not in source.data.lower():
        return None
    named = (span for name, span in names_at(source, (0, len(source.data))) if name in CORRECTING)
    return next(named, None)


def put_on_controller(reach: Reach, model: Model, keys: Set[StatementKey], options: Options) -> OnTheController:
    """Make the run-time module for a program, and the edits of the program that use it.

    Args:
        reach: decides which statements the run-time function can correct.
        keys: statements whose targets go through the function; at least one.

    Raises:
        PostprocError: RUN001, RUN003, RUN006, REN001, REN002 or MOD010, the module cannot be made.
    """
    program = reach.program
    name = NAME if options.run_time_module is None else options.run_time_module.stem
    module = write_module(model, conditions_of(model, reach.events, keys, options), name, options.template_dir)
    edits = [(s.source, e) for s in program.statements if s.key in keys for e in reach.edits(s.key)]
    loads = [*_payload_edits(program)]
    findings = [*module.diagnostics, *_name_findings(program, module.text, name), *_lent_loads(program)]
    findings += _tilted(model, program.sources[0])
    told = tuple(edit for part in [*loads, *(_reset_edits(program) if loads else ())] for edit in part)
    return OnTheController(name, module, frozenset(keys), (*edits, *told), len(loads), tuple(findings))


def _tilted(model: Model, source: Source) -> Iterator[Diagnostic]:
    """RUN011, an error, if external axes tilt the arm: the module has one constant direction of gravity."""
    station = model.station
    pull = None if station is None else station.gravity(np.random.default_rng(1).uniform(-1.0, 1.0, (TRIED, 6)))
    if pull is not None and np.ptp(pull, axis=0).max() > LEVEL:
        text = "an external axis tilts the arm, and the function for run time knows one direction of gravity"
        yield Diagnostic("RUN011", "error", text, source, None, "convert with `--run-time off`")


def conditions_of(model: Model, events: Sequence[MotionEvent], keys: Set[StatementKey], options: Options) -> Conditions:
    """The conditions for the run-time module: tool and load of the program, forces and channels of the options.

    The tool is the first one that the robot holds in these statements, else the model's; a tool without load counts as
    half of the arm's payload.

    Args:
        keys: statements whose targets are corrected at run time.
    """
    robot = model.robot
    tool = next((e.tool for e in events if e.statement.key in keys and e.tool.name != "tool0" and e.tool.robhold), None)
    frame = model.T_flange_tcp if tool is None else tool_matrix(tool)
    mass: float = 0.5 * (robot.payload or 0.0)
    center: Array = 0.5 * frame[:3, 3]
    if tool is not None and tool.tload.mass > 0:
        mass, center = tool.tload.mass, MM * np.array(tool.tload.cog)
    return Conditions(
        robot.lower, robot.upper, frame, mass, center, np.array(options.force), np.array(options.moment),
        options.force_on, dict(options.channels),
    )  # fmt: skip


def reads_back(drafts: Program, written: Program, count: int) -> bool:
    """Whether the written program differs from its draft only by calls of the correcting function around arguments.

    Args:
        drafts: the program before the calls were put in; written: after.
        count: number of motion statements that have to differ.
    """
    pairs = [[s for s in program.statements if not s.source.read_only] for program in (drafts, written)]
    if len(pairs[0]) != len(pairs[1]):
        return False
    changed = 0
    for old, new in zip(*pairs, strict=True):
        texts = [[a.text for a in statement.arguments] for statement in (old, new)]
        if (old.instruction, old.roles) != (new.instruction, new.roles):
            return False
        if not all(a == b or _calls(b, a) for a, b in zip(*texts, strict=True)):
            return False
        changed += texts[0] != texts[1]
    return changed == count


def _calls(text: str, argument: str) -> bool:
    """Whether a text is a call of the correcting function whose first argument is ``argument``."""
    data = text.encode("latin-1")
    try:
        tree = read_whole_expression(data, 0, len(data))
    except Unknown:
        return False
    if not isinstance(tree, Call) or tree.name not in CORRECTING:
        return False
    return data[slice(*tree.arguments[0].span)].decode("latin-1") == argument


def _payload_edits(program: Program) -> Iterator[tuple[tuple[Source, Edit], ...]]:
    """Edits for each `GripLoad` in files that may change: behind it, its load is assigned to `ppPayload`."""
    for routine in program.all_routines():
        for body in (routine.body, *routine.handlers):
            if not routine.source.read_only:
                yield from _in_body(program, routine, body, None)


def _reset_edits(program: Program) -> Iterator[tuple[tuple[Source, Edit], ...]]:
    """The edit that starts `main` with an empty payload, as the controller does at PP to Main; none without `main`."""
    main = next((r for r in program.all_routines() if r.name.lower() == "main" and not r.source.read_only), None)
    if main is not None and main.body:
        start = main.body[0].span[0]
        lead, newline = line_style(main.source.data, start)
        yield ((main.source, Edit(start, start, f"{PAYLOAD}:=load0;".encode() + newline + lead)),)


def _in_body(
    program: Program, routine: Routine, body: Sequence[Statement], around: Statement | None
) -> Iterator[tuple[tuple[Source, Edit], ...]]:
    """The edits of `_payload_edits` in a list of statements and in their branches.

    Args:
        body: the statements.
        around: the one-line IF whose only statement ``body`` holds; it gets THEN and ENDIF, to hold two. None if there
            is none.
    """
    source = routine.source
    for statement in body:
        if _grips(program, routine, statement):
            told = f"{PAYLOAD}:={_loaded(source, statement)};"
            start, end = statement.span
            lead, newline = line_style(source.data, start)
            if around is None:
                yield ((source, Edit(end, end, newline + lead + told.encode("latin-1"))),)
            else:
                yield (
                    (source, Edit(start, start, b"THEN ")),
                    (source, Edit(end, end, b" " + told.encode("latin-1") + b" ENDIF")),
                )
        for branch in statement.branches:
            alone = statement.kind == "if" and [s.span[1] for s in branch.body] == [statement.span[1]]
            yield from _in_body(program, routine, branch.body, statement if alone else None)


def _grips(program: Program, routine: Routine, statement: Statement) -> bool:
    """Whether a statement is a call of the built-in `GripLoad`."""
    own = program.routine(statement.word, routine.module)
    return statement.kind == "call" and statement.word == "gripload" and own is None


def _loaded(source: Source, statement: Statement) -> str:
    """The load argument of a `GripLoad` statement as text, `load0` without one."""
    pieces = read_arguments(source.data, statement.span[0] + len(statement.word), statement.span[1])
    return source.data[slice(*pieces[0][1])].decode("latin-1") if pieces else "load0"


def _lent_loads(program: Program) -> Iterator[Diagnostic]:
    """RUN010, a warning, at the first `GripLoad` in a read-only file: the run-time function is not told that load."""
    for routine in program.all_routines():
        if not routine.source.read_only:
            continue
        for statement in statements_of(routine):
            if _grips(program, routine, statement):
                text = "`GripLoad` stands in a file that is only read along: the function is not told what it takes up"
                help_ = f"write `{PAYLOAD}:={_loaded(routine.source, statement)};` behind it"
                yield Diagnostic("RUN010", "warning", text, routine.source, statement.span, help_)
                return


def _name_findings(program: Program, text: bytes, name: str) -> Iterator[Diagnostic]:
    """RUN008 for each declaration whose name clashes with the run-time module of this name and text.

    What a routine of the module declares itself, loop variables and labels too, means its own there.
    """
    source = Source(f"{name}.sys", text)
    (made,), _ = parse(source)
    own = {name.lower(), *(r.name.lower() for r in made.routines if not r.local)}
    own |= {d.name.lower() for d in made.declarations if d.scope != "LOCAL"}
    hiding = {d.name.lower() for d in made.declarations} | {r.name.lower() for r in made.routines}
    used = {word for d in made.declarations for word, _ in names_at(source, d.span)}
    used |= {word for r in made.routines for word, _ in names_at(source, r.span) if word not in names_of(r)}
    used = (used - hiding) | own
    for module in program.modules:
        if module.name.lower() in own:
            yield _clash(module.name, module.source, module.head)
        for declared in module.declarations:
            if declared.name.lower() in (own if declared.scope == "LOCAL" else used):
                yield _clash(declared.name, declared.source, declared.span)
        for routine in module.routines:
            if routine.name.lower() in (own if routine.local else used):
                yield _clash(routine.name, routine.source, routine.span)
            inner = [(d.name, d.source, d.span) for d in routine.declarations]
            inner += [(p.name, routine.source, routine.span) for p in routine.parameters]
            yield from (_clash(*one) for one in inner if one[0].lower() in own)


def _clash(name: str, source: Source, span: tuple[int, int]) -> Diagnostic:
    """RUN008, an error: the program declares a name that the run-time module uses."""
    text = f"`{name}` is a name that the module for run time uses, too"
    return Diagnostic("RUN008", "error", text, source, span, "give it another name, or convert with `--run-time off`")
