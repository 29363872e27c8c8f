"""The check in several worlds: whatever the text leaves open, original and corrected program make the same motions.

Both are followed with the same inputs, operator data, effects of unseen routines and touched-up targets.  Each motion
of the original must come again, in the same order, its goal no farther away than its correction; a goal that was added
lies on the way of the original.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensation.judgement.bounds import Bound, largest_corrections
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.text.values import StatementOutcome
from postproc.diagnostics import Diagnostic
from postproc.motion.path.curves import circle_through
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.data.records import Quat, RobTarget
from postproc.rapid.execution.follower import WorldMotion, follow
from postproc.rapid.execution.interpreter import AddedMotions
from postproc.rapid.execution.worlds import World
from postproc.rapid.flow.steps import StepReader, comes_back
from postproc.rapid.motions.units import MM, object_matrix
from postproc.rapid.program.program import Program, read_again
from postproc.rapid.program.write_effects import WriteEffects

SEEDS = range(1, 6)
ROUNDING_MM, ROUNDING_RAD = 0.003, 1e-5  # of numbers with three decimals and what single precision adds
MOST_WORDS = 100
_TEXT = re.compile(rb'"([^"\n]{1,80})"')
NO_CORRECTION = Bound()


@dataclass(frozen=True, slots=True)
class Worlds:
    """Number of worlds in which the programs were compared, and of those in which they differed.

    A world is one choice of all that the text leaves open: inputs, operator data, unknown values.
    """

    count: int
    differing: int


def depends_on_run_time(events: Sequence[MotionEvent]) -> bool:
    """Whether something that the text does not state (inputs, unknown data) decides on what a program does."""
    return any(
        event.conditional
        or event.assumed
        or event.unknowns
        or event.unreachable
        or event.target_origin.kind == "expression"
        for event in events
    )


def check_written(
    program: Program,
    events: Sequence[MotionEvent],
    drafts: Mapping[str, bytes],
    plan: CorrectionPlan,
    outcomes: Sequence[StatementOutcome],
) -> tuple[Worlds, list[Diagnostic]]:
    """Compare the written program with the original in several worlds, as ``check_worlds`` does.

    A world is one choice of all that the text leaves open. Nothing is compared if the text determines all ways and
    targets of the program.

    Args:
        events: all of the program.
        drafts: text of the written files by path.
        outcomes: what has become of its statements.
    """
    if not depends_on_run_time(events) and not plan.arrivals.open:
        return Worlds(0, 0), []
    added = Counter(insertion.statement.key for insertion in plan.insertions)
    bounds = largest_corrections(outcomes, plan)
    return check_worlds(program, read_again(program, drafts), added, bounds, plan.motion.options.entry)


def check_worlds(
    program: Program,
    written: Program,
    added: Mapping[StatementKey, int],
    bounds: Mapping[StatementKey, Bound],
    entry: str | None = None,
) -> tuple[Worlds, list[Diagnostic]]:
    """Follow the original and the written program in every world: one choice of all that the text leaves open.

    Args:
        added: how many statements were added before each statement of the original.
        bounds: largest corrections of the statements that have one.
        entry: routine where both begin.

    Returns:
        Number of worlds and of those with a difference, and CMP019 at the statements of the original that differ.
    """
    numbers = {s.key: i for i, s in enumerate(program.statements)}
    planned = [key for s in program.statements for key in [None] * added.get(s.key, 0) + [s.key]]
    own = {s.key: numbers[key] for s, key in zip(written.statements, planned, strict=False) if key is not None}
    effects = WriteEffects(program), WriteEffects(written)
    steps = StepReader(program, effects[0])
    returning = [r for r in program.all_routines() if r.kind == "TRAP" and comes_back(r, steps)]
    inside = {(r.source.path, r.module.lower(), r.name.lower()) for r in returning}
    traps = {s.key for s in program.statements if (s.source.path, s.module.lower(), s.routine.lower()) in inside}
    taught = frozenset(d.key for d in program.declarations)
    routines = AddedMotions.between(program, written)
    pairing = Pairing(own, numbers, bounds, traps)
    words = sorted({m[1].decode("latin-1") for s in program.sources for m in _TEXT.finditer(s.data)})[:MOST_WORDS]
    findings: dict[StatementKey, Diagnostic] = {}
    differing = 0
    for seed in SEEDS:
        before = follow(program, entry, World(seed, taught, words), numbers, effects[0])
        after = follow(written, entry, World(seed, taught, words), own, effects[1], routines)
        found = list(_differences(before, after, pairing))
        differing += bool(found)
        for motion, text in found:
            findings.setdefault(motion.statement.key, _finding(motion, text))
    return Worlds(len(SEEDS), differing), list(findings.values())


def _finding(motion: WorldMotion, text: str) -> Diagnostic:
    """CMP019, an error at the statement: the corrected program differs there in the way that ``text`` says."""
    help_ = "nothing is written; please report this program"
    statement = motion.statement
    return Diagnostic(
        "CMP019", "error", f"where run-time data differs, the corrected program {text}", statement.source,
        statement.span, help_,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Pairing:
    """Which statement of the written program is which one of the original.

    Args:
        own: number in the original of each statement of the written program that was not added.
        numbers: number of each statement of the original.
        bounds: largest corrections of the original's statements.
        traps: statements in trap routines that bring the arm back to where it was.
    """

    own: Mapping[StatementKey, int]
    numbers: Mapping[StatementKey, int]
    bounds: Mapping[StatementKey, Bound]
    traps: Set[StatementKey]


def _differences(
    before: Sequence[WorldMotion], after: Sequence[WorldMotion], pairing: Pairing
) -> Iterator[tuple[WorldMotion, str]]:
    """Motions of the original that the written program does not make, each with what it does instead.

    Args:
        before, after: motions of the original and of the written program in one world, in the order of execution.
    """
    own, numbers, bounds = pairing.own, pairing.numbers, pairing.bounds
    at, last = 0, None
    largest = max((bound.mm for bound in bounds.values()), default=0.0)  # of an added goal, too
    for motion in before:
        extra: list[WorldMotion] = []
        while at < len(after) and after[at].statement.key not in own:
            extra.append(after[at])
            at += 1
        if at == len(after) or own[after[at].statement.key] != numbers[motion.statement.key]:
            yield motion, "does not come to this statement, or comes to another first"
            return
        bound = bounds.get(motion.statement.key, NO_CORRECTION)
        last = last if motion.begins is None else replace(motion, target=motion.begins)
        text = _difference(last, motion, after[at], bound)
        off = max((_off_way(last, motion, goal) for goal in extra), default=0.0)
        if text:
            yield motion, text
        elif off > largest + ROUNDING_MM:
            yield motion, f"goes {off:.3f} mm off its way first"
        # A trap leads the arm away and back: the way goes on from where it was.
        last = last if motion.statement.key in pairing.traps else motion
        at += 1
    if any(motion.statement.key in own for motion in after[at:]):
        yield before[-1] if before else after[at], "goes on behind this statement"


def _difference(start: WorldMotion | None, before: WorldMotion, after: WorldMotion, bound: Bound) -> str:
    """What a motion of the written program does differently from its original, as text; empty if nothing.

    Args:
        start: the motion before it in the original, at whose goal an arc begins; None if not known.
        bound: largest correction of the statement.
    """
    if (before.wobj, before.displacement) != (after.wobj, after.displacement):
        return "goes there in another frame"
    if before.tool != after.tool:
        return "goes there with another tool"
    a, b = before.target, after.target
    most = bound.at(a.trans) if isinstance(a, RobTarget) else bound.mm
    aside, allowed = _off_arc(start, before, after), 2.0 * max(most, bound.way)
    if aside > allowed + ROUNDING_MM:
        return f"goes {aside:.3f} mm beside the original's arc, and its correction may make {allowed:.3f} mm"
    if not isinstance(a, RobTarget) or not isinstance(b, RobTarget):
        return "has another target" if a != b else ""
    apart, turned = math.dist(a.trans, b.trans), _angle(a.rot, b.rot)
    if apart > most + ROUNDING_MM:
        return f"goes {apart:.3f} mm from where the original goes, its correction is {most:.3f} mm"
    if turned > bound.rad + ROUNDING_RAD:
        return f"turns the tool by {math.degrees(turned):.4f} degrees"
    return "moves the external axes elsewhere" if a.extax != b.extax else ""


def _off_arc(start: WorldMotion | None, before: WorldMotion, after: WorldMotion) -> float:
    """Distance [mm] of the new circle point from the original's arc, anywhere on it; 0 without circle points.

    If the start of the arc is not known, it is the distance of the two circle points.

    Args:
        start: the motion before the original's one, to the start of the arc.
    """
    if before.via is None or after.via is None:
        return 0.0
    places = [np.array(t.trans) for t in (before.via, after.via)]
    apart = float(np.linalg.norm(places[1] - places[0]))
    begin = start.target if start is not None and start.wobj == before.wobj else None
    if not isinstance(begin, RobTarget) or not isinstance(before.target, RobTarget):
        return apart
    ends = np.array([begin.trans, before.target.trans])
    center, radial, tangent, *_ = circle_through(ends[:1], places[0][None], ends[1:])
    normal = np.cross(radial[0], tangent[0])
    normal /= max(float(np.linalg.norm(normal)), 1e-12)
    away = places[1] - center[0]
    up = float(away @ normal)
    flat = float(np.linalg.norm(away - up * normal))
    return min(apart, math.hypot(up, flat - float(np.linalg.norm(radial[0]))))


def _angle(a: Quat, b: Quat) -> float:
    """Angle between two orientations [rad]; q and -q are one."""
    return 4.0 * math.asin(min(1.0, min(math.dist(a, b), math.dist(a, [-x for x in b])) / 2.0))


def _off_way(start: WorldMotion | None, motion: WorldMotion, extra: WorldMotion) -> float:
    """Distance [mm] of an added goal from the straight line of the original motion; 0 for motions that are no line.

    Args:
        start: the motion before the original's one, to the start of the line; 0 is returned if it is not known.
        extra: the motion to the added goal.
    """
    if start is None or motion.statement.interpolation != "line":
        return 0.0
    places = [_in_base(m) for m in (start, motion, extra)]
    if any(place is None for place in places):
        return 0.0
    a, b, x = (place for place in places if place is not None)
    way = b - a
    along = float(np.clip((x - a) @ way / max(float(way @ way), 1e-12), 0.0, 1.0))
    return float(np.linalg.norm(x - a - along * way)) / MM


def _in_base(motion: WorldMotion) -> Array | None:
    """The goal of a motion in base axes, (3,) [m]; None if it is no robtarget or the tool is stationary."""
    if not isinstance(motion.target, RobTarget) or motion.wobj is None or motion.tool is None:
        return None
    if not motion.tool.robhold or motion.wobj.robhold:
        return None
    place = np.array([*motion.target.trans, 1.0 / MM]) * MM
    return np.asarray(object_matrix(motion.wobj, motion.displacement) @ place)[:3]
