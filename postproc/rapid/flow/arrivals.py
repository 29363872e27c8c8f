"""After which motion each motion statement of a program may run: reaching definitions over the flow of the task.

Each routine is looked at once for itself, from where the arm stood when it was entered (``ENTRY``) to where it stands
when the routine is left; what holds at its calls then says what ``ENTRY`` is.  A routine that the pendant or a program
in none of the files may start is entered from anywhere: all that are not LOCAL, traps, and those that nobody calls.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from postproc.grouping import closure, grouped
from postproc.rapid.data.events import MotionStatement, StatementKey
from postproc.rapid.flow.constants import Constants
from postproc.rapid.flow.graph import EXIT, Graph, draw
from postproc.rapid.flow.states import (
    ANYTHING,
    ANYWHERE,
    CALLED,
    FROM_CALLER,
    LOST,
    NOTHING,
    REFERRED,
    State,
    entered,
    joined,
    returned,
    substituted,
    written,
)
from postproc.rapid.flow.steps import CallStep, Go, Step, StepReader, comes_back
from postproc.rapid.program.arguments import BY_REFERENCE
from postproc.rapid.program.program import Program
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Routine
from postproc.rapid.syntax.tokens import identifiers


@dataclass(slots=True)
class _Routine:
    """A routine while its states are worked out.

    Args:
        moves: whether it may move the arm, calls included; handled: whether its handlers may.
        exit: the state at its end; states: at the begin of each block. ``ENTRY`` in them stands for where the arm is
            when the routine is entered.
    """

    routine: Routine
    graph: Graph
    moves: bool
    handled: bool
    exit: State
    states: list[State]


class Arrivals:
    """After which motions each motion statement may run, whatever the data of the program are.

    A ``State`` has the motions that may have been the last, each with the keys of data that may be written since.

    Args:
        open: whether anything but constants of the text decides which way the program takes.
    """

    def __init__(self, program: Program, changes: WriteEffects | None = None) -> None:
        """Work out where the arm may stand before each motion of a program; ``changes`` are its write effects."""
        self.program = program
        self.changes = changes or WriteEffects(program)
        reader, constants = StepReader(program, self.changes), Constants(program)
        self._routines: dict[str, _Routine] = {}
        for routine in program.all_routines():
            graph = draw(routine, reader, constants)
            self._routines[routine.key] = _Routine(routine, graph, False, False, {}, [])
        steps = [(key, step) for key, r in self._routines.items() for step in _steps(r.graph)]
        calls = [(key, step) for key, step in steps if isinstance(step, CallStep)]
        self._callers = grouped((called, key) for key, step in calls for called in step.routines)
        self._find_moving()
        self._summarise()
        self._before: dict[StatementKey, tuple[str, State]] = {}
        self._entries = self._find_entries()
        traps = [
            r for r in self._routines.values() if r.routine.kind == "TRAP" or r.routine.key in self.changes.started
        ]
        unclear = any(step.unseen or len(step.routines) != 1 for _, step in calls)  # which routine runs
        leaving = [r for r in traps if r.moves and not comes_back(r.routine, reader)]
        self._adrift = bool(leaving)  # at any moment something may take the arm elsewhere
        self.open = bool(traps) or any(r.graph.open for r in self._routines.values()) or unclear

    def before(self, key: StatementKey) -> State:
        """Motions that may come last before a statement, with what may be written since; empty if none leads there.

        ``LOST`` if that is not known.

        Args:
            key: of the motion statement.
        """
        if self._adrift:
            return LOST
        routine, state = self._before.get(key, ("", {}))
        return substituted(state, self._entries[routine]) if routine else state

    @cached_property
    def resumed_behind_errors(self) -> frozenset[str]:
        """Keys of routines in which a statement that fails may be passed over by TRYNEXT.

        TRYNEXT stands in a handler of the routine, or of another routine to which its errors are passed.
        """

        def reached(key: str) -> set[str]:
            """Keys of the routines that a routine calls and that leave their errors to it."""
            graph = self._routines[key].graph
            called = {k for step in _steps(graph) if isinstance(step, CallStep) for k in step.routines}
            return {k for k in called if not self._routines[k].graph.handlers or self._routines[k].graph.raises}

        return frozenset(closure((key for key, routine in self._routines.items() if routine.graph.skips), reached))

    def keeps(self, statement: MotionStatement, text: str) -> bool:
        """Whether the value of an expression at a statement is the same as at the motion before, on every way there.

        That holds if no data in it and neither displacement nor offset may have been written since.

        Args:
            text: of the expression.
        """
        since = NOTHING.union(*self.before(statement.key).values())
        if not since and not self.changes.volatile and not self.changes.unseen_any_time:
            return True  # as for nearly all
        routine = self.program.routine(statement.routine, statement.module)
        if routine is None or since >= ANYTHING or not since.isdisjoint(("@pdisp", "@eoffs")):
            return False
        return all(self._holds(name, routine, since) for name in identifiers(text.encode("latin-1")))

    def _holds(self, name: str, routine: Routine, since: frozenset[str]) -> bool:
        """Whether a name keeps its meaning and value in a routine although other data may have been written.

        Args:
            name: in lower case; since: keys of all that may have been written.
        """
        if self.program.routine(name, routine.module) is not None and since - {CALLED}:
            return False  # a function of the program's own may read anything
        parameter = next((p for p in routine.parameters if p.name == name), None)
        declared = None if parameter else self.program.declaration(name, routine.module, routine.name)
        own = parameter is not None or name in self._routines[routine.key].graph.counters
        if CALLED in since and (own or (declared is not None and declared.routine)):
            return False
        data = {k for k in since if k[0] not in "@#"}
        if parameter is not None and parameter.mode in BY_REFERENCE and data:
            return False
        if declared is None or declared.storage == "CONST":
            return since.isdisjoint((f"%{name}", f"#{name}"))
        if self.changes.may_be_written_any_time(declared.key) or (REFERRED in since or any(k[0] == "%" for k in data)):
            return False
        return since.isdisjoint((declared.key, f"#{name}"))

    def _find_moving(self) -> None:
        """Set ``moves`` and ``handled`` of each routine: whether it (calls included) or its handlers may move the
        arm.
        """
        moving = [key for key, r in self._routines.items() if any(_moves(step, {}) for step in _steps(r.graph))]
        for key in closure(moving, lambda key: self._callers.get(key, ())):
            self._routines[key].moves = True
        for routine in self._routines.values():
            routine.handled = any(_moves(step, self._routines) for step in _steps(routine.graph, routine.graph.inside))

    def _summarise(self) -> None:
        """Compute ``states`` and ``exit`` of all routines, relative to their entry, until none changes."""
        pending = dict.fromkeys(self._routines)
        while pending:
            key, _ = pending.popitem()
            routine = self._routines[key]
            before = routine.exit
            routine.states = self._states(routine)
            routine.exit = routine.states[EXIT]
            if routine.exit != before:
                pending |= dict.fromkeys(self._callers.get(key, ()))

    def _states(self, routine: _Routine) -> list[State]:
        """The state at the begin of each block of a routine, relative to its ``ENTRY``; empty for blocks not run."""
        graph = routine.graph
        states: list[State] = [{} for _ in graph.blocks]
        reached = [False] * len(states)
        starts = {0: FROM_CALLER} | dict.fromkeys(graph.handlers, LOST if routine.moves else FROM_CALLER)
        pending: dict[int, None] = {}
        for at, state in starts.items():
            states[at], reached[at] = state, True
        pending |= dict.fromkeys(reversed(starts))
        while pending:
            at, _ = pending.popitem()
            behind = states[at]
            for step in graph.blocks[at].steps:
                behind = self._behind(step, behind, routine)
            for then in graph.blocks[at].then if behind else ():
                met = joined([states[then], behind])
                if met != states[then] or not reached[then]:
                    states[then], reached[then] = met, True
                    pending[then] = None
        return states

    def _behind(self, step: Step, state: State, routine: _Routine) -> State:
        """The state behind a step of a routine that begins in ``state``; empty if nothing goes on behind it."""
        if isinstance(step, Go):
            return LOST if step.unresolved_start or routine.graph.skips else {step.statement.key: NOTHING}
        if not isinstance(step, CallStep):
            return written(state, step.keys)
        if not state or step.unseen:
            return LOST if state else state
        if routine.graph.skips and _moves(step, self._routines):
            return LOST
        exits = [self._routines[called].exit for called in step.routines]
        return joined([returned(self._at(step, state, routine), exit_, step.keys) for exit_ in exits])

    def _at(self, step: Step, state: State, routine: _Routine) -> State:
        """The state in which a step of a routine begins: ``LOST`` if a handler may repeat it after the arm has moved.

        Args:
            state: in which it begins when it is run for the first time.
        """
        graph = routine.graph
        again = routine.handled or (isinstance(step, CallStep) and _moves(step, self._routines))
        return LOST if state and (graph.retries or graph.skips) and again else state

    def _find_entries(self) -> Mapping[str, State]:
        """The state in which each routine may be entered, by key; also fills ``_before`` for all motions."""
        calls: dict[str, list[tuple[str, State]]] = {}
        for key, routine in self._routines.items():
            for block, state in zip(routine.graph.blocks, routine.states, strict=True):
                for step in block.steps if state else ():
                    at = self._at(step, state, routine)
                    if isinstance(step, Go):
                        self._before[step.statement.key] = key, at
                    elif isinstance(step, CallStep):
                        for called in step.routines:
                            calls.setdefault(key, []).append((called, at))
                    state = self._behind(step, state, routine)
        reached = {name for found in calls.values() for name, _ in found}
        entries: dict[str, State] = {
            key: {} if r.routine.local and r.routine.kind != "TRAP" and key in reached else LOST
            for key, r in self._routines.items()
        }
        entries |= dict.fromkeys(self.changes.started, LOST)
        pending = dict.fromkeys(entries)
        while pending:
            key, _ = pending.popitem()
            for name, at in calls.get(key, ()):
                state = joined([entries[name], entered(substituted(at, entries[key]))])
                if state != entries[name]:
                    entries[name] = state
                    pending[name] = None
        return entries


def only(state: State) -> StatementKey | None:
    """The motion statement that is the last on every way; None if there are several or none, or it is not known."""
    key = next(iter(state), ANYWHERE)
    return key if len(state) == 1 and key != ANYWHERE else None


def _steps(graph: Graph, start: int = 0) -> Iterator[Step]:
    """The steps of the blocks with index ``start`` and above, in the order of the blocks."""
    for block in graph.blocks[start:]:
        yield from block.steps


def _moves(step: Step, routines: Mapping[str, _Routine]) -> bool:
    """Whether a step may move the arm: a motion, or a call of a routine that moves or is in no file.

    Args:
        routines: by key; the program's routines that are not among them count as not moving.
    """
    if isinstance(step, CallStep):
        return step.unseen or any(key in routines and routines[key].moves for key in step.routines)
    return isinstance(step, Go)
