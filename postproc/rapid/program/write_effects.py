"""Which data and which state a piece of program may change, found without running it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from functools import cached_property

from postproc.diagnostics import Span
from postproc.rapid.program.from_the_arm import FromTheArm
from postproc.rapid.program.program import Program, statements_in, statements_of
from postproc.rapid.program.scopes import is_shared, shared_name
from postproc.rapid.program.signatures import SETTERS
from postproc.rapid.program.statement_effects import (
    NO_EFFECT,
    UNSEEN,
    CalledWith,
    EffectReader,
    StatementEffect,
    acting_functions,
)
from postproc.rapid.syntax.nodes import Declaration, Routine, Statement

_GOES_ON = (b"retry", b"trynext", b"return")  # how a handler begins a statement behind which the program goes on


class WriteEffects:
    """What every routine of a program may change: keys of declarations, ``@`` state, its parameters as ``%name``.

    ``UNSEEN`` among them stands for all that a routine in none of the files may write.

    Args:
        direct: effects of single statements.
        of_routine: by key of a routine, the keys that it may change, calls included.
        everything: all keys that any routine may change, without parameters.
        started: keys of routines that a motion starts, and which so run at any moment.
        unseen: names of routines in none of the files.
        acting: matches calls of the program's functions that do more than calculate; None if there is none.
        shared: keys of data that other tasks declare too; written_by_others: of data that code outside of the
            program may write at any time.
        interrupting: keys of what runs at any moment may change: traps, and procedures that a motion starts.
        volatile: keys of data that may be written at any moment: by other tasks, traps, handlers.
        unseen_any_time: whether code in none of the files may run at any moment.
    """

    def __init__(self, program: Program) -> None:
        """Work out what each routine of the program may change, calls included."""
        self.program = program
        self.direct = EffectReader(program)
        self._kept: dict[tuple[str, Span], frozenset[str]] = {}
        self.unseen: set[str] = set()
        routines = {r.key: r for r in program.all_routines()}
        calls: dict[str, set[CalledWith]] = {}
        written_by_name: dict[str, set[str]] = {}
        callers: dict[str, set[str]] = {}
        for key, routine in routines.items():
            effects = self._effects(statements_of(routine), routine)
            written_by_name[key] = {written for effect in effects for written in effect.keys}
            calls[key] = {call for effect in effects for call in effect.calls}
            self.unseen.update(name for effect in effects for name in effect.unseen)
            for called, _ in calls[key]:
                callers.setdefault(called, set()).add(key)
        pending = dict.fromkeys(routines)  # each routine waits once
        while pending:
            key, _ = pending.popitem()
            before = len(written_by_name[key])
            self._add_calls(written_by_name[key], calls[key], written_by_name, routines[key])
            if len(written_by_name[key]) != before:
                pending |= dict.fromkeys(callers.get(key, ()))
        self.of_routine = {key: frozenset(keys) for key, keys in written_by_name.items()}
        self.everything = frozenset(k for keys in written_by_name.values() for k in keys if not k.startswith("%"))
        self.started = frozenset(self.direct.started)
        self.acting = acting_functions(routines, self.of_routine, callers)
        # What a trap changes may change at any moment, what a handler changes that goes on wherever an error may come.
        self.shared = _shared_keys(program, program.other_tasks.shared)
        self.written_by_others = _shared_keys(program, program.other_tasks.written) | program.other_tasks.read_along
        traps = [
            written_by_name[key] for key, routine in routines.items() if routine.kind == "TRAP" or key in self.started
        ]
        handlers = [
            self.of(body, routine)
            for routine in routines.values()
            for body in routine.handlers
            if any(routine.source.data[slice(*s.span)].lower().startswith(_GOES_ON) for s in statements_in(body))
        ]
        self.interrupting = frozenset[str]().union(*traps)
        written_any_time = (k for keys in (*traps, *handlers, self.direct.lasting) for k in keys if k[0] not in "%@")
        self.volatile = self.written_by_others.union(written_any_time)
        self.unseen_any_time = any(UNSEEN in keys for keys in (*traps, *handlers, self.started))

    def paths(self, declaration: Declaration) -> Sequence[tuple[str, ...]]:
        """The components of declared data that are written, none inside another; an empty path stands for all of it.

        If no component is known, all of it counts as written.
        """
        paths = sorted(self.direct.paths.get(declaration.key, {()}))
        return [path for i, path in enumerate(paths) if not any(path[: len(p)] == p for p in paths[:i])]

    @cached_property
    def exposed(self) -> frozenset[str]:
        """Keys of all that code in none of the files may write.

        That is module data that is not LOCAL, data written by routines that it may call (all but main and LOCAL ones),
        and all state.
        """
        of_modules = (d for d in self.program.declarations if not d.routine and d.scope != "LOCAL")
        data = {d.key for d in of_modules if d.storage != "CONST"}
        called = {r.key for r in self.program.all_routines() if not r.local and r.name.lower() != "main"}
        within = {k for key in called for k in self.of_routine[key] if k[0] not in "%@"}
        return frozenset(data | within | SETTERS.keys())

    def may_be_written_any_time(self, key: str) -> bool:
        """Whether data may be written at any moment: by a trap, handler, other task, or procedure that a motion starts.

        Args:
            key: of the data.
        """
        return key in self.volatile or (self.unseen_any_time and key in self.exposed)

    @cached_property
    def measured(self) -> frozenset[str]:
        """Keys of data that may hold where the arm stands: by CRobT and the like, by a search, or by copying."""
        return frozenset(FromTheArm(self.program).keys & self.program.names.keys())

    @cached_property
    def may_be_written(self) -> frozenset[str]:
        """Keys of declarations that anything, in these files or not, may write while the program runs.

        That an operator may change PERS data on the pendant does not count.
        """
        written = {k for k in self.everything if k[0] != "@"} | self.written_by_others
        if UNSEEN in self.everything:
            written |= {k for k in self.exposed if k[0] != "@"}
        return frozenset(written)

    def of_one(self, statement: Statement, routine: Routine) -> frozenset[str]:
        """Keys that one statement, with all in it and what they call, may change, as of ``of``; worked out once."""
        key = (routine.source.path, statement.span)
        if key not in self._kept:
            self._kept[key] = frozenset(self.of([statement], routine))
        return self._kept[key]

    def of(self, body: Sequence[Statement], routine: Routine) -> set[str]:
        """Keys of data, state and parameters that these statements of a routine, and what they call, may change."""
        effects = self._effects(statements_in(body), routine)
        changed = {key for effect in effects for key in effect.keys}
        self._add_calls(changed, {call for effect in effects for call in effect.calls}, self.of_routine, routine)
        return changed

    def through(self, effect: StatementEffect, routine: Routine) -> frozenset[str]:
        """Keys of what routines called by an effect change; for their parameters by reference, of the data passed.

        Args:
            effect: of a statement or of the functions in it; routine: in which the statement stands.
        """
        changed: set[str] = set()
        self._add_calls(changed, effect.calls, self.of_routine, routine)
        return frozenset(changed)

    def _effects(self, statements: Sequence[Statement], routine: Routine) -> list[StatementEffect]:
        """The effects of statements of a routine, and of the functions in them, without those that have none."""
        reader = self.direct
        effects = [reader.of_statement(statement, routine) for statement in statements]
        if routine.source.path in reader.calling:
            effects += [reader.functions(statement, routine) for statement in statements]
        return [effect for effect in effects if effect is not NO_EFFECT]

    def _add_calls(
        self, changed: set[str], calls: Iterable[CalledWith], below: Mapping[str, Set[str]], routine: Routine
    ) -> None:
        """Add to ``changed`` what called routines change; for their parameters by reference, the data passed.

        Args:
            calls: keys of the called routines, with (parameter, data) passed by reference.
            below: by key of a routine, the keys that it changes; routine: the caller.
        """
        for called, passed in calls:
            keys = below[called]
            changed |= {k for k in keys - changed if not k.startswith("%")}
            for parameter, name in passed:
                if "%" + parameter in keys and (key := self.direct.key_of(name, routine)) is not None:
                    changed.add(key)


def _shared_keys(program: Program, names: Collection[tuple[str, str]]) -> frozenset[str]:
    """Keys of the program's declarations of global PERS data whose lower-case (name, type) is in ``names``."""
    return frozenset({d.key for d in program.declarations if shared_name(d) in names and is_shared(d)} if names else ())
