"""Writing to data while a program is walked, and forgetting what is no longer certain."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from postproc.rapid.evaluation.evaluate import evaluate, whole
from postproc.rapid.evaluation.memory import Binding, Memory, Reference
from postproc.rapid.program.program import Program
from postproc.rapid.program.values import Data, Value
from postproc.rapid.program.write_effects import SETTERS, UNSEEN
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.syntax.trees import Component, Expression, Index, Name
from postproc.rapid.unknown import PartlyUnknown, Unknown, unknown_part

Path = list[int | str]

MEASURED_MM, MEASURED_TURN = 5.0, 0.01  # what is measured is nearer than that to what it was; numbers of a quaternion


def no_longer(now: Data, data: Data) -> bool:
    """Whether data that is known is given a value that is farther off than measuring explains."""
    if isinstance(now, tuple) and isinstance(data, tuple) and len(now) == len(data):
        if len(now) == 4 and all(isinstance(item, float) for item in (*now, *data)):
            return any(abs(a - b) > MEASURED_TURN for a, b in zip(now, data, strict=True))
        return any(map(no_longer, now, data))
    return isinstance(now, float) and isinstance(data, float) and abs(now - data) > MEASURED_MM


def store(tree: Expression, data: Data, memory: Memory) -> None:
    """Write ``data`` (or, as Unknown, that it is not known) to a variable, an element or a component.

    Raises:
        Unknown: which part is written is not known; nothing is written then.
    """
    path, name = _path(tree, memory)
    bound = memory.frame.bindings.get(name)
    if isinstance(bound, Reference):
        declaration, path = bound.declaration, [*bound.indices, *path]
    elif bound is not None:
        memory.frame.bindings[name] = _rebound(bound, path, data, memory)
        return
    else:
        found = memory.find(name)
        if found is None or found.storage == "CONST":
            return
        declaration = found
    if path:
        try:
            data = _replaced(_present(declaration, memory), path, data, memory)
        except Unknown as error:
            data = error
        unknown = unknown_part(data)
        data = data if unknown is None or unknown is data else PartlyUnknown(unknown, data)
    memory.changed[declaration.key] = data


def _present(declaration: Declaration, memory: Memory) -> Value:
    """Value of declared data as far as it is known: what nothing in the program writes is as it was declared.

    Raises:
        Unknown: no part of it is known.
    """
    try:
        return memory.value(declaration)
    except PartlyUnknown as partly:
        return Value(partly.data, declaration.type, len(declaration.dims))
    except Unknown as error:
        value = memory.declared(declaration)
        for path in memory.changes.paths.get(declaration.key, {()}):
            data = _replaced(value, path, error, memory) if path else _all_unknown(value.data, value.rank, error)
            value = Value(data, value.type, value.rank)
        return value


def _all_unknown(data: Data, rank: int, why: Unknown) -> Data:
    """An array of the same size of which no element is known."""
    return tuple(_all_unknown(item, rank - 1, why) for item in data) if rank and isinstance(data, tuple) else why


def forget(memory: Memory, keys: Iterable[str], reason: str) -> None:
    """Data and state of these keys (as ``WriteEffects`` names them) may have any value from here on."""
    for key in keys:
        bound = memory.frame.bindings.get(key[1:]) if key.startswith("%") else None
        if isinstance(bound, Reference):
            memory.changed[bound.declaration.key] = Unknown(f"`{bound.declaration.name}` {reason}")
        elif bound is not None:
            memory.frame.bindings[key[1:]] = Unknown(f"`{key[1:]}` {reason}")
        elif key[0] != "%" and key not in ("@moves", UNSEEN):
            memory.changed[key] = Unknown(f"{shown(key, memory.program)} {reason}")


def shown(key: str, program: Program) -> str:
    """The name of data as it is spelt where it is declared, or what sets a state."""
    declaration = program.names.get(key)
    return f"what {SETTERS[key]} sets" if declaration is None else f"`{declaration.name}`"


def undecided(key: str, program: Program) -> str:
    """Why data or state has no value where ways meet that leave it different."""
    return f"{shown(key, program)} depends on a condition that is not known"


def joined(ends: Sequence[dict[str, Data]], program: Program) -> dict[str, Data]:
    """What holds where several ways meet: a value only if all of them agree."""
    result = dict(ends[0])
    for end in ends[1:]:
        for key in result.keys() | end.keys():
            if key not in result or key not in end or (result[key] is not end[key] and result[key] != end[key]):
                result[key] = Unknown(undecided(key, program))
    return result


def _path(tree: Expression, memory: Memory) -> tuple[Path, str]:
    """Indices and components that lead from a variable to the part that is written, and the variable's name."""
    match tree:
        case Name(_, name):
            return [], name
        case Index(_, base, indices):
            path, name = _path(base, memory)
            return [*path, *(whole(evaluate(i, memory).data) for i in indices)], name
        case Component(_, base, field):
            path, name = _path(base, memory)
            return [*path, field], name
    raise Unknown("this cannot be assigned to")


def _replaced(value: Value, path: Sequence[int | str], data: Data, memory: Memory) -> Data:
    """A copy of the value's data with one part replaced."""
    if not path:
        return data
    step, rest = path[0], path[1:]
    if isinstance(step, int):
        at, kind = step - 1, value.type
    else:
        names = [name for name, _ in memory.records.get(value.type, ())]
        if step not in names:
            raise Unknown(f"`.{step}` is not a known component")
        at = names.index(step)
        kind = memory.records[value.type][at][1]
    items = value.data
    if isinstance(items, Unknown) and isinstance(step, str):
        items = (items,) * len(names)
    if not isinstance(items, tuple) or not 0 <= at < len(items):
        raise Unknown("the part that is written does not exist")
    return (*items[:at], _replaced(Value(items[at], kind), rest, data, memory), *items[at + 1 :])


def _rebound(bound: Value | Unknown, path: Path, data: Data, memory: Memory) -> Binding:
    """A parameter by value after an assignment to it."""
    if isinstance(data, Unknown):
        return data
    if isinstance(bound, Unknown):
        return bound if path else Value(data)
    try:
        return Value(_replaced(bound, path, data, memory), bound.type, bound.rank)
    except Unknown as error:
        return error
