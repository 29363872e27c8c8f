"""The conversion: read, follow, move, correct, assign, write, prove; each step gives its value and its findings.

Program -> MotionEvents -> Motion -> Exact -> CorrectionPlan -> RAPID text -> the same way again -> Deviation
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

from jinja2.sandbox import SandboxedEnvironment

from postproc.compensation.choices import check_choices
from postproc.compensation.conversion import Conversion, JudgedProgram
from postproc.compensation.correction.applicable import applicable_model
from postproc.compensation.correction.curve import Exact, invert_model
from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.correction.rigid_shift import RigidShift, fit_shifts, leave_out, not_taught, with_rests
from postproc.compensation.judgement.accuracy import Expected, expect_on_arm
from postproc.compensation.judgement.belief import doubt_corrections, doubt_flange_mass
from postproc.compensation.judgement.dynamics import check_corrected
from postproc.compensation.judgement.figures import figures_of, worsened
from postproc.compensation.judgement.outcomes import judge_statements, unknown_outcomes, unmeasured, unproved
from postproc.compensation.judgement.provenance import doubt_drawn
from postproc.compensation.judgement.seams import find_seams, partial_seams, unfinished_seams
from postproc.compensation.options import Options
from postproc.compensation.path.motion import Motion
from postproc.compensation.plan import CorrectionPlan, OnController, Planner
from postproc.compensation.readback import changed_confdata, deviations_of, run_again
from postproc.compensation.reading import few_ways, no_known_target, read_runnable, with_way_out, without_impossible
from postproc.compensation.worlds import check_written
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
from postproc.rapid.program.shared_data import say_written_elsewhere
from postproc.rapid.syntax.edits import Edit
from postproc.render.header import header_edit, header_values
from postproc.render.module import change_edits, function_edits, insertion_edits, render_text
from postproc.render.templates import environment
from postproc.results.conversion import conversion_values
from postproc.robot.cells.station import Station
from postproc.runtime.programs.program import OnTheController, put_on_controller, reads_back, say_corrected_before
from postproc.runtime.programs.reach import Reach, without_shared_values, without_unreachable, would_reach
from postproc.watch import Watch, unwatched

PROOF = ("reading back and proving", 0.65, 0.98)  # the step, and the shares of the work at which it begins and ends


class _Refused(Exception):
    """Ends a conversion with findings: an error forbids it, or nothing in the program moves the arm (exit code 0)."""

    def __init__(self, *findings: Diagnostic, exit_code: int = 1) -> None:
        self.findings, self.exit_code = findings, exit_code


@dataclass(frozen=True)
class _Task:
    """What is converted: the program, its motions, and the model of the arm as far as it holds for the program.

    Args:
        events: the motions in order of execution.
        motion: their path and timing; None where no target is known before the program runs.
        reach: which statements a function on the controller can correct.
        measured: findings at data that the program itself measures, by key of the data.
        shifts: how much of the correction in each work object is one rigid motion.
        expected: to remain on the arm, once the correction is known.
    """

    program: Program
    events: list[MotionEvent]
    model: Model
    options: Options
    motion: Motion | None
    reach: Reach
    measured: Mapping[str, Diagnostic]
    shifts: tuple[RigidShift, ...] = ()
    expected: Expected = Expected()

    @property
    def on(self) -> bool:
        """Whether anything may be corrected on the controller."""
        return self.options.run_time != "off"


@dataclass(frozen=True)
class _Text:
    """The text that is written.

    Args:
        edits, drafts: of each file, by path, the edits without header and function, and the bytes with these edits.
        function: that corrects targets on the controller, None if there is none.
    """

    env: SandboxedEnvironment
    edits: Mapping[str, list[Edit]]
    drafts: Mapping[str, bytes]
    function: OnTheController | None


def compensate_program(
    source: Source | Sequence[Source],
    model: Model,
    options: Options,
    watch: Watch = unwatched,
    findings: Sequence[Diagnostic] = (),
) -> Conversion:
    """Correct the program of one task so that the real arm follows its programmed paths.

    Args:
        source: one file, or all files of a task; each of them that is not read only may change.
        model: the real arm.
        watch: is called with the name of each step and the share of the work done so far.
        findings: on how its files were read; they come before those of the conversion.
    """
    sources = (source,) if isinstance(source, Source) else tuple(source)
    done = _converted(sources, model, options, watch)
    done = replace(done, diagnostics=(*findings, *done.diagnostics))
    return replace(done, report=conversion_values(done))


def _converted(sources: tuple[Source, ...], model: Model, options: Options, watch: Watch) -> Conversion:
    """The conversion of a task's files, without its document."""
    findings: list[Diagnostic] = []
    try:
        with seldom_collecting():
            watch("following the program", 0.0)
            program, more = _read(sources, model, options)
            findings += _sound(more, 2 if any(d.matter is Matter.NO_MODULE for d in more) else 1)
            (events, measured), more = _follow(program, model, options)
            findings += _sound(more)
            watch("path and timing", 0.15)
            task, more = _move(program, events, measured, model, options)
            findings += _sound(more)
            if task.motion is None:
                return _run_time_alone(task, findings)
            watch("correction", 0.45)
            task, exact, more = _correct(task, task.motion)
            findings += _sound(more)
            plan, more = _assign(task, exact)
            findings += _sound(more)
            text, more = _write(task, plan)
            findings += _sound(more)
            plan = replace(plan, changes=())  # they are edits now, and many
            watch(PROOF[0], PROOF[1])
            judged, more = _prove(task, plan, text, watch)
            findings += _sound(more)
            return _conversion(task, text, judged, findings)
    except _Refused as refusal:
        findings += refusal.findings
        kept = {s.path: s.data for s in sources if not s.read_only} if refusal.exit_code == 0 else {}
        return Conversion(kept, tuple(findings), refusal.exit_code)


