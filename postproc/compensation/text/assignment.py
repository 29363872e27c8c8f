"""Which text gets which correction: requests assigned to slots, offsets for what the slots do not serve.

Every argument of a statement is at a level, and levels only rise, so the rounds end:

1. ``SLOT``: the numbers that its target comes from (a declaration, an element, an aggregate, the argument of a call)
   get one value that is within the tolerance of all requests.
2. ``OFFSET``: what that leaves is an offset around the expression, constant or affine in numbers that it names.
3. ``RELAXED``: the offset that leaves least, if that is at most half of what one for all runs would leave.
4. ``MIDDLE``: one value for all runs that takes at least half of the correction off in each.
5. ``LEFT``: the statement stays uncorrected, and so does every slot that serves it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
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
from postproc.rapid.data.records import Vec3

DIFFERENT = "it runs several times and each time needs another correction"
WAYS = "the arm comes to it by several ways and each needs another correction"
LENT = "it stands in a file that is only read along"
ELSEWHERE = "it also runs with other targets, on ways that are not followed"
CONFIGURATION = (
    "the correction carries a joint over a quadrant boundary, and no place in the text holds its configuration"
)
OWN_OFFS = "the program has an `Offs` of its own: no offset can be put around the target"

SLOT, OFFSET, RELAXED, MIDDLE, LEFT = range(5)
SHARE = 0.5  # of a correction that may stay off from level RELAXED on; of that, where numbers are worth naming
AROUND = 4.0  # an `Offs` around a name that stood plainly counts as much as so many changed amounts of an `Offs`
ROUNDING_MM = 1e-6  # positions that are nearer than that are one
MOST_SEEDS = 40  # values that are tried for a slot whose requests differ


@dataclass(frozen=True, slots=True)
class SlotValue:
    """What is written into a slot: shift [mm] and turn [rad] of the target that stands there, and its configuration.

    Args:
        of: the request that it serves, where it is one alone.
    """

    shift: Array
    turn: Array
    robconf: Conf
    of: TargetRequest | None = None


@dataclass(frozen=True, slots=True)
class Assignment:
    """What is written where.

    Args:
        slots: values by slot; offsets: laws by argument, beside what the slots do.
        slot_of: the slot that serves each request, None where none does.
        left: statements that stay uncorrected, with the reason; relaxed: statements at level ``RELAXED`` or ``MIDDLE``.
        unserved: (n, 3) what stays off at each request [mm], object axes.
    """

    slots: Mapping[SlotKey, SlotValue]
    offsets: Mapping[ArgumentKey, OffsetLaw]
    slot_of: Sequence[SlotKey | None]
    left: Mapping[StatementKey, str]
    relaxed: frozenset[StatementKey]
    unserved: Array


@dataclass(frozen=True, slots=True)
class _AssignmentRound:
    """One round: levels by argument, the reasons of those that are ``LEFT``."""

    levels: Mapping[ArgumentKey, int]
    reasons: Mapping[StatementKey, str]


@dataclass(frozen=True, slots=True)
class _Filled:
    """Slots with their values: the slot of each request, the values, (n, 3) how far each target moves with it [mm]."""

    slot_of: Sequence[SlotKey | None]
    slots: Mapping[SlotKey, SlotValue]
    base: Array

    def slot(self, row: int) -> SlotKey | None:
        """The slot that moves a request, None where nothing does."""
        slot = self.slot_of[row]
        return slot if slot in self.slots else None


class Assigner:
    """Assigns the requests of one kind (goals or circle points).

    Args:
        astray: statements that also run elsewhere; expression: the argument of a statement as an expression.
        closed: slots that are not to be edited; fixed: slots that have their values already.
    """

    def __init__(
        self,
        incidence: Incidence,
        astray: Set[StatementKey],
        expression: Callable[[ArgumentKey], TargetExpression],
        closed: Set[SlotKey],
        fixed: Mapping[SlotKey, SlotValue],
    ) -> None:
        self.incidence, self.astray, self.expression = incidence, astray, expression
        self.closed, self.fixed = closed, fixed
        requests = incidence.requests
        self.shift = np.array([r.shift for r in requests]).reshape(-1, 3)
        self.turn = np.array([r.turn for r in requests]).reshape(-1, 3)
        roots = [r.origin.root for r in requests]
        self.lever = np.array([root.lever if root else (0.0, 0.0, 0.0) for root in roots]).reshape(-1, 3)
        self.within = np.array([r.within_mm for r in requests])
        self.relaxed = np.maximum(self.within, SHARE * np.linalg.norm(self.shift, axis=1))
        self.derived = np.array([root is not None for root in roots], dtype=bool)

    def assign(self) -> Assignment:
        """Raise levels until every argument is served or left."""
        now = _AssignmentRound(dict.fromkeys(self.incidence.of_argument, SLOT), {})
        while True:
            slot_of = self._slots_in_use(now)
            slots = self._slot_values(now, slot_of)
            filled = _Filled(slot_of, slots, self._moved_by(slots, slot_of))
            offsets: dict[ArgumentKey, OffsetLaw] = {}
            raised = self._raised(now, filled, offsets)
            if raised is None:
                break
            now = raised
        unserved = self.shift - filled.base
        for key, law in offsets.items():
            rows = list(self.incidence.of_argument[key])
            unserved[rows] -= self._in_object_axes(key, rows, law)
        relaxed = frozenset(key for (key, _), level in now.levels.items() if level in (RELAXED, MIDDLE))
        return Assignment(slots, offsets, slot_of, now.reasons, relaxed, unserved)

    def _slots_in_use(self, now: _AssignmentRound) -> list[SlotKey | None]:
        """The slot of every request: the first one that serves no statement which is left."""
        requests, left = self.incidence.requests, now.reasons
        shut = set(self.closed)
        if left:
            for key, rows in self.incidence.of_slot.items():
                if any(requests[row].event.statement.key in left for row in rows):
                    shut.add(key)
        return [next((slot for slot in slots if slot not in shut), None) for slots in self.incidence.slots]

    def _slot_values(self, now: _AssignmentRound, slot_of: Sequence[SlotKey | None]) -> dict[SlotKey, SlotValue]:
        """One value for each slot, from the arguments that it serves alone."""
        requests = self.incidence.requests
        voters: dict[SlotKey, list[int]] = {}
        silent: list[list[int]] = []
        for key, rows in self.incidence.of_argument.items():
            read_only = requests[rows[0]].event.statement.source.read_only
            complete = all(slot_of[row] is not None for row in rows)
            level = now.levels[key]
            if read_only or not (level == SLOT or (level == MIDDLE and complete)):
                silent.append(list(rows))
                continue
            for row in rows:
                if (slot := slot_of[row]) is not None and slot not in self.fixed:
                    voters.setdefault(slot, []).append(row)
        # What cannot be displaced, or comes from slots of which some are edited, votes for those that have no votes.
        more: dict[SlotKey, list[int]] = {}
        for rows in silent:
            read_only = requests[rows[0]].event.statement.source.read_only
            if read_only or any(slot_of[row] in voters for row in rows):
                for row in rows:
                    if (slot := slot_of[row]) is not None and slot not in voters and slot not in self.fixed:
                        more.setdefault(slot, []).append(row)
        voters |= more
        return {**self.fixed, **{slot: self._common(now, rows) for slot, rows in voters.items()}}

    def _common(self, now: _AssignmentRound, rows: Sequence[int]) -> SlotValue:
        """The value that serves most of the requests, those with the least tolerance first."""
        requests = self.incidence.requests
        if len(rows) == 1 and not self.derived[rows[0]]:
            row = rows[0]
            return SlotValue(self.shift[row], self.turn[row], requests[row].value.robconf, requests[row])
        chosen = np.array(rows)
        plain = chosen[~self.derived[chosen]]
        turn = midrange(self.turn[plain if len(plain) else chosen])
        demand = self.shift[chosen] - np.cross(turn, self.lever[chosen])
        within = np.array([self._within(now, row) for row in rows])
        confs = [requests[row].value.robconf for row in rows]
        weight = np.array([self._weight(row) for row in rows]) / within
        strict = np.flatnonzero(within <= 1.001 * within.min())
        seeds = [midrange(demand), midrange(demand[strict]), *demand[_spread(len(rows))]]
        best, most = seeds[0], -1.0
        for seed in seeds:
            near = np.linalg.norm(demand - seed, axis=1) <= 2.0 * within
            for value in [seed, midrange(demand[near])] if near.any() else [seed]:
                served = np.linalg.norm(demand - value, axis=1) <= within
                score = float(np.sum(served * weight))
                if score > most * (1 + 1e-9):
                    best, most = value, score
            if served.all():
                break
        return SlotValue(best, turn, max(set(confs), key=confs.count))

    def _weight(self, row: int) -> float:
        """What it would cost the text if the slot did not serve a request."""
        request = self.incidence.requests[row]
        return 1.0 if self.expression((request.event.statement.key, request.role)).form == "amounts" else AROUND

    def _within(self, now: _AssignmentRound, row: int) -> float:
        request = self.incidence.requests[row]
        relaxed = now.levels[request.event.statement.key, request.role] in (RELAXED, MIDDLE)
        return float(self.relaxed[row] if relaxed else self.within[row])

    def _moved_by(self, slots: Mapping[SlotKey, SlotValue], slot_of: Sequence[SlotKey | None]) -> Array:
        """(n, 3) how far [mm] each target moves with the slot that it comes from."""
        base = np.zeros_like(self.shift)
        for row, slot in enumerate(slot_of):
            value = slots.get(slot) if slot is not None else None
            if value is not None:
                base[row] = value.shift
                if self.derived[row]:
                    base[row] += np.cross(value.turn, self.lever[row])
        return base

    def _raised(
        self, now: _AssignmentRound, filled: _Filled, offsets: dict[ArgumentKey, OffsetLaw]
    ) -> _AssignmentRound | None:
        """The next round, None where every argument is served or left; the offsets of those that have one."""
        levels, reasons = dict(now.levels), dict(now.reasons)
        rest, whole = np.linalg.norm(self.shift - filled.base, axis=1), np.linalg.norm(self.shift, axis=1)
        for key, rows in self.incidence.of_argument.items():
            level, statement = now.levels[key], key[0]
            if level == LEFT or statement in reasons:
                levels[key] = LEFT
                continue
            served = all(filled.slot(row) is not None for row in rows)
            if self.incidence.requests[rows[0]].event.statement.source.read_only:
                if not served:
                    levels[key], reasons[statement] = LEFT, LENT
                continue
            fits = served and self._configured(key, rows, filled)
            if fits and all(rest[row] <= self._within(now, row) + ROUNDING_MM for row in rows):
                continue
            if level == SLOT:
                levels[key] = OFFSET
                continue
            law, why = self._offset(key, rows, filled, level)
            if law is not None:
                offsets[key] = law
            elif level in (OFFSET, RELAXED) and why is None:
                levels[key] = level + 1
            elif not (fits and self.derived[list(rows)].all() and all(rest[row] <= whole[row] for row in rows)):
                # What is derived from a corrected target follows that, where it is nowhere worse than no correction.
                levels[key], reasons[statement] = LEFT, why or self._unlike(rows)
        return (
            None if levels == dict(now.levels) and reasons == dict(now.reasons) else _AssignmentRound(levels, reasons)
        )

    def _configured(self, key: ArgumentKey, rows: Sequence[int], filled: _Filled) -> bool:
        """Whether the configuration that the requests ask for is what stands in their slots, or as it was.

        Where the text has no place for another one, one that a controller takes for it will do.
        """
        asked: list[tuple[Conf, Conf]] = []
        for row in rows:
            request, slot = self.incidence.requests[row], filled.slot(row)
            there = request.target.robconf if slot is None else filled.slots[slot].robconf
            asked.append((request.value.robconf, there))
        if all(wanted == there for wanted, there in asked):
            return True
        return not self._stated(key, rows) and all(compliant(wanted, there) for wanted, there in asked)

    def _stated(self, key: ArgumentKey, rows: Sequence[int]) -> bool:
        """Whether the argument can be written with one configuration for all of its runs."""
        return self.expression(key).stated and len({self.incidence.requests[row].value.robconf for row in rows}) == 1

    def _offset(
        self, key: ArgumentKey, rows: Sequence[int], filled: _Filled, level: int
    ) -> tuple[OffsetLaw | None, str | None]:
        """The offset around an argument that serves its runs, or why there can be none; neither where none fits."""
        requests = [self.incidence.requests[row] for row in rows]
        expression = self.expression(key)
        if key[0] in self.astray or any(r.event.has_unresolved_runs for r in requests):
            return None, ELSEWHERE
        configured = self._configured(key, rows, filled)
        if not configured and not self._stated(key, rows):
            return None, CONFIGURATION
        if configured and expression.form is None:
            return None, OWN_OFFS
        chosen = list(rows)
        rest = self._along(key, chosen, self.shift[chosen] - filled.base[chosen])
        worth = SHARE * self._left_by_middle(chosen, filled) if level == RELAXED else np.inf
        return self._law(chosen, rest, level, worth), None

    def _left_by_middle(self, rows: Sequence[int], filled: _Filled) -> float:
        """What one value for all runs that share a slot would leave [mm]; they share an offset where some have none."""
        shares = grouped((filled.slot_of[row], row) for row in rows)
        parts = [list(rows)] if None in shares else list(shares.values())
        return max(float(np.linalg.norm(constant_law(self.shift[part])[1], axis=1).max()) for part in parts)

    def _law(self, rows: Sequence[int], rest: Array, level: int, worth: float) -> OffsetLaw | None:
        """The law of an offset (n, 3) [mm] that the level allows, with as few numbers as will do.

        Args:
            worth: what it may leave at most where it is not within the tolerance [mm].
        """
        regressors = [dict(self.incidence.requests[row].event.numbers) for row in rows]
        within = self.within[rows]
        laws = [constant_law(rest)]
        if (np.linalg.norm(laws[0][1], axis=1) <= within + ROUNDING_MM).all():
            return laws[0][0]
        for fine in (within.min(), within.min() / 4):
            law = fit_affine(regressors, rest, float(fine))
            laws.append((law, rest - [law.at(run) for run in regressors]))
            if (np.linalg.norm(laws[-1][1], axis=1) <= within + ROUNDING_MM).all():
                return law
        if level == OFFSET:
            return None
        return nearest_law(laws, Allowed(0.0, np.minimum(self.relaxed[rows], worth).tolist()))

    def _along(self, key: ArgumentKey, rows: Sequence[int], offsets: Array) -> Array:
        """Offsets (n, 3) in the axes in which the argument displaces: those of the tool for ``RelTool``."""
        if not self.expression(key).in_tool:
            return offsets
        rots = np.array([self.incidence.requests[row].target.rot for row in rows])
        return np.asarray(Rotation.from_quat(rots, scalar_first=True).inv().apply(offsets))

    def _in_object_axes(self, key: ArgumentKey, rows: Sequence[int], law: OffsetLaw) -> Array:
        """(n, 3) what a law adds in each run [mm], object axes."""
        requests = [self.incidence.requests[row] for row in rows]
        offsets = np.array([law.at(dict(r.event.numbers)) for r in requests])
        if not self.expression(key).in_tool:
            return offsets
        rots = np.array([r.target.rot for r in requests])
        return np.asarray(Rotation.from_quat(rots, scalar_first=True).apply(offsets))

    def _unlike(self, rows: Sequence[int]) -> str:
        """Why runs that differ cannot be served."""
        requests = [self.incidence.requests[row] for row in rows]
        one = len({(r.target, r.origin.base.spans) for r in requests}) == 1
        return WAYS if one and any(r.event.way for r in requests) else DIFFERENT


def _spread(n: int) -> list[int]:
    """At most ``MOST_SEEDS`` rows, evenly spread."""
    return sorted({*np.linspace(0, n - 1, min(n, MOST_SEEDS)).astype(int).tolist()})


def _vec(values: Array) -> Vec3:
    x, y, z = values.tolist()
    return x, y, z
