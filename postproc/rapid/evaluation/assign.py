"""Writing to data while a program is followed, and what becomes of data that may have been written unseen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import compress
from operator import is_, is_not

from postproc.rapid.data.values import Data, Value, as_type
from postproc.rapid.evaluation.memory import Binding, Memory, Path, Reference, part_of
from postproc.rapid.evaluation.teaching import SET_BY_PROGRAM, equal_when_measured
from postproc.rapid.program.program import Program
from postproc.rapid.program.signatures import SETTERS
from postproc.rapid.program.statement_effects import UNSEEN
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.syntax.trees import Expression
from postproc.rapid.unknown import (
    Assumed,
    Causes,
    Kind,
    PartlyUnknown,
    Unknown,
    assumed_for,
    joined_causes,
    unknown_part,
    without_causes,
)


def store(tree: Expression, data: Data, memory: Memory) -> None:
    """Write data (certain, assumed or Unknown) to the variable, element or component that the expression names.

    Raises:
        Unknown: which part is written is not known; nothing is written then.
    """
    part = part_of(tree, memory)
    if part is None:
        raise Unknown(Kind.NOT_ASSIGNABLE)
    name, path, causes = part
    data, data_causes = without_causes(data)
    if isinstance(data, Unknown) and not isinstance(data, PartlyUnknown):
        data = data.renewed()  # each write of an Unknown counts as another unknown value
    causes = joined_causes(data_causes, causes)
    bound = memory.frame.bindings.get(name)
    if isinstance(bound, Reference):
        declaration, path = bound.declaration, (*bound.path, *path)
        causes = joined_causes(causes, bound.assumed)
    elif bound is not None:
        memory.frame.bindings[name] = _rebound(bound, path, assumed_for(data, causes), memory)
        return
    else:
        variable = memory.find(name)
        if variable is None or variable.storage == "CONST":
            return
        declaration = variable
    set_data(declaration, _written(declaration, path, data, causes, memory), memory)


def set_data(declaration: Declaration, data: Data, memory: Memory) -> None:
    """Set the whole value of declared data: certain, ``Assumed`` or Unknown.

    Data named by ``--taught`` (set by calibration routines) keeps the value in its file if the new one is measured.
    """
    now = without_causes(data)[0]
    if isinstance(now, Unknown) and declaration.key not in now.stored_in:
        now.stored_in = (*now.stored_in, declaration.key)
    if memory.teaching.covers(declaration):
        data = memory.teaching.written(declaration, data, lambda: memory.declared(declaration).data)
    memory.changed[declaration.key] = data


def _written(declaration: Declaration, path: Path, data: Data, causes: Causes, memory: Memory) -> Data:
    """Value of declared data after ``data`` is written to the part at ``path`` (() for all of it).

    Args:
        causes: why it is not certain which part is written; the result is assumed for these, too.
    """
    if path:
        try:
            value, unknown = _present(declaration, memory), unknown_part(data)
            data, causes = _replaced(value, path, data, memory), joined_causes(value.assumed, causes)
        except Unknown as error:
            data = unknown = error.kept()
        if unknown is None and not _is_known(declaration, memory):
            unknown = unknown_part(data)
        data = data if unknown is None or unknown is data else PartlyUnknown(unknown, data)
    else:
        data = as_type(data, declaration.type)
    return assumed_for(data, causes)


def _present(declaration: Declaration, memory: Memory) -> Value:
    """Present value of a variable; components that are not known hold Unknown.

    If the value is unknown, components that no assignment in the program writes keep their declared value, all others
    are Unknown.

    Raises:
        Unknown: the value is unknown and the declaration gives none, or lacks a part.
    """
    try:
        return memory.value(declaration)
    except PartlyUnknown as partly:
        return Value(partly.data, declaration.type, len(declaration.dims), assumed=partly.assumed)
    except Unknown as error:
        why, value = error.kept(), memory.declared(declaration)
        for path in memory.changes.paths(declaration):
            data = _replaced(value, path, why, memory) if path else _all_unknown(value.data, value.rank, why)
            value = Value(data, value.type, value.rank)
        return value


def _is_known(declaration: Declaration, memory: Memory) -> bool:
    """Whether declared data has a value that is not marked as unknown in whole or in part; no element is looked at."""
    now = memory.changed.get(declaration.key)
    return not isinstance(without_causes(now)[0], Unknown) and (now is not None or declaration.init is not None)


def _all_unknown(data: Data, rank: int, why: Unknown) -> Data:
    """An array of ``rank`` dimensions with the size of ``data`` in which every element is the Unknown ``why``."""
    return tuple(_all_unknown(item, rank - 1, why) for item in data) if rank and isinstance(data, tuple) else why


def forget(memory: Memory, keys: Iterable[str], kind: Kind, cause: str = "") -> None:
    """Make the values of these keys unknown from here on.

    The key ``UNSEEN`` stands for all that code outside the files can write: its values become assumed, not unknown.

    Args:
        keys: of declared data, of parameters (``%name``) and of state that instructions set (``@pdisp``).
        kind: the reason; cause: what completes the words of ``kind``, as the name of a routine.
    """
    for key in keys:
        bound = memory.frame.bindings.get(key[1:]) if key[0] == "%" else None
        if key == UNSEEN:
            assume(memory, memory.changes.exposed, cause)
        elif isinstance(bound, Reference):
            _forget_data(bound.declaration, kind, cause, memory)
        elif bound is not None:
            memory.frame.bindings[key[1:]] = Unknown(kind, f"`{key[1:]}`", cause, key=key)
        elif key[0] != "%" and key != "@moves":
            declaration = memory.program.names.get(key)
            if declaration is not None and memory.teaching.covers(declaration):
                _forget_data(declaration, kind, cause, memory)
            else:
                memory.changed[key] = Unknown(kind, shown(key, memory.program), cause, key=key)


def _forget_data(declaration: Declaration, kind: Kind, cause: str, memory: Memory) -> None:
    """Make declared data unknown, with ``kind`` and ``cause`` as in `forget`.

    ``--taught`` data near its value in the file keeps it, if the reason is one of ``SET_BY_PROGRAM`` (a loop, a jump).
    """
    key, teaching = declaration.key, memory.teaching
    if teaching.covers(declaration) and kind in SET_BY_PROGRAM:
        now = memory.changed.get(key)
        if now is None or not teaching.away(memory.declared(declaration).data, now):
            teaching.kept.add(key)
            return
    set_data(declaration, Unknown(kind, f"`{declaration.name}`", cause, key=key), memory)


def assume(memory: Memory, keys: Iterable[str], cause: str) -> None:
    """Make the values of these keys uncertain (``Assumed``) from here on: they may have been written unseen.

    Keys that nothing has set so far are skipped: ``Memory.value`` treats these as assumed anyway.

    Args:
        cause: what may have written it, in backticks; empty: a routine in none of the files.
    """
    changed, names, cause = memory.changed, memory.program.names, cause or "a routine in none of the files"
    for key in changed.keys() & keys:
        data = changed[key]
        if memory.teaching.covers(names.get(key)):
            continue
        if isinstance(data, Unknown) and not isinstance(data, PartlyUnknown):
            changed[key] = data.renewed()
        elif not (isinstance(data, Assumed) and any(why.key == key and why.cause == cause for why in data.causes)):
            changed[key] = assumed_for(
                data, (Unknown(Kind.MAY_BE_WRITTEN, shown(key, memory.program), cause, key=key),)
            )


def shown(key: str, program: Program) -> str:
    """How messages name the data or state of a key: the declared name in backticks, or "what GripLoad sets"."""
    declaration = program.names.get(key)
    return f"what {SETTERS[key]} sets" if declaration is None else f"`{declaration.name}`"


def joined(ends: Sequence[dict[str, Data]], program: Program) -> dict[str, Data]:
    """Values by key where several ways through the program meet.

    A key is unknown if its values differ or one way lacks it, and assumed if it is assumed on any way.

    Args:
        ends: values by key at the end of each way, at least one.
    """
    result, undecided = dict(ends[0]), set[str]()
    for end in ends[1:]:
        for key in _apart(result, end):
            if key in undecided:
                continue
            (a, first), (b, second) = without_causes(result.get(key, key)), without_causes(end.get(key, key))
            declaration = program.names.get(key) if program.taught else None
            if declaration is not None and declaration.name.lower() in program.taught and equal_when_measured(a, b):
                continue
            if key not in result or key not in end or (a is not b and a != b):
                result[key] = Unknown(Kind.UNDECIDED, shown(key, program), key=key)
                undecided.add(key)
            else:
                result[key] = assumed_for(a, joined_causes(first, second))
    return result


def _apart(one: dict[str, Data], other: dict[str, Data]) -> list[str]:
    """Keys that only one of two dictionaries has, or whose values are not the same object in both."""
    if len(one) == len(other) and all(map(is_, one, other)):
        return list(compress(one, map(is_not, one.values(), other.values())))
    return [k for k in one.keys() | other.keys() if k not in one or k not in other or one[k] is not other[k]]


def present(memory: Memory, keys: Iterable[str]) -> dict[str, object]:
    """The present values of data and state by key; a key itself stands for the value if nothing has set it."""
    values: dict[str, object] = {}
    for key in keys:
        bound = memory.frame.bindings.get(key[1:]) if key.startswith("%") else None
        if bound is None or isinstance(bound, Reference):
            values[key] = memory.changed.get(key if bound is None else bound.declaration.key, key)
        else:
            values[key] = bound
    return values


def differing(before: Mapping[str, object], after: Mapping[str, object]) -> set[str]:
    """Keys whose value changed; an unknown value that is replaced by another unknown one counts as unchanged."""
    return {key for key, now in after.items() if before[key] is not now and not _equal(before[key], now)}


def _equal(before: object, now: object) -> bool:
    """Whether two values are equal; two unknown values count as equal, partly known ones if their parts do."""
    match before, now:
        case PartlyUnknown(), PartlyUnknown():
            return _equal(before.data, now.data)
        case (PartlyUnknown(), _) | (_, PartlyUnknown()):
            return False
        case Unknown(), Unknown():
            return True
        case tuple(), tuple() if before != now and len(before) == len(now):
            return all(map(_equal, before, now))
    return before == now


def _replaced(value: Value, path: Sequence[int | str], data: Data, memory: Memory) -> Data:
    """A copy of the value's data with the part at ``path`` (indices from 1, field names) replaced by ``data``.

    Raises:
        Unknown: the value has no such part.
    """
    if not path:
        return as_type(data, value.type)
    step, inner = path[0], path[1:]
    if isinstance(step, int):
        at, kind = step - 1, value.type
    else:
        names = [name for name, _ in memory.records.get(value.type, ())]
        if step not in names:
            raise Unknown(Kind.NO_COMPONENT, step)
        at = names.index(step)
        kind = memory.records[value.type][at][1]
    items = value.data
    if isinstance(items, Unknown) and isinstance(step, str):
        items = (items,) * len(names)
    if not isinstance(items, tuple) or not 0 <= at < len(items):
        raise Unknown(Kind.NO_PART)
    return (*items[:at], _replaced(Value(items[at], kind), inner, data, memory), *items[at + 1 :])


def _rebound(bound: Value | Unknown, path: Path, data: Data, memory: Memory) -> Binding:
    """Binding of a parameter handed over by value, after an assignment to it or to a part of it.

    Args:
        bound: binding before; path: evaluated indices and field names of the part, () for all of it.
        data: what is assigned; memory: gives the fields of records.

    Returns:
        The new value; Unknown if ``data`` is, or if a part of an unknown value is assigned.
    """
    if isinstance(data, Unknown):
        return data
    data, causes = without_causes(data)
    if isinstance(bound, Unknown):
        return bound if path else Value(data, assumed=causes)
    try:
        causes = joined_causes(causes, bound.assumed if path else ())
        return Value(_replaced(bound, path, data, memory), bound.type, bound.rank, assumed=causes)
    except Unknown as error:
        return error.kept()