def _sound(findings: Sequence[Diagnostic], exit_code: int = 1) -> Sequence[Diagnostic]:
    """The findings of a step, unchanged.

    Raises:
        _Refused: an error is among them; the command ends with this exit code.
    """
    if has_errors(findings):
        raise _Refused(*findings, exit_code=exit_code)
    return findings


def _read(sources: tuple[Source, ...], model: Model, options: Options) -> tuple[Program, list[Diagnostic]]:
    """The parsed program, and findings of the text."""
    if options.unknown_at_run_time and options.run_time != "off":
        text = f"the function for run time does not know {options.unknown_at_run_time}"
        raise _Refused(Diagnostic("MOD012", "error", text, sources[0], help="leave one of the two out"))
    arm = NominalArm(model.robot, model.station or Station())
    program = read_program(sources, options.taught, arm, options.elsewhere)
    return program, [*program.diagnostics, *say_written_elsewhere(program), *say_corrected_before(sources)]


def _follow(
    program: Program, model: Model, options: Options
) -> tuple[tuple[list[MotionEvent], Mapping[str, Diagnostic]], list[Diagnostic]]:
    """The motions in order of execution, findings at data that the program measures (by its key), and all findings.

    Raises:
        _Refused: CMP002, nothing in the program moves the arm.
    """
    station = model.station or Station()
    walked = walk_program(program, options.entry)
    events = place_events(walked.events, station)
    measured = say_measured(program, events, options.entry)
    findings = [*say_resting(events, station), *shown_to_users(walked.diagnostics, events), *measured.values()]
    if not any(e.statement.interpolation != "none" and not e.statement.source.read_only for e in events):
        text, help_ = "nothing in it moves the arm: it stays as it is", "its motions stand in another module: give that"
        findings.append(Diagnostic("CMP002", "warning", text, program.sources[0], None, help_, Matter.STILL))
        raise _Refused(*findings, exit_code=1 if has_errors(findings) else 0)
    return (events, measured), findings


def _move(
    program: Program, events: list[MotionEvent], measured: Mapping[str, Diagnostic], model: Model, options: Options
) -> tuple[_Task, list[Diagnostic]]:
    """The task with moves, samples and timing of its program, and findings.

    If a function may correct targets on the controller, values that only the last run left, and those out of reach,
    count as unknown. So do targets that the arm cannot run, if they are few or a part of the program may be corrected
    alone: the motion is then read again without them, until it can be run.
    """
    model, findings = applicable_model(model, events, options)
    reach = Reach(program, events, options.scope)
    events = without_shared_values(program, events, reach) if options.run_time != "off" else events
    without = partial(_without_errors, reach=reach, options=options)
    events, motion, more = read_runnable(model, events, options, without)
    findings += more if options.allow_partial else with_way_out(events, more)
    reasons = any([e.reason is not None and not e.statement.source.read_only for e in events])
    lost = motion is None or (reasons and all(move.T_work_tcp is None for move in motion.moves))
    reach = Reach(program, events, options.scope)
    return _Task(program, events, model, options, None if lost else motion, reach, measured), findings


def _without_errors(
    events: list[MotionEvent], errors: Sequence[Diagnostic], reach: Reach, options: Options
) -> tuple[list[MotionEvent], list[Diagnostic]]:
    """Events without the targets that the arm cannot run (by ``errors``), and warnings for these; or neither change."""
    if options.run_time != "off":
        known, forgiven = without_unreachable(events, errors, reach, options.run_time == "all")
        if forgiven:
            return known, forgiven
    if options.allow_partial or few_ways(events, errors):
        return without_impossible(events, errors)
    return events, []


