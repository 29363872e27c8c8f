"""Targets on a line or arc whose ends have names: calls of a function that is written into the program.

    MoveL ppLinePoint(pStart,pGoal,0.25,0.012,-0.03,0.007),v50,z1,tT;

goes to the point after a quarter of the line, displaced by the correction, wherever the ends are taught
(templates/line_point.j2, arc_point.j2). Orientation, configuration and external axes are those of the ends, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensation.text.laws import Allowed, OffsetLaw, constant_law, fit_affine, nearest_law
from postproc.compensation.text.values import Change, Conf, Insertion, PathPoint, TargetValue, compliant
from postproc.motion.path.curves import circle_through
from postproc.motion.path.postures import any_configuration
from postproc.motion.path.refusals import STILL
from postproc.rapid.data.builtins import FUNCTIONS
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import NO_AXIS, RobTarget
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.tokens import identifiers
from postproc.rapid.syntax.trees import Call, Star, nodes
from postproc.rapid.unknown import Unknown
from postproc.robot.cells.cell import LETTERS

UNLIKE = "it runs several times on different ways"
OTHER_POSTURE = "in its middle the arm has the configuration of neither end"
OTHER_AXES = "its ends do not say how external axes move along it"
HIDDEN = "the program has a name of its own for `{}`, which a target between its ends needs"
SHARE_DECIMALS = 5
# The functions of a point on a line, in the configuration of its nearer end, of its first end, and of that some quarter
# turns on; first with a constant displacement, then with one that goes with the square of the length. Those of an arc.
LINE_FUNCTIONS = "ppLinePoint", "ppLineKeep", "ppLineConf", "ppLineBend", "ppBendKeep", "ppBendConf"
ARC_FUNCTIONS = "ppArcPoint", "ppArcKeep", "ppArcConf"
NEARER, FIRST, TURNED = range(3)
# What the functions call and declare (templates/line_point.j2, arc_point.j2).
LINE_NAMES = ("ATan2", "Sqrt", "Sin", "robtarget", "confdata", "num")
ARC_NAMES = ("DotProd", "ATan2", "Sqrt", "Sin", "Cos", "Abs", "robtarget", "confdata", "orient", "pos", "num")


@dataclass(frozen=True, slots=True)
class PathRun:
    """One execution of a divided line or arc.

    Args:
        texts: expressions of start and goal, for an arc with the circle point between them.
        targets: their values after the correction of the numbers that they come from.
        shares: fractions of the way at the added goals; via_shares: at the circle points, one more.
    """

    event: MotionEvent
    texts: tuple[str, ...]
    targets: tuple[RobTarget, ...]
    shares: Array
    via_shares: Array

    @property
    def points(self) -> Array:
        """(2, 3) start and goal, or (3, 3) with the circle point between them [mm]."""
        return np.array([target.trans for target in self.targets])


def free_names(program: Program, names: Iterable[str]) -> list[str]:
    """For each name one that no identifier of the program equals: ``name``, or ``name2``, ``name3``, .."""
    taken = set[str]().union(*(identifiers(source.data) for source in program.sources))
    numbered = ((name, *(f"{name}{k}" for k in range(2, 1000))) for name in names)
    return [next(name for name in several if name.lower() not in taken) for several in numbered]


def hidden_name(program: Program, module: str, arc: bool) -> str | None:
    """Why a function that calculates a point of a line or arc cannot be written into a module, None if it can.

    The reason is a built-in name, needed by the function, that the program declares itself.

    Args:
        module: name of the module.
        arc: the point is on an arc, not on a line.
    """
    hidden = (name for name in (ARC_NAMES if arc else LINE_NAMES) if program.hides(name, module, ""))
    return next((HIDDEN.format(name) for name in hidden), None)


def argument_text(text: str, program: Program, module: str) -> str | None:
    """A target expression on one line for use in a call; None if evaluating it several times could have an effect.

    Args:
        text: the expression as it stands in the module.
    """
    text = " ".join(text.split())
    data = text.encode("latin-1")
    try:
        tree = read_whole_expression(data, 0, len(data)) if "!" not in text else None
    except Unknown:
        return None
    if tree is None or any(isinstance(part, Star) for part in nodes(tree)):
        return None
    called = [part.name for part in nodes(tree) if isinstance(part, Call)]
    pure = all(name in FUNCTIONS and program.routine(name, module) is None for name in called)
    return text if pure else None


def on_line(
    functions: Sequence[str], runs: Sequence[PathRun], added: Sequence[Sequence[Insertion]], allowed: Allowed
) -> list[Insertion] | str:
    """Added statements for all runs of a line, or the reason why there are none.

    Args:
        functions: the names that the program has for ``LINE_FUNCTIONS``.
        added: what each run would add as numbers.
        allowed: how far off [mm] an added target may be in each run.
    """
    found = []
    for k, insertions in enumerate(zip(*added, strict=True)):
        share = _share(runs, k)
        to = _added_point(functions, runs, [i.to for i in insertions], [share] * len(runs), allowed)
        if isinstance(to, str):
            return to
        found.append(replace(insertions[0], to=to))
    return found


def _added_point(
    functions: Sequence[str],
    runs: Sequence[PathRun],
    values: Sequence[TargetValue],
    shares: Sequence[float],
    allowed: Allowed,
) -> TargetValue | str:
    """One added target of all runs with confdata and external axes of its ends, or the reason why there is none.

    Args:
        functions: the names that the program has for ``LINE_FUNCTIONS`` or ``ARC_FUNCTIONS``.
        values: the target that each run requires.
        shares: fraction of the way at it in each run.
        allowed: error that a formula for the displacement may leave in each run.
    """
    share = round(float(np.median(shares)), SHARE_DECIMALS)
    if any(not _same_axes(run.targets, value, own) for run, value, own in zip(runs, values, shares, strict=True)):
        return OTHER_AXES
    configured = _configuration(runs, values, share)
    if configured is None:
        return OTHER_POSTURE
    which, turns = configured
    to = _on_path(functions[which::3], runs, values, shares, allowed)
    if to is None or to.point is None:
        return UNLIKE
    point = replace(to.point, keeps=which != NEARER, turns=turns)
    if (which == FIRST) == (share < 0.5) and which != NEARER:
        # The way backwards: its first end is the one whose configuration counts.
        point = replace(point, ends=point.ends[::-1], share=round(1.0 - share, SHARE_DECIMALS))
    return replace(to, point=point)


def _configuration(
    runs: Sequence[PathRun], values: Sequence[TargetValue], share: float
) -> tuple[int, Conf | None] | None:
    """From which end of the line or arc, in all runs, an added target has its confdata.

    Args:
        values: the added target of each run, with the confdata of the posture that the arm has there.

    Returns:
        NEARER (of both ends) or FIRST (the farther end, which is then stated first), and None; or TURNED, and what is
        to be added to the nearer end's: quarter turns of axes 1, 4 and 6, and 1 where axis 5 has the other sign. None
        if no end of some run has a configuration that a controller accepts.
    """
    near, far = (0, -1) if share < 0.5 else (-1, 0)
    pairs = list(zip(runs, values, strict=True))
    if all(value.robconf == run.targets[near].robconf for run, value in pairs):
        return NEARER, None
    if all(value.robconf == run.targets[far].robconf for run, value in pairs):
        return FIRST, None
    turns = {_quarter_turns(run.targets[near].robconf, value.robconf) for run, value in pairs}
    if len(turns) == 1 and None not in turns:
        return TURNED, turns.pop()
    accepted = (any_configuration(r.event) or compliant(v.robconf, r.targets[near].robconf) for r, v in pairs)
    return (NEARER, None) if all(accepted) else None


def _quarter_turns(start: Conf, there: Conf) -> Conf | None:
    """Quarter turns of axes 1, 4 and 6 from one confdata to the other, and 1 where axis 5 has the other sign.

    None where shoulder or elbow differ. They are the same for targets taught anew with the other wrist: axes 4 and 6 of
    the whole line are then half a turn on.
    """
    other = start[3] ^ there[3]
    return (there[0] - start[0], there[1] - start[1], there[2] - start[2], other) if other < 2 else None


def on_arc(
    functions: Sequence[str],
    runs: Sequence[PathRun],
    added: Sequence[Sequence[Insertion]],
    last: Sequence[TargetValue],
    allowed: Allowed,
) -> tuple[list[Insertion], Change] | str:
    """Added statements for all runs of an arc, and the change of the circle point that its own statement states.

    The reason why there are none, if no displacement or configuration of some point suits all runs.

    Args:
        functions: the names that the program has for ``ARC_FUNCTIONS``.
        added: what each run would add as numbers.
        last: the circle point of the last part in each run.
        allowed: how far off [mm] an added target may be in each run.
    """
    found = []
    for k, insertions in enumerate(zip(*added, strict=True)):
        to = _added_point(functions, runs, [i.to for i in insertions], [run.shares[k] for run in runs], allowed)
        if isinstance(to, str):
            return to
        vias = [i.via for i in insertions if i.via is not None]
        # The configuration of a circle point means nothing.
        via = _on_path(functions[:1], runs, vias, [run.via_shares[k] for run in runs], allowed)
        if via is None:
            return UNLIKE
        found.append(replace(insertions[0], to=to, via=via))
    left = _on_path(functions[:1], runs, last, [run.via_shares[-1] for run in runs], allowed)
    statement = runs[0].event.statement
    argument = statement.argument("via")
    if left is None or argument is None:
        return UNLIKE
    return found, Change(statement.source, argument.span, "offset", left, left.law)


def _share(runs: Sequence[PathRun], k: int) -> float:
    """Median fraction of the way, over all runs of a line, at the k-th added goal, rounded to 5 decimals."""
    return round(float(np.median([run.shares[k] for run in runs])), SHARE_DECIMALS)


def _on_path(
    functions: Sequence[str],
    runs: Sequence[PathRun],
    values: Sequence[TargetValue],
    shares: Sequence[float],
    allowed: Allowed,
) -> TargetValue | None:
    """One added target of all runs as a call of a function, None if no displacement suits all runs.

    Args:
        functions: names for a constant displacement, and for one proportional to the square of the length.
        runs: executions of the divided line or arc.
        values: the target that each run requires.
        shares: fraction of the way at it in each run.
        allowed: error that a formula for the displacement may leave in each run.
    """
    share = round(float(np.median(shares)), SHARE_DECIMALS)
    points = [point_at(run.points, own) for run, own in zip(runs, shares, strict=True)]
    offsets = np.array([value.pose.trans for value in values]) - points
    law, length = _law(runs, offsets, allowed)
    if law is None:
        return None
    ends = [target for run in runs for target in run.targets]
    axes = "".join(a for k, a in enumerate(LETTERS) if any(target.extax[k] < NO_AXIS for target in ends))
    return replace(values[0], point=PathPoint(functions[length > 0], runs[0].texts, share, axes, length), law=law)


def _law(runs: Sequence[PathRun], offsets: Array, allowed: Allowed) -> tuple[OffsetLaw | None, int]:
    """Displacement of a point in all runs (None if none suits), and the line length [mm] it holds for, 0 for any.

    A displacement that holds for one length is to be multiplied by the square of the ratio of lengths.

    Args:
        runs: executions of the divided line or arc.
        offsets: (n, 3) that the runs require [mm].
        allowed: error that a formula may leave in each run.
    """
    law = nearest_law(_laws(runs, offsets, allowed), allowed)
    lengths = np.linalg.norm([run.points[-1] - run.points[0] for run in runs], axis=1)
    if law is not None or len(runs[0].points) > 2 or np.ptp(lengths) < 1.0:
        return law, 0
    length = round(float(lengths.max()))
    bends = ((lengths / length) ** 2)[:, None]
    x, y, z = ((bends * offsets).sum(axis=0) / (bends**2).sum()).tolist()
    return nearest_law([(OffsetLaw((x, y, z)), offsets - bends * (x, y, z))], allowed), length


def _laws(runs: Sequence[PathRun], offsets: Array, allowed: Allowed) -> Iterator[tuple[OffsetLaw, Array]]:
    """A constant and an affine formula for the offsets (n, 3) [mm], each with the error (n, 3) that it leaves.

    The affine one does not use coordinates of the ends, from which the function calculates already.

    Args:
        runs: executions of the divided line or arc.
        allowed: error up to which the affine formula is simplified.
    """
    yield constant_law(offsets)
    # The function works with the coordinates of both ends already.
    regressors = [{n: v for n, v in run.event.numbers if n.partition(".trans.")[0] not in run.texts} for run in runs]
    law = fit_affine(regressors, offsets, allowed.fine)
    yield law, offsets - [law.at(numbers) for numbers in regressors]


def _same_axes(ends: Sequence[RobTarget], value: TargetValue, share: float) -> bool:
    """Whether external axes that move evenly between both ends are at the added target's values at that fraction."""
    start, goal = (np.array(end.extax) for end in (ends[0], ends[-1]))
    return bool((np.abs(start + share * (goal - start) - value.extax) <= STILL).all())


def point_at(points: Array, share: float) -> Array:
    """(3,) point at a fraction of the line between two points (2, 3), or of the arc through three (3, 3)."""
    if len(points) < 3:
        along: Array = points[0] + share * (points[1] - points[0])
        return along
    start, via, goal = points[:, None]
    center, radial, tangent, angle, _, _ = circle_through(start, via, goal)
    along = (center + np.cos(share * angle) * radial + np.sin(share * angle) * tangent)[0]
    return along
