"""The convert loop: read, plan, write, read back, prove.

Program -> Moves -> Trajectory -> exact correction -> targets -> RAPID text -> the same way again -> Deviation
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, NoReturn

import numpy as np
from jinja2.sandbox import SandboxedEnvironment

from postproc.compensation.correction.applicable import applicable_model
from postproc.compensation.correction.deviation import Deviation, Driven, measure_deviation
from postproc.compensation.options import Options
from postproc.compensation.path.motion import Motion
from postproc.compensation.plan import FRUITLESS, CorrectionPlan, OnController, plan_changes
from postproc.compensation.readback import drive, run_again
from postproc.compensation.reading import few_ways, no_known_target, read_motion, with_way_out, without_impossible
from postproc.compensation.results.accuracy import expect_accuracy, expect_remaining
from postproc.compensation.results.belief import doubt_corrections, doubt_weights
from postproc.compensation.results.document import JudgedProgram, document, refused, unmeasured_document
from postproc.compensation.results.dynamics import check_corrected
from postproc.compensation.results.figures import figures_of, fruitless, worsened
from postproc.compensation.results.outcomes import judge_statements, largest_shifts, unknown_outcomes
from postproc.compensation.results.seams import find_seams, partial_seams, unfinished_seams
from postproc.compensation.text.values import StatementOutcome
from postproc.compensation.worlds import Bounds, Spared, Worlds, check_written, depends_on_run_time
from postproc.diagnostics import Diagnostic, Matter, PostprocError, Source, has_errors
from postproc.model.arm import Model
from postproc.motion.path.nominal_arm import NominalArm
from postproc.motion.path.places import place_events, say_resting
from postproc.process import seldom_collecting
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.execution.measured import say_measured, with_advice
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.motions.missing import shown_to_users
from postproc.rapid.program.program import Program, read_program
from postproc.rapid.program.read_only import say_written_elsewhere
from postproc.rapid.syntax.edits import Edit
from postproc.render.header import header_values
from postproc.render.module import change_edits, function_edits, header_edit, indent_after, insertion_edits, render_text
from postproc.render.templates import environment
from postproc.robot.cells.station import Station
from postproc.runtime.programs.program import OnTheController, put_on_controller, reads_back, say_corrected_before
from postproc.runtime.programs.reach import Reach, without_shared_values, without_unreachable, would_reach
from postproc.watch import Watch, told_of, unwatched

"""Findings that say: this is no program."""
PROOF = ("reading back and proving", 0.65, 0.98)


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
    outcomes: tuple[StatementOutcome, ...] = ()
    module: bytes | None = None
    plan: CorrectionPlan | None = None
    before: Deviation | None = None
    after: Deviation | None = None
    model: Model | None = None

    @property
    def output(self) -> bytes | None:
        """The corrected bytes of a single file."""
        return next(iter(self.outputs.values()), None)


class _Unsafe(Exception):
    """The program is not converted; the findings say why: with exit code 0 nothing in it moves the arm."""

    def __init__(self, exit_code: int = 1) -> None:
        self.exit_code = exit_code


class _Again(Exception):
    """More statements are spared than this conversion knew of."""


@dataclass(frozen=True)
class _Task:
    """What is converted: the program, the arm as far as its model holds for it, the motions, the choices, and what a
    function on the controller can correct.
    """

    program: Program
    model: Model
    events: list[MotionEvent]
    options: Options
    reach: Reach

    @property
    def on(self) -> bool:
        """Whether anything may be corrected on the controller."""
        return self.options.run_time != "off"


def compensate_program(
    source: Source | Sequence[Source], model: Model, options: Options, watch: Watch = unwatched
) -> Conversion:
    """Correct the program of one task so that the real arm follows its programmed paths.

    Args:
        source: one file, or all files of a task; each of them that is not lent may change.
        model: the real arm. watch: is told what is done, and which share of the work is.
    """
    sources = (source,) if isinstance(source, Source) else tuple(source)
    spared = Spared()
    while True:
        findings: list[Diagnostic] = []
        try:
            with seldom_collecting():
                return _converted(_Request(sources, model, options, spared), findings, watch)
        except _Again:
            continue
        except _Unsafe as stop:
            if not spared.learn(findings):
                kept = {s.path: s.data for s in sources if not s.read_only} if stop.exit_code == 0 else {}
                return Conversion(kept, refused(findings), tuple(findings), stop.exit_code)


@dataclass(frozen=True)
class _Request:
    """What is to be converted, and the statements that earlier tries have found to need care."""

    sources: tuple[Source, ...]
    model: Model
    options: Options
    spared: Spared


def _converted(asked: _Request, findings: list[Diagnostic], watch: Watch) -> Conversion:
    """The conversion; what is found on the way is added to ``findings``.

    Raises:
        _Unsafe: an error is among them.
    """
    sources, model, options = asked.sources, asked.model, asked.options
    if options.already and options.run_time != "off":
        text = "the function for run time does not know what the controller corrects by itself (`--already`)"
        _refuse(findings, Diagnostic("MOD012", "error", text, sources[0], help="leave one of the two out"))
    watch("following the program", 0.0)
    program, events, measured = _followed(sources, options, model, findings)
    events = asked.spared.applied(events)
    watch("path and timing", 0.15)
    model, more = applicable_model(model, events, options)
    findings += more
    task, motion = _moving(_Task(program, model, events, options, Reach(program, events, options.scope)), findings)
    if motion is None:
        return _run_time_alone(task, findings)
    events, reach = task.events, task.reach
    watch("correction", 0.45)
    chosen = OnController(reach.takes, options.run_time == "all") if task.on else OnController()
    plan = plan_changes(model, motion, events, program, replace(chosen, left=asked.spared.left))
    findings += [*doubt_weights(model, plan), *doubt_corrections(model, plan)]
    _stop_at_errors(findings)
    function = _function(task, plan.not_by_numbers(program), findings)
    env = environment(options.template_dir)
    edits = _edits_of(env, program, plan)
    plan = replace(plan, changes=())  # they are edits now, and many
    drafts = {s.path: render_text(env, s.data, edits[s.path]) for s in sources}
    watch(PROOF[0], PROOF[1])
    before, after = _proved(task, plan, drafts, function, findings, watch)
    if vain := fruitless(plan, before, after) - asked.spared.left.keys():
        asked.spared.left |= dict.fromkeys(vain, FRUITLESS)
        raise _Again
    figures = figures_of(plan, before, after)
    findings += worsened(figures, plan, sources[0])
    _stop_at_errors(findings)
    through = function.keys if function is not None else frozenset()
    outcomes, unlike = judge_statements(program, events, plan, after, through)
    findings += with_advice(unlike, events, program, measured)
    seams = find_seams(outcomes, plan, before, after)
    findings += [*partial_seams(seams, options.allow_partial), *unfinished_seams(events)]
    worlds = _same_in_worlds(task, plan, drafts, largest_shifts(outcomes, plan), findings)
    findings += asked.spared.findings.values()
    accuracy, more = expect_accuracy(model, motion, sources[0])
    if any(d.matter is Matter.NOT_WHOLE for d in findings):
        accuracy = None  # what the fit knows is the arm with everything that the model holds
    findings += more
    limits, more = check_corrected(model.robot, plan, sources[0])
    findings += more
    judged = JudgedProgram(outcomes, seams, figures, accuracy, limits)
    report = document(model.robot.name, plan, events, judged, findings)
    report["worlds"] = worlds.as_json()
    report["expected_remaining_fraction"] = expect_remaining(model, motion)
    report["run_time"] = function and function.as_json(options.run_time, after, plan)
    edits = _with_header(env, program, edits, function, header_values(model, options, report))
    outputs = _outputs(env, program, edits, function, findings)
    module = function.module.text if function is not None else None
    return Conversion(outputs, report, tuple(findings), 0, tuple(outcomes), module, plan, before, after, model)


def _edits_of(env: SandboxedEnvironment, program: Program, plan: CorrectionPlan) -> dict[str, list[Edit]]:
    """What is planned, as edits by path."""
    edits: dict[str, list[Edit]] = {s.path: [] for s in program.sources}
    written = change_edits(env, plan.changes), insertion_edits(env, plan.insertions)
    for changed, edit in chain(*written, function_edits(env, program, plan.insertions)):
        edits[changed.path].append(edit)
    return edits


def _function(task: _Task, asked: Sequence[StatementKey], findings: list[Diagnostic]) -> OnTheController | None:
    """What corrects statements on the controller, None where nothing does; how many it would reach where it is off."""
    keys = frozenset(key for key in asked if task.reach.takes(key))
    if not task.on:
        findings += would_reach(task.program, keys)
    if not task.on or not keys:
        return None
    function = put_on_controller(task.reach, task.model, keys, task.options)
    findings += function.findings
    _stop_at_errors(findings)
    return function


def _run_time_alone(task: _Task, findings: list[Diagnostic]) -> Conversion:
    """The conversion of a program none of whose targets is known before it runs."""
    program, events = task.program, task.events
    keys = [s.key for s in program.statements]
    function = _function(task, keys, findings)
    if function is None:
        reachable = 0 if task.on else sum(map(task.reach.takes, keys))
        _refuse(findings, no_known_target(program, events, findings, reachable))
    outcomes, more = unknown_outcomes(program, events, function.keys)
    findings += more
    report = unmeasured_document(task.model.robot.name, outcomes, task.options, findings)
    report["run_time"] = function.as_json(task.options.run_time)
    env = environment(task.options.template_dir)
    head = header_values(task.model, task.options, report)
    edits = _with_header(env, program, {s.path: [] for s in program.sources}, function, head)
    outputs = _outputs(env, program, edits, function, findings)
    return Conversion(outputs, report, tuple(findings), 0, tuple(outcomes), function.module.text)


def _stop_at_errors(findings: Sequence[Diagnostic], exit_code: int = 1) -> None:
    if has_errors(findings):
        raise _Unsafe(exit_code)


def _refuse(findings: list[Diagnostic], *errors: Diagnostic) -> NoReturn:
    findings += errors
    raise _Unsafe


def _followed(
    sources: tuple[Source, ...], options: Options, model: Model, findings: list[Diagnostic]
) -> tuple[Program, list[MotionEvent], Mapping[str, Diagnostic]]:
    """The program, its motions in the order in which it runs, with where external axes stand, and what it measures."""
    station = model.station or Station()
    program = read_program(sources, options.taught, NominalArm(model.robot, station), options.elsewhere)
    findings += [*program.diagnostics, *say_written_elsewhere(program), *say_corrected_before(sources)]
    _stop_at_errors(findings, 2 if any(d.matter is Matter.NO_MODULE for d in findings) else 1)
    walked = walk_program(program, options.entry)
    events = place_events(walked.events, station)
    findings += say_resting(events, station)
    measured = say_measured(program, events, options.entry)
    findings += [*shown_to_users(walked.diagnostics, events), *measured.values()]
    if not any(e.statement.interpolation != "none" and not e.statement.source.read_only for e in events):
        text, help_ = "nothing in it moves the arm: it stays as it is", "its motions stand in another module: give that"
        findings.append(Diagnostic("CMP002", "warning", text, sources[0], None, help_, Matter.STILL))
        _stop_at_errors(findings)
        raise _Unsafe(0)
    _stop_at_errors(findings)
    return program, events, measured


def _moving(task: _Task, findings: list[Diagnostic]) -> tuple[_Task, Motion | None]:
    """What the program makes the arm do, None where no target is known.

    Where a function corrects targets on the controller, values that are there only as the last run left them, and
    those that the arm cannot reach, are not known; nor are targets that the arm cannot run, where they are few ways or
    part of a program may be corrected.
    """
    model, options, reach = task.model, task.options, task.reach
    events = without_shared_values(task.program, task.events, reach) if task.on else task.events
    motion, more = read_motion(model, events, options)
    while has_errors(more):
        given, said = events, list[Diagnostic]()
        if task.on:
            given, said = without_unreachable(events, more, reach, options.run_time == "all")
        if not said and (options.allow_partial or few_ways(events, more)):
            given, said = without_impossible(events, more)
        if not said:
            break
        events, (motion, more) = given, read_motion(model, given, options)
        more += said
    findings += more if options.allow_partial else with_way_out(events, more)
    _stop_at_errors(findings)
    reasons = any(e.reason is not None and not e.statement.source.read_only for e in events)
    lost = motion is None or (reasons and all(move.T_work_tcp is None for move in motion.moves))
    return replace(task, events=events, reach=Reach(task.program, events, options.scope)), None if lost else motion


def _proved(
    task: _Task,
    plan: CorrectionPlan,
    drafts: Mapping[str, bytes],
    function: OnTheController | None,
    findings: list[Diagnostic],
    watch: Watch,
) -> tuple[Deviation, Deviation]:
    """Deviation of the program as it was and as it is written, from the text itself."""
    motion, model, program, events = plan.motion, task.model, task.program, task.events
    before = measure_deviation(model, motion.samples, [Driven(motion, np.arange(len(motion.moves)))])
    ran, owners = run_again(program, drafts, plan.insertions, events, motion.options, station=model.station)
    if function is not None and owners is not None:
        through = {j for j, i in enumerate(owners) if events[i].statement.key in function.keys}
        ran = list(function.apply(model, ran, through, task.options).events)
    try:
        driven = drive(model, plan, ran, owners)
        told = told_of(driven, lambda part: len(part.owner) / len(motion.moves), watch, PROOF)
        return before, measure_deviation(model, motion.samples, told)
    except PostprocError as error:
        text = "the corrected program cannot be run by the arm, so nothing is written"
        help_ = "see the findings above" if error.diagnostics else "please report this program"
        failed = Diagnostic("CMP004", "error", text, program.sources[0], help=help_)
        _refuse(findings, *error.diagnostics, failed)


def _same_in_worlds(
    task: _Task, plan: CorrectionPlan, drafts: Mapping[str, bytes], bounds: Bounds, findings: list[Diagnostic]
) -> Worlds:
    """The check in several worlds, but for programs that have but one way and one value of each place."""
    if not depends_on_run_time(task.events) and not plan.arrivals.open:
        return Worlds(0, 0)
    added = Counter(insertion.statement.key for insertion in plan.insertions)
    worlds, more = check_written(task.program, drafts, added, bounds, task.options.entry)
    findings += more
    _stop_at_errors(findings)
    return worlds


def _with_header(
    env: SandboxedEnvironment,
    program: Program,
    edits: Mapping[str, list[Edit]],
    function: OnTheController | None,
    head: Mapping[str, Any],
) -> dict[str, list[Edit]]:
    """Edits by path, with a header in every file that changes, by them or by the function."""
    through = {source.path for source, _ in function.edits} if function is not None else set[str]()
    found = {path: list(given) for path, given in edits.items()}
    for s in program.sources:
        if found[s.path] or s.path in through:
            at = next(m.head[1] for m in program.modules if m.source is s)
            found[s.path].append(header_edit(env, s, at, {**head, "indent": indent_after(s.data, at)}))
    return found


def _outputs(
    env: SandboxedEnvironment,
    program: Program,
    edits: Mapping[str, list[Edit]],
    function: OnTheController | None,
    findings: list[Diagnostic],
) -> dict[str, bytes]:
    """The bytes of every file that may change.

    Raises:
        _Unsafe: CMP004, the function does not stand in the text as it should.
    """
    own = [s for s in program.sources if not s.read_only]
    outputs = {s.path: render_text(env, s.data, edits[s.path]) for s in own}
    if function is None:
        return outputs
    through = {s.path: [*edits[s.path], *(e for source, e in function.edits if source is s)] for s in own}
    drafts, outputs = outputs, {s.path: render_text(env, s.data, through[s.path]) for s in own}
    without, written = (read_program([replace(s, data=text[s.path]) for s in own]) for text in (drafts, outputs))
    if not reads_back(without, written, len(function.keys)):
        text, help_ = "the text with the function reads back as another program", "please report this program"
        _refuse(findings, Diagnostic("CMP004", "error", text, own[0], help=help_))
    return outputs
