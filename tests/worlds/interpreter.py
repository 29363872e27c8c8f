"""Runs a RAPID task in a world and lists what it does: motions and other effects, in order.

Sources: RAPID kernel manual (3HAC16585-1; section numbers in comments), RAPID Overview, Instructions, Functions (RL).
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.worlds import functions, instructions
from tests.worlds.geometry import Array
from tests.worlds.syntax import Arg, Data, Expr, Module, Routine, Statement, parse
from tests.worlds.values import ALIASES, RECORDS, Dnum, Fault, convert, default, predefined, single
from tests.worlds.world import World

STEPS = 60_000
"""Statements after which a program counts as endless."""
Identity = tuple[str, str, int]


@dataclass(eq=False)
class Ref:
    """A place that holds a value: INOUT parameters share it with the argument (5.1)."""

    holder: list[Any]
    key: int
    type: str
    storage: str
    name: str

    def get(self) -> Any:
        return self.holder[self.key]

    def set(self, value: Any, records: dict[str, Any]) -> None:
        self.holder[self.key] = convert(value, self.type, records)


@dataclass
class Frame:
    """A running routine: its data by name; ``present`` the optional parameters that were given."""

    routine: Routine
    names: dict[str, Ref] = field(default_factory=dict)
    absent: dict[str, str] = field(default_factory=dict)
    handling: bool = False


@dataclass
class Event:
    """What the program did: a motion or another effect, which statement asked, whether the original has it."""

    identity: Identity
    inserted: bool
    name: str
    motion: bool
    line: int
    values: dict[str, Any]


class Return(Exception):
    def __init__(self, value: Any) -> None:
        self.value = value


class Goto(Exception):
    def __init__(self, label: str) -> None:
        self.label = label


class Retry(Exception):
    pass


class TryNext(Exception):
    pass


class Ended(Exception):
    """EXIT, or an error nobody handles: the program stops."""


class RapidError(Exception):
    def __init__(self, number: float, left: Frame | None = None) -> None:
        self.number, self.left = number, left


class Interpreter:
    """A task. ``identities`` maps statements of a corrected program to those of the original, see `alignment`."""

    def __init__(self, modules: list[Module], world: World, identities: dict[Statement, tuple[Identity, bool]] | None = None) -> None:
        self.modules, self.world = modules, world
        self.identities = identities
        self.records = dict(RECORDS)
        self.aliases = dict(ALIASES)
        self.events: list[Event] = []
        self.frames: list[Frame] = []
        self.counts: dict[Identity, int] = {}
        self.here: tuple[Identity, int] = (("", "", -1), 0)
        self.inserted = False
        self.steps = 0
        self.stopped = ""
        self.motion = instructions.MotionState()
        self.interrupts: dict[float, instructions.Interrupt] = {}
        self.pending: list[tuple[int, Callable[[], None]]] = []
        self.in_trap = self.disabled = 0
        for m in modules:
            self.records |= m.records
            self.aliases |= m.aliases
        self.builtin = {n: Ref([v], 0, t, "const", n) for n, (t, v) in predefined().items()}
        self.builtin["errno"] = Ref([0.0], 0, "num", "var", "errno")
        self.builtin["c_progdisp"] = Ref([default("progdisp", self.records)], 0, "progdisp", "pers", "c_progdisp")
        self._declare()

    # 2.18 data, 9.1 modules
    def _declare(self) -> None:
        self.reading: str | None = None
        self.shared: dict[str, Ref] = {}
        self.own: dict[str, dict[str, Ref]] = {m.name: {} for m in self.modules}
        self.routines: dict[str, Routine] = {}
        self.local_routines: dict[str, dict[str, Routine]] = {m.name: {} for m in self.modules}
        waiting = []
        for m in self.modules:
            for r in m.routines:
                (self.local_routines[m.name] if r.local else self.routines)[r.name] = r
            waiting += [(m.name, d) for d in m.data]
        while waiting:
            left = []
            for module, d in waiting:
                try:
                    ref = self._made(d, module)
                except KeyError:
                    left.append((module, d))
                    continue
                (self.own[module] if d.scope == "local" else self.shared)[d.name] = ref
            if len(left) == len(waiting):
                raise Fault(f"`{left[0][1].name}` is declared by what is declared nowhere")
            waiting = left

    def _made(self, d: Data, module: str | None, prefix: str = "") -> Ref:
        type_ = self.aliases.get(d.type, d.type)
        self.reading = module
        prefix = prefix or (f"{module}/" if d.scope == "local" else "")
        sizes = [int(self.evaluate(e, "num")) for e in d.dims]
        if d.value is None:
            value: Any = default(type_, self.records)
            for n in reversed(sizes):
                value = [copy.deepcopy(value) for _ in range(n)]
        else:
            value = convert(self.evaluate(d.value, type_), type_, self.records)
        value = self._varied(value, type_, len(sizes), d, f"{prefix}{d.name}")
        return Ref([value], 0, type_, d.storage, d.name)

    def _varied(self, value: Any, type_: str, dims: int, d: Data, name: str) -> Any:
        """What the operator made of declared data: PERS values changed, targets touched up (also CONST ones, ModPos)."""
        w = self.world
        if dims:
            return [self._varied(v, type_, dims - 1, d, f"{name}/{i}") for i, v in enumerate(value, 1)]
        if d.value is None:
            return value
        if w.touched and type_ == "robtarget":
            return convert(w.varied(value, type_, name, "touched"), type_, self.records)
        if w.operator and d.storage == "pers" and type_ != "robtarget":
            other = w.varied(value, type_, name, "operator")
            return value if other is None else convert(other, type_, self.records)
        return value

    # names: routine, module, task, built-in (2.17 scope rules: the nearer declaration hides)
    def find(self, name: str) -> Ref | None:
        module = self.reading
        if self.frames:
            frame = self.frames[-1]
            if name in frame.names:
                return frame.names[name]
            module = frame.routine.module
        if module is not None and name in self.own[module]:
            return self.own[module][name]
        return self.shared.get(name) or self.builtin.get(name)

    def find_routine(self, name: str) -> Routine | None:
        module = self.frames[-1].routine.module if self.frames else None
        if ":" in name:  # late binding may name a module: "Module:proc"
            module, name = name.lower().split(":", 1)
            return self.local_routines.get(module, {}).get(name) or self.routines.get(name)
        if module is not None and name in self.local_routines[module]:
            return self.local_routines[module][name]
        return self.routines.get(name)

    def ref(self, e: Expr) -> Ref:
        """The place that an expression names; KeyError where nothing has that name."""
        if e[0] != "ref":
            raise Fault("a name of data is expected")
        base = self.find(e[1])
        if base is None:
            raise KeyError(e[1])
        return self._inside(base, e[2])

    def _inside(self, ref: Ref, accessors: Iterable[tuple[str, Any]]) -> Ref:
        for kind, what in accessors:
            if kind == "part":
                parts = self.records.get(ref.type, [])
                k = next((i for i, (n, _) in enumerate(parts) if n == what), None)
                if k is None:
                    raise Fault(f"{ref.type} has no component `{what}`")
                ref = Ref(ref.get(), k, self.aliases.get(parts[k][1], parts[k][1]), ref.storage, ref.name)
                continue
            for e in what:  # 3.5: the index of the first element is 1
                i = int(self.evaluate(e, "num"))
                if not isinstance(ref.get(), list) or not 1 <= i <= len(ref.get()):
                    raise Ended(f"index {i} of `{ref.name}`")
                ref = Ref(ref.get(), i - 1, ref.type, ref.storage, ref.name)
        return ref

    # 3: expressions
    def evaluate(self, e: Expr, want: str | None = None) -> Any:
        kind = e[0]
        if kind == "num":
            value = float(int(e[1], 16)) if e[1][:2].lower() == "0x" else float(e[1])
            return Dnum(value) if want == "dnum" else single(value)
        if kind in ("str", "bool"):
            return e[1]
        if kind == "agg":
            return [self.evaluate(x, t) for x, t in zip(e[1], self._part_types(want, len(e[1])), strict=True)]
        if kind == "ref":
            try:
                return self.ref(e).get()
            except KeyError:
                if self.frames and e[1] in self.frames[-1].absent:
                    raise Ended(f"optional `{e[1]}` was not given") from None
                if not self.frames or e[2]:
                    raise
                return instructions.signal(self, e[1])
        if kind == "call":
            value = self.call_function(e[1], e[2], want)
            if not e[3]:
                return value
            type_ = self._result_type(e[1])
            return self._inside(Ref([value], 0, type_, "var", e[1]), e[3]).get()
        if kind == "un":
            return self._unary(e[1], self.evaluate(e[2], want))
        if kind == "bin":
            return self._binary(e, want)
        raise Fault(f"an expression `{kind}` has no value")

    def _part_types(self, want: str | None, n: int) -> list[str | None]:
        parts = self.records.get(want or "")
        if parts and len(parts) == n:
            return [t for _, t in parts]
        return [want] * n

    def _result_type(self, name: str) -> str:
        routine = self.find_routine(name)
        return self.aliases.get(routine.type or "", routine.type or "") if routine else functions.RESULTS.get(name, "robtarget")

    @staticmethod
    def _unary(op: str, a: Any) -> Any:
        if op == "not":
            return not a
        if isinstance(a, list):
            return [-v for v in a]
        return Dnum(-a) if isinstance(a, Dnum) else -a

    def _binary(self, e: Expr, want: str | None) -> Any:
        op = e[1]
        if op in ("and", "or", "xor"):
            a = self.evaluate(e[2], "bool")
            # Overview: the right operand of AND and OR is not evaluated where the left decides ("conditional evaluation")
            if (op == "and" and not a) or (op == "or" and a):
                return bool(a)
            b = self.evaluate(e[3], "bool")
            return bool(a) != bool(b) if op == "xor" else bool(b)
        hint = None if op in ("<", "<=", "=", ">", ">=", "<>") else want
        a, b = self.evaluate(e[2], hint), self.evaluate(e[3], hint)
        if isinstance(a, Dnum) != isinstance(b, Dnum):  # a literal takes the precision of the other side
            a = self.evaluate(e[2], "dnum") if e[2][0] == "num" else a
            b = self.evaluate(e[3], "dnum") if e[3][0] == "num" else b
        return functions.operate(op, a, b, RapidError)

    # routines
    def call_function(self, name: str, arguments: tuple[Arg, ...], want: str | None) -> Any:
        routine = self.find_routine(name)
        if routine is None:
            known = functions.FUNCTIONS.get(name)
            if known is not None:
                return known(self, arguments)
            return instructions.unknown_function(self, name, arguments, want)
        if routine.kind != "func":
            raise Fault(f"`{name}` is no function")
        return self.run_routine(routine, arguments)

    def run_routine(self, routine: Routine, arguments: tuple[Arg, ...]) -> Any:
        frame = Frame(routine)
        self._bind(frame, arguments)
        if len(self.frames) > 60:
            raise Ended("too many calls inside each other")
        here, self.frames = self.here, [*self.frames, frame]
        try:
            for d in routine.data:
                frame.names[d.name] = self._made(d, None, f"{routine.module}/{routine.name}/")
            self.block(routine.body)
        except Return as r:
            return convert(r.value, self._type(routine.type), self.records) if routine.type else None
        except Goto as g:
            raise Fault(f"label `{g.label}` is nowhere") from None
        finally:
            self.frames = self.frames[:-1]
            self.here = here
        if routine.kind == "func":
            raise Ended(f"function `{routine.name}` ends without RETURN")
        return None

    def _type(self, name: str | None) -> str:
        return self.aliases.get(name or "", name or "")

    def _bind(self, frame: Frame, arguments: tuple[Arg, ...]) -> None:
        required = [p for p in frame.routine.parameters if not p.optional]
        optional = {p.name: p for p in frame.routine.parameters if p.optional}
        frame.absent = {p.name: p.type for p in optional.values()}
        for a in arguments:
            if a.kind == "pos":
                if not required:
                    raise Fault(f"too many arguments for `{frame.routine.name}`")
                p, value = required.pop(0), a.value
            elif a.kind == "named":
                p = next(q for q in required if q.name == a.name)
                required.remove(p)
                value = a.value
            else:
                p, value = optional[a.name], a.value
                if a.kind == "cond":  # 3.10: handed on only if it is present itself
                    assert value is not None
                    if value[1] in self.frames[-1].absent:
                        continue
            del_absent = frame.absent.pop(p.name, None)
            assert del_absent is None or p.optional
            if p.mode == "switch":
                frame.names[p.name] = Ref([True], 0, "switch", "const", p.name)
            elif p.mode == "in":  # 5.1: a copy, which the routine may change
                type_ = self._type(p.type)
                assert value is not None
                frame.names[p.name] = Ref([convert(self.evaluate(value, type_), type_, self.records)], 0, type_, "var", p.name)
            else:  # the argument itself, also one element or component of it
                assert value is not None
                frame.names[p.name] = self.ref(value)
        if required:
            raise Ended(f"`{frame.routine.name}` lacks `{required[0].name}`")

    # 4: statements
    def block(self, statements: list[Statement]) -> None:
        labels = {s.parts["name"]: i for i, s in enumerate(statements) if s.kind == "label"}
        i = 0
        while i < len(statements):
            try:
                self.statement(statements[i])
            except Goto as g:  # 4.6: to a label of the same or an enclosing statement list
                if g.label not in labels:
                    raise
                i = labels[g.label]
                continue
            i += 1

    def statement(self, s: Statement) -> None:
        frame = self.frames[-1]
        while True:
            self.steps += 1
            if self.steps > STEPS:
                raise Ended("endless")
            try:
                return self._begun(s, frame)
            except RapidError as e:
                if e.left is frame or frame.handling or not self._handled(frame, e.number):
                    raise
                try:
                    self._handle(frame, e)
                except Retry:
                    continue
                except TryNext:
                    return None
                raise Return(None) from None

    def _handled(self, frame: Frame, number: float) -> bool:
        r = frame.routine
        if r.error is None:
            return False
        return not r.error_numbers or any(self.evaluate(n) == number for n in r.error_numbers)

    def _handle(self, frame: Frame, e: RapidError) -> None:
        self.builtin["errno"].holder[0] = e.number
        frame.handling = True
        try:
            self.block(frame.routine.error or [])
        except RapidError as again:
            raise RapidError(again.number, frame) from None
        finally:
            frame.handling = False

    def _begun(self, s: Statement, frame: Frame) -> None:
        """Where the statement stands in the original; what waits for this moment happens before it."""
        if self.identities is None:
            identity, inserted = (frame.routine.module, frame.routine.name, s.index), False
        else:
            identity, inserted = self.identities[s]
        if not inserted:
            self.counts[identity] = self.counts.get(identity, 0) + 1
            self.here = (identity, self.counts[identity])
            if not self.inserted:
                instructions.meanwhile(self)
                self.here = (identity, self.counts[identity])
            return self._execute(s, frame)
        if self.inserted:
            return self._execute(s, frame)
        self.here = (identity, self.counts.get(identity, 0) + 1)
        kept, self.inserted = dict(self.counts), True
        try:
            return self._execute(s, frame)
        finally:
            self.inserted, self.counts = False, kept

    def _execute(self, s: Statement, frame: Frame) -> None:
        getattr(self, f"_{s.kind}")(s, frame)

    def _nothing(self, s: Statement, frame: Frame) -> None:
        pass

    _label = _nothing

    def _assign(self, s: Statement, frame: Frame) -> None:
        ref = self._writable(s.parts["target"])
        ref.set(self.evaluate(s.parts["value"], ref.type), self.records)

    def _writable(self, target: Expr) -> Ref:
        try:
            ref = self.ref(target)
        except KeyError as e:
            raise Fault(f"`{e.args[0]}` is declared nowhere") from None
        if ref.storage == "const":
            raise Fault(f"`{ref.name}` is a constant")
        return ref

    def _goto(self, s: Statement, frame: Frame) -> None:
        raise Goto(s.parts["name"])

    def _return(self, s: Statement, frame: Frame) -> None:
        value = s.parts["value"]
        raise Return(None if value is None else copy.deepcopy(self.evaluate(value, self._type(frame.routine.type))))

    def _raise(self, s: Statement, frame: Frame) -> None:
        # 4.8: with a number the routine's own handler gets it, without one the error goes to the caller
        if s.parts["value"] is None:
            raise RapidError(self.builtin["errno"].get(), frame)
        raise RapidError(self.evaluate(s.parts["value"]), frame if frame.handling else None)

    def _exit(self, s: Statement, frame: Frame) -> None:
        raise Ended("EXIT")

    def _retry(self, s: Statement, frame: Frame) -> None:
        raise Retry

    def _trynext(self, s: Statement, frame: Frame) -> None:
        raise TryNext

    def _connect(self, s: Statement, frame: Frame) -> None:
        ref = self._writable(s.parts["target"])
        number = float(len(self.interrupts) + 1)
        ref.set(number, self.records)
        self.interrupts[number] = instructions.Interrupt(s.parts["trap"], ref.name)

    def _if(self, s: Statement, frame: Frame) -> None:
        for condition, body in s.parts["arms"]:
            if self.evaluate(condition, "bool"):
                return self.block(body)
        if s.parts["otherwise"]:
            self.block(s.parts["otherwise"])
        return None

    def _while(self, s: Statement, frame: Frame) -> None:
        identity, n = self.here
        turn = 0
        while self.evaluate(s.parts["condition"], "bool"):
            self.block(s.parts["body"])
            turn += 1
            self.here = (identity, n * 1000 + turn)
            self.steps += 1
            if self.steps > STEPS:
                raise Ended("endless")

    def _for(self, s: Statement, frame: Frame) -> None:
        p = s.parts
        first, last = self.evaluate(p["first"], "num"), self.evaluate(p["last"], "num")
        # 4.15: without STEP the step is 1, or -1 where the first value is greater than the last; evaluated once
        step = self.evaluate(p["step"], "num") if p["step"] else (1.0 if first <= last else -1.0)
        if step == 0:
            raise Ended("STEP 0")
        hidden = frame.names.get(p["name"])
        k = first
        try:
            while min(first, last) <= k <= max(first, last):
                # the loop variable is declared by the statement, cannot be changed and hides others
                frame.names[p["name"]] = Ref([k], 0, "num", "const", p["name"])
                self.block(p["body"])
                k = single(k + step)
        finally:
            if hidden is None:
                frame.names.pop(p["name"], None)
            else:
                frame.names[p["name"]] = hidden

    def _test(self, s: Statement, frame: Frame) -> None:
        value = self.evaluate(s.parts["subject"])
        for values, body in s.parts["cases"]:
            if any(self.evaluate(v) == value for v in values):
                return self.block(body)
        if s.parts["default"]:
            self.block(s.parts["default"])
        return None

    def _call(self, s: Statement, frame: Frame) -> None:
        self.call(s.parts["name"], s.parts["args"], s.line)

    def _late(self, s: Statement, frame: Frame) -> None:
        # 4.5: the expression between the signs gives the name of the procedure
        self.call(str(self.evaluate(s.parts["name"], "string")).lower(), s.parts["args"], s.line)

    def call(self, name: str, arguments: tuple[Arg, ...], line: int) -> None:
        routine = self.find_routine(name)
        if routine is not None:
            self.run_routine(routine, arguments)
        else:
            instructions.run(self, name, arguments, line)

    def log(self, name: str, line: int, values: dict[str, Any], motion: bool = False) -> None:
        self.events.append(Event(self.here[0], self.inserted, name, motion, line, copy.deepcopy(values)))

    def run(self, entry: str = "main") -> list[Event]:
        """Runs the entry procedure to its end, its stop or STEPS statements; ``stopped`` says why it stopped."""
        routine = self.routines.get(entry)
        if routine is None:
            raise Fault(f"no procedure `{entry}`")
        try:
            self.run_routine(routine, ())
        except Ended as e:
            self.stopped = str(e)
        except RapidError as e:
            self.stopped = f"error {e.number:g}"
        except (Retry, TryNext):
            raise Fault("RETRY or TRYNEXT outside an error handler") from None
        return self.events

    def final(self) -> dict[str, Any]:
        """The values of all data of the modules at the end."""
        out = {f"/{n}": r for n, r in self.shared.items()}
        for module, refs in self.own.items():
            out |= {f"{module}/{n}": r for n, r in refs.items()}
        return {n: (r.type, r.get()) for n, r in out.items()}


def load(texts: Iterable[str]) -> list[Module]:
    return [m for text in texts for m in parse(text)]


def matrix(*parts: Array) -> Array:
    out = np.eye(4)
    for p in parts:
        out = out @ p
    return out
