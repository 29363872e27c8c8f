"""The ways by which the arm comes to a motion, where a program branches on what only the controller knows."""

from __future__ import annotations

from dataclasses import replace

from postproc.rapid.data.events import MotionEvent
from postproc.rapid.evaluation.memory import NOWHERE

MOST_WAYS = 8  # that are followed to one motion; from there on the others count as not known
MOST_KEPT = 256  # places where the arm may stand, of a program with a thousand branches


class Predecessors:
    """Events in the order in which they run; where several ways meet, one after the other.

    Where the arm stands on a way is told by ``Memory.ends``.
    """

    def __init__(self) -> None:
        self.events: list[MotionEvent] = []
        self.last = NOWHERE  # the last event that moves the arm

    def either(self, *ends: frozenset[int]) -> frozenset[int]:
        """Ends of some ways together; of very many those alone that a motion after them tells from all: two at each of
        the last places (see ``go``), and ``NOWHERE``.
        """
        found = ends[0].union(*ends[1:])
        if len(found) <= MOST_KEPT:
            return found
        places: dict[tuple[object, ...], list[int]] = {}
        kept = [*found & {NOWHERE}]
        for end in sorted(found, reverse=True):
            if end == NOWHERE or len(places) == MOST_WAYS:
                break
            here = places.setdefault(reached(self.events[end]), [])
            kept += [end] if len(here) < 2 else []
            here.append(end)
        return frozenset(kept)

    def go(self, event: MotionEvent, ends: frozenset[int]) -> frozenset[int]:
        """Add a motion once for every way that leads to it; where the arm stands then.

        On a way other than from the event before, the arm first stands ``resumes_from`` where that way has brought it.
        """
        if _still(event):
            self.events.append(event)
            return ends
        if self.last == NOWHERE or ends != {self.last}:
            self._go_by_all_ways(event, ends)
        else:  # as nearly all do: on from the motion before
            self.events.append(event)
        self.last = len(self.events) - 1
        return frozenset({self.last})

    def _go_by_all_ways(self, event: MotionEvent, ends: frozenset[int]) -> None:
        # Predecessors from one place are one: of a loop's turns that end alike the last counts.
        known = sorted(ends - {NOWHERE})
        if len(known) > 1:
            known = sorted({reached(self.events[end]): end for end in known}.values())[-MOST_WAYS:]
            known.sort(key=lambda end: end != self.last)  # on from the event before while it is the one before
        if len(ends) > 1 or not known:
            event = replace(event, detached=True, first=not known)
        for number, end in enumerate(known or [self.last]):
            if known and (end != self.last or number > 0):
                self.events.append(replace(self.events[end], resumes_from=end))
            self.events.append(replace(event, way=number) if number else event)


def reached(event: MotionEvent) -> tuple[object, ...]:
    """Where an event brings the arm, with what, and by which statement."""
    if event.reason is not None or event.target is None:
        return (id(event),)
    return (event.statement.key, event.target, event.tool, event.wobj, event.displacement, event.gripload)


def _still(event: MotionEvent) -> bool:
    """The arm stays where it is."""
    return event.statement.interpolation == "none" and event.reason is None
