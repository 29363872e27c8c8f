"""RAPID's own instructions, what they leave to the world, and where the robot stands.

Sources: instruction signatures of 3HAC050917-001 (RL) and the Instructions manual; see the functions.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.worlds import motions
from tests.worlds.geometry import Array, flange
from tests.worlds.syntax import Arg, Expr
from tests.worlds.values import NO_TURN, Fault, convert, default, matrix_pose, pose_matrix, predefined, single

if TYPE_CHECKING:
    from tests.worlds.interpreter import Interpreter, Ref

ERR_WAIT_MAXTIME, ERR_REFUNKPRC = predefined()["err_wait_maxtime"][1], predefined()["err_refunkprc"][1]


@dataclass
class Interrupt:
    """An interrupt: the trap that it runs, the variable that holds its number, what orders it."""

    trap: str
    name: str
    order: str = ""
    single: bool = False
    asleep: bool = False


@dataclass
class MotionState:
    """Where the robot was sent last, and what holds for later motions."""

    pose: Array = field(default_factory=lambda: flange([0, 0, 0, 0, 30, 0]))  # base to tool0
    conf: list[float] = field(default_factory=lambda: [0.0] * 4)
    extax: list[float] = field(default_factory=lambda: [9e9] * 6)
    tool: Any = field(default_factory=lambda: copy.deepcopy(predefined()["tool0"][1]))
    wobj: Any = field(default_factory=lambda: copy.deepcopy(predefined()["wobj0"][1]))
    trigger: dict[str, Any] = field(default_factory=dict)

    def displacement(self, task: Interpreter) -> Array:
        return pose_matrix(task.builtin["c_progdisp"].get()[0]) if task.builtin["c_progdisp"].get()[0][1] != [0.0] * 4 else np.eye(4)

    def frame(self, task: Interpreter, wobj: Any) -> Array:
        """Base to the coordinates of programmed targets: user frame, object frame, program displacement."""
        return pose_matrix(wobj[3]) @ pose_matrix(wobj[4]) @ self.displacement(task)

    def target(self, task: Interpreter, tool: Any, wobj: Any) -> list[Any]:
        """CRobT: the present position as a target that would lead here (with the displacement that is on)."""
        tool, wobj = tool or self.tool, wobj or predefined()["wobj0"][1]
        t = np.linalg.inv(self.frame(task, wobj)) @ self.pose @ pose_matrix(tool[1])
        return [*matrix_pose(t), list(self.conf), list(self.extax)]


def with_offsets(task: Interpreter, axes: list[float]) -> list[float]:
    offsets = task.builtin["c_progdisp"].get()[1]
    return [single(a + o) if a < 8e9 and o < 8e9 else a for a, o in zip(axes, offsets, strict=True)]


def target_of_joints(task: Interpreter, joints: Any, tool: Any, wobj: Any) -> list[Any]:
    """CalcRobT: where the joints would put the tool, in the work object and with the displacement that is on."""
    frame = task.motion.frame(task, wobj or predefined()["wobj0"][1])
    t = np.linalg.inv(frame) @ flange(joints[0]) @ pose_matrix(tool[1])
    quarters = [float(np.floor(joints[0][i] / 90)) for i in (0, 3, 5)]
    return [*matrix_pose(t), [*quarters, 0.0], list(joints[1])]


# What the world answers. A signal keeps its value while one statement runs.
def signal(task: Interpreter, name: str) -> float:
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
        out.append(copy.deepcopy(task.evaluate(a.value)))
        if ref is not None and ref.storage != "const" and task.world.unknown and task.world.chance(0.7, name, k, task.here):
            _vary(task, ref, name, k)
    return out


def _vary(task: Interpreter, ref: Ref, *key: Any) -> None:
    other = task.world.varied(ref.get(), ref.type, ref.name, *key, task.here)
    if other is not None and not isinstance(ref.get(), list) or ref.type in task.records and other is not None:
        ref.set(other, task.records)


def unknown_procedure(task: Interpreter, name: str, arguments: tuple[Arg, ...], line: int) -> None:
    """A procedure of no file writes global data by name (not LOCAL ones) and what it was handed."""
    task.log(name, line, {"handed": _handed(task, name, arguments)})
    if not task.world.unknown:
        return
    named = task.world.says.get(f"writes {name}")
    for data, ref in sorted(task.shared.items()):
        if ref.storage == "const" or ref.name != data or (named is not None and data not in [n.lower() for n in named]):
            continue
        if named is None and not (ref.type in ("num", "pos", "pose", "robtarget", "bool") and task.world.chance(0.35, name, data, task.here)):
            continue
        _vary(task, ref, name)


# Interrupts, synchronised procedures, other tasks: before a statement of the original, in both programs before the same.
def meanwhile(task: Interpreter) -> None:
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
    task.run_routine(routine, ())


def later(task: Interpreter, run: Callable[[], None], *key: Any) -> None:
    """Before one of the next three statements: the program runs ahead of the motion, nobody knows how far."""
    task.pending.append((task.world.random("later", *key, task.here).randint(1, 3), run))


# Instructions by name: (task, arguments, line).
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
    task.builtin["c_progdisp"].get()[1] = convert(task.evaluate(_given(arguments)[0], "extjoint"), "extjoint", task.records)


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
        from tests.worlds.interpreter import RapidError

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
    **dict.fromkeys("isignaldi isignaldo isignalai isignalao isignalgi isignalgo itimer ipers ierror".split(), _order),
    **dict.fromkeys("waitdi waitdo waitai waitao waitgi waitgo waituntil".split(), _wait),
}

EFFECTS = frozenset(
    """set reset setdo setao setgo pulsedo invertdo tpwrite tperase tpshow waittime waitrob waitsyncload accset velset
    confl confj singarea cirpathmode clkreset clkstart clkstop errwrite errlog setallsignals stopmove startmove storepath
    restopath clearpath actunit deactunit softact softdeact worldacclim pathacclim motionsup speedrefresh pathresol
    tryint bookerrno open close write writebin writestrbin systemstopaction ioenable iodisable settpmode corrcon corrclear
    corrwrite corrdiscon indreset uimsgbox uimsgwrite break speedoverride sethwsim resetretrycount trigg""".split()
)
"""Instructions that do nothing to data: they are listed with the values of their arguments."""


def run(task: Interpreter, name: str, arguments: tuple[Arg, ...], line: int) -> None:
    """An instruction, or a procedure that is in none of the files."""
    if name in motions.ROLES:
        motions.move(task, name, arguments, line)
    elif name in INSTRUCTIONS:
        INSTRUCTIONS[name](task, arguments, line)
    elif name in EFFECTS:
        task.log(name, line, {"handed": [_plain(task, a) for a in arguments]})
    else:
        unknown_procedure(task, name, arguments, line)


def _plain(task: Interpreter, a: Arg) -> Any:
    if a.value is None:
        return a.name
    if a.value[0] == "ref" and task.find(a.value[1]) is None:
        return a.value[1]
    return [a.name, copy.deepcopy(task.evaluate(a.value))]
