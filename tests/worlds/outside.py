"""What a program meets outside of itself: signals, answers, routines of other files, interrupts, other tasks."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from tests.worlds.syntax import Arg
from tests.worlds.values import Ended, Fault, RapidError, clone, convert, default, single

if TYPE_CHECKING:
    from tests.worlds.interpreter import Interpreter
    from tests.worlds.task import Ref


def signal(task: Interpreter, name: str) -> float:
    """The value of an input or output, which it keeps while one statement runs."""
    said = task.world.value(name, task.here)
    if said is not None:
        return float(said)
    r = task.world.random("signal", name, task.here)
    if re.match(r"a[io]", name):
        return single(round(r.uniform(0, 10), 2))
    if re.match(r"g[io]", name):
        return float(r.randint(0, 3))
    return float(r.randint(0, 1))


def answer(task: Interpreter, name: str) -> float:
    said = task.world.value(name, task.here)
    return float(said) if said is not None else float(task.world.random("answer", name, task.here).randint(1, 3))


def unknown_function(task: Interpreter, name: str, arguments: tuple[Arg, ...], want: str | None) -> Any:
    """A function of no file: the world says what it returns, and what it does to the variables that it was handed."""
    given = _handed(task, name, arguments)
    said = task.world.value(name, task.here)
    if said is not None:
        return convert(said, want or "num", task.records)
    if want in task.records:
        like = next((v for v in given if isinstance(v, list) and len(v) == len(task.records[want])), None)
        base = like if like is not None else default(want, task.records)
        other = task.world.varied(base, want, name, task.here)
        return base if other is None else convert(other, want, task.records)
    r = task.world.random("returned", name, task.here)
    if want == "bool":
        return r.random() < 0.5
    if want == "string":
        return r.choice(["A", "B", ""])
    return single(round(r.uniform(-15, 15), 2))


def _handed(task: Interpreter, name: str, arguments: tuple[Arg, ...]) -> list[Any]:
    """The values handed to a routine of no file, as they were; it may have taken the variables as INOUT."""
    out = []
    for k, a in enumerate(arguments):
        if a.value is None:
            continue
        try:
            ref = task.ref(a.value) if a.value[0] == "ref" else None
        except KeyError:
            out.append(a.value[1])
            continue
        out.append(clone(task.evaluate(a.value)))
        if (
            ref is not None
            and ref.storage != "const"
            and task.world.unknown
            and task.world.chance(0.7, name, k, task.here)
        ):
            _vary(task, ref, name, k)
    return out


def _vary(task: Interpreter, ref: Ref, *key: Any) -> None:
    if ref.type.startswith("*"):
        for i in range(len(ref.get())):
            _vary(task, type(ref)(ref.get(), i, ref.type[1:], ref.storage, ref.name), *key, i)
        return
    other = task.world.varied(ref.get(), ref.type, ref.name, *key, task.here)
    if other is not None:
        ref.set(other, task.records)


def unknown_procedure(task: Interpreter, name: str, arguments: tuple[Arg, ...], line: int) -> None:
    """A procedure of no file writes global data by name (not LOCAL ones) and what it was handed."""
    task.log(name, line, {"handed": _handed(task, name, arguments)})
    if task.world.wanders:
        _wander(task, name)
    if not task.world.unknown:
        return
    named = task.world.says.get(f"writes {name}")
    for data, ref in sorted(task.shared.items()):
        if (
            data in task.beside_data
            or ref.storage == "const"
            or ref.name != data
            or (named is not None and data not in [n.lower() for n in named])
        ):
            continue
        if named is None and not (
            ref.type.lstrip("*") in ("num", "pos", "pose", "robtarget", "bool")
            and task.world.chance(0.5, name, data, task.here)
        ):
            continue
        _vary(task, ref, name)


def _wander(task: Interpreter, name: str) -> None:
    """Code in no file moves the arm, or calls a procedure of the files that is not LOCAL."""
    chance = task.world.random("wanders", name, task.here).random()
    callable_ = [r for r in entries(task) if r != "main"]
    if chance < 0.3:
        task.motion.pose = task.motion.pose.copy()
        task.motion.pose[:3, 3] += task.world.shift(200, "wanders", name, task.here)
    elif chance > 0.5 and callable_ and not task.called_elsewhere:
        task.called_elsewhere = True
        chosen = task.world.random("called", name, task.here).choice(callable_)
        task.run_routine(task.routines[chosen], ())
        task.called_elsewhere = False


def entries(task: Interpreter) -> list[str]:
    """Procedures that the pendant may start, and code in no file may call."""
    beside = task.beside
    return sorted(
        n for n, r in task.routines.items() if r.kind == "proc" and not r.parameters and r.module not in beside
    )


def meanwhile(task: Interpreter) -> None:
    """Interrupts, synchronised procedures, other tasks: before a statement of the original, in both programs the same."""
    if task.in_trap:
        return
    for data, ref in task.shared.items():
        if f"task {data}" in task.world.says and task.world.traps and task.world.chance(0.3, data, task.here):
            said = task.world.value(f"task {data}", task.here)
            ref.set(single(float(said or 0)), task.records)
    due = [(n - 1, run) for n, run in task.pending]
    task.pending = [(n, run) for n, run in due if n > 0]
    for n, run in due:
        if n <= 0:
            _interrupting(task, run)
    if task.disabled or not task.world.traps:
        return
    for number, interrupt in list(task.interrupts.items()):
        if interrupt.order == "signal" and not interrupt.asleep and task.world.chance(0.25, interrupt.name, task.here):
            if interrupt.single:
                interrupt.order = ""
            _interrupting(task, lambda number=number: raise_interrupt(task, number))  # type: ignore[misc]


def _interrupting(task: Interpreter, run: Callable[[], None]) -> None:
    task.in_trap += 1
    here = task.here
    try:
        run()
    finally:
        task.in_trap -= 1
        task.here = here


def raise_interrupt(task: Interpreter, number: float) -> None:
    routine = task.find_routine(task.interrupts[number].trap)
    if routine is None:
        raise Fault("a trap that is declared nowhere")
    try:
        task.run_routine(routine, ())
    except RapidError as e:  # K3 8.1: an error propagated from a trap ends the execution
        raise Ended(f"error {e.number:g} in a trap") from None


def later(task: Interpreter, run: Callable[[], None], *key: Any) -> None:
    """Before one of the next three statements: the program runs ahead of the motion, nobody knows how far."""
    task.pending.append((task.world.random("later", *key, task.here).randint(1, 3), run))
