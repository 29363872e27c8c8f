"""A RAPID task: its declarations, names and expressions.

Sources: RAPID kernel manual (3HAC16585-1; section numbers in comments), RAPID Overview.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from tests.worlds import functions, outside
from tests.worlds.state import Interrupt, MotionState
from tests.worlds.syntax import Arg, Data, Expr, Module, Routine, Statement
from tests.worlds.values import (
    ALIASES,
    RECORDS,
    Dnum,
    Ended,
    Fault,
    RapidError,
    clone,
    convert,
    default,
    predefined,
    single,
)
from tests.worlds.world import World

Identity = tuple[str, str, int]
"""A statement of the original: module, routine, place in it."""


@dataclass(eq=False)
class Ref:
    """A place that holds a value: INOUT parameters share it with the argument (5.1); ``*`` before a type: an array."""

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


class Task:
    """A task in a world.

    Args:
        identities: of statements of a corrected program, see `alignment`. functions: of the controller, beside RAPID's.
    """

    def __init__(
        self,
        modules: list[Module],
        world: World,
        identities: dict[Statement, tuple[Identity, bool]] | None = None,
        functions: dict[str, Any] | None = None,
    ) -> None:
        self.modules, self.world = modules, world
        self.identities = identities
        self.functions = functions or {}
        # Modules that the original lacks: nothing from outside touches their data.
        known = {identity[0] for identity, _ in identities.values()} if identities is not None else set()
        self.beside = {m.name for m in modules if identities is not None and m.routines and m.name not in known}
        self.records = dict(RECORDS)
        self.aliases = dict(ALIASES)
        self.events: list[Event] = []
        self.frames: list[Frame] = []
        self.counts: dict[Identity, int] = {}
        self.begun: set[tuple[Identity, int]] = set()
        self.here: tuple[Identity, int] = (("", "", -1), 0)
        self.inserted = False
        self.steps = 0
        self.stopped = ""
        self.motion = MotionState()
        self.interrupts: dict[float, Interrupt] = {}
        self.pending: list[tuple[int, Callable[[], None]]] = []
        self.in_trap = self.disabled = 0
        self.called_elsewhere = False
        self.own_records = {name: parts for m in modules for name, parts in m.records.items()}
        self.records |= self.own_records
        for m in modules:
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
        self.beside_data = {d.name for m in self.modules if m.name in self.beside for d in m.data}
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
                value = [clone(value) for _ in range(n)]
        else:
            array = "*" * len(sizes) + type_
            value = convert(self.evaluate(d.value, array), array, self.records)
        if module not in self.beside:
            value = self._varied(value, type_, len(sizes), d, f"{prefix}{d.name}")
        return Ref([value], 0, "*" * len(sizes) + type_, d.storage, d.name)

    def _varied(self, value: Any, type_: str, dims: int, d: Data, name: str) -> Any:
        """What the operator made of declared data: PERS values changed, targets touched up (also CONST ones, ModPos)."""
        w = self.world
        if dims:
            return [self._varied(v, type_, dims - 1, d, f"{name}/{i}") for i, v in enumerate(value, 1)]
        if d.value is None:
            return value
        if type_ in self.own_records:
            parts = zip(value, self.own_records[type_], strict=True)
            return [self._varied(v, self.aliases.get(t, t), 0, d, f"{name}.{n}") for v, (n, t) in parts]
        if name in w.anew:
            return convert(w.anew[name].of(value), type_, self.records)
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
                ref = Ref(ref.get(), i - 1, ref.type.removeprefix("*"), ref.storage, ref.name)
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
                return outside.signal(self, e[1])
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
        if want is not None and want.startswith("*"):
            return [want[1:]] * n
        parts = self.records.get(want or "")
        if parts and len(parts) == n:
            return [t for _, t in parts]
        return [want] * n

    def _result_type(self, name: str) -> str:
        routine = self.find_routine(name)
        return (
            self.aliases.get(routine.type or "", routine.type or "")
            if routine
            else functions.RESULTS.get(name, "robtarget")
        )

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

    def call_function(self, name: str, arguments: tuple[Arg, ...], want: str | None) -> Any:
        raise NotImplementedError

    def log(self, name: str, line: int, values: dict[str, Any], motion: bool = False) -> None:
        self.events.append(
            Event(self.here[0], self.inserted, name, motion, line, {k: clone(v) for k, v in values.items()})
        )

    def final(self) -> dict[str, Any]:
        """The values of all data of the modules at the end, without constant targets, which motions show."""
        out = {f"/{n}": r for n, r in self.shared.items()}
        for module, refs in self.own.items():
            out |= {f"{module}/{n}": r for n, r in refs.items()}
        return {
            n: (r.type, r.get()) for n, r in out.items() if r.storage != "const" or r.type.lstrip("*") != "robtarget"
        }
