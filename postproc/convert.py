"""The conversion by numbers: read, follow, move, correct, assign, write, prove.

Program -> MotionEvents -> Motion -> Exact -> CorrectionPlan -> RAPID text -> the same way again -> Deviation

`Draft` holds what the steps have found. `follow_program` and `correct_by_numbers` make it, `prove_numbers` ends it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import replace
from itertools import chain

from postproc.compensation.choices import check_choices
from postproc.compensation.conversion import Conversion, Draft, JudgedProgram, Refused
from postproc.compensation.correction.applicable import applicable_model
from postproc.compensation.correction.curve import Exact, invert_model
from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.correction.rigid_shift import fit_shifts, leave_out, not_taught, with_rests
from postproc.compensation.judgement.accuracy import expect_on_arm
from postproc.compensation.judgement.doubts import check_corrected, doubt_corrections, doubt_drawn, doubt_flange_mass
from postproc.compensation.judgement.figures import figures_of, worsened
from postproc.compensation.judgement.outcomes import judge_statements, unmeasured, unproved
from postproc.compensation.judgement.seams import find_seams, uncorrected_seams, unfinished_seams
from postproc.compensation.options import Options
from postproc.compensation.path.motion import Motion
from postproc.compensation.plan import CorrectionPlan, Planner
from postproc.compensation.readback import changed_confdata, deviations_of, run_again
from postproc.compensation.reading import no_known_target, read_runnable
from postproc.compensation.text.marks import say_corrected_before, say_touched_up
from postproc.diagnostics import Diagnostic, Matter, PostprocError, Source
from postproc.model.arm import Model
from postproc.motion.path.nominal_arm import NominalArm
from postproc.motion.path.places import place_events, say_resting
from postproc.process import seldom_collecting
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.execution.measured import say_measured, with_advice
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.motions.missing import shown_to_users
from postproc.rapid.program.program import read_program
from postproc.rapid.program.read_along import say_written_elsewhere
from postproc.rapid.syntax.spans import Edit
from postproc.render.header import render_outputs
from postproc.render.module import change_edits, function_edits, insertion_edits, render_text
from postproc.render.templates import environment
from postproc.results.convert.conversion import conversion_values
from postproc.robot.cells.station import Station
from postproc.watch import Watch, unwatched

PROOF = ("reading back and proving", 0.66, 0.98)  # the step, and the shares of the work at which it begins and ends
Retarget = Callable[[Sequence[MotionEvent], Set[int]], Sequence[MotionEvent]]
"""Of a written program's events and the indices of some of them: all events, these with the targets the arm gets."""


def converted(
    source: Source | Sequence[Source],
    convert: Callable[[Sequence[Source]], Conversion],
    findings: Sequence[Diagnostic] = (),
) -> Conversion:
    """The conversion of some files with its document, whether it is refused or not.

    Args:
        convert: raises ``Refused`` where nothing can be written.
        findings: on how the files were read.
    """
    sources = (source,) if isinstance(source, Source) else tuple(source)
    try:
        with seldom_collecting():
            done = convert(sources)
    except Refused as refusal:
        kept = {s.path: s.data for s in sources if not s.read_only} if refusal.exit_code == 0 else {}
        done = Conversion(kept, refusal.findings, refusal.exit_code)
    done = replace(done, diagnostics=(*findings, *done.diagnostics))
    return replace(done, report=conversion_values(done))


