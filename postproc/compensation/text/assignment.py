"""Which text gets which correction: values for slots, offsets for what they do not serve.

The numbers that a target comes from (a declaration, an element, an aggregate, the argument of a call) are a slot. It
gets the centre of what its arguments ask for, where that is within the tolerance of them all. Where it is not, the
arguments that ask for most, counted from the median, go to an offset around their expression, constant or affine in
numbers that they name. An argument that neither serves leaves its statement as it is; so do the slots that serve this
one, and whoever plans assigns the others without them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensation.text.expressions import TargetExpression
from postproc.compensation.text.laws import Allowed, OffsetLaw, constant_law, fit_affine, midrange, nearest_law
from postproc.compensation.text.slots import ArgumentKey, Incidence, SlotKey
from postproc.compensation.text.values import Conf, TargetRequest, compliant
from postproc.grouping import grouped
from postproc.rapid.data.events import StatementKey

DIFFERENT = "it runs several times and each time needs another correction"
WAYS = "the arm comes to it by several ways and each needs another correction"
LENT = "it stands in a file that is only read along"
ELSEWHERE = "it also runs with other targets, on ways that are not followed"
CONFIGURATION = (
    "the correction carries a joint over a quadrant boundary, and no place in the text holds its configuration"
)
OWN_OFFS = "the program has an `Offs` of its own: no offset can be put around the target"

SHARE = 0.5  # of a correction that may stay off where nothing is within the tolerance of all runs; numbers that an
# offset then names have to take this share off what one value for all runs would leave
ROUNDING_MM = 1e-6  # positions that are nearer than that are one


@dataclass(frozen=True, slots=True)
class SlotValue:
    """What is written into a slot (a place in the text with the numbers of a target).

    Args:
        shift, turn: (3,) of the target that stands there [mm], [rad].
        robconf: its configuration; None where it stays that of the expression in the argument of a call.
        of: the request that it serves, if that is only one.
    """

    shift: Array
    turn: Array
    robconf: Conf | None
    of: TargetRequest | None = None


@dataclass(frozen=True, slots=True)
class Assignment:
    """What is written where.

    Args:
        slots: values by slot.
        offsets: formulas of the offsets by argument, in addition to the slots.
        slot_of: the slot that serves each request, None where none does.
        left: statements that nothing serves, with the reason; the others must then be assigned again without them.
        relaxed: statements whose runs get one value that is not within the tolerance of all of them.
        unserved: (n, 3) error that remains at each request [mm], object axes.
    """

    slots: Mapping[SlotKey, SlotValue]
    offsets: Mapping[ArgumentKey, OffsetLaw]
    slot_of: Sequence[SlotKey | None]
    left: Mapping[StatementKey, str]
    relaxed: frozenset[StatementKey]
    unserved: Array


class Assigner:
    """Assigns the requests of one kind (goals or circle points) to slots and offsets.

    A slot is a place in the text that holds the numbers of a target; an offset is put around the expression of an
    argument.

    Args:
        incidence: the requests, and which slots could serve them.
        unresolved: statements that also run to places that are not known.
        expression: function that returns how the text of an argument (statement and role) can be changed.
        closed: slots that must not be edited.
        fixed: slots whose values are already decided.
    """

    def __init__(
        self,
        incidence: Incidence,
        unresolved: Set[StatementKey],
        expression: Callable[[ArgumentKey], TargetExpression],
        closed: Set[SlotKey],
        fixed: Mapping[SlotKey, SlotValue],
    ) -> None:
        self.incidence, self.requests, self.arguments = incidence, incidence.requests, incidence.of_argument
        self.unresolved, self.expression = unresolved, expression
        self.slots: dict[SlotKey, SlotValue] = dict(fixed)
        self.slot_of = [next((slot for slot in slots if slot not in closed), None) for slots in incidence.slots]
        self.shift = np.array([r.shift for r in self.requests]).reshape(-1, 3)
        self.turn = np.array([r.turn for r in self.requests]).reshape(-1, 3)
        roots = [r.origin.root for r in self.requests]
        self.lever = np.array([root.lever if root else (0.0, 0.0, 0.0) for root in roots]).reshape(-1, 3)
        self.within = np.array([r.within_mm for r in self.requests])
        self.largest = np.maximum(self.within, SHARE * np.linalg.norm(self.shift, axis=1))
        self.derived = np.array([root is not None for root in roots], dtype=bool)
        self.read_only = {
            key for key, rows in self.arguments.items() if self.requests[rows[0]].event.statement.source.read_only
        }

    def assign(self) -> Assignment:
        """Assign values to slots (places that hold a target's numbers), then offsets to the other arguments."""
        self._fill_slots()
        rest = self.shift - self._moved_by_slots(range(len(self.requests)))
        off = np.linalg.norm(rest, axis=1)
        offsets: dict[ArgumentKey, OffsetLaw] = {}
        left: dict[StatementKey, str] = {}
        relaxed: set[StatementKey] = set()
        for key, rows in self.arguments.items():
            filled = all(self.slot_of[row] in self.slots for row in rows)
            fits = filled and self._configured(rows)
            if fits and all(off[row] <= self.within[row] + ROUNDING_MM for row in rows):
                continue
            if key in self.read_only:
                left |= {} if filled else {key[0]: LENT}
                continue
            chosen = list(rows)
            why = self._no_offset(key, rows)
            middle, leaves = ({}, np.inf) if why else self._middle(chosen)
            law = None if why else self._law(key, chosen, rest[chosen], leaves)
            if law is None and not why and not middle:
                law = self._constant(key, chosen, rest[chosen])
            if law is not None:
                offsets[key] = law
                added = np.array([law.at(dict(self.requests[row].event.numbers)) for row in chosen])
                rest[chosen] -= self._turned(key, chosen, added, to_object=True)
            elif middle:
                self.slots |= middle
                rest[chosen] = self.shift[chosen] - self._moved_by_slots(chosen)
            else:
                # What is derived from a corrected target follows that, where it is nowhere worse than no correction.
                follows = fits and self.derived[chosen].all()
                if not (follows and all(off[row] <= np.linalg.norm(self.shift[row]) for row in chosen)):
                    left[key[0]] = why or self._unlike(rows)
                continue
            if (np.linalg.norm(rest[chosen], axis=1) > self.within[chosen] + ROUNDING_MM).any():
                relaxed.add(key[0])
        return Assignment(self.slots, offsets, self.slot_of, left, frozenset(relaxed), rest)

    def _fill_slots(self) -> None:
        """Give each slot (a place that holds a target's numbers) the centre of what its arguments require.

        Arguments that one value cannot serve together with the others do not count. The values go to ``self.slots``.
        """
        of_slot: dict[SlotKey, dict[ArgumentKey, list[int]]] = {}
        others = set(self.read_only)
        for key, rows in self.arguments.items():
            if any(self.slot_of[row] is None for row in rows):
                others.add(key)
            for row in rows:
                if (slot := self.slot_of[row]) is not None and slot not in self.slots:
                    of_slot.setdefault(slot, {}).setdefault(key, []).append(row)
        for arguments in of_slot.values():
            able = {key: rows for key, rows in arguments.items() if key not in others}
            others |= able.keys() - self._served_together(able)
        for slot, arguments in of_slot.items():
            if rows := [row for key, own in arguments.items() if key not in others for row in own]:
                self.slots[slot] = self._common(rows)
        # An offset around elements of which some are corrected fits them all where the others are corrected, too.
        partly = {key for key in others if any(self.slot_of[row] in self.slots for row in self.arguments[key])}
        partly |= self.read_only
        for slot, arguments in of_slot.items():
            rows = [row for key, own in arguments.items() if key in partly for row in own]
            if rows and slot not in self.slots:
                self.slots[slot] = self._common(rows)

    def _served_together(self, arguments: Mapping[ArgumentKey, Sequence[int]]) -> set[ArgumentKey]:
        """The arguments of one slot (place with a target's numbers) that one value serves: all if possible.

        Otherwise arguments are taken in turn if one value serves them and those taken before: first those with the
        greatest need, among these first the nearest to the median of what the neediest ones with the smallest tolerance
        require. Calls of ``Offs`` or ``RelTool`` whose own amounts can be changed instead are never taken.

        Args:
            arguments: for each argument (statement and role) the indices of its requests.
        """
        if self._one_value([row for own in arguments.values() for row in own]):
            return {*arguments}
        need = {key: self._need(key) for key in arguments}
        able = {key: own for key, own in arguments.items() if need[key]}
        rows = [row for own in able.values() for row in own]
        if not rows:
            return set()
        asked = dict(zip(rows, self._demand(rows), strict=True))
        most = [row for key, own in able.items() if need[key] == max(need.values()) for row in own]
        strict = [row for row in most if self.within[row] == self.within[most].min()]
        median = np.median([asked[row] for row in strict], axis=0)
        far = {
            key: max(float(np.linalg.norm(asked[row] - median) / self.within[row]) for row in own)
            for key, own in able.items()
        }
        kept: list[ArgumentKey] = []
        for key in sorted(able, key=lambda key: (-need[key], far[key])):
            if self._one_value([row for other in (*kept, key) for row in able[other]]):
                kept.append(key)
        return set(kept)

    def _need(self, key: ArgumentKey) -> int:
        """How much the argument ``key`` (statement and role) needs its slot (place with a target's numbers), 0 to 3.

        It is 3 if no offset can be put around it, 0 if it is a call of ``Offs`` or ``RelTool`` whose amounts can be
        changed instead, 2 if its runs use several slots, else 1.
        """
        rows = self.arguments[key]
        if self._no_offset(key, rows, configured=True):
            return 3
        if self.expression(key).form == "amounts":
            return 0
        return 2 if len({self.slot_of[row] for row in rows}) > 1 else 1

    def _one_value(self, rows: Sequence[int]) -> bool:
        """Whether one value of a slot is within tolerance of all requests ``rows``, and they have one configuration."""
        if len(rows) < 2:
            return True
        if not self._keeps(rows) and len({self.requests[row].value.robconf for row in rows}) > 1:
            return False
        demand, within = self._demand(rows), self.within[rows]
        return bool((np.linalg.norm(demand - _centre(demand, within), axis=1) <= within).all())

    def _demand(self, rows: Sequence[int]) -> Array:
        """(k, 3) shift [mm] that each of the requests ``rows`` needs of the target in its slot.

        That target is taken to turn by the rotation that ``_common_turn`` gives for these requests.
        """
        chosen = np.array(rows)
        demand: Array = self.shift[chosen] - np.cross(self._common_turn(rows), self.lever[chosen])
        return demand

    def _common_turn(self, rows: Sequence[int]) -> Array:
        """(3,) rotation vector [rad] for the target in a slot, half-way between those that requests ``rows`` require.

        Requests whose argument displaces that target count only if there are no others.
        """
        chosen = np.array(rows)
        plain = chosen[~self.derived[chosen]]
        return midrange(self.turn[plain if len(plain) else chosen])

    def _common(self, rows: Sequence[int]) -> SlotValue:
        """The value of a slot in the centre of what the requests ``rows`` require.

        It has their most common configuration, or keeps that of an expression.
        """
        if len(rows) == 1 and not self.derived[rows[0]] and not self._keeps(rows):
            row = rows[0]
            return SlotValue(self.shift[row], self.turn[row], self.requests[row].value.robconf, self.requests[row])
        confs = [self.requests[row].value.robconf for row in rows]
        shift = _centre(self._demand(rows), self.within[rows])
        conf = None if self._keeps(rows) else max(set(confs), key=confs.count)
        return SlotValue(shift, self._common_turn(rows), conf)

    def _keeps(self, rows: Sequence[int]) -> bool:
        """Whether the slot of requests ``rows`` is the argument of a call: an expression keeps its configuration."""
        slot = self.slot_of[rows[0]]
        return slot is not None and slot[0] == "call"

    def _moved_by_slots(self, rows: Iterable[int]) -> Array:
        """(k, 3) how far [mm] the targets of requests ``rows`` move by the values decided for their slots so far.

        A slot is a place in the text with the numbers of a target; those of slots without a value do not move.
        """
        moved = []
        for row in rows:
            slot = self.slot_of[row]
            value = self.slots.get(slot) if slot is not None else None
            shift = np.zeros(3) if value is None else value.shift
            moved.append(shift + np.cross(value.turn, self.lever[row]) if value and self.derived[row] else shift)
        return np.array(moved).reshape(-1, 3)

    def _configured(self, rows: Sequence[int]) -> bool:
        """Whether slots or the present text give requests ``rows`` configurations that a controller accepts for theirs.

        The configuration of an expression stays the programmer's: a target taught anew may have another one.
        """
        for row in rows:
            slot = self.slot_of[row]
            value = self.slots.get(slot) if slot is not None else None
            there = None if value is None else value.robconf
            if not compliant(self.requests[row].value.robconf, there or self.requests[row].target.robconf):
                return False
        return True

    def _no_offset(self, key: ArgumentKey, rows: Sequence[int], configured: bool | None = None) -> str:
        """Why no offset of any size can be put around the argument ``key`` with requests ``rows``; empty if one can.

        Args:
            configured: whether its runs get their configurations without the offset; None: as `_configured` says.
        """
        if key[0] in self.unresolved or any(self.requests[row].event.has_unresolved_runs for row in rows):
            return ELSEWHERE
        configured = self._configured(rows) if configured is None else configured
        if not configured:
            return CONFIGURATION
        return OWN_OFFS if self.expression(key).form is None else ""

    def _law(self, key: ArgumentKey, rows: Sequence[int], rest: Array, leaves: float) -> OffsetLaw | None:
        """The formula of an offset for the argument ``key`` that is within the tolerances of all its requests ``rows``.

        It is a constant, or affine in as few numbers of the program as possible. If there is none, the best affine one,
        if it leaves at most half of what a single value would leave; else None.

        Args:
            rest: (n, 3) what each request requires [mm], object axes.
            leaves: remaining error [mm] with one value in each slot.
        """
        rest = self._turned(key, rows, rest, to_object=False)
        regressors = [dict(self.requests[row].event.numbers) for row in rows]
        within = self.within[rows]
        laws = [constant_law(rest)]
        least = np.linalg.norm(laws[0][1], axis=1)
        if (least <= within + ROUNDING_MM).all():
            return laws[0][0]
        for fine in (within.min(), within.min() / 4):
            law = fit_affine(regressors, rest, float(fine))
            laws.append((law, rest - [law.at(run) for run in regressors]))
            if (np.linalg.norm(laws[-1][1], axis=1) <= within + ROUNDING_MM).all():
                return law
        most = np.minimum(self.largest[rows], SHARE * min(leaves, float(least.max())))
        return nearest_law(laws[1:], Allowed(0.0, most.tolist()))

    def _middle(self, rows: Sequence[int]) -> tuple[dict[SlotKey, SlotValue], float]:
        """Values for the slots (places with a target's numbers) of requests ``rows``, and the error [mm] they leave.

        No values if a slot also serves other requests or has a value already, or if more than the tolerance and half of
        the correction of some request would remain.
        """
        shares = grouped((self.slot_of[row], row) for row in rows)
        found: dict[SlotKey, SlotValue] = {}
        leaves, fits = 0.0, True
        for slot, own in shares.items():
            if slot is None or slot in self.slots or len(own) < len(self.incidence.of_slot[slot]):
                return {}, np.inf
            found[slot] = self._common(own)
            off = np.linalg.norm(self._demand(own) - found[slot].shift, axis=1)
            leaves, fits = max(leaves, float(off.max())), fits and bool((off <= self.largest[own]).all())
        return (found if fits else {}), leaves

    def _constant(self, key: ArgumentKey, rows: Sequence[int], rest: Array) -> OffsetLaw | None:
        """The constant offset for all requests ``rows`` of the argument ``key``.

        None if more than the tolerance and half of the correction of some request would remain.

        Args:
            rest: (n, 3) what each request requires [mm], object axes.
        """
        return nearest_law(
            [constant_law(self._turned(key, rows, rest, to_object=False))], Allowed(0.0, self.largest[rows].tolist())
        )

    def _turned(self, key: ArgumentKey, rows: Sequence[int], offsets: Array, *, to_object: bool) -> Array:
        """Offsets (n, 3) of requests ``rows``, turned from object axes into those of the argument ``key``.

        The axes of ``RelTool`` are those of the tool; those of all other arguments are the object's.

        Args:
            to_object: they are turned from the axes of the argument into object axes.
        """
        if not self.expression(key).in_tool:
            return offsets
        tool = Rotation.from_quat(np.array([self.requests[row].target.rot for row in rows]), scalar_first=True)
        return np.asarray((tool if to_object else tool.inv()).apply(offsets))

    def _unlike(self, rows: Sequence[int]) -> str:
        """Text that says why the requests ``rows`` of one argument, with different corrections, are not served."""
        requests = [self.requests[row] for row in rows]
        one = len({(r.target, r.origin.base.spans) for r in requests}) == 1
        return WAYS if one and any(r.event.way for r in requests) else DIFFERENT


def _centre(demand: Array, within: Array) -> Array:
    """(3,) shift [mm] in the middle, along each axis, of the range within the tolerances of all demands.

    Args:
        demand: (n, 3) shifts that requests need [mm].
        within: (n,) their tolerances [mm].
    """
    centre: Array = ((demand - within[:, None]).max(axis=0) + (demand + within[:, None]).min(axis=0)) / 2
    return centre
