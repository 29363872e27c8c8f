"""The convert loop: read, plan, write, read back, prove.

Program -> Moves -> Trajectory -> exact correction -> targets -> RAPID text -> the same way again -> Deviation
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, NoReturn

import numpy as np
from jinja2.sandbox import SandboxedEnvironment

from postproc.compensate.correction.applicable import applicable_model
from postproc.compensate.options import Options
from postproc.compensate.path.deviation import Deviation, Driven, measure_deviation
from postproc.compensate.path.motion import Motion
from postproc.compensate.plan import OnController, Plan, plan_changes
from postproc.compensate.readback import drive, run_again
from postproc.compensate.reading import read_motion
from postproc.compensate.results.accuracy import expect_accuracy, expect_remaining
from postproc.compensate.results.belief import doubt_corrections, doubt_weights
from postproc.compensate.results.document import document, refused, summary, unmeasured_document
from postproc.compensate.results.dynamics import check_corrected
from postproc.compensate.results.figures import Figures, figures_of
from postproc.compensate.results.outcomes import judge_statements, largest_shifts, unknown_outcomes
from postproc.compensate.results.seams import find_seams, partial_seams
from postproc.compensate.text.values import Outcome
from postproc.compensate.worlds import Worlds, check_written, depends_on_run_time
from postproc.diagnostics import Diagnostic, PostprocError, Source, has_errors
from postproc.model.arm import Model
from postproc.motion.path.places import place_events
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.evaluation.memory import set_first
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.motions.missing import shown_to_users
from postproc.rapid.program.program import Program, read_program
from postproc.rapid.syntax.edits import Edit
from postproc.render.header import header_values
from postproc.render.module import change_edits, function_edits, header_edit, indent_after, insertion_edits, render_text
from postproc.render.templates import environment
from postproc.robot.station import Station
from postproc.runtime.program import OnTheController, corrected_before, put_on_controller, reads_back
from postproc.runtime.reach import Reach, without_shared_values, without_unreachable, would_reach

UNREADABLE = frozenset({"RAP001", "RAP002", "RAP011"})
"""Findings that say: this is no program."""
WORSE = 2.0  # between targets that are corrected and others that cannot be, a line may end a little farther off
MARKER = re.compile(rb"^[ \t]*!\s*postproc \d+\.\d+[^\r\n]*compensated", re.MULTILINE)


@dataclass(frozen=True)
class Conversion:
    """Result of one conversion.

    Args:
        outputs: path of each source to its corrected bytes, those of the source where nothing moves the arm; empty
            where the program is not safe to compensate.
        report: the ``postproc/compensate/1`` document.
        diagnostics: all findings; exit_code: 0, 1 not safe, 2 bad input.
        outcomes: of every motion statement; module: with the function for run time, None where nothing uses it;
            plan, before, after: what was decided, and the deviation along the way; model: of the real arm, as far as
            it holds here.
    """

    outputs: Mapping[str, bytes]
    report: dict[str, Any]
    diagnostics: tuple[Diagnostic, ...]
    exit_code: int = 0
    outcomes: tuple[Outcome, ...] = ()
    module: bytes | None = None
    plan: Plan | None = None
    before: Deviation | None = None
    after: Deviation | None = None
    model: Model | None = None

    @property
    def summary(self) -> str:
        """One line for people."""
        if self.plan is None and self.module is None:
            return "nothing moves: written as it is" if self.outputs else "no program written"
        return summary(self.report)

    @property
    def output(self) -> bytes | None:
        """The corrected bytes of a single file."""
        return next(iter(self.outputs.values()), None)


class _Unsafe(Exception):
    """The program is not converted; the findings say why: with exit code 0 nothing in it moves the arm."""

    def __init__(self, exit_code: int = 1) -> None:
        self.exit_code = exit_code


def compensate_program(source: Source | Sequence[Source], model: Model, options: Options) -> Conversion:
    """Correct the program of one task so that the real arm follows its programmed paths.

    Args:
        source: one file, or all files of a task; each of them that is not lent may change.
        model: the real arm.
    """
    sources = (source,) if isinstance(source, Source) else tuple(source)
    findings: list[Diagnostic] = []
    try:
        return _converted(sources, model, options, findings)
    except _Unsafe as stop:
        kept = {s.path: s.data for s in sources if not s.lent} if stop.exit_code == 0 else {}
        return Conversion(kept, refused(findings), tuple(findings), stop.exit_code)


def _converted(sources: tuple[Source, ...], model: Model, options: Options, findings: list[Diagnostic]) -> Conversion:
    """The conversion; what is found on the way is added to ``findings``.

    Raises:
        _Unsafe: an error is among them.
    """
    program, events = _followed(sources, options, model.station, findings)
    model, more = applicable_model(model, events, options)
    findings += more
    reach = Reach(program, events, options.scope)
    known, motion = _moving(model, program, events, options, reach, findings)
    events = list(known)
    if motion is None:
        return _run_time_alone(program, model, events, reach, options, findings)
    on = options.run_time != "off"
    chosen = OnController(reach.takes, options.run_time == "all") if on else OnController()
    plan = plan_changes(model, motion, events, program, chosen)
    findings += [*doubt_weights(model, plan), *doubt_corrections(model, plan)]
    _stop_at_errors(findings)
    function = _function(program, model, events, reach, _not_by_numbers(program, plan), options, findings)
    env = environment(options.template_dir)
    edits: dict[str, list[Edit]] = {s.path: [] for s in sources}
    written = change_edits(env, plan.changes), insertion_edits(env, plan.insertions)
    for changed, edit in chain(*written, function_edits(env, program, plan.insertions)):
        edits[changed.path].append(edit)
    plan = replace(plan, changes=())  # they are edits now, and many
    drafts = {s.path: render_text(env, s.data, edits[s.path]) for s in sources}
    before, after = _proved(model, plan, program, events, drafts, function, findings)
    figures = figures_of(plan, before, after)
    _refuse_worse(figures, plan, sources[0], findings)
    through = function.keys if function is not None else frozenset()
    outcomes, unlike = judge_statements(program, events, plan, after, through)
    findings += unlike
    seams = find_seams(outcomes, plan, before, after)
    findings += partial_seams(seams, options.allow_partial)
    bounds = largest_shifts(outcomes, plan)
    added = Counter(insertion.statement.key for insertion in plan.insertions)
    worlds, more = Worlds(0, 0), list[Diagnostic]()
    if depends_on_run_time(events):
        worlds, more = check_written(program, drafts, added, bounds, options.entry)
    findings += more
    _stop_at_errors(findings)
    accuracy, more = expect_accuracy(model, motion, sources[0])
    if any(d.code == "CMP016" for d in findings):
        accuracy = None  # what the fit knows is the arm with everything that the model holds
    findings += more
    limits, more = check_corrected(model.robot, plan, sources[0])
    findings += more
    report = document(plan, model.robot.name, events, outcomes, seams, figures, accuracy, limits, findings)
    report["worlds"] = worlds.as_json()
    report["expected_remaining_fraction"] = expect_remaining(model, motion)
    report["run_time"] = function and function.as_json(options.run_time, after, plan)
    outputs = _outputs(program, edits, function, header_values(model, options, report), env, findings)
    module = function.module.text if function is not None else None
    return Conversion(outputs, report, tuple(findings), 0, tuple(outcomes), module, plan, before, after, model)


def _not_by_numbers(program: Program, plan: Plan) -> list[StatementKey]:
    """Motion statements of the text that no numbers correct, but for those that nobody asked for."""
    corrected = {move.event.statement.key for move in plan.motion.moves} - plan.left.keys()
    return [s.key for s in program.statements if s.key not in corrected and s.key not in plan.unasked]


def _function(
    program: Program,
    model: Model,
    events: Sequence[MotionEvent],
    reach: Reach,
    asked: Sequence[StatementKey],
    options: Options,
    findings: list[Diagnostic],
) -> OnTheController | None:
    """What corrects statements on the controller, None where nothing does; how many it would reach where it is off."""
    keys = frozenset(key for key in asked if reach.takes(key))
    if options.run_time == "off":
        findings += would_reach(program, keys)
    if options.run_time == "off" or not keys:
        return None
    function = put_on_controller(program, model, events, reach, keys, options)
    findings += function.findings
    _stop_at_errors(findings)
    return function


def _run_time_alone(
    program: Program,
    model: Model,
    events: Sequence[MotionEvent],
    reach: Reach,
    options: Options,
    findings: list[Diagnostic],
) -> Conversion:
    """The conversion of a program none of whose targets is known before it runs."""
    function = _function(program, model, events, reach, [s.key for s in program.statements], options, findings)
    if function is None:
        _refuse(findings, _no_known_target(program, events, findings))
    outcomes, more = unknown_outcomes(program, events, function.keys)
    findings += more
    report = unmeasured_document(model.robot.name, outcomes, options, findings)
    report["run_time"] = function.as_json(options.run_time)
    env = environment(options.template_dir)
    edits: dict[str, list[Edit]] = {s.path: [] for s in program.sources}
    outputs = _outputs(program, edits, function, header_values(model, options, report), env, findings)
    return Conversion(outputs, report, tuple(findings), 0, tuple(outcomes), function.module.text)


def _stop_at_errors(findings: Sequence[Diagnostic], exit_code: int = 1) -> None:
    if has_errors(findings):
        raise _Unsafe(exit_code)


def _refuse(findings: list[Diagnostic], *errors: Diagnostic) -> NoReturn:
    findings += errors
    raise _Unsafe


def _followed(
    sources: tuple[Source, ...], options: Options, station: Station | None, findings: list[Diagnostic]
) -> tuple[Program, list[MotionEvent]]:
    """The program, and its motions in the order in which it runs, with where external axes stand."""
    program = read_program(sources, options.constants)
    findings += [*program.diagnostics, *_already_done(sources)]
    _stop_at_errors(findings, 2 if any(d.code in UNREADABLE for d in findings) else 1)
    walked = walk_program(program, options.entry)
    events = place_events(walked.events, station or Station())
    findings += shown_to_users(walked.diagnostics, events)
    if not any(e.statement.interpolation != "none" and not e.statement.source.lent for e in events):
        text, help_ = "nothing in it moves the arm: it stays as it is", "its motions stand in another module: give that"
        findings.append(Diagnostic("CMP002", "warning", text, sources[0], help=help_))
        _stop_at_errors(findings)
        raise _Unsafe(0)
    _stop_at_errors(findings)
    return program, events


def _already_done(sources: Sequence[Source]) -> list[Diagnostic]:
    own = "the program was compensated before", "start from the original, or take the postproc lines out"
    lent = "the file that is read along was compensated before: its targets hold the correction", "lend the original"
    marked = [(s, found.span()) for s in sources if (found := MARKER.search(s.data)) is not None]
    marked += corrected_before(s for s in sources if s not in [one for one, _ in marked])
    return [
        Diagnostic("CMP001", "error", text, s, span, action)
        for s, span in marked
        for text, action in [lent if s.lent else own]
    ]


def _moving(
    model: Model,
    program: Program,
    events: Sequence[MotionEvent],
    options: Options,
    reach: Reach,
    findings: list[Diagnostic],
) -> tuple[Sequence[MotionEvent], Motion | None]:
    """What the program makes the arm do, None where no target is known; its events.

    Where a function corrects targets on the controller, values that are there only as the last run left them, and
    those that the arm cannot reach, are not known.
    """
    on = options.run_time != "off"
    events = without_shared_values(program, events, reach) if on else events
    motion, more = read_motion(model, events, options)
    while on and has_errors(more):
        given, said = without_unreachable(events, more, reach, options.run_time == "all")
        if not said:
            break
        events, (motion, more) = given, read_motion(model, given, options)
        more += said
    findings += more
    _stop_at_errors(findings)
    reasons = any(e.reason is not None and not e.statement.source.lent for e in events)
    if motion is None or (reasons and all(move.T_work_tcp is None for move in motion.moves)):
        return events, None
    return events, motion


def _no_known_target(program: Program, events: Sequence[MotionEvent], findings: Sequence[Diagnostic]) -> Diagnostic:
    """CMP003, with the reason that most statements have."""
    text = "no motion statement leads to a place that is known before the program runs"
    reasons = Counter(e.reason for e in events if e.reason is not None and not e.statement.source.lent)
    why = f"most often: {reasons.most_common(1)[0][0]}; " if reasons else ""
    measured = (d.help for d in findings if d.code == "RAP023")  # a tool or frame that the program measures
    most = reasons.most_common(1)[0][0] if reasons else ""
    first = next((set_first(e.unknowns) for e in events if e.reason == most), None)
    help_ = why + next(measured, first or "`postproc inspect` has the reason of every statement")
    return Diagnostic("CMP003", "error", text, program.sources[0], help=help_)


def _proved(
    model: Model,
    plan: Plan,
    program: Program,
    events: Sequence[MotionEvent],
    drafts: Mapping[str, bytes],
    function: OnTheController | None,
    findings: list[Diagnostic],
) -> tuple[Deviation, Deviation]:
    """Deviation of the program as it was and as it is written, from the text itself."""
    motion = plan.motion
    before = measure_deviation(model, motion.samples, [Driven(motion, np.arange(len(motion.moves)))])
    ran, owners = run_again(program, drafts, plan.insertions, events, motion.options, model.station)
    if function is not None and owners is not None:
        through = {j for j, i in enumerate(owners) if events[i].statement.key in function.keys}
        ran = list(function.apply(model, ran, through).events)
    try:
        return before, measure_deviation(model, motion.samples, drive(model, plan, ran, owners))
    except PostprocError as error:
        text = "the corrected program cannot be run by the arm, so nothing is written"
        help_ = "see the findings above" if error.diagnostics else "please report this program"
        failed = Diagnostic("CMP004", "error", text, program.sources[0], help=help_)
        _refuse(findings, *error.diagnostics, failed)


def _refuse_worse(figures: Figures, plan: Plan, source: Source, findings: list[Diagnostic]) -> None:
    """CMP013 where the corrected program would be farther off than the original."""
    burning = (figures.arc_before, figures.arc, plan.motion.options.tolerance_m)
    for before, after, tolerance in (burning, (figures.before, figures.after, float(plan.path_tolerance.max()))):
        if before is not None and after is not None and after > max(tolerance, WORSE * before):
            text = f"the corrected program would be {1e3 * after:.5g} mm off, the original is {1e3 * before:.5g} mm"
            help_ = "nothing is written; please report this program"
            _refuse(findings, Diagnostic("CMP013", "error", text, source, help=help_))


def _outputs(
    program: Program,
    edits: Mapping[str, list[Edit]],
    function: OnTheController | None,
    head: Mapping[str, Any],
    env: SandboxedEnvironment,
    findings: list[Diagnostic],
) -> dict[str, bytes]:
    """The bytes of every file that may change, with a header in those that do.

    Raises:
        _Unsafe: CMP004, the function does not stand in the text as it should.
    """
    changed = {path: list(found) for path, found in edits.items()}
    for source, edit in function.edits if function is not None else ():
        changed[source.path].append(edit)
    for s in program.sources:
        if changed[s.path]:
            at = next(m.head[1] for m in program.modules if m.source is s)
            for one in (edits, changed):
                one[s.path].append(header_edit(env, s, at, {**head, "indent": indent_after(s.data, at)}))
    own = [s for s in program.sources if not s.lent]
    outputs = {s.path: render_text(env, s.data, changed[s.path]) for s in own}
    if function is not None:
        texts = [[replace(s, data=render_text(env, s.data, edits[s.path])) for s in own]]
        texts += [[replace(s, data=outputs[s.path]) for s in own]]
        if not reads_back(read_program(texts[0]), read_program(texts[1]), len(function.keys)):
            text, help_ = "the text with the function reads back as another program", "please report this program"
            _refuse(findings, Diagnostic("CMP004", "error", text, own[0], help=help_))
    return outputs
