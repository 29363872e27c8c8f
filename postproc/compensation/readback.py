"""The written program read back: which part of it belongs to which statement of the original, and what it drives.

Its confdata is read against the postures in which the arm comes to its targets.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from postproc.compensation.correction.deviation import Deviation, Driven, measure_deviation
from postproc.compensation.options import Options
from postproc.compensation.path.motion import feels_sides, motion_of
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.reading import OUT_OF_REACH, read_samples
from postproc.compensation.text.values import Insertion
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.model.arm import Model
from postproc.motion.findings import place
from postproc.motion.path.places import place_events
from postproc.motion.path.postures import POSTURE_DISTANCE
from postproc.motion.path.samples import Samples
from postproc.motion.values import Flags, Index, Move
from postproc.rapid.data.events import MotionEvent, StatementKey, executions_of
from postproc.rapid.data.records import RobTarget
from postproc.rapid.execution.interpreter import AddedMotions
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import Program, read_again
from postproc.robot.arm import Robot
from postproc.robot.cells.station import Station
from postproc.robot.configuration import confdata, quadrant_excess
from postproc.robot.inverse import COMPLIANT
from postproc.watch import Watch, reporting_progress

MOST_EVENTS = 2000  # events of the written program that are looked at together
OTHER_ARM = 0.2  # [rad] of axes 1 to 3 between two shoulders or elbows: no correction turns them that far
BENT_RAD = np.radians(6.0)  # |q5| from which on no correction turns axes 4 and 6 by ``OTHER_WRIST`` [rad]
OTHER_WRIST = 1.0
NEARBY = np.radians(15.0)  # that axes turn between a circle point and the nearest sample


def run_again(
    program: Program,
    drafts: Mapping[str, bytes],
    insertions: Sequence[Insertion],
    events: Sequence[MotionEvent],
    options: Options,
    *,
    station: Station | None = None,
) -> tuple[list[MotionEvent], list[int] | None]:
    """Follow the execution of the written program.

    Args:
        drafts: new content of the changed files, by path.
        insertions: the statements that were added.
        events: of the original program.
        options: of these the routine to start from counts.
        station: where the arm stands, and its external axes.

    Returns:
        Its events, and for each the index of the original event that it belongs to; None in place of the indices if the
        written program does not run the same statements as often.
    """
    written = read_again(program, drafts)
    # Of every statement of the text its original one, and whether it is that; added ones stand in front of theirs.
    count = Counter(i.statement.key for i in insertions)
    planned = [(s.key, stays) for s in program.statements for stays in [False] * count[s.key] + [True]]
    pairs = zip(written.statements, planned, strict=False)  # ``owners_of`` sees where there are not as many
    added = AddedMotions.between(program, written, (statement.key for statement, (_, stays) in pairs if not stays))
    ran = place_events(walk(written, options.entry, added), station or Station())
    if len(planned) != len(written.statements):
        return ran, None
    original = dict(zip((s.key for s in written.statements), planned, strict=True))
    ran = _without_unpaired(ran, original)
    return ran, owners_of(original, events, ran)


def _without_unpaired(
    ran: Sequence[MotionEvent], original: Mapping[StatementKey, tuple[StatementKey, bool]]
) -> list[MotionEvent]:
    """Events without those of added statements whose original statement does not run after them.

    Of a program too long to be followed entirely, only runs to new places are events; an added statement may then
    appear without the motion to whose goal it leads.

    Args:
        ran: events of the written program.
        original: for each statement of the written text its original, and whether it is that one or an added one.
    """
    kept, behind = [False] * len(ran), None
    for j in range(len(ran) - 1, -1, -1):
        key, is_original = original[ran[j].statement.key]
        kept[j] = is_original or key == behind
        behind = key if kept[j] else None
    at = np.cumsum(kept) - 1
    return [
        event if event.resumes_from is None else replace(event, resumes_from=int(at[event.resumes_from]))
        for event, stays in zip(ran, kept, strict=True)
        if stays
    ]


def owners_of(
    original: Mapping[StatementKey, tuple[StatementKey, bool]],
    events: Sequence[MotionEvent],
    ran: Sequence[MotionEvent],
) -> list[int] | None:
    """Index of the original event for every event of the written program; that of the next one for added statements.

    The n-th execution of a statement is that of its original; an event that only states where the arm resumes from
    belongs to the motion that starts there. None if the written program does not run the same statements as often.

    Args:
        original: for each statement of the written text its original, and whether it is that one or an added one.
        events: of the original program.
        ran: of the written program.
    """
    standing: dict[StatementKey, list[int]] = {}
    for i, event in enumerate(events):
        if event.resumes_from is not None:
            standing.setdefault(event.statement.key, []).append(i)
    runs = executions_of(events)
    met: defaultdict[tuple[StatementKey, bool], int] = defaultdict(int)
    owners, order = [-1] * len(ran), list[int]()
    for j, event in enumerate(ran):
        key, is_original = original[event.statement.key]
        resumes = event.resumes_from is not None
        if resumes and not is_original:
            continue
        rows, nth = (standing if resumes else runs).get(key, []), met[event.statement.key, resumes]
        if nth >= len(rows) or event.unreachable != events[rows[nth]].unreachable:
            return None
        met[event.statement.key, resumes] += 1
        if is_original and not resumes:
            order.append(rows[nth])
        owners[j] = rows[nth]
    every = {*chain(*runs.values(), *standing.values())}
    if every - {*owners} or -1 in owners[-1:] or order != sorted(order):
        return None
    for j in range(len(ran) - 2, -1, -1):
        owners[j] = owners[j] if owners[j] >= 0 else owners[j + 1]
    return owners


def changed_confdata(
    events: Sequence[MotionEvent], ran: Sequence[MotionEvent], owners: Sequence[int] | None
) -> frozenset[StatementKey]:
    """Statements of which a target or circle point has other confdata than the programmer wrote, in some run.

    Args:
        events: of the original program.
        ran, owners: events of the written program and their original events, from ``run_again``.
    """
    last = dict(zip(owners, ran, strict=True)) if owners is not None else {}  # added ones come before their own
    return frozenset(
        events[i].statement.key
        for i, event in last.items()
        for now, before in ((event.target, events[i].target), (event.via, events[i].via))
        if now is not None and isinstance(now, RobTarget) and isinstance(before, RobTarget)
        if now.robconf != before.robconf
    )


def deviations_of(
    model: Model,
    plan: CorrectionPlan,
    ran: Sequence[MotionEvent],
    owners: Sequence[int] | None,
    *,
    watch: Watch,
    step: tuple[str, float, float],
) -> list[tuple[Deviation, Deviation]]:
    """Deviations of the original and of the written program.

    The first pair is from the wanted path, the second one from the programmed path where that is another.

    Args:
        ran, owners: events of the written program and their original events, from ``run_again``.
        watch: is told the step and the share done so far; step: as of ``reporting_progress``.

    Raises:
        PostprocError: as ``drive``.
    """
    motion, pairs = plan.motion, []
    for curves in dict.fromkeys((motion.wanted, motion.samples)):
        before = measure_deviation(model, curves, [Driven(motion, np.arange(len(motion.moves)))])
        driven = drive(model, plan, ran, owners)
        watched = reporting_progress(driven, lambda part: len(part.owner) / len(motion.moves), watch, step)
        pairs.append((before, measure_deviation(model, curves, watched)))
    return pairs


def drive(
    model: Model, plan: CorrectionPlan, ran: Sequence[MotionEvent], owners: Sequence[int] | None
) -> Iterator[Driven]:
    """Samples and states of the written program, part by part, so that memory does not grow with the program.

    Args:
        ran, owners: events of the written program and their original events, from ``run_again``.

    Raises:
        PostprocError: the arm cannot run the written program, or it does not run what was planned; the diagnostics may
            be empty.
    """
    index = {move.row: i for i, move in enumerate(plan.motion.moves)}
    missing = Counter({i: 1 + len(plan.shares.get(i, ())) for i in index.values()})
    if owners is None:
        raise PostprocError([])
    edges = {i: (0.0, *shares, 1.0) for i, shares in plan.shares.items()}
    moves = plan.motion.moves
    # Where the arm stands after an added statement it does nothing: the part of the move comes after it.
    stands = [
        e.resumes_from is not None and (i not in index or moves[index[i]].resumes_from is None)
        for e, i in zip(ran, owners, strict=True)
    ]
    nth = np.zeros(len(owners), dtype=np.int64)  # how many parts of the same move have gone before
    gone: defaultdict[int, int] = defaultdict(int)
    for j, i in enumerate(owners):
        nth[j] = gone[i]
        gone[i] += not stands[j]
    # What the arm could not run before is no part of the plan, even where it can by now.
    moved = [e.reason is None and e.statement.interpolation != "none" for e in ran]
    lost = [moved[j] and i not in index for j, i in enumerate(owners)]
    ran = [replace(e, reason=OUT_OF_REACH) if lost[j] else e for j, e in enumerate(ran)]
    warnings: list[Diagnostic] = []
    # A side of approach may be as old as the program.
    for a, b in [(0, len(ran))] if feels_sides(model) else _parts(ran):
        begin = max(a - 1, 0)  # with the goal from which the part goes on
        part = [e if e.resumes_from is None else replace(e, resumes_from=e.resumes_from - begin) for e in ran[begin:b]]
        samples, findings = read_samples(model, part, plan.motion.options)
        errors = [d for d in findings if d.severity == "error"]
        if errors:
            raise PostprocError(errors)
        warnings += [d for d in findings if d.code.startswith("KIN")]
        if samples is None:
            continue
        at = begin + np.array([move.row for move in samples.moves])
        owner = np.array([index.get(owners[j], -1) for j in at])
        missing.subtract(i for i, k in zip(owner.tolist(), at.tolist(), strict=True) if k >= a and not stands[k])
        if (owner < 0).any():
            break
        span = [edges.get(i, (0.0, 1.0))[k : k + 2] for i, k in zip(owner.tolist(), nth[at].tolist(), strict=True)]
        if min(map(len, span)) < 2:
            break
        low, high = np.array(span).T
        unfit = unfit_confdata(model.robot, plan, samples, owner, high < 1.0)
        if unfit:
            raise PostprocError(unfit)
        place = owner[samples.move] + low[samples.move] + (high - low)[samples.move] * samples.u
        yield Driven(motion_of(model, samples, plan.motion.timeline, plan.motion.options, place), owner)
    if any(missing.values()):
        raise PostprocError(warnings)


def _parts(events: Sequence[MotionEvent]) -> Iterator[tuple[int, int]]:
    """Ranges [a, b) of ``MOST_EVENTS`` events or a few more, cut between motions of one tool, load and weld state."""
    # Nor does a way that goes on from an earlier event (``resumes_from``) lead from one part into another.
    back = [i if e.resumes_from is None else e.resumes_from for i, e in enumerate(events)]
    earliest = np.minimum.accumulate(back[::-1])[::-1]
    begin = 0
    for i in range(MOST_EVENTS, len(events)):
        if i - begin >= MOST_EVENTS and earliest[i - 1] >= i - 1 and _goes_on(events[i - 1], events[i]):
            yield begin, i
            begin = i
    yield begin, len(events)


def _goes_on(before: MotionEvent, event: MotionEvent) -> bool:
    """Whether a program can be cut between two consecutive motions, since the second starts as the first ends.

    Tool, load and weld state are the same, the configuration is monitored and the goal of the first is known.
    """
    same = before.tool == event.tool and before.gripload == event.gripload and before.weld == event.weld
    monitored = all(before.options.get(name) is not False for name in ("conf_l", "conf_j"))
    known = before.target is not None and before.reason is None
    kinds = {before.statement.interpolation, event.statement.interpolation}
    return same and monitored and known and kinds <= {"line", "arc", "joint"}


def unfit_confdata(robot: Robot, plan: CorrectionPlan, ran: Samples, owner: Index, added: Flags) -> list[Diagnostic]:
    """CMP022, an error, for each target whose confdata does not select the posture that the program has there.

    On lines and arcs that is the posture in which the arm comes; at every target of the original it is also that of the
    original. Where the confdata of the original does not fit already, nothing is said.

    Args:
        ran: of the written program; owner: (k,) index of the programmed move of each of its k moves.
        added: (k,) moves to targets that were added.
    """
    programmed = plan.motion.samples
    before = programmed.q[programmed.goal[owner]]
    fitted = np.abs(programmed.q_reached[owner] - before).max(axis=1) < POSTURE_DISTANCE
    comes = ~ran.curves.joint & (ran.goal > ran.start)
    selected = ran.q[ran.goal]
    unfit = comes & (np.abs(ran.q_reached - selected).max(axis=1) > POSTURE_DISTANCE) & (added | fitted)
    change = np.abs(selected - before)
    bent = np.abs(np.sin(selected[:, 4])) > np.sin(BENT_RAD)
    other = (change[:, :3].max(axis=1) > OTHER_ARM) | (bent & (change[:, 3:].max(axis=1) > OTHER_WRIST))
    unfit |= ~added & other
    moves = [(ran.moves[j], programmed.moves[owner[j]]) for j in np.flatnonzero(unfit)]
    return [_unfit(old, move.event.target) for move, old in moves] + [*_unfit_circle_points(robot, plan, ran, owner)]


def _unfit_circle_points(robot: Robot, plan: CorrectionPlan, ran: Samples, owner: Index) -> Iterator[Diagnostic]:
    """CMP022 for circle points with other confdata than in the original that is not that of the way past them."""
    for j, move in enumerate(ran.moves):
        via, old = move.event.via, plan.motion.samples.moves[owner[j]]
        if via is None or move.T_work_via is None or old.event.via is None or via.robconf == old.event.via.robconf:
            continue
        rows = slice(int(ran.start[j]), int(ran.goal[j]) + 1)
        nearest = np.argmin(np.linalg.norm(ran.T_work_tcp[rows, :3, 3] - move.T_work_via[:3, 3], axis=1))
        q, conf = ran.q[rows][[nearest]], np.array([via.robconf])
        arm = (confdata(robot, q)[:, 3] ^ conf[:, 3]) > 1
        if (arm | (quadrant_excess(q, conf) > COMPLIANT + NEARBY)).any():
            yield _unfit(old, via)


def _unfit(move: Move, target: object) -> Diagnostic:
    """CMP022 for a written target of a programmed move."""
    conf = [*target.robconf] if isinstance(target, RobTarget) else []
    text = f"the confdata {conf} of a written target would mean another posture than the arm has there"
    return Diagnostic("CMP022", "error", text, *place(move.event), "please report this program")
