"""RAPID's own instructions that do not move.

Sources: instruction signatures of 3HAC050917-001 (RL) and the Instructions manual; see the functions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tests.worlds import motions
from tests.worlds.outside import answer, raise_interrupt, unknown_procedure
from tests.worlds.state import plain
from tests.worlds.syntax import Arg, Expr
from tests.worlds.values import NO_TURN, Fault, RapidError, convert, matrix_pose, pose_matrix, predefined, single

if TYPE_CHECKING:
    from tests.worlds.interpreter import Interpreter
    from tests.worlds.task import Ref

ERR_WAIT_MAXTIME = predefined()["err_wait_maxtime"][1]


def _given(arguments: tuple[Arg, ...]) -> list[Expr]:
    return [a.value for a in arguments if a.kind in ("pos", "named") and a.value is not None]


def _option(arguments: tuple[Arg, ...], name: str) -> Arg | None:
    return next((a for a in arguments if a.name == name and a.kind in ("opt", "cond")), None)


def _add(sign: float) -> Any:
    def f(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
        given = _given(arguments)
        ref = task.ref(given[0])
        amount = task.evaluate(given[1], ref.type) if len(given) > 1 else 1.0
        ref.set(ref.get() + sign * amount, task.records)

    return f


def _clear(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    task.ref(_given(arguments)[0]).set(0.0, task.records)


def _read_answer(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    ref = task.ref(_given(arguments)[0])
    said = task.world.value(ref.name, task.here)
    ref.set(answer(task, "answer") if said is None else said, task.records)


def _by_name(task: Interpreter, name: str) -> Ref:
    found = task.find(name.lower())
    if found is None:
        raise Fault(f"SetDataVal or GetDataVal of `{name}`, which is declared nowhere")
    return found


def _set_data(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    given = _given(arguments)
    ref = _by_name(task, task.evaluate(given[0], "string"))
    if ref.storage != "const":
        ref.set(task.evaluate(given[1], ref.type), task.records)


def _get_data(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    given = _given(arguments)
    task.ref(given[1]).set(_by_name(task, task.evaluate(given[0], "string")).get(), task.records)


def _call_by_var(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    given = _given(arguments)
    name, number = task.evaluate(given[0], "string"), task.evaluate(given[1], "num")
    task.call(f"{name}{number:g}".lower(), (), line)


def _disp_set(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    task.builtin["c_progdisp"].get()[0] = convert(task.evaluate(_given(arguments)[0], "pose"), "pose", task.records)


def _disp_off(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    task.builtin["c_progdisp"].get()[0] = [[0.0] * 3, list(NO_TURN)]


def _disp_on(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    """PDispOn [\\Rot] [\\ExeP] ProgPoint Tool [\\WObj]: from ProgPoint to ExeP or the present position; moves, turns with \\Rot."""
    given = _given(arguments)
    program, tool = task.evaluate(given[0], "robtarget"), task.evaluate(given[1], "tooldata")
    executed, wobj = _option(arguments, "exep"), _option(arguments, "wobj")
    _disp_off(task, arguments, line)
    if executed is not None and executed.value is not None:
        now = task.evaluate(executed.value, "robtarget")
    else:
        now = task.motion.target(task, tool, task.evaluate(wobj.value) if wobj and wobj.value else None)
    if _option(arguments, "rot"):
        disp = matrix_pose(pose_matrix(now) @ np.linalg.inv(pose_matrix(program)))
    else:
        disp = [[single(a - b) for a, b in zip(now[0], program[0], strict=True)], list(NO_TURN)]
    task.builtin["c_progdisp"].get()[0] = disp


def _offsets_set(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    task.builtin["c_progdisp"].get()[1] = convert(
        task.evaluate(_given(arguments)[0], "extjoint"), "extjoint", task.records
    )


def _offsets_off(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    task.builtin["c_progdisp"].get()[1] = [0.0] * 6


def _wait(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    """Satisfied at once; with \\MaxTime it may time out: \\TimeFlag says so, else it is an error."""
    task.log("wait", line, {})
    if _option(arguments, "maxtime") is None:
        return
    late = task.world.chance(0.3, "late", task.here) and task.world.unknown
    flag = _option(arguments, "timeflag")
    if flag is not None and flag.value is not None:
        task.ref(flag.value).set(late, task.records)
    elif late:
        raise RapidError(ERR_WAIT_MAXTIME)


def _order(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    """ISignalDI [\\Single] Signal, Value, Interrupt; ITimer [\\Single] Time, Interrupt; IPers and the like: number last."""
    interrupt = task.interrupts[task.evaluate(_given(arguments)[-1], "num")]
    interrupt.order, interrupt.single = "signal", _option(arguments, "single") is not None


def _sleep(asleep: bool) -> Any:
    def f(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
        task.interrupts[task.evaluate(_given(arguments)[0], "num")].asleep = asleep

    return f


def _delete(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    task.interrupts.pop(task.evaluate(_given(arguments)[0], "num"), None)


def _disable(by: int) -> Any:
    def f(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
        task.disabled = max(0, task.disabled + by)

    return f


def _trigger(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    """TriggInt TriggData, Distance [\\Start] | [\\Time], Interrupt; TriggIO, TriggEquip, ...: a signal is set underway."""
    ref = task.ref(_given(arguments)[0])
    task.motion.trigger[f"{ref.name}/{ref.key}"] = lambda: None


def _trigger_interrupt(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    given = _given(arguments)
    ref, number = task.ref(given[0]), task.evaluate(given[2], "num")
    task.motion.trigger[f"{ref.name}/{ref.key}"] = lambda: raise_interrupt(task, number)


def _grip(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    task.log("gripload", line, {"load": task.evaluate(_given(arguments)[0], "loaddata")})


def _stop(task: Interpreter, arguments: tuple[Arg, ...], line: int) -> None:
    task.log("stop", line, {})


INSTRUCTIONS: dict[str, Any] = {
    "add": _add(1.0),
    "incr": _add(1.0),
    "decr": _add(-1.0),
    "clear": _clear,
    "tpreadnum": _read_answer,
    "tpreaddnum": _read_answer,
    "tpreadfk": _read_answer,
    "setdataval": _set_data,
    "getdataval": _get_data,
    "callbyvar": _call_by_var,
    "pdispset": _disp_set,
    "pdispoff": _disp_off,
    "pdispon": _disp_on,
    "eoffsset": _offsets_set,
    "eoffsoff": _offsets_off,
    "gripload": _grip,
    "isleep": _sleep(True),
    "iwatch": _sleep(False),
    "idelete": _delete,
    "idisable": _disable(1),
    "ienable": _disable(-1),
    "triggint": _trigger_interrupt,
    "stop": _stop,
    **dict.fromkeys(["triggio", "triggequip", "triggspeed", "triggcheckio", "triggrampao"], _trigger),
    **dict.fromkeys(
        ["isignaldi", "isignaldo", "isignalai", "isignalao", "isignalgi", "isignalgo", "itimer", "ipers", "ierror"],
        _order,
    ),
    **dict.fromkeys(["waitdi", "waitdo", "waitai", "waitao", "waitgi", "waitgo", "waituntil"], _wait),
}

EFFECTS = frozenset(
    [
        "set",
        "reset",
        "setdo",
        "setao",
        "setgo",
        "pulsedo",
        "invertdo",
        "tpwrite",
        "tperase",
        "tpshow",
        "waittime",
        "waitrob",
        "waitsyncload",
        "accset",
        "velset",
        "confl",
        "confj",
        "singarea",
        "cirpathmode",
        "clkreset",
        "clkstart",
        "clkstop",
        "errwrite",
        "errlog",
        "setallsignals",
        "stopmove",
        "startmove",
        "storepath",
        "restopath",
        "clearpath",
        "actunit",
        "deactunit",
        "softact",
        "softdeact",
        "worldacclim",
        "pathacclim",
        "motionsup",
        "speedrefresh",
        "pathresol",
        "tryint",
        "bookerrno",
        "open",
        "close",
        "write",
        "writebin",
        "writestrbin",
        "systemstopaction",
        "ioenable",
        "iodisable",
        "settpmode",
        "corrcon",
        "corrclear",
        "corrwrite",
        "corrdiscon",
        "indreset",
        "uimsgbox",
        "uimsgwrite",
        "break",
        "speedoverride",
        "sethwsim",
        "resetretrycount",
        "trigg",
    ]
)
"""Instructions that do nothing to data: they are listed with the values of their arguments."""


def run(task: Interpreter, name: str, arguments: tuple[Arg, ...], line: int) -> None:
    """An instruction, or a procedure that is in none of the files."""
    if name in motions.ROLES:
        motions.move(task, name, arguments, line)
    elif name in INSTRUCTIONS:
        INSTRUCTIONS[name](task, arguments, line)
    elif name in EFFECTS:
        task.log(name, line, {"handed": [plain(task, a) for a in arguments]})
    else:
        unknown_procedure(task, name, arguments, line)
