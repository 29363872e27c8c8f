"""Motions recorded as events while a program is walked, by every way by which the arm may come to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.data.records import JointTarget, RobTarget
from postproc.rapid.evaluation.memory import LOST, NOWHERE, Memory
from postproc.rapid.motions.events_of import EventMaker, Numbers, named_numbers
from postproc.rapid.motions.targets import IndexValues, elements
from postproc.rapid.unknown import Kind

MOST_KEPT = 256  # places where the arm may stand, of a program with a thousand branches
MOST_STARTS = 8  # places from which the arm may come to a motion that are told apart


class Recorder:
    """Records motions; where the arm stands on a way is told by ``Memory.ends``.

    Args:
        events: in the order in which they run; where several ways meet, one after the other.
        last: the last event that moves the arm.
        visited: statements that have an event; first: indices of their first events; went: of the first event of a
            statement to each other target.
        other_targets: statements that run again with another target.
        others: what numbers statements name on ways that are not followed, and where they go there.
        only_new: only what has not been recorded yet counts.
        cases: of statements to an element that only the controller knows, the last event of each case; reached: by the
            place to which such a statement goes, its event; chosen: by index of that event, the numbers that chose it.
    """

    def __init__(self, maker: EventMaker) -> None:
        """Start without events; ``maker`` makes each of them."""
        self.maker = maker
        self.events: list[MotionEvent] = []
        self.last = NOWHERE
        self.visited: set[StatementKey] = set()
        self.first: dict[StatementKey, int] = {}
        self.went: dict[tuple[StatementKey, RobTarget], int] = {}
        self.other_targets: set[StatementKey] = set()
        self.others: set[tuple[StatementKey, RobTarget | JointTarget | None, Numbers]] = set()
        self.cases: dict[StatementKey, dict[IndexValues, int]] = {}
        self.reached: dict[tuple[object, ...], int] = {}
        self.chosen: dict[int, tuple[tuple[str, float], ...]] = {}
        self.only_new = False

    def move(self, statement: MotionStatement, memory: Memory) -> int:
        """Record one execution of a motion statement.

        Returns:
            Number of events recorded beyond the first; 0 also if none is (a trial, or not new).
        """
        if memory.trial or (memory.returning and memory.ends <= LOST):
            return 0
        moved = self._go(statement, memory)
        if memory.returning and statement.interpolation != "none":
            memory.ends = frozenset()
        return moved

    def _go(self, statement: MotionStatement, memory: Memory) -> int:
        """Record one execution, or one to each element that an unknown index may choose.

        With ``only_new`` nothing is recorded for a statement with an event to this target.

        Returns:
            Number of events recorded beyond the first.
        """
        new = statement.key not in self.visited
        self.visited.add(statement.key)
        if not new and self.only_new and self._is_known(statement, memory):
            memory.ends = LOST
            return 0
        event = self.maker.event(statement, memory)
        if not new and self.only_new and event.reason is not None:
            self.other_targets.add(statement.key)
            memory.ends = LOST
            return 0
        if event.target is None and (cases := elements(statement, memory)):
            return self._each(statement, cases, memory)
        if memory.returning and event.reason is not None:
            return 0
        return self._add(event, memory)

    def _add(self, event: MotionEvent, memory: Memory) -> int:
        """Append an event, once for every way by which the arm comes; the arm then stands behind it.

        On a way other than from the event before, an event with ``resumes_from`` first puts the arm where that way led.

        Returns:
            How many events that takes beyond the first.
        """
        statement = event.statement
        events, before = self.events, len(self.events)
        still = statement.interpolation == "none" and event.reason is None
        if still:
            events.append(event)
        else:
            if self.last == NOWHERE or memory.ends != {self.last}:
                self._go_by_all_paths(event, memory.ends)
            else:  # as nearly all do: on from the motion before
                events.append(event)
            self.last = len(events) - 1
            memory.ends = frozenset({self.last})
        index = before
        while events[index].resumes_from is not None:
            index += 1
        if self.first.setdefault(statement.key, index) != index and isinstance(event.target, RobTarget):
            self.went.setdefault((statement.key, event.target), index)
        return 0 if still else self.last - before

    def _each(self, statement: MotionStatement, cases: Sequence[tuple[IndexValues, Memory]], memory: Memory) -> int:
        """Record an execution for each element that may be meant; returns the number of events beyond the first.

        If the motion before chose by the same numbers, each case goes on from the place of its own case.

        Args:
            cases: index values and memory of each element, from ``elements``.
        """
        begin, before = memory.ends, len(self.events)
        last = {} if begin <= LOST else self.cases.get(self.events[self.last].statement.key, {})
        ends: dict[IndexValues, int] = {}
        for choice, case in cases:
            starts = {last[choice]} if choice in last and begin == {*last.values()} else begin
            case.ends, case.conditional = frozenset(starts) if len(starts) == 1 else LOST, memory.conditional + 1
            event = replace(self.maker.event(statement, case), one_of_several=True)
            if event.target is None:
                if all(unknown.root.kind is not Kind.NEVER_TAUGHT for unknown in event.unknowns):
                    self.other_targets.add(statement.key)
                continue
            chosen = tuple((name, value) for name, _, value in choice)
            place = reached(event), chosen
            if place not in self.reached and not memory.returning:
                self._add(event, case)
                self.chosen[self.last] = chosen
                self.reached[place] = self.last
            ends[choice] = self.reached.get(place, NOWHERE)
        self.cases[statement.key] = ends
        memory.ends = frozenset(ends.values()) or LOST
        return max(0, len(self.events) - before - 1)

    def _is_known(self, statement: MotionStatement, memory: Memory) -> bool:
        """Whether there is an event already for what a statement does now; notes the numbers that it names now."""
        if memory.frame.supposed:
            return True
        before = self._earlier(statement, memory)
        if before is None:
            return False
        known = self.events[before]
        if known.numbers:
            numbers = named_numbers(statement, known.target_origin, memory)
            self.others.add((statement.key, known.target, numbers))
        return True

    def _earlier(self, statement: MotionStatement, memory: Memory) -> int | None:
        """Index of the first event in which the statement went to its present target; None if it has not gone there.

        For a statement whose first event has no known robtarget it is the index of that event. A statement may have
        none: to elements of which none was ever taught.
        """
        first = self.first.get(statement.key)
        if first is None:
            return None
        known = self.events[first].target
        if "to" not in statement.roles or not isinstance(known, RobTarget):
            return first
        target = self.maker.targets.robtarget(statement.source, statement.span_of("to"), memory)[0]
        if target == known:
            return first
        return self.went.get((statement.key, target)) if isinstance(target, RobTarget) else None

    def _place(self, end: int) -> tuple[object, ...]:
        """A key of the place to which the event of that index brings the arm.

        Equal targets in two elements of an array are two places: each element gets a correction of its own.
        """
        return reached(self.events[end]), self.chosen.get(end)

    def either(self, *ends: frozenset[int]) -> frozenset[int]:
        """Indices of the events after one of which the arm stands where ways meet: the union of ``ends`` of each way.

        Of more than ``MOST_KEPT``, two for each of the last ``MOST_STARTS`` places are kept, and ``NOWHERE``.
        """
        union = ends[0].union(*ends[1:])
        if len(union) <= MOST_KEPT:
            return union
        places: dict[tuple[object, ...], list[int]] = {}
        kept = [*union & {NOWHERE}]
        for end in sorted(union, reverse=True):
            if end == NOWHERE or len(places) == MOST_STARTS:
                break
            ends_at_place = places.setdefault(self._place(end), [])
            kept += [end] if len(ends_at_place) < 2 else []
            ends_at_place.append(end)
        return frozenset(kept)

    def _go_by_all_paths(self, event: MotionEvent, ends: frozenset[int]) -> None:
        """Append the event once for each of the last ``MOST_STARTS`` places from which the arm may come.

        Args:
            ends: indices of the events after one of which the arm stands now.
        """
        # Predecessors from one place are one: of a loop's turns that end alike the last counts.
        known = sorted(ends - {NOWHERE})
        if len(known) > 1:
            known = sorted({self._place(end): end for end in known}.values())[-MOST_STARTS:]
            known.sort(key=lambda end: end != self.last)  # on from the event before while it is the one before
        if len(ends) > 1 or not known:
            event = replace(event, detached=True, start_unknown=not known)
        for number, end in enumerate(known or [self.last]):
            if known and (end != self.last or number > 0):
                self.events.append(replace(self.events[end], resumes_from=end))
            self.events.append(replace(event, way=number) if number else event)


def reached(event: MotionEvent) -> tuple[object, ...]:
    """A key of the place to which an event brings the arm: statement, target, tool, frames and load.

    An event without a known target is a place of its own.
    """
    if event.reason is not None or event.target is None:
        return (id(event),)
    return (event.statement.key, event.target, event.tool, event.wobj, event.displacement, event.gripload)
