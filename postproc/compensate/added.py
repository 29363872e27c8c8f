"""Statements to add: where a divided move gets its targets, and what runs of one statement can share of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.compensate.between import FUNCTIONS, between
from postproc.compensate.insertions import insertion_of, small_zone
from postproc.compensate.sharing import straight
from postproc.compensate.targets import Pieces
from postproc.compensate.texts import SAME_MM, same_value
from postproc.compensate.values import Displacement, Insertion, Place, TargetValue
from postproc.compensate.wishes import Wishes, conf_of, middle_value
from postproc.grouping import grouped
from postproc.motion.refusals import STILL
from postproc.rapid.program.events import StatementKey
from postproc.rapid.program.program import Program
from postproc.rapid.program.records import NO_AXIS, Ax6, RobTarget
from postproc.robot.configuration import confdata

NO_CONF = (0, 0, 0, 0)


def added_statements(
    wishes: Wishes,
    pieces: Sequence[Pieces],
    edited: Mapping[StatementKey, Place],
    program: Program,
    tolerance: float,
) -> tuple[list[Insertion], dict[int, str]]:
    """Statements to add; moves whose statement runs several times and would need different ones.

    Different is what differs by more than half of the tolerance [m], and cannot be shared either.

    Args:
        edited: where the targets of statements are written.
    """
    same = max(SAME_MM, 500.0 * tolerance)
    divided = {p.move: p for p in pieces if p.goals}
    moves = wishes.motion.moves
    runs = grouped((move.event.statement.key, i) for i, move in enumerate(moves) if move.again is None)
    found: list[Insertion] = []
    clashing: dict[int, str] = {}
    for group in runs.values():
        if not any(i in divided for i in group):
            continue
        first, *others = (_added(wishes, i, divided.get(i), program) for i in group)
        # Functions of the program's own by these names may calculate something else.
        module = moves[group[0]].event.statement.module
        named = None if any(program.routine(name, module) for name in FUNCTIONS) else edited
        if all(_same_insertions(first, other, same) for other in others):
            found += _tuned(wishes, group[0], divided[group[0]], first) if group[0] in divided else first
        elif shared := _shared(wishes, [divided.get(i) for i in group], [first, *others], named, same / 2):
            found += shared
        else:
            clashing.update({i: "it runs several times on different ways" for i in group})
    return found, clashing


def _added(wishes: Wishes, i: int, part: Pieces | None, program: Program) -> list[Insertion]:
    """The statements to add before one move."""
    if part is None:
        return []
    event = wishes.motion.moves[i].event
    goals = list(part.goals)
    confs = [conf_of(row) for row in confdata(wishes.robot, wishes.written.q[goals])]
    to = wishes.values([(i, wishes.curve[g], c) for g, c in zip(goals, confs, strict=True)])
    shares = wishes.motion.samples.u[goals].tolist()
    to = [replace(value, extax=_axes(wishes, i, share)) for value, share in zip(to, shares, strict=True)]
    vias = wishes.values([(i, wishes.curve[v], c) for v, c in zip(part.vias, confs, strict=False)])
    zone, parts = small_zone(program, event), np.diff(shares, prepend=0.0).tolist()
    return [insertion_of(event, t, vias[k] if vias else None, zone, parts[k]) for k, t in enumerate(to)]


def _tuned(wishes: Wishes, i: int, part: Pieces, added: Sequence[Insertion]) -> list[Insertion]:
    """The same displaced as the target behind them is by PERS data, or by a share of it where their start is not."""
    origins = [wishes.motion.moves[j].event.target_origin for j in (max(i - 1, 0), i)]
    before, terms = (() if origin.tuned is None else origin.tuned.terms for origin in origins)
    found = []
    for insertion, goal in zip(added, part.goals, strict=True):
        share = 1.0 if before == terms else float(wishes.motion.samples.u[goal])
        away, slopes = [0.0, 0.0, 0.0], []
        for axis, name, value in terms:
            away[axis] = share * value
            x, y, z = share * np.eye(3)[axis]
            slopes.append((name, (float(x), float(y), float(z))))
        pose = insertion.to.pose
        if slopes:
            x, y, z = np.subtract(pose.trans, away).tolist()
            to = replace(insertion.to, pose=replace(pose, trans=(x, y, z)), way=Displacement((0.0,) * 3, tuple(slopes)))
            insertion = replace(insertion, to=to)
        found.append(insertion)
    return found


def _axes(wishes: Wishes, i: int, share: float) -> Ax6:
    """Where the external axes are after a share of a move: they move evenly with it."""
    before, target = (wishes.motion.moves[j].event.target for j in (max(i - 1, 0), i))
    assert before is not None and target is not None
    a, b, c, d, e, f = (
        end if max(begin, end) >= NO_AXIS else round(begin + share * (end - begin), 3)
        for begin, end in zip(before.extax, target.extax, strict=True)
    )
    return a, b, c, d, e, f


def _shared(
    wishes: Wishes,
    parts: Sequence[Pieces | None],
    runs: Sequence[Sequence[Insertion]],
    edited: Mapping[StatementKey, Place] | None,
    least: float,
) -> list[Insertion] | None:
    """One set of statements for all runs of a statement, None where it would not halve what is off.

    Every target goes straight with the numbers by which the runs differ, in the middle of what is left, where the ways
    are parallel: on displaced work they are one; in layers they are displaced with the target. On other ways it stands
    between start and end (see ``between``).
    """
    divided = [part for part in parts if part is not None]
    if len(divided) < len(parts) or len({len(run) for run in runs}) > 1:
        return None
    events = [wishes.motion.moves[p.move].event for p in divided]
    ways, gaps = [_way(wishes, part) for part in divided], [_gap(wishes, part) for part in divided]
    if not all(same_value(a, b) for way in ways[1:] for a, b in zip(ways[0], way, strict=True)):
        return None if edited is None else between(wishes, divided, runs, edited, gaps, least)
    numbers = [dict(event.numbers) for event in events]
    if any(event.target != events[0].target for event in events):
        # Coordinates of targets are corrected themselves: what goes with them as a whole would be corrected twice.
        numbers = [{name: value for name, value in run.items() if ".trans." not in name} for run in numbers]
    most = [min(max(gaps) / 2, max(gap, least)) for gap in gaps]
    found = []
    for insertions in zip(*runs, strict=True):
        to = _straight(wishes, [i.to for i in insertions], numbers, most)
        circles = [i.via for i in insertions if i.via is not None]
        via = _straight(wishes, circles, numbers, most) if circles else None
        if to is None or (circles and via is None):
            return None
        found.append(replace(insertions[0], to=to, via=via))
    return found


def _way(wishes: Wishes, part: Pieces) -> list[TargetValue]:
    """Programmed poses where targets are added, positions from the move's own target on, axes of the object frame."""
    target = wishes.motion.moves[part.move].event.target
    assert isinstance(target, RobTarget)
    found = []
    for value in wishes.values([(part.move, T, NO_CONF) for T in wishes.motion.samples.T_work_tcp[list(part.goals)]]):
        x, y, z = np.subtract(value.pose.trans, target.trans).tolist()
        found.append(replace(value, pose=replace(value.pose, trans=(x, y, z))))
    return found


