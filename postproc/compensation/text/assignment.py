"""Which text gets which correction: values for slots, offsets for what they do not serve.

The numbers that a target comes from (a declaration, an element, an aggregate, the argument of a call) are a slot. It
gets the centre of what the arguments that use it require, where that is within the tolerance of them all. An argument
that no slot serves gets an offset around its expression, constant or affine in numbers that it names. An argument that
neither serves leaves its statement as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import chain

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensation.text.laws import OffsetLaw, constant_law, fit_affine, midrange, nearest_law
from postproc.compensation.text.slots import ArgumentKey, SlotKey, TargetExpression
from postproc.compensation.text.values import Conf, TargetRequest, compliant
from postproc.grouping import grouped
from postproc.motion.values import Flags
from postproc.rapid.data.events import StatementKey

DIFFERENT = "it runs several times and each time needs another correction"
APPROACHES = "the arm comes to it by several ways and each needs another correction"
READ_ALONG = "it stands in a file that is only read along"
UNFOLLOWED_RUNS = "it also runs with other targets, on ways that are not followed"
CONFIGURATION = (
    "the correction carries a joint over a quadrant boundary, and no place in the text holds its configuration"
)
HIDDEN_OFFS = "the program has an `Offs` of its own: no offset can be put around the target"

REMAINING_SHARE = 0.5
"""Of a correction that may stay off where nothing is within the tolerance of all runs; numbers in an offset have
to take this share off what one value would leave."""
ROUNDING_MM = 1e-6  # positions that are nearer than that are one


@dataclass(frozen=True, slots=True)
class SlotValue:
    """What is written into a slot (a place in the text with the numbers of a target).

    Args:
        shift, turn: (3,) of the target that stands there [mm], [rad].
        robconf: its configuration; None where it stays that of the expression in the argument of a call.
        of: the request whose target it is, if it serves only that.
    """

    shift: Array
    turn: Array
    robconf: Conf | None
    of: TargetRequest | None = None


@dataclass(frozen=True, slots=True)
class Demands:
    """What n requests of one kind (goals or circle points) require, and which slots may serve them.

    Args:
        requests, arguments: the requests, and their rows by argument.
        slot_of: the slot that may serve each request, None where none may; of_slot: rows by slot, of all slots.
        shift, turn: (n, 3) from the programmed to the corrected target [mm], [rad].
        lever: (n, 3) what turns with the target in the slot, in arguments that displace it; else zero [mm].
        derived: (n,) whether the argument displaces the target in the slot.
        within: (n,) tolerance [mm]; largest: (n,) error that may remain where nothing is within all tolerances [mm].
        unresolved: statements that also run to places that are not known.
        expression: function that returns how the text of an argument can be changed.
    """

    requests: Sequence[TargetRequest]
    arguments: Mapping[ArgumentKey, Sequence[int]]
    slot_of: Sequence[SlotKey | None]
    of_slot: Mapping[SlotKey, Sequence[int]]
    shift: Array
    turn: Array
    lever: Array
    derived: Flags
    within: Array
    largest: Array
    unresolved: Set[StatementKey]
    expression: Callable[[ArgumentKey], TargetExpression]

    def read_only(self, key: ArgumentKey) -> bool:
        """Whether an argument stands in a file that must not change."""
        return self.requests[self.arguments[key][0]].event.statement.source.read_only


@dataclass(frozen=True, slots=True)
class Assignment:
    """What is written where.

    Args:
        demands: what it serves.
        slots: values by slot.
        offsets: formulas of the offsets by argument, in addition to the slots.
        refused: statements that nothing serves, with the reason; their numbers must then serve no other one.
        relaxed: statements whose runs get one value that is not within the tolerance of all of them.
        unserved: (n, 3) error that remains at each request [mm], object axes.
    """

    demands: Demands
    slots: Mapping[SlotKey, SlotValue]
    offsets: Mapping[ArgumentKey, OffsetLaw]
    refused: Mapping[StatementKey, str]
    relaxed: frozenset[StatementKey]
    unserved: Array


def demands_of(
    requests: Sequence[TargetRequest],
    editable: Sequence[Sequence[SlotKey]],
    closed: Set[SlotKey],
    unresolved: Set[StatementKey],
    expression: Callable[[ArgumentKey], TargetExpression],
) -> Demands:
    """What requests require.

    Args:
        editable: for each request the slots that may be edited for it, the preferred one first.
        closed: those of them that must not be edited since they serve something else.
        unresolved: statements that also run to places that are not known.
        expression: function that returns how the text of an argument (statement and role) can be changed.
    """
    roots = [r.origin.root for r in requests]
    levers = [root.lever if root else (0.0, 0.0, 0.0) for root in roots]
    shift, turn, lever = (
        np.array(rows, dtype=float).reshape(-1, 3)
        for rows in ([r.shift for r in requests], [r.turn for r in requests], levers)
    )
    within = np.array([r.within_mm for r in requests])
    return Demands(
        requests=requests,
        arguments=grouped(((r.event.statement.key, r.role), row) for row, r in enumerate(requests)),
        slot_of=[next((slot for slot in slots if slot not in closed), None) for slots in editable],
        of_slot=grouped((slot, row) for row, slots in enumerate(editable) for slot in slots),
        shift=shift,
        turn=turn,
        lever=lever,
        derived=np.array([root is not None for root in roots], dtype=bool),
        within=within,
        largest=np.maximum(within, REMAINING_SHARE * np.linalg.norm(shift, axis=1)),
        unresolved=unresolved,
        expression=expression,
    )


def assign(demands: Demands, fixed: Mapping[SlotKey, SlotValue]) -> Assignment:
    """Assign values to slots, then offsets to the arguments that these do not serve.

    Args:
        fixed: slots whose values are decided already.
    """
    slots = {**fixed, **_slot_values(demands, fixed)}
    limit = demands.within + ROUNDING_MM
    unserved = _unserved(demands, range(len(demands.requests)), slots)
    served = (np.linalg.norm(unserved, axis=1) <= limit).tolist()
    # A controller may refuse a configuration that differs from the one of the target.
    lacking = {
        (request.event.statement.key, request.role)
        for request, slot, near in zip(demands.requests, demands.slot_of, served, strict=True)
        if not near
        or slot is None
        or slot not in slots
        or not compliant(request.value.robconf, slots[slot].robconf or request.target.robconf)
    }
    offsets: dict[ArgumentKey, OffsetLaw] = {}
    refused: dict[StatementKey, str] = {}
    relaxed: set[StatementKey] = set()
    for key, rows in demands.arguments.items():
        # By slots alone.
        if key not in lacking:
            continue
        filled = all(demands.slot_of[row] in slots for row in rows)
        configured = _configured(demands, rows, slots)
        if demands.read_only(key):
            refused |= {} if filled else {key[0]: READ_ALONG}
            continue
        # By an offset, or by values for slots of its own.
        why = _why_no_offset(demands, key, configured)
        value = None if why else _offset(demands, key, unserved[rows], slots)
        if isinstance(value, OffsetLaw):
            offsets[key] = value
            added = np.array([value.at(dict(demands.requests[row].event.numbers)) for row in rows])
            unserved[rows] -= _turned(demands, key, added, to_object=True)
        elif value is not None:
            slots |= value
            unserved[rows] = _unserved(demands, rows, slots)
        # What is derived from a corrected target follows that, where it is nowhere worse than no correction.
        elif (
            not (filled and configured and demands.derived[rows].all())
            or (np.linalg.norm(unserved[rows], axis=1) > np.linalg.norm(demands.shift[rows], axis=1)).any()
        ):
            requests = [demands.requests[row] for row in rows]
            several = len({(r.target, r.origin.base.spans) for r in requests}) > 1
            refused[key[0]] = why or (APPROACHES if not several and any(r.event.way for r in requests) else DIFFERENT)
        if value is not None and (np.linalg.norm(unserved[rows], axis=1) > limit[rows]).any():
            relaxed.add(key[0])
    return Assignment(demands, slots, offsets, refused, frozenset(relaxed), unserved)


def _slot_values(demands: Demands, fixed: Mapping[SlotKey, SlotValue]) -> dict[SlotKey, SlotValue]:
    """A value for each slot that is not fixed and serves any argument: the centre of what its arguments require."""
    users: dict[SlotKey, dict[ArgumentKey, list[int]]] = {}
    by_offset, read_only = set[ArgumentKey](), set[ArgumentKey]()
    for key, rows in demands.arguments.items():
        for row in rows:
            slot = demands.slot_of[row]
            if slot is None:
                by_offset.add(key)
            elif slot not in fixed:
                users.setdefault(slot, {}).setdefault(key, []).append(row)
        # Arguments of files that must not change take what others leave them.
        if demands.requests[rows[0]].event.statement.source.read_only:
            read_only.add(key)
    by_offset |= read_only
    for slot, arguments in users.items():
        if len(demands.of_slot[slot]) > 1:
            able = {key: rows for key, rows in arguments.items() if key not in by_offset}
            by_offset |= able.keys() - _served_together(demands, slot, able)
    known, values = set(fixed), dict[SlotKey, SlotValue]()
    for carried in (False, True):
        # An offset around elements of which some are corrected fits them all where the others are corrected, too.
        partly = {key for key in by_offset if any(demands.slot_of[row] in known for row in demands.arguments[key])}
        served = read_only | partly if carried else demands.arguments.keys() - by_offset
        for slot, arguments in users.items():
            rows = [row for key, used in arguments.items() if key in served for row in used]
            if rows and slot not in values:
                values[slot] = _centre(demands, slot, rows)
        known |= values.keys()
    return values


def _served_together(
    demands: Demands, slot: SlotKey, arguments: Mapping[ArgumentKey, Sequence[int]]
) -> Collection[ArgumentKey]:
    """The arguments of one slot that one value serves: all if possible, else each that agrees with those before it.

    First come those that no offset can serve, then those whose runs use several slots, those that name the target, and
    those that derive one from it. Calls of ``Offs`` or ``RelTool`` whose own amounts can be changed are never taken.

    Args:
        arguments: for each argument (statement and role) the indices of its requests that use the slot.
    """
    if _one_value(demands, slot, [*chain(*arguments.values())]):
        return arguments.keys()

    def rank(key: ArgumentKey) -> int:
        """Place of an argument in that order, from 0 to 3; 4 for calls with amounts."""
        rows = demands.arguments[key]
        if _why_no_offset(demands, key, configured=True):
            return 0
        if demands.expression(key).form == "amounts":
            return 4
        return 1 if len({demands.slot_of[row] for row in rows}) > 1 else 3 if demands.derived[rows].any() else 2

    kept: list[ArgumentKey] = []
    for key in sorted((key for key in arguments if rank(key) < 4), key=rank):
        if _one_value(demands, slot, [row for one in (*kept, key) for row in arguments[one]]):
            kept.append(key)
    return kept


def _one_value(demands: Demands, slot: SlotKey, rows: Sequence[int]) -> bool:
    """Whether one value of a slot is within the tolerance of all requests ``rows``, and they have one configuration."""
    if len(rows) < 2:
        return True
    value = _centre(demands, slot, rows)
    one = value.robconf is None or len({demands.requests[row].value.robconf for row in rows}) == 1
    return one and bool((_off(demands, rows, {slot: value}) <= demands.within[rows]).all())


def _centre(demands: Demands, slot: SlotKey, rows: Sequence[int]) -> SlotValue:
    """The value of a slot in the middle, along each axis, of the range within the tolerances of requests ``rows``.

    It is turned half-way between the rotations that they require; those whose argument displaces the target count for
    it only if there are no others. It has their most common configuration, or keeps that of an expression.
    """
    if len(rows) == 1 and not demands.derived[rows[0]]:
        only = demands.requests[rows[0]]
        conf = None if slot[0] == "call" else only.value.robconf
        return SlotValue(demands.shift[rows[0]], demands.turn[rows[0]], conf, only)
    confs = [demands.requests[row].value.robconf for row in rows]
    conf = None if slot[0] == "call" else max(set(confs), key=confs.count)
    chosen = np.array(rows)
    plain = chosen[~demands.derived[chosen]]
    turn = midrange(demands.turn[plain if len(plain) else chosen])
    required, within = demands.shift[chosen] - np.cross(turn, demands.lever[chosen]), demands.within[chosen, None]
    return SlotValue(((required - within).max(axis=0) + (required + within).min(axis=0)) / 2, turn, conf)


def _unserved(demands: Demands, rows: Sequence[int], slots: Mapping[SlotKey, SlotValue]) -> Array:
    """(k, 3) what requests ``rows`` still require [mm], object axes, with these values of slots."""
    still = SlotValue(np.zeros(3), np.zeros(3), None)
    values = [still if (slot := demands.slot_of[row]) is None else slots.get(slot, still) for row in rows]
    moved = np.array([(value.shift, value.turn) for value in values]).reshape(-1, 2, 3)
    chosen = list(rows)
    return np.asarray(demands.shift[chosen] - moved[:, 0] - np.cross(moved[:, 1], demands.lever[chosen]))


def _off(demands: Demands, rows: Sequence[int], slots: Mapping[SlotKey, SlotValue]) -> Array:
    """(k,) distance [mm] of the targets of requests ``rows`` from the corrected ones, with these values of slots."""
    return np.asarray(np.linalg.norm(_unserved(demands, rows, slots), axis=1))


def _configured(demands: Demands, rows: Sequence[int], slots: Mapping[SlotKey, SlotValue]) -> bool:
    """Whether slots or the present text give requests ``rows`` configurations that a controller accepts for theirs.

    The configuration of an expression stays the programmer's: a target taught anew may have another one.
    """
    for row in rows:
        slot, request = demands.slot_of[row], demands.requests[row]
        value = slots.get(slot) if slot is not None else None
        written = None if value is None else value.robconf
        if not compliant(request.value.robconf, written or request.target.robconf):
            return False
    return True


def _why_no_offset(demands: Demands, key: ArgumentKey, configured: bool) -> str:
    """Why no offset of any size can be put around an argument; empty if one can.

    Args:
        configured: whether its runs get their configurations without the offset.
    """
    runs = (demands.requests[row].event for row in demands.arguments[key])
    if key[0] in demands.unresolved or any(event.has_unresolved_runs for event in runs):
        return UNFOLLOWED_RUNS
    if not configured:
        return CONFIGURATION
    return HIDDEN_OFFS if demands.expression(key).form is None else ""


def _offset(
    demands: Demands, key: ArgumentKey, unserved: Array, slots: Mapping[SlotKey, SlotValue]
) -> OffsetLaw | Mapping[SlotKey, SlotValue] | None:
    """What serves all requests of an argument that slots alone do not serve; None if nothing does.

    It is the first of these: an offset within all tolerances, constant or affine in as few numbers of the program as
    possible; the best affine one that leaves at most half of what one value would leave; values for the slots of this
    argument alone; the constant offset. The last three leave at most the tolerance or half of each correction.

    Args:
        unserved: (n, 3) what each request still requires [mm], object axes.
        slots: what the slots have already.
    """
    rows = demands.arguments[key]
    required = _turned(demands, key, unserved, to_object=False)
    within, largest = demands.within[rows], demands.largest[rows]
    constant, errors = constant_law(required)
    off = np.linalg.norm(errors, axis=1)
    if (off <= within + ROUNDING_MM).all():
        return constant
    regressors = [dict(demands.requests[row].event.numbers) for row in rows]
    laws = []
    for least in (float(within.min()), float(within.min()) / 4):
        law = fit_affine(regressors, required, least)
        laws.append((law, required - [law.at(run) for run in regressors]))
        if (np.linalg.norm(laws[-1][1], axis=1) <= within + ROUNDING_MM).all():
            return law
    # Values for the slots, if these serve no other requests and have none yet.
    by_slot = grouped((demands.slot_of[row], row) for row in rows)
    exclusive = {slot: of for slot, of in by_slot.items() if slot is not None and len(of) == len(demands.of_slot[slot])}
    values, remaining = dict[SlotKey, SlotValue](), np.full(len(rows), np.inf)
    if len(exclusive) == len(by_slot) and exclusive.keys().isdisjoint(slots):
        values = {slot: _centre(demands, slot, of) for slot, of in exclusive.items()}
        remaining = _off(demands, rows, values)
    most = np.minimum(largest, REMAINING_SHARE * min(remaining.max(), off.max()))
    return (
        nearest_law(laws, most)
        or (values if (remaining <= largest).all() else None)
        or nearest_law([(constant, errors)], largest)
    )


def _turned(demands: Demands, key: ArgumentKey, offsets: Array, *, to_object: bool) -> Array:
    """Offsets (n, 3) of an argument, turned from object axes into those of its text: in ``RelTool`` the tool's.

    Args:
        to_object: they are turned from the axes of the text into object axes.
    """
    if not demands.expression(key).in_tool:
        return offsets
    rots = [demands.requests[row].target.rot for row in demands.arguments[key]]
    tool = Rotation.from_quat(np.array(rots), scalar_first=True)
    return np.asarray((tool if to_object else tool.inv()).apply(offsets))
