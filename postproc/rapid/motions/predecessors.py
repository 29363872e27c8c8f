"""The ways by which the arm comes to a motion, where a program branches on what only the controller knows."""

from __future__ import annotations

from dataclasses import replace

from postproc.rapid.data.events import MotionEvent

NOWHERE = -1  # where the arm stands is not known
MOST_WAYS = 8  # that are followed to one motion; from there on the others count as not known
MOST_KEPT = 256  # places where the arm may stand, of a program with a thousand branches


class Predecessors:
    """Events in the order in which they run; where several ways meet, one after the other.

    ``ends`` are indices of the events after one of which the arm stands now, and ``NOWHERE``.

    Args:
        exits: the same for ways on which the routine may have been left.
    """

    def __init__(self) -> None:
        self.events: list[MotionEvent] = []
        self._ends: frozenset[int] = frozenset({NOWHERE})
        self.exits: frozenset[int] = frozenset()
        self.last = NOWHERE  # the last event that moves the arm

    @property
    def ends(self) -> frozenset[int]:
        """Where the arm may stand (see above)."""
        return self._ends

    @ends.setter
    def ends(self, ends: frozenset[int]) -> None:
        self._ends = self.either(ends, frozenset())

    def either(self, ends: frozenset[int], more: frozenset[int]) -> frozenset[int]:
        """Ends of some ways and of others; of very many those alone that a motion after them tells from all: two at
        each of the last places (see ``go``), and ``NOWHERE``.
        """
        ends |= more
        if len(ends) <= MOST_KEPT:
            return ends
        places: dict[tuple[object, ...], list[int]] = {}
        kept = [*ends & {NOWHERE}]
        for end in sorted(ends, reverse=True):
            if end == NOWHERE or len(places) == MOST_WAYS:
                break
            here = places.setdefault(reached(self.events[end]), [])
            kept += [end] if len(here) < 2 else []
            here.append(end)
        return frozenset(kept)

    @property
    def known(self) -> list[int]:
        """Indices of the events that may have been the last motion, ascending.

        Ways that come from an unknown place are left out, so that the list is not always complete.
        """
        return sorted(end for end in self.ends if end > NOWHERE)

    def lose(self) -> None:
        """Nobody knows where the arm stands."""
        self.ends = frozenset({NOWHERE})

    def doubt(self) -> None:
        """The arm may stand elsewhere, too."""
        self.ends |= {NOWHERE}

    def leave(self) -> None:
        """The routine ends on this way."""
        self.exits = self.either(self.exits, self.ends)
        self.ends = frozenset()

    def go(self, event: MotionEvent) -> None:
        """Add a motion once for every way that leads to it.

        On a way other than from the event before, the arm first stands ``resumes_from`` where that way has brought it.
        """
        if _still(event):
            self.events.append(event)
            return
        if self.last == NOWHERE or self.ends != {self.last}:
            self._go_by_all_ways(event)
        else:  # as nearly all do: on from the motion before
            self.events.append(event)
        self.last = len(self.events) - 1
        self.ends = frozenset({self.last})

    def _go_by_all_ways(self, event: MotionEvent) -> None:
        # Predecessors from one place are one: of a loop's turns that end alike the last counts.
        known = self.known
        if len(known) > 1:
            known = sorted({reached(self.events[end]): end for end in known}.values())[-MOST_WAYS:]
            known.sort(key=lambda end: end != self.last)  # on from the event before while it is the one before
        if len(self.ends) > 1 or not known:
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
