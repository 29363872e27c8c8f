"""Which text to change: the numbers of a declaration, of an array element or of an aggregate, or a whole argument.

A declaration is edited when all that it serves for are targets of compensated moves and all of them ask for the same
value; otherwise each statement gets a target of its own. Where a call hands the target to a routine, the call gets it.
A statement that runs several times with different corrections cannot have one of its own: where all ask for the same of
what Offs displaces, that is replaced; where its target is derived (Offs, RelTool) from one that is edited it follows
that; where all ask for one displacement of whatever target it has, it gets an Offs; else it is left alone, with that
reason.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.compensate.sharing import Users, fully_wished, led_elsewhere, straight
from postproc.compensate.texts import (
    SAME_MM,
    ArgumentKey,
    PlaceKey,
    agree,
    base_of,
    by_argument,
    by_place,
    circles_apart,
    one_target,
    same_value,
    serves_these,
    text_of,
)
from postproc.compensate.values import Change, Place, Wish
from postproc.rapid.program.events import MotionEvent, StatementKey
from postproc.rapid.program.pose import pose_inv, pose_mult, subtract
from postproc.rapid.program.records import Pose, RobTarget

DIFFERENT = "it runs several times and each time needs another correction"
WAYS = "the arm comes to it by several ways and each needs another correction"
LENT = "it stands in a file that is only read along"
ELSEWHERE = "it also runs with other targets, on ways that are not followed"
FOLLOWS = "it follows the target that it is derived from"

IN_PLACE: Mapping[str, Place] = {"inline": "aggregate", "declared": "declaration", "element": "element"}


@dataclass(frozen=True, slots=True)
class Decisions:
    """What is written.

    Args:
        changes: texts to change.
        refused: statements that stay as they are, with the reason.
        following: statements whose targets move with the declarations and parameters named, being derived from them.
        edited: where the target of every other statement is written.
        serving: numbers of targets that could be edited in place, if all that is asked of them were the same.
    """

    changes: tuple[Change, ...]
    refused: Mapping[StatementKey, str]
    following: Mapping[StatementKey, frozenset[str]]
    edited: Mapping[StatementKey, Place]
    serving: frozenset[PlaceKey]


def decide_changes(
    runs: Mapping[int, MotionEvent], wishes: Sequence[Wish], users: Mapping[str, Users], least: float
) -> Decisions:
    """Decide for every wish where it is written.

    Args:
        runs: all executions (see ``possible_runs``); wishes: of those that can be compensated.
        users: from ``target_users``; least: see ``straight`` [mm].
    """
    wishes = circles_apart(wishes)
    places = by_place(wishes)
    arguments = by_argument(wishes)
    wished = {w.move.row for w in wishes}
    complete, astray = fully_wished(runs, wished), led_elsewhere(runs, wished)
    bases: dict[StatementKey, set[str]] = {}
    for name, use in users.items():
        for key in use.derived:
            bases.setdefault(key, set()).add(name)

    serving = frozenset(k for k, group in places.items() if serves_these(k, group, users, complete))
    editable = {k for k in serving if agree(places[k])}
    while True:
        refused, following = _refuse(arguments, editable, bases, complete, astray, least)
        # A declaration stays as it is when a statement that uses it does, or one that is derived from it, or one that
        # displaces it as it is, because other runs of that have no text to edit.
        fixed = {name for name, use in users.items() if not use.derived.isdisjoint(refused)}
        untouched = refused.keys() | {
            key
            for (key, _), group in arguments.items()
            if key not in following and any(text_of(w, editable) is None for w in group)
            if not agree(group) and base_of(group) is None
        }
        kept = {
            k for k in editable if not any(w.event.statement.key in untouched or w.names & fixed for w in places[k])
        }
        if kept == editable:
            break
        editable = kept
    changes = []
    for place in places:
        if place in editable and (here := [w for w in places[place] if text_of(w, editable) == place]):
            changes.append(_change(here[0], place[0]))
    edited: dict[StatementKey, Place] = dict.fromkeys(following, "derived")
    for (key, _), group in arguments.items():
        if key in refused or key in following:
            continue
        texts = [text for w in group if (text := text_of(w, editable)) is not None]
        if len(texts) < len(group):
            displaced = _inside(group) if agree(group) else _displaced(group, least)
            changes.append(displaced or _change(group[0], "argument"))
            edited[key] = "argument"
        else:
            handed = group[0].origin.handed is not None
            called = handed and (texts[0][0] == "call" or group[0].origin.kind == "inline")
            edited.setdefault(key, "call" if called else IN_PLACE[group[0].origin.kind])
    return Decisions(tuple(changes), refused, following, edited, serving)


def _refuse(
    arguments: Mapping[ArgumentKey, list[Wish]],
    editable: set[PlaceKey],
    bases: Mapping[StatementKey, set[str]],
    complete: frozenset[StatementKey],
    astray: frozenset[StatementKey],
    least: float,
) -> tuple[dict[StatementKey, str], dict[StatementKey, frozenset[str]]]:
    """Statements for which no text can be found, with the reason, and those that follow what they are derived from."""
    edited: set[str] = set()
    moved: set[RobTarget] = set()  # targets that have new numbers where they stand
    for group in arguments.values():
        for wish in group:
            if text_of(wish, editable) is not None:
                edited |= wish.names
                moved.add(wish.target)
    refused: dict[StatementKey, str] = {}
    following: dict[StatementKey, frozenset[str]] = {}
    for (key, _), group in arguments.items():
        if all(text_of(w, editable) is not None for w in group):
            continue
        lent = group[0].event.statement.source.lent
        replaced = key in complete and not lent and base_of(group) is not None
        if replaced and not agree(group) and _displaced(group, least) is not None:
            continue
        followed = edited & bases.get(key, set())
        # It would follow in some of its runs only, or a function decides how.
        if followed and not agree(group) and any(w.origin.root not in moved for w in group):
            refused[key] = DIFFERENT
            continue
        # Another call may hand another target over: what is derived from a parameter is not tied to one of them.
        if followed and (lent or not agree(group) or any("%" in name for name in followed)):
            following[key] = frozenset(followed)
        elif lent:
            refused[key] = LENT
        elif not agree(group) and (key not in complete or _displaced(group, least) is None):
            refused[key] = WAYS if any(w.event.way for w in group) and one_target(group) else DIFFERENT
        elif key in astray or any(w.event.elsewhere for w in group):
            refused[key] = ELSEWHERE
    return refused, following


def _displaced(group: Sequence[Wish], least: float) -> Change | None:
    """The change of an argument that leads to another target in each run, where one displacement serves all runs.

    What ``Offs`` displaces by another amount each time is replaced; any other argument is put into an ``Offs``, and so
    is one whose displacement goes with a number that the statement names.
    """
    base = base_of(group)
    numbers = [dict(wish.event.numbers) for wish in group]
    shifts = []
    for wish in group:
        target = wish.target
        shifts.append(np.subtract(wish.value.pose.trans, target.trans))
        kept = replace(wish.value, pose=Pose(wish.value.pose.trans, target.rot), robconf=target.robconf)
        turned = replace(wish.value, pose=Pose(wish.value.pose.trans, group[0].value.pose.rot))
        if not same_value(wish.value, kept if base is None else turned):
            return None  # Offs does not turn
    for finest in (least, SAME_MM / 2):  # with fewer numbers if that will do
        way = straight(numbers, np.array(shifts), finest)
        off = [np.abs(np.subtract(way.at(named), shift)).max() for named, shift in zip(numbers, shifts, strict=True)]
        if max(off) <= SAME_MM:
            break
    else:
        return None
    whole = _change(group[0], "argument")
    if base is None:
        return replace(whole, displacement=way)
    x, y, z = np.add(base.target.trans, way.constant).tolist()
    value = replace(whole.value, pose=Pose((x, y, z), whole.value.pose.rot))
    if not way.slopes:
        return Change(base.source, base.span, value)
    return replace(whole, value=value, displacement=replace(way, constant=(0.0, 0.0, 0.0)), inner=base.span)


def _inside(group: Sequence[Wish]) -> Change | None:
    """The change of what PERS data displaces; None where nothing is."""
    tuned = group[0].origin.tuned
    if tuned is None or any(wish.origin.tuned != tuned for wish in group):
        return None
    pose = group[0].value.pose
    for plain, after, before in tuned.steps:
        if plain:
            pose = Pose(subtract(pose.trans, subtract(after.trans, before.trans)), pose.rot)
        else:
            turn = pose_mult(pose_inv(Pose(after.trans, after.rot)), Pose(before.trans, before.rot))
            pose = pose_mult(pose, turn)
    return Change(tuned.source, tuned.span, replace(group[0].value, pose=pose))


def _change(wish: Wish, where: str) -> Change:
    """The change of the numbers of a target, of the argument of a call, or of the statement's own argument."""
    statement, origin = wish.event.statement, wish.origin
    if where == "numbers":
        assert origin.spans is not None
        return Change(origin.spans.source, origin.spans.whole, wish.value, origin.spans)
    if where == "call":
        assert origin.handed is not None
        return Change(origin.handed.source, origin.handed.span, wish.value)
    argument = statement.argument(wish.role)
    assert argument is not None
    return Change(statement.source, argument.span, wish.value)