def _correct(task: _Task, motion: Motion) -> tuple[_Task, Exact, list[Diagnostic]]:
    """The task with path meant, rigid shifts and what is expected on the arm, the commanded joint angles, and findings.

    Findings are CMP026 about taught work objects, MOD005 on a tool lighter than nothing, and those on what is expected.
    """
    shifts = fit_shifts(task.model, motion, task.program, task.options.wobj_taught)
    motion = replace(motion, meant=leave_out(motion.samples, shifts))
    exact = invert_model(task.model, motion)
    findings = [*doubt_flange_mass(task.model, motion), *not_taught(task.options.wobj_taught, shifts, task.program)]
    shifts = with_rests(shifts, motion.samples, exact.T_base_flange)
    expected, more = expect_on_arm(task.model, motion, exact, task.program.sources[0])
    return replace(task, motion=motion, shifts=shifts, expected=expected), exact, [*findings, *more]


def _assign(task: _Task, exact: Exact) -> tuple[CorrectionPlan, list[Diagnostic]]:
    """The plan of which targets are changed or added, and findings about corrections that are too large."""
    chosen = OnController(task.reach.takes, task.options.run_time == "all") if task.on else OnController()
    assert task.motion is not None  # else only a function on the controller can correct
    known = (task.model, task.motion, exact, task.events, task.program)
    plan = Planner(*known, expected_m=task.expected.distance, on_controller=chosen).plan()
    return plan, doubt_corrections(task.model, plan)


def _write(task: _Task, plan: CorrectionPlan) -> tuple[_Text, list[Diagnostic]]:
    """The corrected text, with the function on the controller for statements that changed numbers do not correct."""
    function, findings = _function(task, plan.not_by_numbers(task.program))
    env = environment(task.options.template_dir)
    edits: dict[str, list[Edit]] = {s.path: [] for s in task.program.sources}
    written = change_edits(env, plan.changes), insertion_edits(env, plan.insertions)
    for changed, edit in chain(*written, function_edits(env, task.program, plan.insertions)):
        edits[changed.path].append(edit)
    drafts = {s.path: render_text(env, s.data, edits[s.path]) for s in task.program.sources}
    return _Text(env, edits, drafts, function), findings


def _function(task: _Task, keys: Iterable[StatementKey]) -> tuple[OnTheController | None, list[Diagnostic]]:
    """The function on the controller that corrects those of some statements (by key) that it can, and findings.

    None if it can correct none, or if it is off: the findings then say how many statements it would correct.
    """
    chosen = frozenset(key for key in keys if task.reach.takes(key))
    if not task.on:
        return None, would_reach(task.program, chosen)
    function = put_on_controller(task.reach, task.model, chosen, task.options) if chosen else None
    return function, [] if function is None else [*function.findings]


def _prove(task: _Task, plan: CorrectionPlan, text: _Text, watch: Watch) -> tuple[JudgedProgram, list[Diagnostic]]:
    """Follow the written text, compare its deviation with the original's, and judge every statement.

    The findings include those of accuracy, joint limits, seams, and of runs in which open conditions go other ways.
    """
    program, events, model, source = task.program, task.events, task.model, task.program.sources[0]
    ((before, after), *others), configured = _deviations(task, plan, text, watch)
    figures = figures_of(plan, before, after)
    findings = list(_sound(worsened(figures, plan, source)))
    through = text.function.keys if text.function is not None else frozenset()
    outcomes, unlike = judge_statements(program, events, plan, after, through)
    outcomes = [replace(o, conf_changed=True) if o.statement.key in configured else o for o in outcomes]
    findings += with_advice(unlike, events, program, task.measured)
    seams = find_seams(outcomes, plan, before, after)
    findings += [*partial_seams(seams, task.options.allow_partial), *unfinished_seams(events)]
    worlds, more = check_written(program, events, text.drafts, plan, outcomes)
    findings = [*_sound([*findings, *more]), *check_choices(model, program, events, text.drafts, plan)]
    limits, more = check_corrected(model.robot, plan, source)
    unseen, lines = unmeasured(outcomes, events, plan)
    judged = JudgedProgram(
        options=plan.motion.options,
        outcomes=tuple(outcomes),
        lines=lines,
        unmeasured=unseen,
        unproved=unproved(outcomes, events, plan),
        plan=plan,
        before=before,
        after=after,
        seams=seams,
        figures=figures,
        shifts=task.shifts,
        drawn=figures_of(plan, *others[0]) if others else None,
        accuracy=task.expected.accuracy,
        limits=limits,
        worlds=worlds,
        remaining=task.expected.remaining,
        run_time=text.function.figures(task.options.run_time, after, plan) if text.function is not None else None,
    )
    return judged, [*findings, *more, *doubt_drawn(task.shifts, plan.motion.moves, task.options)]


