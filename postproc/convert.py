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
from postproc.compensate.plan import Plan, plan_changes
from postproc.compensate.readback import drive, run_again
from postproc.compensate.reading import read_motion
from postproc.compensate.results.accuracy import expect_accuracy, expect_remaining
from postproc.compensate.results.belief import doubt_corrections, doubt_weights
from postproc.compensate.results.document import document, refused, summary
from postproc.compensate.results.dynamics import check_corrected
from postproc.compensate.results.figures import Figures, figures_of
from postproc.compensate.results.outcomes import judge_statements, largest_shifts
from postproc.compensate.results.seams import find_seams, partial_seams
from postproc.compensate.text.values import Outcome
from postproc.compensate.worlds import Worlds, check_written, depends_on_run_time
from postproc.diagnostics import Diagnostic, PostprocError, Source, has_errors
from postproc.model.arm import Model
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.evaluation.memory import set_first
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.motions.base_frame import seen_from_base
from postproc.rapid.motions.missing import shown_to_users
from postproc.rapid.program.program import Program, read_program
from postproc.rapid.syntax.edits import Edit
from postproc.render.header import header_values
from postproc.render.module import change_edits, function_edits, header_edit, indent_after, insertion_edits, render_text
from postproc.render.templates import environment

UNREADABLE = frozenset({"RAP001", "RAP002", "RAP011"})
"""Findings that say: this is no program."""
MOST_TURNED = 0.02  # rad; that a correction turns the tool by
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
        outcomes: of every motion statement; plan, before, after: what was decided, and the deviation along the way;
            model: of the real arm, as far as it holds here.
    """

    outputs: Mapping[str, bytes]
    report: dict[str, Any]
    diagnostics: tuple[Diagnostic, ...]
    exit_code: int = 0
    outcomes: tuple[Outcome, ...] = ()
    plan: Plan | None = None
    before: Deviation | None = None
    after: Deviation | None = None
    model: Model | None = None

    @property
    def summary(self) -> str:
        """One line for people."""
        if self.plan is None:
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
    program, events = _followed(sources, options, findings)
    model, more = applicable_model(model, events, options)
    findings += more
    motion = _moving(model, program, events, options, findings)
    plan = plan_changes(model, motion, events, program)
    findings += [*doubt_weights(model, plan), *doubt_corrections(model, plan)]
    _stop_at_errors(findings)
    env = environment(options.template_dir)
    edits: dict[str, list[Edit]] = {s.path: [] for s in sources}
    written = change_edits(env, plan.changes), insertion_edits(env, plan.insertions)
    for changed, edit in chain(*written, function_edits(env, program, plan.insertions)):
        edits[changed.path].append(edit)
    plan = replace(plan, changes=())  # they are edits now, and many
    drafts = {s.path: render_text(env, s.data, edits[s.path]) for s in sources}
    before, after = _proved(model, plan, program, events, drafts, findings)
    figures = figures_of(plan, before, after)
    _refuse_worse(figures, plan, sources[0], findings)
    outcomes, unlike = judge_statements(program, events, plan, after)
    findings += unlike
    seams = find_seams(outcomes, plan, before, after)
    findings += partial_seams(seams, options.allow_partial)
    bounds = {key: (most, MOST_TURNED) for key, most in largest_shifts(outcomes, plan).items()}
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
    outputs = _outputs(program, edits, header_values(model, options, report), env)
    return Conversion(outputs, report, tuple(findings), 0, tuple(outcomes), plan, before, after, model)


def _stop_at_errors(findings: Sequence[Diagnostic], exit_code: int = 1) -> None:
    if has_errors(findings):
        raise _Unsafe(exit_code)


def _refuse(findings: list[Diagnostic], *errors: Diagnostic) -> NoReturn:
    findings += errors
    raise _Unsafe


def _followed(
    sources: tuple[Source, ...], options: Options, findings: list[Diagnostic]
) -> tuple[Program, list[MotionEvent]]:
    """The program, and its motions in the order in which it runs, seen from the base of the arm."""
    program = read_program(sources, options.constants)
    findings += [*program.diagnostics, *_already_done(sources)]
    _stop_at_errors(findings, 2 if any(d.code in UNREADABLE for d in findings) else 1)
    walked = walk_program(program, options.entry)
    events = seen_from_base(walked.events, options.base)
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
    return [
        Diagnostic("CMP001", "error", text, s, found.span(), action)
        for s in sources
        for text, action in [lent if s.lent else own]
        if (found := MARKER.search(s.data)) is not None
    ]


def _moving(
    model: Model, program: Program, events: Sequence[MotionEvent], options: Options, findings: list[Diagnostic]
) -> Motion:
    """What the program makes the arm do."""
    motion, more = read_motion(model, events, options)
    findings += more
    _stop_at_errors(findings)
    reasons = Counter(e.reason for e in events if e.reason is not None and not e.statement.source.lent)
    if motion is None or (reasons and all(move.T_work_tcp is None for move in motion.moves)):
        text = "no motion statement leads to a place that is known before the program runs"
        why = f"most often: {reasons.most_common(1)[0][0]}; " if reasons else ""
        measured = (d.help for d in findings if d.code == "RAP023")  # a tool or frame that the program measures
        most = reasons.most_common(1)[0][0] if reasons else ""
        first = next((set_first(e.unknowns) for e in events if e.reason == most), None)
        help_ = why + next(measured, first or "`postproc inspect` has the reason of every statement")
        _refuse(findings, Diagnostic("CMP003", "error", text, program.sources[0], help=help_))
    return motion


def _proved(
    model: Model,
    plan: Plan,
    program: Program,
    events: Sequence[MotionEvent],
    drafts: Mapping[str, bytes],
    findings: list[Diagnostic],
) -> tuple[Deviation, Deviation]:
    """Deviation of the program as it was and as it is written, from the text itself."""
    motion = plan.motion
    before = measure_deviation(model, motion.samples, [Driven(motion, np.arange(len(motion.moves)))])
    ran, owners = run_again(program, drafts, plan.insertions, events, motion.options)
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
    program: Program, edits: Mapping[str, list[Edit]], head: Mapping[str, Any], env: SandboxedEnvironment
) -> dict[str, bytes]:
    """The bytes of every file that may change, with a header in those that do."""
    outputs = {}
    for s in program.sources:
        if edits[s.path]:
            at = next(m.head[1] for m in program.modules if m.source is s)
            edits[s.path].append(header_edit(env, s, at, {**head, "indent": indent_after(s.data, at)}))
        if not s.lent:
            outputs[s.path] = render_text(env, s.data, edits[s.path])
    return outputs
