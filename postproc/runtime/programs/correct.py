"""The second pass: what numbers leave uncorrected goes through a function that corrects it on the controller.

`leave_to_function` says what the first pass must not count on, `correct_at_run_time` takes the text that it has written
and the list of what it has left.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from postproc.arrays import Array, invert
from postproc.compensation.conversion import Conversion, Draft, JudgedProgram, Refused, RunTimeFigures
from postproc.compensation.judgement.outcomes import unknown_outcomes
from postproc.compensation.options import Options
from postproc.compensation.reading import IMPOSSIBLE, IN_SEAM
from postproc.convert import PROOF, prove
from postproc.diagnostics import Diagnostic, Source
from postproc.model.arm import Model
from postproc.motion.path.moves import read_moves
from postproc.motion.values import Move, mounts_of
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.data.records import RobTarget
from postproc.rapid.motions.units import MM, target_poses, tool_matrix, via_matrix
from postproc.rapid.program.program import read_program
from postproc.render.header import render_outputs
from postproc.robot.inverse import nearest_solution
from postproc.runtime.conditions import Conditions
from postproc.runtime.module import MODULE_NAME
from postproc.runtime.programs.program import payload_edits, reads_back, reset_edits, say_unfit
from postproc.runtime.programs.reach import WELDING, Reach, counted, without_shared_values
from postproc.runtime.proof.calls import Caller, FunctionCall
from postproc.runtime.proof.check import LINE_M
from postproc.runtime.written import RunTimeModule, write_module
from postproc.watch import Watch

ON_CONTROLLER = "all that can be is corrected on the controller"


def leave_to_function(draft: Draft) -> Draft:
    """A followed program in which what the function will correct is left to it; with ``all`` that is all it can.

    Targets that other tasks share count as unknown, and so do stored ones where the arm cannot run what the files say.

    Raises:
        Refused: MOD012, the options say what the function does not know.
    """
    program, options = draft.program, draft.options
    if options.unknown_at_run_time:
        text = f"the function for run time does not know {options.unknown_at_run_time}"
        raise Refused(Diagnostic("MOD012", "error", text, program.sources[0], help="leave one of the two out"))
    reach = Reach(program, draft.events, options.scope)
    events = without_shared_values(program, draft.events, reach)
    served = frozenset(s.key for s in program.statements if reach.takes(s.key))
    everything = options.run_time == "all"
    unsure = {
        e.statement.key for e in events if e.reason is None and (everything or e.target_origin.base.storage == "PERS")
    }
    excluded = dict.fromkeys(served if everything else (), ON_CONTROLLER)
    return replace(draft, events=events, served=served, excluded=excluded, unsure=served & unsure)


def correct_at_run_time(draft: Draft, watch: Watch) -> Conversion | None:
    """Send what changed numbers do not correct through the function, prove that, and write files and module.

    None if the function can correct none of it.

    Args:
        draft: written by the first pass, after `leave_to_function`.

    Raises:
        Refused: RUN006, RUN008 or RUN011, the function cannot be made or does not go with the program; CMP004, the text
            with the function does not read back as the same program; or what ``prove`` refuses.
        PostprocError: RUN001, RUN003, REN001, REN002 or MOD010, the module cannot be made.
    """
    program, model, options, plan = draft.program, draft.model, draft.options, draft.plan
    reach = Reach(program, draft.events, options.scope)
    keys = frozenset(key for key in draft.not_corrected() if reach.takes(key))
    if not keys:
        return None
    name = MODULE_NAME if options.run_time_module is None else options.run_time_module.stem
    module = write_module(model, conditions_of(draft, keys), name, options.template_dir)
    source = Source(f"{name}.sys", module.text)
    draft = draft.with_findings([*_say_unreachable(draft), *module.diagnostics, *say_unfit(program, model, source)])
    loads = payload_edits(program)
    if plan is None:
        outcomes, further = unknown_outcomes(program, draft.events, keys)
        lines = sum(o.statement.interpolation in ("line", "arc") for o in outcomes)
        judged = JudgedProgram(options=options, outcomes=tuple(outcomes), lines=lines, unmeasured=lines)
        findings = (*draft.findings, *further)
    else:
        watch(PROOF[0], PROOF[1])
        judged, findings = prove(
            draft, watch, keys, lambda events, rows: apply_module(source, model, events, rows, options.free_axes)
        )
    judged = replace(judged, run_time=_figures(judged, module, keys, options, len(loads)))
    calls = [(s.source, edit) for s in program.statements if s.key in keys for edit in reach.edits(s.key) or ()]
    payloads = [edit for part in (*loads, reset_edits(program) if loads else ()) for edit in part]
    outputs = render_outputs(draft, judged, [*calls, *payloads])
    files = [s for s in program.sources if not s.read_only]
    texts = draft.texts or {s.path: s.data for s in files}
    before, after = (read_program([replace(s, data=data[s.path]) for s in files]) for data in (texts, outputs))
    if not reads_back(before, after, len(keys)):
        message, help_ = "the text with the function reads back as another program", "please report this program"
        raise Refused(*findings, Diagnostic("CMP004", "error", message, files[0], help=help_))
    return Conversion(outputs, findings, 0, judged, model, module.text)


def _say_unreachable(draft: Draft) -> list[Diagnostic]:
    """RUN009, a warning with the number of statements of which the arm cannot run what the files say; none for none."""
    known = {e.statement.key for e in draft.events if e.reason is None}
    partial = {e.statement.key for e in draft.events if IMPOSSIBLE in e.unknowns or IN_SEAM in e.unknowns}
    statements = [s for s in draft.program.statements if s.key in draft.unsure - known - partial]
    if not statements:
        return []
    text = f"what stands in the files for the targets of {counted(len(statements), 'motion statement')} cannot be run"
    help_ = "they are corrected on the controller: targets that cannot be reached come back as they came"
    return [Diagnostic("RUN009", "warning", text, statements[0].source, statements[0].span, help_)]


def conditions_of(draft: Draft, keys: Set[StatementKey]) -> Conditions:
    """The conditions for the run-time module: tool and load of the program, forces and channels of the options.

    The tool is the first one that the robot holds in these statements, else the model's; a tool without load counts as
    half of the arm's payload.

    Args:
        keys: statements whose targets are corrected at run time.
    """
    robot, options = draft.model.robot, draft.options
    tools = (e.tool for e in draft.events if e.statement.key in keys and e.tool.name != "tool0" and e.tool.robhold)
    tool = next(tools, None)
    frame = draft.model.T_flange_tcp if tool is None else tool_matrix(tool)
    mass: float = 0.5 * (robot.payload or 0.0)
    center: Array = 0.5 * frame[:3, 3]
    if tool is not None and tool.tload.mass > 0:
        mass, center = tool.tload.mass, MM * np.array(tool.tload.cog)
    return Conditions(
        robot.lower, robot.upper, frame, mass, center, np.array(options.force), np.array(options.moment),
        options.force_on, dict(options.channels),
    )  # fmt: skip


def _figures(
    judged: JudgedProgram, module: RunTimeModule, keys: Set[StatementKey], options: Options, loads: int
) -> RunTimeFigures:
    """What is known of the function.

    Args:
        judged: has plan and deviation where targets of the statements ``keys`` are known before the program runs.
        loads: number of `GripLoad` statements behind which the payload is passed.
    """
    moves = [] if judged.plan is None else judged.plan.motion.moves
    known = [i for i, move in enumerate(moves) if move.event.statement.key in keys]
    after = judged.after
    checks, chord = module.checks, module.chord
    return RunTimeFigures(
        mode=options.run_time,
        module=MODULE_NAME if options.run_time_module is None else options.run_time_module.stem,
        statements=len(keys),
        loads=loads,
        known_targets=len(known),
        max_known_error_mm=1e3 * max(float(after.goal_distance[i]) for i in known) if known and after else None,
        region_targets=sum(check.corrected for check in checks),
        max_region_error_mm=1e3 * max(check.largest_m for check in checks),
        max_chord_error_mm=1e3 * chord.largest_m,
        chord_length_mm=1e3 * LINE_M,
        max_chord_error_mm_per_m2=1e3 * chord.per_square_metre,
        cost=module.cost,
    )


def apply_module(
    module: Source, model: Model, events: Sequence[MotionEvent], chosen: Set[int], free_axes: str = ""
) -> list[MotionEvent]:
    """Events with the targets that the module's function gives for chosen ones; other targets stay as they are.

    It is calculated in single precision, as on a controller.

    Args:
        module: text of the run-time module; model: the arm that the program drives.
        events: all of a program.
        chosen: indices of the events whose target is corrected.
        free_axes: letters of external axes that carry neither the robot nor its work.

    Raises:
        PostprocError: RUN003, the module holds what cannot be calculated.
    """
    driven = list(events)
    moves = [
        m
        for m in read_moves(model.robot, events, free_axes, model.station)[0]
        if m.row in chosen and m.resumes_from is None and isinstance(m.event.target, RobTarget)
        if m.event.tool.robhold and not m.event.wobj.robhold  # the function returns other targets as they came
    ]
    if not moves:
        return driven
    caller = Caller(module, model)
    answers = [caller.call(_call(m, m.q)) for m in moves]
    poses = target_poses([m.event for m in moves], _on_work(moves, np.array([a.pose for a in answers])))
    for move, answer, pose in zip(moves, answers, poses, strict=True):
        target = move.event.target
        if answer.reason == 0 and isinstance(target, RobTarget):
            target = replace(target, trans=pose.trans, rot=pose.rot, robconf=answer.target.robconf)
        via = _circle_point(caller, model, move)
        driven[move.row] = replace(move.event, target=target, via=via)
    return driven


def _call(move: Move, q: Array, end: Array | None = None) -> FunctionCall:
    """Arguments of the correcting function for one target of a move.

    Args:
        q: (6,) joint angles [rad] at the target, or at the circle point of an arc.
        end: (6,) joint angles [rad] at the end of the arc; None if the target is no circle point.
    """
    event = move.event
    welding = event.statement.signature.phase in WELDING
    return FunctionCall(q, event.tool, event.gripload, welding, end, event.in_force.total_load)


def _circle_point(caller: Caller, model: Model, move: Move) -> RobTarget | None:
    """The circle point of a move as the function gives it; None without one."""
    via = move.event.via
    if via is None:
        return None
    q = nearest_solution(model.robot, mounts_of([move]).flange(via_matrix(move.event)[None])[0], move.q)
    if not np.isfinite(q).all():
        return via
    answer = caller.call(_call(move, q, move.q))
    if answer.reason != 0:
        return via
    (pose,) = target_poses([move.event], _on_work([move], answer.pose[None]))
    return replace(via, trans=pose.trans, rot=pose.rot)


def _on_work(moves: Sequence[Move], T_base_tcp: Array) -> Array:
    """Convert TCP poses (n, 4, 4) from the base frame to the frame of the work in each of n moves."""
    mounts = mounts_of(moves)
    return mounts.work(T_base_tcp @ invert(mounts.T_mount_tcp))
