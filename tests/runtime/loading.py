"""What a controller checks when it loads the modules of a task: names, scopes, and types of what is handed over.

Written from the RAPID kernel manual (2.17 scopes, 5.1 parameters) on the reader of the worlds; nothing of the package.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from tests.worlds.functions import FUNCTIONS, RESULTS
from tests.worlds.motions import ROLES
from tests.worlds.parser import parse
from tests.worlds.syntax import Arg, Data, Module, Parameter, Routine
from tests.worlds.values import ALIASES, RECORDS, predefined

CONTROLLER = {"calcjointt": "jointtarget", "calcrobt": "robtarget", "robos": "bool", **RESULTS}


class Loaded:
    """The modules of one task.

    Args:
        texts: of its modules. beside: PERS data of other tasks, names with types.
    """

    def __init__(self, texts: Sequence[str]) -> None:
        self.modules: list[Module] = [m for text in texts for m in parse(text)]
        self.records = RECORDS | {name: parts for m in self.modules for name, parts in m.records.items()}
        self.shared: dict[str, Data] = {d.name: d for m in self.modules for d in m.data if d.scope != "local"}
        self.routines = {r.name: r for m in self.modules for r in m.routines if not r.local}
        self.builtin = predefined()

    def faults(self) -> list[str]:
        """What keeps the task from being loaded or linked; empty where nothing does."""
        return [*self._twice(), *self._calls()]

    def _twice(self) -> Iterator[str]:
        seen: set[str] = set()
        for m in self.modules:
            own = [d.name for d in m.data] + [r.name for r in m.routines]
            yield from (f"`{name}` stands twice in `{m.name}`" for name in own if own.count(name) > 1)
            public = [d.name for d in m.data if d.scope != "local"] + [r.name for r in m.routines if not r.local]
            for name in [m.name, *public]:
                if name in seen:
                    yield f"`{name}` is given twice"
                seen.add(name)
                if len(name) > 32:
                    yield f"`{name}` is too long"

    def _calls(self) -> Iterator[str]:
        for m in self.modules:
            for r in m.routines:
                for s in r.flat:
                    for call in _calls_in(tuple(s.parts.values())):
                        yield from self._call(m, r, call, s.line)

    def _call(self, m: Module, r: Routine, call: Any, line: int) -> Iterator[str]:
        _, name, arguments, _ = call
        called = next((q for q in m.routines if q.name == name), None) or self.routines.get(name)
        if called is None:
            if name not in FUNCTIONS and name not in CONTROLLER:
                yield f"line {line}: there is no function `{name}`"
            return
        required = [p for p in called.parameters if not p.optional]
        optional = {p.name: p for p in called.parameters if p.optional}
        for a in arguments:
            if a.kind in ("pos", "named"):
                if not required:
                    yield f"line {line}: too many arguments for `{name}`"
                    return
                yield from self._handed(m, r, required.pop(0), a, line)
            elif a.name not in optional:
                yield f"line {line}: `{name}` has no argument `\\{a.name}`"
            else:
                yield from self._handed(m, r, optional[a.name], a, line)
        if required:
            yield f"line {line}: `{name}` lacks `{required[0].name}`"

    def _handed(self, m: Module, r: Routine, p: Parameter, a: Arg, line: int) -> Iterator[str]:
        if p.mode == "switch":
            if a.kind == "opt" and a.value is not None:
                yield f"line {line}: a switch takes no value"
            return
        type_, storage = self.type_of(m, r, a.value)
        if type_ != p.type:
            yield f"line {line}: `{p.name}` is {p.type}, what is handed over {type_}"
        if p.mode == "pers" and storage != "pers":
            yield f"line {line}: `{p.name}` takes PERS data, not {storage}"
        if p.mode == "inout" and storage not in ("var", "pers"):
            yield f"line {line}: `{p.name}` takes data that can be written, not {storage}"

    def type_of(self, m: Module, r: Routine, e: Any) -> tuple[str, str]:
        """Type and storage (``const``, ``var``, ``pers``, ``value``) of an expression; ``?`` for what is declared nowhere."""
        if e[0] == "ref":
            return self._named(m, r, e)
        if e[0] == "call":
            called = next((q for q in m.routines if q.name == e[1]), None) or self.routines.get(e[1])
            return (called.type or "?") if called else CONTROLLER.get(e[1], "num"), "value"
        if e[0] == "agg":
            return {4: "robtarget", 3: "pos"}.get(len(e[1]), "?"), "value"
        return {"num": "num", "str": "string", "bool": "bool"}.get(e[0], "num"), "value"

    def _named(self, m: Module, r: Routine, e: Any) -> tuple[str, str]:
        _, name, accessors = e
        parameter = next((p for p in r.parameters if p.name == name), None)
        data = next((d for d in r.data if d.name == name), None) or next((d for d in m.data if d.name == name), None)
        data = data or self.shared.get(name)
        if parameter is not None:
            type_, storage = parameter.type, {"in": "var", "inout": "var"}.get(parameter.mode, parameter.mode)
        elif data is not None:
            type_, storage = data.type, data.storage
        elif name in self.builtin:
            type_, storage = self.builtin[name][0], "pers"
        else:
            return "?", "?"
        for kind, what in accessors:
            if kind == "part":
                type_ = dict(self.records.get(type_, [])).get(what, "?")
                type_ = ALIASES.get(type_, type_)
        return type_, storage


def _calls_in(e: Any) -> Iterator[Any]:
    """Function calls in parts of a statement, those inside others too."""
    if isinstance(e, Arg):
        yield from _calls_in(e.value)
    elif isinstance(e, tuple):
        if len(e) == 4 and e[0] == "call":
            yield e
        for part in e:
            yield from _calls_in(part)


def statements_through(texts: Sequence[str], function: str = "ppcorrected") -> dict[str, int]:
    """How many motion statements of each instruction have the function around their targets."""
    found: dict[str, int] = {}
    for m in (m for text in texts for m in parse(text)):
        for s in (s for r in m.routines for s in r.flat if s.kind == "call" and s.parts["name"] in ROLES):
            if any(call[1] == function for call in _calls_in(tuple(s.parts.values()))):
                found[s.parts["name"]] = found.get(s.parts["name"], 0) + 1
    return found
