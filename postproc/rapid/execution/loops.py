"""Loops: turn by turn where the text tells how many there are, else for all turns at once."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import replace

from postproc.diagnostics import Span
from postproc.rapid.data.values import Data, Value
from postproc.rapid.evaluation.assign import forget
from postproc.rapid.evaluation.evaluate import names_in
from postproc.rapid.evaluation.memory import Binding, Memory, Reference
from postproc.rapid.execution.calls import MAX_STEPS, Execution
from postproc.rapid.execution.jumps import UNTIL
from postproc.rapid.flow.constants import MAX_TURNS, counted
from postproc.rapid.program.statement_effects import UNSEEN
from postproc.rapid.syntax.nodes import Statement
from postproc.rapid.unknown import Kind, PartlyUnknown, Unknown, without_causes

MAX_IDLE_TURNS = 300  # of one loop that moves nothing
MOST_STEPS_ABOVE = 2  # times MAX_STEPS: from there on what is in a loop is not followed at all
MAX_TRIALS = 4  # turns to find out what every turn of a loop leaves as it was; after them all it changes is unknown


class Loops(Execution):
    """Executes FOR and WHILE: turn by turn if the number of turns is known, else once for all turns."""

    @abstractmethod
    def body(self, statements: Iterable[Statement], memory: Memory) -> bool:
        """Run statements on ``memory``; True if their end is reached, False if something leaves before it."""

    def truth(self, condition: Span, memory: Memory) -> bool | None:
        """Whether the condition at this span holds, by data or else by the oracle; None if it is not known."""
        data = self.deciding(condition, memory)
        return data if isinstance(data, bool) else self.asked(condition, memory)

    def deciding(self, span: Span, memory: Memory) -> Data:
        """Value of the expression at a span, by which a way is chosen: ``Assumed`` or ``Unknown`` if not certain.

        With an oracle that decides, and in added routines, an assumed value counts as certain.
        """
        data = self.data.value_or_not(span, memory)
        if self.oracle.decides or memory.frame.routine.key in self.added.routines:
            return without_causes(data)[0]  # a place is worked out of places that are assumed
        return data

    def asked(self, condition: Span, memory: Memory) -> bool | None:
        """The oracle's answer whether a condition holds that no data decides; None if it has none."""
        routine = memory.frame.routine
        words = routine.source.data[slice(*condition)].decode("latin-1")
        return self.oracle.condition(f"{routine.key} {words}")

    def for_loop(self, loop: Statement, memory: Memory) -> bool:
        """Run a FOR loop on ``memory``; True if its end is reached, False if its body is left.

        If the bounds are not known or the turns too many, the body is followed once, with all that it changes unknown.
        """
        hidden = memory.frame.bindings.get(loop.word)
        turns = self.turns(loop, memory)
        reached = True
        done = turns is not None
        for index in turns or ():
            if self.exhausted(memory.frame.routine.source):
                done = False
                break
            memory.frame.bindings[loop.word] = Value(index, "num")
            reached = self.body(loop.branches[0].body, memory)
            if not reached:
                break
        if reached and not done:
            self.unknown_turns(loop, memory, {loop.word: Unknown(Kind.LOOP_INDEX, loop.word)})
        memory.frame.bindings.pop(loop.word, None)
        if hidden is not None:
            memory.frame.bindings[loop.word] = hidden
        return reached

    def turns(self, loop: Statement, memory: Memory) -> list[float] | None:
        """Values of the index of a FOR loop, one per turn; None if they are not known or more than ``MAX_TURNS``."""
        bounds = [self.deciding(span, memory) for span in loop.parts]
        return counted(*bounds) if all(isinstance(bound, float) for bound in bounds) else self.oracle.turns()

    def while_loop(self, loop: Statement, memory: Memory) -> bool:
        """Run a WHILE loop on ``memory``; True if its end is reached, False if its body is left or it never ends."""
        condition = loop.parts[0] if loop.parts else (0, 0)
        words = memory.frame.routine.source.data[condition[0] : condition[1]]
        if loop.word != UNTIL and words.strip(b"() \t\r\n").lower() in (b"true", b""):
            self.unknown_turns(loop, memory, {}, certain=True)
            memory.leave(goes_on=False)
            return False
        keys = self.changes.of_one(loop, memory.frame.routine)
        turns = MAX_TURNS if "@moves" in keys else MAX_IDLE_TURNS
        if not self.can_end(condition, keys, memory):
            turns = 1
        for _ in range(turns):
            verdict = self.truth(condition, memory)
            if verdict is (loop.word == UNTIL):
                return True
            if verdict is None or self.exhausted(memory.frame.routine.source) or turns == 1:
                break
            before = _values(memory, keys)
            if not self.body(loop.branches[0].body, memory):
                return False
            if not _differing(before, _values(memory, keys)):
                break  # nor will it in the next turn: what ends the loop is not known
        self.unknown_turns(loop, memory, {})
        return True

    def can_end(self, condition: Span, keys: frozenset[str], memory: Memory) -> bool:
        """Whether the loop may change data that its condition names; False if the condition cannot be read.

        Args:
            keys: of the data that the loop may change.
        """
        try:
            names = names_in(self.data.tree(condition, memory))
        except Unknown:
            return False
        found = (memory.find(name) for name in names)
        return any("%" + name in keys for name in names) or any(d.key in keys for d in found if d is not None)

    def unknown_turns(
        self, loop: Statement, memory: Memory, bindings: dict[str, Binding], certain: bool = False
    ) -> None:
        """Follow the body of a loop of unknown turns once, with all data unknown that differs between turns.

        If it moves the arm, its beginning is followed again from its end, up to the first motion, as in a second turn.
        In a program with far too many steps it is not followed; then all that it may change is unknown.

        Args:
            bindings: values of loop indices in the body; certain: the body is known to run at least once.
        """
        keys = self.changes.of_one(loop, memory.frame.routine)
        memory.frame.bindings.update(bindings)
        if self.steps > MOST_STEPS_ABOVE * MAX_STEPS:
            forget(memory, keys, Kind.CHANGED_UNFOLLOWED)
            memory.doubt()
            return
        body, moves = loop.branches[0].body, "@moves" in keys
        functions = self.changes.of_functions(loop, memory.frame.routine)
        keys = self.varying(body, memory, keys) | self.changes.through(functions, memory.frame.routine)
        keys |= self.changes.of_one(loop, memory.frame.routine) & {UNSEEN}
        forget(memory, keys, Kind.CHANGED_IN_LOOP)
        begin = memory.ends
        memory.conditional += not certain
        if not self.body(body, memory):
            memory.ends = frozenset()
        elif moves and not memory.trial and not memory.returning and not self.recorder.only_new:
            next_turn = replace(memory.aside(), trial=False, returning=True)
            forget(next_turn, keys, Kind.CHANGED_IN_LOOP)
            self.body(body, next_turn)
        memory.conditional -= not certain
        forget(memory, keys, Kind.CHANGED_IN_LOOP)
        memory.ends = self.recorder.either(memory.ends, begin)

    def varying(self, body: tuple[Statement, ...], memory: Memory, keys: frozenset[str]) -> frozenset[str]:
        """Keys of data that may differ from one turn of a loop to the next, found by trials; at worst all ``keys``.

        Args:
            keys: of the data that the body may change.
        """
        found: set[str] = {UNSEEN} & keys
        if not memory.trial and not self.exhausted(memory.frame.routine.source):
            for _ in range(MAX_TRIALS):
                ends = self.tried(body, memory, keys, found)
                if ends <= found:
                    return frozenset(found)
                found |= ends
        return keys

    def tried(self, body: tuple[Statement, ...], memory: Memory, keys: frozenset[str], unknown: set[str]) -> set[str]:
        """Keys whose values differ after one trial turn, in which no motion is recorded and nothing is kept.

        Args:
            keys: of the data to compare; unknown: keys of data that is unknown at the start of the turn.
        """
        trial = memory.aside()
        forget(trial, unknown, Kind.CHANGED_IN_LOOP)
        before = _values(trial, keys)
        self.body(body, trial)
        return _differing(before, _values(trial, keys))


def _values(memory: Memory, keys: Iterable[str]) -> dict[str, object]:
    """The present values of data and state by key; a key itself stands for the value if nothing has set it."""
    found: dict[str, object] = {}
    for key in keys:
        bound = memory.frame.bindings.get(key[1:]) if key.startswith("%") else None
        if bound is None or isinstance(bound, Reference):
            found[key] = memory.changed.get(key if bound is None else bound.declaration.key, key)
        else:
            found[key] = bound
    return found


def _differing(before: Mapping[str, object], after: Mapping[str, object]) -> set[str]:
    """Keys whose value changed; an unknown value that is replaced by another unknown one counts as unchanged.

    Args:
        before, after: values by key.
    """
    return {key for key, now in after.items() if before[key] is not now and not _alike(before[key], now)}


def _alike(before: object, now: object) -> bool:
    """Whether two values are equal, where any two unknown values (or parts) count as equal."""
    match before, now:
        case PartlyUnknown(), PartlyUnknown():
            return _alike(before.data, now.data)
        case (PartlyUnknown(), _) | (_, PartlyUnknown()):
            return False
        case Unknown(), Unknown():
            return True
        case tuple(), tuple() if before != now and len(before) == len(now):
            return all(map(_alike, before, now))
    return before == now