def _straight(
    wishes: Wishes, values: Sequence[TargetValue], numbers: Sequence[dict[str, float]], most: Sequence[float]
) -> TargetValue | None:
    """A target that goes straight with numbers, None where a run would lack more than its ``most`` [mm]."""
    middle = middle_value(values)
    places = np.array([value.pose.trans for value in values])
    way = straight(numbers, places, wishes.least)
    lacks = np.linalg.norm(places - [way.at(run) for run in numbers], axis=1)
    alike = all(v.robconf == middle.robconf and _still(v.extax, middle.extax) for v in values)
    if (lacks > most).any() or not alike:
        return None
    pose = replace(middle.pose, trans=way.constant)
    return replace(middle, pose=pose, way=replace(way, constant=(0.0, 0.0, 0.0)) if way.slopes else None)


def _gap(wishes: Wishes, part: Pieces) -> float:
    """How far [mm] the correction is from its chord at the targets to add: what stays off without them."""
    samples, goals, i = wishes.motion.samples, list(part.goals), part.move
    shift = wishes.curve[:, :3, 3] - samples.T_work_tcp[:, :3, 3]
    u = samples.u[goals][:, None]
    gaps: Array = (1 - u) * shift[samples.start[i]] + u * shift[samples.goal[i]] - shift[goals]
    return 1e3 * float(np.linalg.norm(gaps, axis=1).max())


def _still(a: Ax6, b: Ax6) -> bool:
    return bool(np.abs(np.subtract(a, b)).max() <= STILL)


def _same_insertions(a: Sequence[Insertion], b: Sequence[Insertion], within_mm: float) -> bool:
    if len(a) != len(b):
        return False
    for x, y in zip(a, b, strict=True):
        if not same_value(x.to, y.to, within_mm) or (x.via is None) != (y.via is None) or x.duration != y.duration:
            return False
        if not _still(x.to.extax, y.to.extax):
            return False
        if x.via is not None and y.via is not None and not same_value(x.via, y.via, within_mm):
            return False
    return True
