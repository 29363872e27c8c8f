"""Targets between two places that a program names: one text for runs of a line from other places each time.

What is off between the corrected ends of a line grows with the square of its length (the correction bends evenly), so

    P = E + s (S - E) + k |S - E|^2

serves all runs, with s the share of the way that is left and one k; where they run in unlike directions, in which the
correction bends differently, with squares of (S - E) along the axes beside that. It is written with what the program
itself calls the start S and the end E, in a loop along an array the element before:
``Offs(pE{i},0.5*(pS{i}.trans.x-pE{i}.trans.x)+0.21*Pow(Distance(..)/1000,2),..)``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations_with_replacement

import numpy as np

from postproc.arrays import Array
from postproc.compensate.sharing import APART, CANCELLING, straight
from postproc.compensate.targets import Pieces
from postproc.compensate.values import UNCHANGED_MM, Displacement, Insertion, Place, TargetValue
from postproc.compensate.wishes import Wishes
from postproc.motion.refusals import STILL
from postproc.rapid.motions.regressors import NAME
from postproc.rapid.program.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.program.records import Pose, RobTarget, Vec3

FUNCTIONS = ("pow", "distance")  # of RAPID, by which it is written
TURNED = 1e-3  # of a quaternion, 0.1 deg: what is added is turned as the end is
NAMED = frozenset({"declaration", "element", "call"})  # what the program calls the target then holds the corrected one
SHARE_DECIMALS, BEND_DECIMALS = 3, 4
PAIRS = tuple(combinations_with_replacement("xyz", 2))

_NO_CODE = re.compile(rb"(?:\s|![^\n]*)*")
_COMMA = re.compile(_NO_CODE.pattern + b"," + _NO_CODE.pattern)


def between(
    wishes: Wishes,
    parts: Sequence[Pieces],
    runs: Sequence[Sequence[Insertion]],
    edited: Mapping[StatementKey, Place],
    gaps: Sequence[float],
    least: float,
) -> list[Insertion] | None:
    """One set of statements for lines between the targets of two statements; None where it would not halve what is off.

    Args:
        parts: how the runs are divided; runs: what each would add alone; edited: where targets are written.
        gaps: what stays off without them in each run; least: what always may [mm].
    """
    names = [_names(wishes, part.move, edited) for part in parts]
    common = min(names[0].intersection(*names[1:]), default=None)
    if common is None:
        return None
    start, end, taught = common
    events = [wishes.motion.moves[part.move].event for part in parts]
    ends = [_ends(wishes, part.move, taught) for part in parts]
    ways = np.array([np.subtract(start.pose.trans, end.pose.trans) for start, end in ends])
    found = []
    for insertions in zip(*runs, strict=True):
        # Where the runs are in different configurations there is none: the others keep most of what is off.
        base = next((k for k in (1, 0) if all(map(_alike, [i.to for i in insertions], [e[k] for e in ends]))), None)
        if base is None:
            continue
        on = np.array([np.subtract(i.to.pose.trans, e[1].pose.trans) for i, e in zip(insertions, ends, strict=True)])
        shares = np.sum(on * ways, axis=1) / np.sum(ways**2, axis=1)
        share = round(float(np.median(shares)), SHARE_DECIMALS)
        squares = _squares(start, end, ways)
        if taught:  # it lacks the whole correction
            numbers = [{**dict(e.numbers), **{k: v[n] for k, v in squares.items()}} for n, e in enumerate(events)]
            beside = straight(numbers, on - share * ways, least)
            rest = on - share * ways - [beside.at(run) for run in numbers]
        else:
            bends, rest = _bent(squares, on - shares[:, None] * ways, least)  # across the way; along it nothing is off
            beside = Displacement((0.0, 0.0, 0.0), bends)
        lacks = np.linalg.norm(rest, axis=1)
        if lacks.max() > max(gaps) / 2 or any(lack > max(gap, least) for lack, gap in zip(lacks, gaps, strict=True)):
            return None
        along = _along(start, end, share - (not base))
        to = replace(insertions[0].to, way=replace(beside, slopes=(*along, *beside.slopes)))
        found.append(replace(insertions[0], to=to, base=(start, end)[base]))
    return found or None


def _squares(start: str, end: str, ways: Array) -> dict[str, Array]:
    """Squares [m^2] of the ways (n, 3) [mm], as RAPID writes them: of the length, and of the parts along the axes."""
    way = {axis: f"{start}.trans.{axis}-{end}.trans.{axis}" for axis in "xyz"}
    part = dict(zip("xyz", 1e-3 * ways.T, strict=True))
    found: dict[str, Array] = {f"Pow(Distance({start}.trans,{end}.trans)/1000,2)": 1e-6 * np.sum(ways**2, axis=1)}
    for a, b in PAIRS:
        term = f"Pow(({way[a]})/1000,2)" if a == b else f"({way[a]})*({way[b]})/1000000"
        found[term] = part[a] * part[b]
    return found


def _bent(squares: Mapping[str, Array], bent: Array, least: float) -> tuple[tuple[tuple[str, Vec3], ...], Array]:
    """What is off aside (n, 3) [mm] by squares of the ways, and what is left of it.

    The length does for ways in like directions; a square of axes has to take half of what is left.
    """

    def fitted(names: Sequence[str]) -> tuple[dict[str, Array], Array]:
        matrix = np.stack([squares[name] for name in names], axis=1)
        bends = np.round(np.linalg.lstsq(matrix, bent, rcond=APART)[0], BEND_DECIMALS)
        most = np.abs(matrix).max(axis=0)[:, None] * np.abs(bends)
        bends[most < UNCHANGED_MM] = 0.0
        steep = len(names) > 1 and most.max() > CANCELLING * np.abs(bent).max()
        return dict(zip(names, bends, strict=True)), np.full_like(bent, np.inf) if steep else bent - matrix @ bends

    best = fitted([next(iter(squares))])
    while np.abs(best[1]).max() > least and len(best[0]) < len(bent):
        more = [fitted([*best[0], name]) for name in squares if name not in best[0]]
        more.sort(key=lambda found: float(np.abs(found[1]).max()))
        if np.abs(more[0][1]).max() > np.abs(best[1]).max() / 2:
            break
        best = more[0]
    return tuple((name, (float(x), float(y), float(z))) for name, (x, y, z) in best[0].items()), best[1]


def _along(start: str, end: str, share: float) -> Iterator[tuple[str, Vec3]]:
    """A share of the way from end to start."""
    for axis, (x, y, z) in zip("xyz", (share * np.eye(3)).tolist(), strict=True):
        yield f"({start}.trans.{axis}-{end}.trans.{axis})", (x, y, z)


def _names(wishes: Wishes, i: int, edited: Mapping[StatementKey, Place]) -> set[tuple[str, str, bool]]:
    """What the program may call the start and the end of a line, and whether these texts hold the targets as taught.

    Both hold the corrected targets, or both, as variables that the program computes, are displaced where they are used.
    """
    if i == 0 or wishes.motion.samples.curves.arc[i]:
        return set()
    before, move = wishes.motion.moves[i - 1], wishes.motion.moves[i]
    events = before.event, move.event
    statements = [event.statement for event in events]
    end = _text(statements[1])
    one_frame = len({(e.tool, e.wobj, e.displacement) for e in events}) == 1
    held = all(edited.get(s.key) in NAMED for s in statements)
    # Before it is known what the runs share they have no text at all.
    texts = [edited.get(s.key, "argument") for s in statements]
    taught = all(t == "argument" and e.target_origin.kind == "expression" for t, e in zip(texts, events, strict=True))
    if end is None or move.first or before.again is not None or not one_frame or not (held or taught):
        return set()
    starts = {events[1].start, _neighbour(end, *events)} - {None}
    return {(name, end, taught) for name in starts if name is not None}


def _neighbour(text: str, before: MotionEvent, event: MotionEvent) -> str | None:
    """What the target before is called if it is the next element of the same array, where an index runs over it."""
    there, here = before.target_origin, event.target_origin
    if not text.endswith("}") or here.kind != "element" or here.declaration != there.declaration:
        return None
    if here.spans is None or there.spans is None:
        return None
    (_, first), (second, _) = sorted([there.spans.whole, here.spans.whole])
    step = "-1" if second == here.spans.whole[0] else "+1"
    return f"{text[:-1]}{step}}}" if _COMMA.fullmatch(here.spans.source.data, first, second) else None


def _text(statement: MotionStatement) -> str | None:
    argument = statement.argument("to")
    return argument.text if argument is not None and NAME.fullmatch(argument.text) else None


def _ends(wishes: Wishes, i: int, taught: bool) -> tuple[TargetValue, TargetValue]:
    """Start and end of a move in its object frame, as they are taught or corrected."""
    targets = [_target(wishes.motion.moves[k].event) for k in (i - 1, i)]
    if taught:
        start, end = (TargetValue(Pose(t.trans, t.rot), t.robconf, t.extax) for t in targets)
        return start, end
    places = wishes.values([(i, wishes.T_goal[k], t.robconf) for k, t in zip((i - 1, i), targets, strict=True)])
    start, end = (replace(p, extax=t.extax) for p, t in zip(places, targets, strict=True))
    return start, end


def _target(event: MotionEvent) -> RobTarget:
    assert isinstance(event.target, RobTarget)
    return event.target


def _alike(added: TargetValue, end: TargetValue) -> bool:
    """Whether a target can be an end displaced: not turned, nor in another configuration."""
    turned = 1.0 - abs(float(np.dot(added.pose.rot, end.pose.rot)))
    still = float(np.abs(np.subtract(added.extax, end.extax)).max()) <= STILL
    return turned <= TURNED**2 / 2 and added.robconf == end.robconf and still
