"""From requests to changes of the text: what serves which statement, and how each correction is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensation.correction.curve import Exact
from postproc.compensation.path.motion import Motion
from postproc.compensation.text.assignment import Assignment, SlotValue, assign, demands_of
from postproc.compensation.text.laws import OffsetLaw
from postproc.compensation.text.slots import (
    ArgumentKey,
    SlotKey,
    TargetExpression,
    data_keys,
    may_serve,
    possible_runs,
    requested_statements,
    slots_of,
    target_expression,
    target_users,
)
from postproc.compensation.text.values import Change, Place, TargetRequest, TargetValue
from postproc.rapid.data.events import MotionEvent, Origin, StatementKey
from postproc.rapid.data.pose import add, quat_mult
from postproc.rapid.data.records import Pose, RobTarget
from postproc.rapid.motions.units import object_matrices
from postproc.rapid.program.program import Program
from postproc.rapid.program.write_effects import WriteEffects
from postproc.robot.pose import pose_error

EXACT_MM = 1e-4  # a target that is written nearer than that is written as it is wanted
KINDS: dict[str, Place] = {"inline": "aggregate", "declared": "declaration", "element": "element"}


class Writer:
    """Assigns requests to places in the text of a program and makes the changes.

    Args:
        events: all of the program.
        motion: moves and samples of the program.
    """

    def __init__(self, program: Program, events: Sequence[MotionEvent], motion: Motion) -> None:
        self.program, self.events, self.motion = program, events, motion
        self.effects = changes = WriteEffects(program)
        self.users = target_users(program)
        self.written = changes.may_be_written | changes.shared  # one value serves the arms of all tasks
        self.runs = possible_runs(events, {move.row for move in motion.moves})
        self.statements = {s.key: s for s in program.statements}
        self.expression: Callable[[ArgumentKey], TargetExpression] = cache(self._expression)

    def assign(
        self, requests: Sequence[TargetRequest], goals: Assignment | None = None, *, anyway: bool = False
    ) -> Assignment:
        """Decide what is written for requests of goals, or, if ``goals`` are assigned already, of circle points.

        A slot (place in the text with a target's numbers) that got a value for goals then keeps it, and one that could
        serve goals but got no value is not used.

        Args:
            anyway: one value serves runs that need different ones, however far it is off.
        """
        rows = {self.motion.moves[r.move].row for r in requests}
        requested, unresolved = requested_statements(self.runs, rows)
        complete = requested if goals is None else served(goals)
        fixed = {} if goals is None else goals.slots
        shared = set() if goals is None else goals.demands.of_slot.keys() - fixed.keys()
        known = self.users, complete, self.written
        editable = [[slot for slot in slots_of(r.origin) if may_serve(slot, r, *known)] for r in requests]
        closed = shared | self._unforeseen(requests, editable)
        demands = demands_of(requests, editable, closed, unresolved, self.expression)
        if anyway:
            demands = replace(demands, largest=np.full(len(requests), np.inf))
        return assign(demands, fixed)

    def _unforeseen(self, requests: Sequence[TargetRequest], editable: Sequence[Sequence[SlotKey]]) -> set[SlotKey]:
        """Slots (places with a target's numbers) that some statement uses in an expression that cannot be traced back.

        Such a statement is known to derive its target from the slot's data, but none of its own requests says so.

        Args:
            editable: the slots of each request.
        """
        follows: dict[StatementKey, set[str]] = {}
        for request in requests:
            follows.setdefault(request.event.statement.key, set()).update(data_keys(request.origin))
        lost = {
            name
            for name, known in self.users.items()
            if any(name not in follows.get(key, {name}) for key in known.derived)
        }
        first: dict[SlotKey, TargetRequest] = {}
        for request, slots in zip(requests, editable, strict=True):
            for slot in slots if lost else ():
                first.setdefault(slot, request)
        return {slot for slot, request in first.items() if lost & data_keys(request.origin)}

    def _expression(self, key: ArgumentKey) -> TargetExpression:
        """How the text of an argument, by statement and role, can be changed."""
        statement = self.statements[key[0]]
        return target_expression(statement.source, statement.span_of(key[1]), self.program)

    def placed(self, goals: Assignment, exact: Exact) -> dict[int, Array]:
        """Moves whose written target misses the corrected one by more than ``EXACT_MM``.

        Args:
            goals: what is written for the goals.
            exact: has the corrected flange pose of every move.

        Returns:
            By index of the move, the shift (6,) [m, rad] that the text gives the programmed goal, in the work frame.
        """
        rows = np.flatnonzero(np.linalg.norm(goals.unserved, axis=1) > EXACT_MM).tolist()
        if not rows:
            return {}
        moves = [goals.demands.requests[row].move for row in rows]
        samples = self.motion.samples
        T_goal, T_corrected = samples.T_work_tcp[samples.goal], samples.curves.mounts.work(exact.T_base_flange)
        wanted = pose_error(T_goal[moves], T_corrected[moves])
        turn = object_matrices([self.motion.moves[i].event for i in moves])[:, :3, :3]
        wanted[:, :3] -= 1e-3 * np.einsum("nij,nj->ni", turn, goals.unserved[rows])
        return dict(zip(moves, wanted, strict=True))

    def changes(
        self, parts: Sequence[Assignment], elsewhere: Set[ArgumentKey] = frozenset()
    ) -> tuple[tuple[Change, ...], dict[StatementKey, Place]]:
        """The texts to change, each slot once, and the kind of place where each statement's correction is written.

        Args:
            parts: what is written for goals and for circle points.
            elsewhere: arguments whose own text gets another change.
        """
        changes: dict[SlotKey | ArgumentKey, Change] = {}
        places: dict[StatementKey, Place] = {}
        for part in parts:
            for request, slot in zip(part.demands.requests, part.demands.slot_of, strict=True):
                key, origin = request.event.statement.key, request.origin
                if slot is None or slot not in part.slots or key in part.refused:
                    continue
                if origin.stands_in_statement and (key, request.role) in elsewhere:
                    continue
                base = origin.base
                called = base.handed is not None and (slot[0] == "call" or base.kind == "inline")
                kind = "call" if called else KINDS.get(base.kind, "call")
                places.setdefault(key, "derived" if origin.root is not None else kind)
                if slot not in changes:
                    changes[slot] = self._in_slot(request, slot, part.slots[slot])
            for argument, law in part.offsets.items():
                if argument[0] not in part.refused and argument not in elsewhere:
                    changes[argument] = self._around(part, argument, law)
                    places[argument[0]] = "argument"
        return tuple(changes.values()), places

    def _in_slot(self, request: TargetRequest, slot: SlotKey, value: SlotValue) -> Change:
        """The change that writes a value into a slot: new numbers of a target, or an offset in a call's argument.

        Args:
            request: one that the slot serves.
        """
        origin = request.origin
        base, root = origin.base, origin.root
        if slot[0] == "numbers" and base.spans is not None and root is None and value.of is request:
            return Change(base.spans.source, base.spans.span, "numbers", request.value)
        now = request.target if root is None else root.target
        moved = _moved(now, value)
        target = TargetValue(Pose(moved.trans, moved.rot), moved.robconf, now.extax)
        if slot[0] == "numbers":
            assert base.spans is not None
            return Change(base.spans.source, base.spans.span, "numbers", target)
        assert base.handed is not None
        source, span = base.handed.source, base.handed.span
        expression, along = target_expression(source, span, self.program), value.shift
        if expression.in_tool:
            along = Rotation.from_quat(now.rot, scalar_first=True).inv().apply(along)
        x, y, z = np.asarray(along).tolist()
        return Change(source, span, expression.form or "components", target, OffsetLaw((x, y, z)))

    def _around(self, part: Assignment, argument: ArgumentKey, law: OffsetLaw) -> Change:
        """The change that puts an offset with formula ``law`` around an argument, given by statement and role."""
        request = part.demands.requests[part.demands.arguments[argument][0]]
        place, form = request.event.statement.argument(argument[1]), self.expression(argument).form
        assert place is not None and form is not None
        return Change(request.event.statement.source, place.span, form, request.value, law)


def served(assignment: Assignment) -> Set[StatementKey]:
    """Keys of the statements whose correction is written."""
    return {request.event.statement.key for request in assignment.demands.requests} - assignment.refused.keys()


def corrected(parts: Sequence[Assignment]) -> Callable[[Origin, RobTarget], RobTarget]:
    """A function of a target's origin and value that returns the target with what is written into its slot.

    Args:
        parts: what is written for goals and for circle points.
    """

    def moved(origin: Origin, target: RobTarget) -> RobTarget:
        """The target with the value of the first slot of its origin that has one, else unchanged."""
        values = (part.slots.get(slot) for part in parts for slot in slots_of(origin))
        value = next((value for value in values if value is not None), None)
        return target if value is None else _moved(target, value)

    return moved


def _moved(target: RobTarget, value: SlotValue) -> RobTarget:
    """A target shifted and turned by a value for its slot (place with its numbers), in the configuration it states."""
    x, y, z = value.shift.tolist()
    w, a, b, c = Rotation.from_rotvec(value.turn).as_quat(scalar_first=True).tolist()
    rot, robconf = quat_mult((w, a, b, c), target.rot), value.robconf or target.robconf
    return replace(target, trans=add(target.trans, (x, y, z)), rot=rot, robconf=robconf)