def _deviations(
    task: _Task, plan: CorrectionPlan, text: _Text, watch: Watch
) -> tuple[list[tuple[Deviation, Deviation]], frozenset[StatementKey]]:
    """Deviations of the original and of the written program (`deviations_of`), and statements with changed confdata.

    Raises:
        _Refused: CMP004, the arm cannot run what is written.
    """
    model, program, events, function = task.model, task.program, task.events, text.function
    ran, owners = run_again(program, text.drafts, plan.insertions, events, task.options, station=model.station)
    if function is not None and owners is not None:
        through = {j for j, i in enumerate(owners) if events[i].statement.key in function.keys}
        ran = list(function.apply(model, ran, through, task.options).events)
    try:
        return deviations_of(model, plan, ran, owners, watch, PROOF), changed_confdata(events, ran, owners)
    except PostprocError as error:
        message = "the corrected program cannot be run by the arm, so nothing is written"
        help_ = "see the findings above" if error.diagnostics else "please report this program"
        failed = Diagnostic("CMP004", "error", message, program.sources[0], help=help_)
        raise _Refused(*error.diagnostics, failed) from None


def _conversion(task: _Task, text: _Text, judged: JudgedProgram, findings: Sequence[Diagnostic]) -> Conversion:
    """The result for a program whose written text has been proved."""
    if any(d.matter is Matter.NOT_WHOLE for d in findings):
        judged = replace(judged, accuracy=None)  # what the fit knows is the arm with everything that the model holds
    outputs = _outputs(task, text, judged)
    module = text.function.module.text if text.function is not None else None
    return Conversion(outputs, tuple(findings), 0, judged, task.model, module)


def _run_time_alone(task: _Task, findings: Sequence[Diagnostic]) -> Conversion:
    """The conversion of a program none of whose targets is known before it runs: only a function can correct it."""
    program, events, keys = task.program, task.events, [s.key for s in task.program.statements]
    function, more = _function(task, keys)
    found = [*findings, *_sound(more)]
    if function is None:
        reachable = 0 if task.on else sum(map(task.reach.takes, keys))
        raise _Refused(*more, no_known_target(program, events, found, reachable))
    outcomes, unlike = unknown_outcomes(program, events, function.keys)
    lines = sum(o.statement.interpolation in ("line", "arc") for o in outcomes)
    told = function.figures(task.options.run_time)
    judged = JudgedProgram(options=task.options, outcomes=tuple(outcomes), lines=lines, unmeasured=lines, run_time=told)
    edits: dict[str, list[Edit]] = {s.path: [] for s in program.sources}
    text = _Text(environment(task.options.template_dir), edits, {}, function)
    outputs = _outputs(task, text, judged)
    return Conversion(outputs, (*found, *unlike), 0, judged, task.model, function.module.text)


def _outputs(task: _Task, text: _Text, judged: JudgedProgram) -> dict[str, bytes]:
    """The bytes of every file that may change, by path, with a header in each that is edited.

    Raises:
        _Refused: CMP004, the text with the function does not read back as the same program.
    """
    program, env, function = task.program, text.env, text.function
    head = header_values(task.model, judged)
    calls: dict[str, list[Edit]] = {s.path: [] for s in program.sources}
    for source, edit in function.edits if function is not None else ():
        calls[source.path].append(edit)
    edits = {path: list(own) for path, own in text.edits.items()}
    for s in program.sources:
        if edits[s.path] or calls[s.path]:
            at = next(m.head[1] for m in program.modules if m.source is s)
            edits[s.path].append(header_edit(env, s, at, head))
    own = [s for s in program.sources if not s.read_only]
    outputs = {s.path: render_text(env, s.data, edits[s.path]) for s in own}
    if function is None:
        return outputs
    drafts, outputs = outputs, {s.path: render_text(env, s.data, [*edits[s.path], *calls[s.path]]) for s in own}
    without, written = (read_program([replace(s, data=data[s.path]) for s in own]) for data in (drafts, outputs))
    if not reads_back(without, written, len(function.keys)):
        message, help_ = "the text with the function reads back as another program", "please report this program"
        raise _Refused(Diagnostic("CMP004", "error", message, own[0], help=help_))
    return outputs
