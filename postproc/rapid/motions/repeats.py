"""Statements that run again with nothing changed since: the same event serves all turns of a loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.data.values import Data
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.motions.events_of import EventMaker
from postproc.rapid.syntax.tokens import identifiers

MOST_CHANGED = 100  # data and state that is compared; more would cost what it saves


@dataclass(frozen=True, slots=True)
class Kept:
    """An event, the data and state it was made in, and the words of its statement."""

    event: MotionEvent
    changed: Mapping[str, Data]
    words: frozenset[str]

    def holds(self, memory: Memory) -> bool:
        """Whether the statement would make the same event again."""
        same = self.event.conditional == (memory.conditional > 0) and self.changed == memory.changed
        return same and self.words.isdisjoint(memory.frame.varying())


class Repeats:
    """Makes events, and remembers those of statements that run more than once."""

    def __init__(self, maker: EventMaker) -> None:
        self.maker = maker
        self.kept: dict[StatementKey, Kept] = {}

    def event(self, statement: MotionStatement, memory: Memory, before: MotionEvent | None) -> MotionEvent:
        """The event of a further execution."""
        kept = self.kept.get(statement.key)
        if kept is not None and kept.holds(memory):
            start = self.maker.start(before, statement, memory)
            return kept.event if kept.event.start == start else replace(kept.event, start=start)
        event = self.maker.event(statement, memory, before)
        if len(memory.changed) <= MOST_CHANGED and not event.diagnostics:
            words = frozenset(identifiers(statement.source.data[slice(*statement.span)]))
            self.kept[statement.key] = Kept(event, dict(memory.changed), words)
        return event
