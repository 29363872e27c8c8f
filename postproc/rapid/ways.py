"""The ways by which the arm comes to a motion, where a program branches on what only the controller knows."""

from __future__ import annotations

from dataclasses import replace

from postproc.rapid.events import MotionEvent

NOWHERE = -1  # where the arm stands is not known
MOST_WAYS = 8  # that are followed to one motion; from there on the others count as not known


class Ways:
    """Events in the order in which they run; where several ways meet, one after the other.

    Args:
        ends: indices of the events after one of which the arm stands now.
        exits: the same for ways on which the routine may have been left.
    """

    def __init__(self) -> None:
        self.events: list[MotionEvent] = []
        self.ends: frozenset[int] = frozenset({NOWHERE})
        self.exits: frozenset[int] = frozenset()
        self.last = NOWHERE  # the last event that moves the arm

    def lose(self) -> None:
        """Nobody knows where the arm stands."""
        self.ends = frozenset({NOWHERE})

    def doubt(self) -> None:
        """The arm may stand elsewhere, too."""
        self.ends |= {NOWHERE}

    def leave(self) -> None:
        """The routine ends on this way."""
        self.exits |= self.ends
        self.ends = frozenset()

    def go(self, event: MotionEvent) -> int:
        """Add a motion once for every way that leads to it; how many events that takes.

        On a way other than from the event before, the arm first stands ``again`` where that way has brought it.
        """
        count = len(self.events)
        if event.statement.interpolation == "none" and event.reason is None:
            self.events.append(event)  # the arm stays where it is
            return 1
        known = sorted(self.ends - {NOWHERE})[-MOST_WAYS:]
        known.sort(key=lambda end: end != self.last)  # on from the event before while it is the one before
        if len(self.ends) > 1 or not known:
            event = replace(event, detached=True, first=not known)
        for number, end in enumerate(known or [self.last]):
            if known and (end != self.last or number > 0):
                self.events.append(replace(self.events[end], again=end))
            self.events.append(replace(event, way=number) if number else event)
        self.last = len(self.events) - 1
        self.ends = frozenset({self.last})
        return len(self.events) - count
