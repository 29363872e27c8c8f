"""Motions recorded as events while a program is walked, and what has been recorded already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.data.records import JointTarget, RobTarget
from postproc.rapid.evaluation.memory import LOST, NOWHERE, Memory
from postproc.rapid.motions.elements import Choice, elements
from postproc.rapid.motions.events_of import EventMaker
from postproc.rapid.motions.predecessors import Predecessors, reached
from postproc.rapid.motions.regressors import Numbers, named_numbers
from postproc.rapid.motions.repeats import Repeats
from postproc.rapid.unknown import Kind


class Recorder:
    """Records motions.

    Args:
        ways: the events, and after which of them the arm may stand.
        visited: statements that have an event; first: indices of their first events; went: of the first event of a
            statement to each other target.
        elsewhere: statements that run again with another target.
        others: what numbers statements name on ways that are not followed, and where they go there.
        only_new: only what has not been recorded yet counts.
        cases: of statements to an element that only the controller knows, the last event of each case; reached: by the
            place to which such a statement goes, its event.
    """

    def __init__(self, maker: EventMaker) -> None:
        self.maker = maker
        self.repeats = Repeats(maker)
        self.ways = Predecessors()
        self.visited: set[StatementKey] = set()
        self.first: dict[StatementKey, int] = {}
        self.went: dict[tuple[StatementKey, RobTarget], int] = {}
        self.elsewhere: set[StatementKey] = set()
        self.others: set[tuple[StatementKey, RobTarget | JointTarget | None, Numbers]] = set()
        self.cases: dict[StatementKey, dict[Choice, int]] = {}
        self.reached: dict[tuple[object, ...], int] = {}
        self.only_new = False

    def move(self, statement: MotionStatement, memory: Memory) -> int:
        """One execution; how many events it takes beyond the first."""
        if memory.trial or (memory.returning and memory.ends <= LOST):
            return 0
        more = self._go(statement, memory)
        if memory.returning and statement.interpolation != "none":
            memory.ends = frozenset()
        return more

    def _go(self, statement: MotionStatement, memory: Memory) -> int:
        new, supposed = statement.key not in self.visited, memory.frame.supposed
        self.visited.add(statement.key)
        if not new and self.only_new:
            before_it = self.first.get(statement.key) if supposed else self._earlier(statement, memory)
            if supposed or before_it is not None:
                known = None if supposed or before_it is None else self.ways.events[before_it]
                if known is not None and known.numbers:
                    numbers = named_numbers(statement, known.target_origin, memory)
                    self.others.add((statement.key, known.target, numbers))
                memory.ends = LOST
                return 0
        make = self.maker.event if new else self.repeats.event
        ends = memory.ends
        event = make(statement, memory, self._before(ends))
        if memory.ends != ends:  # a function in its target has moved the arm
            event = replace(event, start=self.maker.start(self._before(memory.ends), statement, memory))
        if not new and self.only_new and event.reason is not None:
            self.elsewhere.add(statement.key)
            memory.ends = LOST
            return 0
        if event.target is None and (cases := elements(statement, memory)):
            return self._each(statement, cases, memory)
        if memory.returning and event.reason is not None:
            return 0
        return self._add(event, memory)

    def _before(self, ends: frozenset[int]) -> MotionEvent | None:
        """The event after which the arm stands, where that is the last one."""
        return self.ways.events[self.ways.last] if self.ways.events and ends == {self.ways.last} else None

    def _add(self, event: MotionEvent, memory: Memory) -> int:
        """Add an event; how many it takes beyond the first."""
        statement = event.statement
        events, before = self.ways.events, len(self.ways.events)
        memory.ends = self.ways.go(event, memory.ends)
        index = before
        while events[index].resumes_from is not None:
            index += 1
        if self.first.setdefault(statement.key, index) != index and isinstance(event.target, RobTarget):
            self.went.setdefault((statement.key, event.target), index)
        return len(events) - before - 1

    def _each(self, statement: MotionStatement, cases: Sequence[tuple[Choice, Memory]], memory: Memory) -> int:
        """One execution to each of the elements that may be meant; how many events it takes beyond the first.

        Where the motion before went by the same numbers, each case goes on from its own place.
        """
        begin, before = memory.ends, len(self.ways.events)
        last = {} if begin <= LOST else self.cases.get(self.ways.events[self.ways.last].statement.key, {})
        ends: dict[Choice, int] = {}
        for choice, case in cases:
            own = {last[choice]} if choice in last and begin == {*last.values()} else begin
            case.ends, case.conditional = frozenset(own) if len(own) == 1 else LOST, memory.conditional + 1
            event = self.maker.event(statement, case, self._before(case.ends))
            if event.target is None:
                if all(unknown.root.kind is not Kind.NEVER_TAUGHT for unknown in event.unknowns):
                    self.elsewhere.add(statement.key)
                continue
            place = reached(event)
            if place not in self.reached and not memory.returning:
                self._add(event, case)
                self.reached[place] = self.ways.last
            ends[choice] = self.reached.get(place, NOWHERE)
        self.cases[statement.key] = ends
        memory.ends = frozenset(ends.values()) or LOST
        return max(0, len(self.ways.events) - before - 1)

    def _earlier(self, statement: MotionStatement, memory: Memory) -> int | None:
        """The first event in which the statement went where it goes now; its first one where no target tells."""
        first = self.first[statement.key]
        known = self.ways.events[first].target
        if "to" not in statement.roles or not isinstance(known, RobTarget):
            return first
        target = self.maker.targets.robtarget(statement.source, statement.span_of("to"), memory)[0]
        if target == known:
            return first
        return self.went.get((statement.key, target)) if isinstance(target, RobTarget) else None
