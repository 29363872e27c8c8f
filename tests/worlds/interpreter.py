"""Runs a RAPID task in a world and lists what it does: motions and other effects, in order.

Sources: RAPID kernel manual (3HAC16585-1; section numbers in comments), K3 (Basic Characteristics), Overview.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from tests.worlds import functions, instructions, outside
from tests.worlds.parser import parse
from tests.worlds.state import Interrupt
from tests.worlds.syntax import Arg, Expr, Module, Routine, Statement
from tests.worlds.task import Event, Frame, Ref, Task
from tests.worlds.values import Ended, Fault, RapidError, clone, convert, single

STEPS = 60_000
"""Statements after which a program counts as endless."""


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


class Interpreter(Task):
    """A task that runs."""

    # routines
    def call_function(self, name: str, arguments: tuple[Arg, ...], want: str | None) -> Any:
        routine = self.find_routine(name)
        if routine is None:
            known = self.functions.get(name) or functions.FUNCTIONS.get(name)
            if known is not None:
                return known(self, arguments)
            return outside.unknown_function(self, name, arguments, want)
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
                type_ = "*" * p.dims + self._type(p.type)
                assert value is not None
                frame.names[p.name] = Ref(
                    [convert(self.evaluate(value, type_), type_, self.records)], 0, type_, "var", p.name
                )
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
            self.steps += frame.routine.module not in self.beside
            if self.steps > STEPS:
                raise Ended("endless")
            try:
                return self._begun(s, frame)
            except RapidError as e:
                # K3 8.1: without an error handler the error is raised again where the routine was called
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
        except RapidError as again:  # K3 8.1: an error in an error clause goes to the system, which stops the program
            if again.left is not frame:
                raise Ended(f"error {again.number:g} in an error handler") from None
            raise RapidError(again.number, frame) from None
        finally:
            frame.handling = False

    def _begun(self, s: Statement, frame: Frame) -> None:
        """Where the statement stands in the original; what waits for this moment happens before it."""
        if frame.routine.module in self.beside:
            return self._execute(s, frame)  # part of the statement that calls it
        if self.identities is None:
            identity, inserted = (frame.routine.module, frame.routine.name, s.index), False
        else:
            identity, inserted = self.identities[s]
        now = (identity, self.counts.get(identity, 0) + 1)
        if not self.inserted and now not in self.begun:
            self.begun.add(now)
            self.here = now
            outside.meanwhile(self)
        self.here = now
        if not inserted:
            self.counts[identity] = now[1]
        if self.inserted or not inserted:
            return self._execute(s, frame)
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
        raise Return(None if value is None else clone(self.evaluate(value, self._type(frame.routine.type))))

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
        self.interrupts[number] = Interrupt(s.parts["trap"], ref.name)

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

    def run(self, entry: str = "") -> list[Event]:
        """Runs the entry procedure, that of the world where none is given, to its end, its stop or STEPS statements; ``stopped`` says why it stopped."""
        routine = self.routines.get(entry or self.world.enters)
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


def load(texts: Iterable[str]) -> list[Module]:
    return [m for text in texts for m in parse(text)]