def follow_program(sources: Sequence[Source], model: Model, options: Options, watch: Watch = unwatched) -> Draft:
    """Read a program, and follow it: its motions in order of execution.

    Raises:
        Refused: a file cannot be read, or nothing in the program moves the arm (CMP002).
    """
    watch("following the program", 0.0)
    station = model.station or Station()
    program = read_program(sources, options.taught, NominalArm(model.robot, station), options.other_tasks)
    findings = [*program.diagnostics, *say_written_elsewhere(program), *say_corrected_before(sources)]
    findings += say_touched_up(sources, model.fit.get("touched_sha256", ()))
    draft = Draft(program, [], model, options)
    draft = draft.with_findings(findings, 2 if any(d.matter is Matter.NO_MODULE for d in findings) else 1)
    walked = walk_program(program, options.entry)
    events = place_events(walked.events, station)
    measured = say_measured(program, events, options.entry)
    findings = [*say_resting(events, station), *shown_to_users(walked.diagnostics, events), *measured.values()]
    if not any(e.statement.interpolation != "none" and not e.statement.source.read_only for e in events):
        text, help_ = "nothing in it moves the arm: it stays as it is", "its motions stand in another module: give that"
        still = Diagnostic("CMP002", "warning", text, program.sources[0], None, help_, Matter.STILL)
        raise Refused(*draft.with_findings([*findings, still]).findings, exit_code=0)
    return replace(draft.with_findings(findings), events=events, measured=measured)


def correct_by_numbers(draft: Draft, watch: Watch = unwatched) -> Draft:
    """Plan and write the correction of a program that was followed; without a known target nothing is planned.

    Raises:
        Refused: the arm cannot run the program, or a correction is too large.
    """
    watch("path and timing", 0.08)
    draft = _move(draft)
    if draft.motion is None:
        return draft
    watch("correction", 0.44)
    draft, exact = _correct(draft, draft.motion)
    assert draft.motion is not None
    known = (draft.model, draft.motion, exact, draft.events, draft.program)
    plan = Planner(*known, expected_m=draft.expected.distance, excluded=draft.excluded, served=draft.served).plan()
    return _write(draft.with_findings(doubt_corrections(draft.model, plan)), plan)


def prove_numbers(draft: Draft, watch: Watch = unwatched) -> Conversion:
    """Prove what changed numbers do, and write the files.

    Raises:
        Refused: CMP003, no target is known before the program runs; or what ``prove`` refuses.
    """
    if draft.motion is None:
        nothing = no_known_target(draft.program, draft.events, draft.findings, draft.remedy)
        raise Refused(*draft.findings, nothing)
    watch(PROOF[0], PROOF[1])
    judged, findings = prove(draft, watch)
    return Conversion(render_outputs(draft, judged), findings, 0, judged, draft.model)


def _move(draft: Draft) -> Draft:
    """The draft with path and timing of its program.

    Targets that the arm cannot run count as unknown if the draft says so of them, if they are few, or if a part of the
    program may be corrected alone: the motion is then read again without them, until it can be run.
    """
    model, findings = applicable_model(draft.model, draft.events, draft.options)
    events, motion, further = read_runnable(model, draft.events, draft.options, draft.unsure)
    draft = replace(draft, events=events, model=model).with_findings([*findings, *further])
    reasons = any([e.reason is not None and not e.statement.source.read_only for e in events])
    lost = motion is None or (reasons and all(move.T_work_tcp is None for move in motion.moves))
    return replace(draft, motion=None if lost else motion)


def _correct(draft: Draft, motion: Motion) -> tuple[Draft, Exact]:
    """The draft with path meant, rigid shifts and what is expected on the arm, and the commanded joint angles.

    Findings are CMP026 about taught work objects, MOD005 on a tool lighter than nothing, and those on what is expected.
    """
    model, program, taught = draft.model, draft.program, draft.options.wobj_taught
    shifts = fit_shifts(model, motion, program, taught)
    motion = replace(motion, meant=leave_out(motion.samples, shifts))
    exact = invert_model(model, motion)
    findings = [*doubt_flange_mass(model, motion), *not_taught(taught, shifts, program)]
    shifts = with_rests(shifts, motion.samples, exact.T_base_flange)
    expected, further = expect_on_arm(model, motion, exact, program.sources[0])
    draft = replace(draft, motion=motion, shifts=shifts, expected=expected)
    return draft.with_findings([*findings, *further]), exact


