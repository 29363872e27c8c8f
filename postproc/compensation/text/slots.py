"""Slots: places in the text that can hold a corrected target, and the statements that each of them serves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Literal

from postproc.compensation.text.values import TargetRequest
from postproc.rapid.data.events import MotionEvent, Origin, StatementKey
from postproc.rapid.execution.interpreter import MAX_CALLS
from postproc.rapid.program.program import Program
from postproc.rapid.program.references import Use, declaration_uses

ArgumentKey = tuple[StatementKey, str]  # a motion statement and the role of its argument
# Path and offset of the literal numbers of a target, or of the argument of a call that hands a target over.
SlotKey = tuple[Literal["numbers", "call"], str, int]


@dataclass(frozen=True, slots=True)
class Users:
    """Motion statements whose targets come from one declaration or parameter; those in ``derived`` displace it."""

    statements: frozenset[StatementKey]
    derived: frozenset[StatementKey]


def target_users(program: Program) -> Mapping[str, Users]:
    """Users of each declaration and parameter that is used for targets only, by its key; all others are missing.

    What a call passes to a parameter is used by the statements that use the parameter.
    """
    uses = declaration_uses(program)
    known: dict[str, Users | None] = {}

    def users(key: str, depth: int) -> Users | None:
        """Users of a declaration or parameter, through calls up to depth MAX_CALLS; None if not only for targets."""
        if key not in known:
            known[key] = None  # of a routine that calls itself
            known[key] = joined(uses.get(key, ()), depth) if depth <= MAX_CALLS else None
        return known[key]

    def joined(parts: Iterable[Use], depth: int) -> Users | None:
        """Union of the users of several uses; None if one of them is not for a target."""
        statements: set[StatementKey] = set()
        derived: set[StatementKey] = set()
        for use in parts:
            if use.parameter:
                passed = users(use.parameter, depth + 1)
                if passed is None:
                    return None
                statements |= passed.statements
                derived |= passed.derived
            elif use.statement is None:
                return None
            else:
                statements.add(use.statement)
                derived |= {use.statement} if use.displaced else set()
        return Users(frozenset(statements), frozenset(derived))

    return {key: of_key for key in uses if (of_key := users(key, 0)) is not None}


def slots_of(origin: Origin) -> tuple[SlotKey, ...]:
    """Places in the text that could hold a corrected target, the preferred one first; none in read-only files."""
    base = origin.base
    spans, handed = base.spans, base.handed
    slots: list[SlotKey] = []
    if spans is not None and not spans.source.read_only:
        slots.append(("numbers", spans.source.path, spans.whole[0]))
    if handed is not None and not handed.source.read_only and (spans is None or spans.whole[0] != handed.span[0]):
        slots.append(("call", handed.source.path, handed.span[0]))
    return tuple(slots)


def data_keys(origin: Origin) -> set[str]:
    """Keys of the declaration and the parameters that a target comes from."""
    base = origin.base
    declared = {base.declaration} if base.declaration is not None else set()
    return {*(base.handed.parameters if base.handed is not None else ()), *declared}


def may_serve(
    slot: SlotKey, request: TargetRequest, users: Mapping[str, Users], complete: Set[StatementKey], written: Set[str]
) -> bool:
    """Whether a slot (place in the text that holds a target's numbers) may be edited for a request.

    It may if it is used only for targets of statements all of whose executions are corrected, and nothing can write it
    while the program runs.

    Args:
        users: by declaration and parameter, from ``target_users``.
        complete: statements all of whose executions have a request.
        written: keys of the data that anything may write.
    """
    base = request.origin.base
    if base.handed is not None and (slot[0] == "call" or base.declaration is None):
        name = base.handed.parameters[0]
    elif base.declaration is None:
        # An aggregate in the statement serves that alone, and displaced in runs that are not known it would not do.
        return request.origin.root is None or request.event.statement.key in complete
    else:
        name = base.declaration
    known = users.get(name)
    return known is not None and known.statements <= complete and name not in written


def possible_runs(events: Sequence[MotionEvent], rows: Set[int]) -> dict[int, MotionEvent]:
    """Executions by their index in ``events``, without those that the arm cannot make: the controller stops there.

    Args:
        rows: of the events that are moves of the arm.
    """
    return {
        row: e
        for row, e in enumerate(events)
        if e.resumes_from is None and (row in rows or e.reason is not None or e.statement.interpolation == "none")
    }


def fully_requested(runs: Mapping[int, MotionEvent], requested: Set[int]) -> frozenset[StatementKey]:
    """Statements all of whose possible executions have a request.

    Args:
        runs: executions by index of the event, from ``possible_runs``.
        requested: indices of the events that have a request.
    """
    lacking = {e.statement.key for row, e in runs.items() if row not in requested}
    return frozenset({e.statement.key for e in runs.values()} - lacking)


def led_elsewhere(runs: Mapping[int, MotionEvent], requested: Set[int]) -> frozenset[StatementKey]:
    """Statements that also run to an unknown place, or to a place for which they have no request.

    Args:
        runs: executions by index of the event, from ``possible_runs``.
        requested: indices of the events that have a request.
    """
    places = {(e.statement.key, e.target, e.via) for row, e in runs.items() if row in requested}
    return frozenset(
        e.statement.key
        for row, e in runs.items()
        if row not in requested and (e.statement.key, e.target, e.via) not in places
    )
