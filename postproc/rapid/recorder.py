"""Motions recorded as events while a program is walked, and what has been recorded already."""

from __future__ import annotations

from dataclasses import replace

from postproc.rapid.events import MotionStatement, StatementKey
from postproc.rapid.memory import Memory
from postproc.rapid.records import RobTarget
from postproc.rapid.repeats import Repeats
from postproc.rapid.steps import EventMaker
from postproc.rapid.ways import Ways


class Recorder:
    """Records motions.

    Args:
        ways: the events, and after which of them the arm may stand.
        visited: offsets of the statements that have an event, by file; first: indices of their first events.
        elsewhere: statements that run again with another target; astray: that begin elsewhere.
        only_new: only what has not been recorded yet counts.
        supposed: what runs now has run before as far as its calls tell: only what is new in it counts.
        chosen: some call means nobody knows which routine: what is supposed to have run may begin anywhere.
        emitting: motions become events; not while something is tried out.
        returning: from the end of a loop to the first motion of its next turn.
    """

    def __init__(self, maker: EventMaker) -> None:
        self.maker = maker
        self.repeats = Repeats(maker)
        self.ways = Ways()
        self.visited: dict[str, set[int]] = {}
        self.first: dict[StatementKey, int] = {}
        self.elsewhere: set[StatementKey] = set()
        self.astray: set[StatementKey] = set()
        self.only_new = self.supposed = self.chosen = False
        self.emitting, self.returning = True, False

    def move(self, statement: MotionStatement, memory: Memory, conditional: bool) -> int:
        """One execution; how many events it takes beyond the first."""
        if not self.emitting or (self.returning and not self.ways.known):
            return 0
        more = self._go(statement, memory, conditional)
        if self.returning and statement.interpolation != "none":
            self.ways.ends = frozenset()
        return more

    def _go(self, statement: MotionStatement, memory: Memory, conditional: bool) -> int:
        seen = self.visited.setdefault(statement.source.path, set())
        new = statement.span[0] not in seen
        seen.add(statement.span[0])
        if not new and self.only_new and (self.supposed or self._same_target(statement, memory)):
            self._pass(statement.key)
            return 0
        make = self.maker.event if new else self.repeats.event
        event = make(statement, memory, conditional)
        if not new and self.only_new and event.reason is not None:
            self.elsewhere.add(statement.key)
            self.ways.lose()
            return 0
        if self.returning and event.reason is not None:
            return 0
        events, before = self.ways.events, len(self.ways.events)
        came_from = events[self.ways.last] if before and self.ways.ends == {self.ways.last} else None
        start = self.maker.start(came_from, event, memory) if came_from is not None else None
        if start is not None:
            event = replace(event, start=start)
        self.ways.go(event)
        if statement.key not in self.first:
            self.first[statement.key] = next(i for i in range(before, len(events)) if events[i].again is None)
        return len(events) - before - 1

    def _pass(self, key: StatementKey) -> None:
        """Run a statement again to the place to which it went first."""
        first = self.first.get(key)
        if first is None:
            self.ways.lose()
            return
        if (self.chosen or not self.supposed) and not self.ways.begin_as(first):
            self.astray.add(key)
        self.ways.stay(first)

    def _same_target(self, statement: MotionStatement, memory: Memory) -> bool:
        """Whether a further execution goes where the first one went."""
        first = self.ways.events[self.first[statement.key]]
        to = statement.argument("to")
        if to is None or not isinstance(first.target, RobTarget):
            return True
        return self.maker.targets.robtarget(statement.source, to.span, memory)[0] == first.target
