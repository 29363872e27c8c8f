"""What one statement does to where the arm stands and to data, without the statements inside it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from postproc.rapid.data.events import MotionStatement
from postproc.rapid.flow.states import NOTHING, Writes
from postproc.rapid.program.arguments import argument_name
from postproc.rapid.program.instructions import MOVING
from postproc.rapid.program.program import Program, statements_in
from postproc.rapid.program.statement_effects import NO_EFFECT, UNSEEN, StatementEffect
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import word_set

# Beside those that move the arm by themselves: what leaves the path, or takes up another.
LEAVING = MOVING | word_set("clearpath storepath restopath startmoveretry pathrecmovebwd pathrecmovefwd")


@dataclass(frozen=True, slots=True)
class Go:
    """The step of a motion that may take the arm to another place.

    Args:
        unresolved_start: where it ends, and the next motion starts, is known only at run time, as for a search.
    """

    statement: MotionStatement
    unresolved_start: bool = False


@dataclass(frozen=True, slots=True)
class Write:
    """The step of anything that may write data of these keys and does not move the arm."""

    keys: Writes


@dataclass(frozen=True, slots=True)
class CallStep:
    """The step of a call that runs one of several routines.

    Args:
        routines: keys of those of the program.
        unseen: whether it may be one in none of the files, which may move the arm to anywhere.
        keys: what the call may write, by the names that hold in the caller.
    """

    routines: tuple[str, ...]
    unseen: bool
    keys: Writes


Step = Go | Write | CallStep
LOSE = CallStep((), True, NOTHING)


class StepReader:
    """Reads the steps of statements of a program: what they do to the arm and to data."""

    def __init__(self, program: Program, changes: WriteEffects) -> None:
        """Take the program and its write effects."""
        self.program, self.changes = program, changes

    def steps(self, statement: Statement, routine: Routine) -> Iterator[Step]:
        """The steps (motion, write, call) of a statement in order, without the statements inside it."""
        yield from self.functions(statement, routine)
        if statement.kind == "call":
            motion = self.program.motions.get((routine.source.path, statement.span[0]))
            if motion is not None:
                yield from self._of_motion(motion, statement, routine)
            else:
                yield from self._of_call(statement, routine)
        elif statement.kind in ("assign", "connect"):
            yield from self._writes(statement, routine)
        elif statement.kind == "opaque":
            yield LOSE

    def functions(self, statement: Statement, routine: Routine) -> Iterator[Step]:
        """At most one step: the call of all functions in the statement's own expressions that may write data."""
        effect = self.changes.direct.functions(statement, routine)
        if effect is not NO_EFFECT:
            yield _call(effect, self.changes.through(effect, routine))

    def _of_motion(self, motion: MotionStatement, statement: Statement, routine: Routine) -> Iterator[Step]:
        """Steps of a motion statement: the motion, then what a search or the procedure that it starts may write."""
        measures, still = bool(motion.signature.results), motion.interpolation == "none"
        if not still:
            yield Go(motion, measures)
        if still or measures or "procedure" in motion.roles:
            yield from self._writes(statement, routine)

    def _writes(self, statement: Statement, routine: Routine) -> Iterator[Step]:
        """A step with the keys that a statement may write; before it ``LOSE`` if code in none of the files may run."""
        keys = self.changes.of_one(statement, routine)
        if UNSEEN in keys:
            yield LOSE
        keys -= {"@moves", UNSEEN}
        if keys:
            yield Write(keys)

    def _of_call(self, statement: Statement, routine: Routine) -> Iterator[Step]:
        """At most one step, of a call that is no motion: call of routines, ``LOSE`` if it may move the arm, write."""
        effect, keys = self.changes.direct.own(statement, routine), self.changes.of_one(statement, routine)
        if effect.calls:
            yield _call(effect, keys)
        elif effect.unseen or statement.word in LEAVING:
            yield LOSE
        elif keys:
            yield Write(keys)


def _call(effect: StatementEffect, keys: Writes) -> CallStep:
    """The step of a call.

    Args:
        effect: of the call; keys: what it may write, with what the called routines write.
    """
    return CallStep(tuple(sorted({key for key, _ in effect.calls})), bool(effect.unseen), keys - {"@moves", UNSEEN})


def comes_back(trap: Routine, reader: StepReader) -> bool:
    """Whether a trap brings the arm back to where it was.

    All its motions must stand between ``StorePath`` and ``RestoPath``, and the last one must go to the place where the
    arm stood (``p:=CRobT(); StorePath; .. MoveL p,..; RestoPath;``).
    """
    stored, last = False, None
    for statement in trap.body:
        if statement.word in ("storepath", "restopath") and statement.kind == "call":
            if stored and statement.word == "restopath" and not _goes_back(last, trap, reader):
                return False
            stored, last = statement.word == "storepath", None
        elif any(not isinstance(step, Write) for s in statements_in([statement]) for step in reader.steps(s, trap)):
            last = statement
            if not stored or statement.kind in ("return", "goto", "leave"):
                return False
    return not stored


def _goes_back(last: Statement | None, trap: Routine, reader: StepReader) -> bool:
    """Whether the last motion of a trap goes to a position read from the arm; True without a motion (None)."""
    motion = None if last is None else reader.program.motion(trap.source, last)
    if motion is None or "to" not in motion.roles:
        return last is None
    name = argument_name(trap.source.data, motion.span_of("to"))
    declared = reader.program.declaration(name, trap.module, trap.name)
    return declared is not None and declared.key in reader.changes.measured