def _write(draft: Draft, plan: CorrectionPlan) -> Draft:
    """The draft with a plan and the corrected text, with which the plan needs its changes no longer: they are many."""
    program, env = draft.program, environment(draft.options.template_dir)
    edits: dict[str, list[Edit]] = {s.path: [] for s in program.sources}
    written = change_edits(env, plan.changes), insertion_edits(env, plan.insertions)
    for source, edit in chain(*written, function_edits(env, program, plan.insertions)):
        edits[source.path].append(edit)
    texts = {s.path: render_text(env, s.data, edits[s.path]) for s in program.sources}
    return replace(draft, plan=replace(plan, changes=()), edits=edits, texts=texts)


def prove(
    draft: Draft, watch: Watch, served: Set[StatementKey] = frozenset(), retarget: Retarget | None = None
) -> tuple[JudgedProgram, tuple[Diagnostic, ...]]:
    """Follow the written text, compare its deviation with the original's, and judge every statement.

    Args:
        draft: has a plan.
        watch: is told how far the proof is.
        served: statements that another pass corrects.
        retarget: where the arm is sent in these statements; None if that is what stands in the text.

    Returns:
        What is known of the program, and all findings: those of the draft, of accuracy, joint limits, seams, and of
        runs in which open conditions go other ways.

    Raises:
        Refused: the written program is worse than the original, another one, or leaves a seam in parts.
    """
    assert draft.plan is not None
    plan, program, events, model = draft.plan, draft.program, draft.events, draft.model
    source = program.sources[0]
    ((before, after), *others), configured = _deviations(draft, plan, watch, served, retarget)
    figures = figures_of(plan, before, after)
    draft = draft.with_findings(worsened(plan, before, after, source))
    outcomes, unlike = judge_statements(program, events, plan, after, served)
    outcomes = [replace(o, conf_changed=True) if o.statement.key in configured else o for o in outcomes]
    seams = find_seams(outcomes, plan, before, after)
    findings = with_advice(unlike, events, program, draft.measured)
    findings += [*uncorrected_seams(seams, plan), *unfinished_seams(events)]
    draft = draft.with_findings(findings)
    findings = check_choices(model, program, events, draft.texts, plan)
    limits, further = check_corrected(model.robot, plan, source)
    unseen, lines = unmeasured(outcomes, events, plan)
    drawn = doubt_drawn(draft.shifts, plan.motion.moves, draft.options)
    draft = draft.with_findings([*findings, *further, *drawn])
    # What a fit knows is the arm with everything that its model holds.
    complete = not any(d.matter is Matter.OMITTED for d in draft.findings)
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
        shifts=draft.shifts,
        drawn=figures_of(plan, *others[0]) if others else None,
        accuracy=draft.expected.accuracy if complete else None,
        limits=limits,
        scatter=draft.expected.scatter,
    )
    return judged, draft.findings


def _deviations(
    draft: Draft, plan: CorrectionPlan, watch: Watch, served: Set[StatementKey], retarget: Retarget | None
) -> tuple[list[tuple[Deviation, Deviation]], frozenset[StatementKey]]:
    """Deviations of the original and of the written program (`deviations_of`), and statements with changed confdata.

    Args:
        served, retarget: as of ``prove``.

    Raises:
        Refused: CMP004, the arm cannot run what is written.
    """
    events = draft.events
    station = draft.model.station
    ran, owners = run_again(draft.program, draft.texts, plan.insertions, events, draft.options, station=station)
    if retarget is not None and owners is not None:
        ran = [*retarget(ran, {j for j, i in enumerate(owners) if events[i].statement.key in served})]
    try:
        return deviations_of(draft.model, plan, ran, owners, watch=watch, step=PROOF), changed_confdata(
            events, ran, owners
        )
    except PostprocError as error:
        message = "the corrected program cannot be run by the arm, so nothing is written"
        help_ = "see the findings above" if error.diagnostics else "please report this program"
        failed = Diagnostic("CMP004", "error", message, draft.program.sources[0], help=help_)
        raise Refused(*draft.findings, *error.diagnostics, failed) from None
