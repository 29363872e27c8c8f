"""From requests to changes of the text: what serves which statement, and how each correction is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensation.correction.curve import Exact
from postproc.compensation.path.motion import Motion
from postproc.compensation.text.assignment import Assigner, Assignment, SlotValue
from postproc.compensation.text.expressions import TargetExpression, target_expression
from postproc.compensation.text.laws import OffsetLaw
from postproc.compensation.text.slots import (
    ArgumentKey,
    Incidence,
    SlotKey,
    data_keys,
    fully_requested,
    incidence,
    led_elsewhere,
    possible_runs,
    slots_of,
    target_users,
)
from postproc.compensation.text.values import Change, Place, TargetRequest, TargetValue
from postproc.rapid.data.events import MotionEvent, MotionStatement, Origin, StatementKey
from postproc.rapid.data.pose import add, quat_mult
from postproc.rapid.data.records import Pose, RobTarget
from postproc.rapid.motions.units import object_matrices
from postproc.rapid.program.program import Program
from postproc.rapid.program.write_effects import WriteEffects
from postproc.robot.pose import pose_error

EXACT_MM = 1e-4  # a target that is written nearer than that is written as it is wanted
KINDS: dict[str, Place] = {"inline": "aggregate", "declared": "declaration", "element": "element"}


class Assigned:
    """Requests together with what is written for them.

    Args:
        links: which requests each slot could serve.
        assignment: the values of slots, and offsets.
    """

    def __init__(self, requests: Sequence[TargetRequest], links: Incidence, assignment: Assignment) -> None:
        self.requests, self.links, self.assignment = requests, links, assignment
        self.left, self.relaxed = assignment.left, assignment.relaxed

    @property
    def served(self) -> Set[StatementKey]:
        """Keys of the statements whose correction is written."""
        return {request.event.statement.key for request in self.requests} - self.left.keys()

    def without(self, arguments: Set[ArgumentKey]) -> Assigned:
        """A copy without the changes to the text of some arguments (each a statement and a role).

        These are their offsets, and the values of numbers that stand in the argument itself.
        """
        offsets = {key: law for key, law in self.assignment.offsets.items() if key not in arguments}
        theirs = {
            slot
            for request, slot in zip(self.requests, self.assignment.slot_of, strict=True)
            if (request.event.statement.key, request.role) in arguments and request.origin.stands_in_statement
        }
        slots = {slot: value for slot, value in self.assignment.slots.items() if slot not in theirs}
        return Assigned(self.requests, self.links, replace(self.assignment, slots=slots, offsets=offsets, left={}))


class Writer:
    """Assigns requests to places in the text of a program and makes the changes.

    Args:
        events: all of the program.
        motion: moves and samples of the program.
    """

    def __init__(self, program: Program, events: Sequence[MotionEvent], motion: Motion) -> None:
        self.program, self.events, self.motion = program, events, motion
        self.effects = changes = WriteEffects(program)
        self.users = target_users(program, changes)
        self.written = changes.may_be_written | changes.shared  # one value serves the arms of all tasks
        self.runs = possible_runs(events, {move.row for move in motion.moves})
        self.statements = {s.key: s for s in program.statements}
        self._expressions: dict[ArgumentKey, TargetExpression] = {}

    def assign(self, requests: Sequence[TargetRequest], goals: Assigned | None = None) -> Assigned:
        """Decide what is written for requests of goals, or, if ``goals`` are assigned already, of circle points.

        A slot (place in the text with a target's numbers) that got a value for goals then keeps it, and one that could
        serve goals but got no value is not used.
        """
        moves = self.motion.moves
        rows = {moves[r.move].row for r in requests}
        complete: Set[StatementKey] = fully_requested(self.runs, rows) if goals is None else goals.served
        fixed = {} if goals is None else goals.assignment.slots
        shared = set[SlotKey]() if goals is None else goals.links.of_slot.keys() - fixed.keys()
        links = incidence(requests, self.users, complete, self.written)
        closed = shared | self._unforeseen(requests, links)
        assigner = Assigner(links, led_elsewhere(self.runs, rows), self.expression, closed, fixed)
        return Assigned(requests, links, assigner.assign())

    def _unforeseen(self, requests: Sequence[TargetRequest], links: Incidence) -> set[SlotKey]:
        """Slots (places with a target's numbers) that some statement uses in an expression that cannot be traced back.

        Such a statement is known to derive its target from the slot's data, but none of its own requests says so.

        Args:
            links: which of the requests each slot could serve.
        """
        if not any(known.derived for known in self.users.values()):
            return set()
        follows: dict[StatementKey, set[str]] = {}
        for request in requests:
            follows.setdefault(request.event.statement.key, set()).update(data_keys(request.origin))
        closed = set()
        for slot, rows in links.of_slot.items():
            for name in data_keys(requests[rows[0]].origin):
                known = self.users.get(name)
                if known is not None and any(name not in follows.get(key, {name}) for key in known.derived):
                    closed.add(slot)
        return closed

    def expression(self, key: ArgumentKey) -> TargetExpression:
        """How the text of an argument, by statement and role, can be changed; cached."""
        if key not in self._expressions:
            statement = self.statements[key[0]]
            argument = statement.argument(key[1])
            assert argument is not None
            found = target_expression(statement.source, argument.span, self.program)
            self._expressions[key] = found
        return self._expressions[key]

    def placed(self, goals: Assigned, exact: Exact) -> dict[int, Array]:
        """Moves whose written target misses the corrected one by more than ``EXACT_MM``.

        Args:
            goals: what is written for the goals.
            exact: has the corrected flange pose of every move.

        Returns:
            By index of the move, the shift (6,) [m, rad] that the text gives the programmed goal, in the work frame.
        """
        off = np.linalg.norm(goals.assignment.unserved, axis=1)
        rows = np.flatnonzero(off > EXACT_MM).tolist()
        if not rows:
            return {}
        moves = [goals.requests[row].move for row in rows]
        samples = self.motion.samples
        T_goal, T_corrected = samples.T_work_tcp[samples.goal], samples.curves.mounts.work(exact.T_base_flange)
        wanted = pose_error(T_goal[moves], T_corrected[moves])
        turn = object_matrices([self.motion.moves[i].event for i in moves])[:, :3, :3]
        wanted[:, :3] -= 1e-3 * np.einsum("nij,nj->ni", turn, goals.assignment.unserved[rows])
        return dict(zip(moves, wanted, strict=True))

    def corrected(self, parts: Sequence[Assigned]) -> Callable[[Origin, RobTarget], RobTarget]:
        """A function of a target's origin and value that returns the target with what is written into its slot.

        Args:
            parts: what is written for goals and for circle points.
        """

        def moved(origin: Origin, target: RobTarget) -> RobTarget:
            """The target with the value of the first slot of its origin that has one, else unchanged."""
            values = (part.assignment.slots.get(slot) for part in parts for slot in slots_of(origin))
            value = next((value for value in values if value is not None), None)
            return target if value is None else _moved(target, value)

        return moved

    def changes(self, parts: Sequence[Assigned]) -> tuple[tuple[Change, ...], dict[StatementKey, Place]]:
        """The texts to change, each slot once, and the kind of place where each statement's correction is written.

        Args:
            parts: what is written for goals and for circle points.
        """
        changes: list[Change] = []
        places: dict[StatementKey, Place] = {}
        done: set[SlotKey] = set()
        for part in parts:
            for row, (request, slot) in enumerate(zip(part.requests, part.assignment.slot_of, strict=True)):
                key = request.event.statement.key
                value = part.assignment.slots.get(slot) if slot is not None else None
                if key in part.left or slot is None or value is None:
                    continue
                origin = request.origin
                base, derived = origin.base, origin.root is not None
                called = base.handed is not None and (slot[0] == "call" or base.kind == "inline")
                places.setdefault(key, "derived" if derived else "call" if called else KINDS.get(base.kind, "call"))
                if slot not in done:
                    done.add(slot)
                    changes.append(self._in_slot(part.requests[row], slot, value))
            for argument, law in part.assignment.offsets.items():
                if argument[0] not in part.left:
                    changes.append(self._around(part, argument, law))
                    places[argument[0]] = "argument"
        return tuple(changes), places

    def _in_slot(self, request: TargetRequest, slot: SlotKey, value: SlotValue) -> Change:
        """The change that writes a value into a slot: new numbers of a target, or an offset in a call's argument.

        Args:
            request: one that the slot serves.
        """
        origin = request.origin
        base, root = origin.base, origin.root
        if slot[0] == "numbers" and base.spans is not None and root is None and value.of is request:
            return Change(base.spans.source, base.spans.whole, "numbers", request.value)
        now = request.target if root is None else root.target
        moved = _moved(now, value)
        whole = TargetValue(Pose(moved.trans, moved.rot), moved.robconf, now.extax)
        if slot[0] == "numbers":
            assert base.spans is not None
            return Change(base.spans.source, base.spans.whole, "numbers", whole)
        assert base.handed is not None
        source, span = base.handed.source, base.handed.span
        written = target_expression(source, span, self.program)
        return self._offset(Change(source, span, "offset", whole), written, value.shift, now)

    def _around(self, part: Assigned, argument: ArgumentKey, law: OffsetLaw) -> Change:
        """The change that puts an offset around an argument, given by statement and role.

        Args:
            part: what is written for goals or for circle points, to which the argument belongs.
            law: formula of the offset.
        """
        rows = part.links.of_argument[argument]
        request = part.requests[rows[0]]
        statement: MotionStatement = request.event.statement
        place = statement.argument(argument[1])
        assert place is not None
        form = self.expression(argument).form
        assert form is not None
        return Change(statement.source, place.span, form, request.value, law)

    @staticmethod
    def _offset(change: Change, written: TargetExpression, shift: Array, now: RobTarget) -> Change:
        """A copy of a change with a constant offset ``shift`` (3,) [mm] in object axes, in the form the text allows.

        Args:
            written: how the text can be changed.
            now: present value of the target.
        """
        along = shift
        if written.in_tool:
            along = Rotation.from_quat(now.rot, scalar_first=True).inv().apply(shift)
        x, y, z = np.asarray(along).tolist()
        return replace(change, form=written.form or "components", law=OffsetLaw((x, y, z)))


def _moved(target: RobTarget, value: SlotValue) -> RobTarget:
    """A target shifted and turned by a value for its slot (place with its numbers), in the configuration it states."""
    x, y, z = value.shift.tolist()
    w, a, b, c = Rotation.from_rotvec(value.turn).as_quat(scalar_first=True).tolist()
    rot, robconf = quat_mult((w, a, b, c), target.rot), value.robconf or target.robconf
    return replace(target, trans=add(target.trans, (x, y, z)), rot=rot, robconf=robconf)
