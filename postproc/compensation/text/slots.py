"""Slots: places in the text that can hold a corrected target; whom each serves, and what offset fits around it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Literal

from postproc.compensation.text.values import Form, TargetRequest
from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import MotionEvent, Origin, StatementKey
from postproc.rapid.execution.interpreter import MAX_CALLS
from postproc.rapid.motions.events_of import DATA_NAME
from postproc.rapid.program.program import Program
from postproc.rapid.program.references import Use, declaration_uses
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.trees import Call, Expression
from postproc.rapid.unknown import Unknown

ArgumentKey = tuple[StatementKey, str]  # a motion statement and the role of its argument
# Path and offset of the literal numbers of a target, or of the argument of a call that hands a target over.
SlotKey = tuple[Literal["numbers", "call"], str, int]

DISPLACING = ("offs", "reltool")
AMOUNTS = 3  # along x, y, z


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
        slots.append(("numbers", spans.source.path, spans.span[0]))
    if handed is not None and not handed.source.read_only and (spans is None or spans.span[0] != handed.span[0]):
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


def requested_statements(
    runs: Mapping[int, MotionEvent], requested: Set[int]
) -> tuple[frozenset[StatementKey], frozenset[StatementKey]]:
    """Statements all of whose possible executions have a request, and those that also run to a place without one.

    Args:
        runs: executions by index of the event, from ``possible_runs``.
        requested: indices of the events that have a request.
    """
    places = {(e.statement.key, e.target, e.via) for row, e in runs.items() if row in requested}
    others = [e for row, e in runs.items() if row not in requested]
    complete = {e.statement.key for e in runs.values()} - {e.statement.key for e in others}
    elsewhere = (e.statement.key for e in others if (e.statement.key, e.target, e.via) not in places)
    return frozenset(complete), frozenset(elsewhere)


@dataclass(frozen=True, slots=True)
class TargetExpression:
    """How the text of a target argument can be changed.

    Args:
        form: how an offset is written, None where there is no way.
        in_tool: the offset is along the axes of the tool.
    """

    form: Form | None
    in_tool: bool = False


def target_expression(source: Source, span: Span, program: Program) -> TargetExpression:
    """How an offset can be put into the target expression at ``span`` (begin and end in the text of ``source``).

    That depends on whether the program declares an ``Offs`` or ``RelTool`` of its own.
    """
    text = source.data[slice(*span)].decode("latin-1")
    module, routine = program.place(source, span[0])
    hidden = {name for name in DISPLACING if program.hides(name, module, routine)}
    around: Form | None = None if "offs" in hidden else "offset"
    if text[:1] == "[":
        return TargetExpression(around)
    if DATA_NAME.fullmatch(text) is not None:
        return TargetExpression(around or "components")
    try:
        tree = read_full_expression(source.data, *span)
    except Unknown:
        return TargetExpression(around)
    if amounts_of(tree) and isinstance(tree, Call) and tree.name not in hidden:
        return TargetExpression("amounts", tree.name == "reltool")
    return TargetExpression(around)


def amounts_of(tree: Expression) -> tuple[Expression, ...]:
    """The displacements along x, y, z in a call of ``Offs``, or of ``RelTool`` without rotations.

    Empty for any other expression.
    """
    if isinstance(tree, Call) and tree.name in DISPLACING and not tree.options and len(tree.arguments) == 1 + AMOUNTS:
        return tree.arguments[1:]
    return ()
