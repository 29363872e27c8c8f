"""Functions of a RAPID module run for many arguments at once.

A condition splits the lanes, and both ways are followed, each for its own. Made for functions that calculate:
assignments, IF, FOR, RETURN, error handlers, calls inside the module.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.rapid.program.arguments import read_arguments
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.runtime.proof.lanes import SINGLE, Calculation, Frame, Lanes, Place, Value, cannot, chosen

SILENT = frozenset({"errwrite", "tpwrite", "tperase"})
"""Procedures that tell an operator something."""
TURNS = 1000


class Execution(Calculation):
    """A module whose functions are called for n lanes; one error handler a routine."""

    def call(self, name: str, arguments: Sequence[Value], options: Mapping[str, Value]) -> tuple[Value, Lanes]:
        """What a function gives, and the lanes in which an error leaves it."""
        routine = self.routines.get(name.lower())
        if routine is None:
            raise PostprocError([cannot(self.source, None, f"there is no function `{name}`")])
        places = [Place(value, "") for value in arguments]
        result = self.run(routine, places, {key: Place(value, "") for key, value in options.items()}, self.everywhere)
        raised, self.raised = self.raised, np.zeros(self.count, dtype=bool)
        return result, raised

    def run(self, routine: Routine, given: Sequence[Place], options: Mapping[str, Place], active: Lanes) -> Value:
        frame, rest = Frame(routine), iter(given)
        for parameter in routine.parameters:
            place = options.get(parameter.name) if parameter.optional else next(rest, None)
            if place is not None:
                kind = parameter.type.lower()
                shared = parameter.mode.upper() in ("INOUT", "PERS", "VAR")
                place.type = place.type or kind
                frame.names[parameter.name] = place if shared else Place(copied(place.value), kind)
        for declaration in routine.declarations:
            frame.names[declaration.name.lower()] = self.declared(declaration, frame)
        self._block(routine.body, frame, active)
        if frame.raised is not None:
            self.raised = self.raised | frame.raised
        return frame.result

    def _block(self, body: Sequence[Statement], frame: Frame, active: Lanes) -> Lanes:
        """Run statements in some lanes; those that come to the end."""
        for statement in body:
            if not active.any():
                break
            try:
                active = self._statement(statement, frame, active)
            except (TypeError, ValueError, LookupError, AttributeError, AssertionError) as error:
                text = "the types of this statement do not fit each other"
                raise PostprocError([cannot(self.source, statement.span, text)]) from error
            if (bad := self.raised & active).any():
                self.raised = self.raised & ~bad
                active = active & ~bad
                self._handle(frame, bad)
        return active

    def _handle(self, frame: Frame, bad: Lanes) -> None:
        """Run the error handler, which leaves the routine; without one the caller has the error."""
        if len(frame.routine.handlers) == 1:
            self._block(frame.routine.handlers[0], frame, bad)
        else:
            frame.raised = bad if frame.raised is None else frame.raised | bad

    def _statement(self, statement: Statement, frame: Frame, active: Lanes) -> Lanes:
        match statement.kind:
            case "assign":
                value = self.value_of(self.tree_at(statement.parts[1]), frame, active)
                self.assign(self.tree_at(statement.parts[0]), value, frame, active & ~self.raised)
            case "if":
                return self._if(statement, frame, active)
            case "for":
                return self._for(statement, frame, active)
            case "return":
                if statement.parts and statement.parts[0][0] < statement.parts[0][1]:
                    value = self.value_of(self.tree_at(statement.parts[0]), frame, active)
                    done = active & ~self.raised
                    frame.result = value if frame.result is None else chosen(done, value, frame.result)
                    return active & self.raised
                return np.zeros(self.count, dtype=bool)
            case "call":
                self._procedure(statement, frame, active)
            case _:
                raise PostprocError([cannot(self.source, statement.span, "this statement is not calculated here")])
        return active

    def _if(self, statement: Statement, frame: Frame, active: Lanes) -> Lanes:
        reached, rest = np.zeros(self.count, dtype=bool), active
        for branch in statement.branches:
            hit = rest
            if branch.conditions:
                hit = rest & np.asarray(self.value_of(self.tree_at(branch.conditions[0]), frame, rest), dtype=bool)
                hit = hit & ~self.raised
            reached = reached | (self._block(branch.body, frame, hit) if hit.any() else hit)
            rest = rest & ~hit
        return reached | rest

    def _for(self, statement: Statement, frame: Frame, active: Lanes) -> Lanes:
        bounds = [self.value_of(self.tree_at(span), frame, active) for span in statement.parts if span[0] < span[1]]
        begin, end, *step = (float(np.asarray(x).flat[0]) for x in bounds)
        turns = np.arange(begin, end + 0.5, step[0] if step else 1.0)
        if len(turns) > TURNS:
            raise PostprocError([cannot(self.source, statement.span, "this loop has too many turns")])
        for turn in turns:
            frame.names[statement.word] = Place(np.full(self.count, turn, dtype=SINGLE), "num")
            active = self._block(statement.branches[0].body, frame, active)
        return active

    def _procedure(self, statement: Statement, frame: Frame, active: Lanes) -> None:
        routine = self.routines.get(statement.word)
        if routine is None:
            if statement.word not in SILENT:
                text = f"`{statement.word}` is not calculated here"
                raise PostprocError([cannot(self.source, statement.span, text)])
            return
        start = statement.span[0] + len(statement.word)
        pieces = [span for option, span, _ in read_arguments(self.source.data, start, statement.span[1]) if not option]
        self.run(routine, [self.place_of(self.tree_at(span), frame, active) for span in pieces], {}, active)


def copied(value: Value) -> Value:
    return [copied(part) for part in value] if isinstance(value, list) else value
