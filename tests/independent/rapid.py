"""A small RAPID reader by regular expressions, for checking weld modules: statements, values, executed motion.

It reads what the checks need (declarations, aggregates, Offs, RelTool, calls, FOR and IF with known values) and
raises ``Unreadable`` on the rest. Lengths in metres and angles in radians leave it; the text keeps mm and degrees.
"""

from __future__ import annotations

import copy
import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from tests.independent.rapid_text import DECLARATION, MOVES, Statement, Unreadable, comments, statements
from tests.independent.rapid_values import (
    PARTS,
    V,
    evaluate,
    matrix_quaternion,
    pose,
    predefined,
    quaternion_matrix,
    split_arguments,
    unpose,
)

__all__ = [
    "DECLARATION",
    "MOVES",
    "Module",
    "Motion",
    "Runner",
    "Statement",
    "comments",
    "matrix_quaternion",
    "motions",
    "pose",
    "quaternion_matrix",
    "read",
    "split_arguments",
    "statements",
]


@dataclass(frozen=True)
class Motion:
    """One executed motion statement, in base coordinates [m].

    Args:
        name: instruction as written; kind: J, L, C or A; statement: its index in the file; line of it.
        goal, via: (4, 4) T_base_tcp, of a stationary tool T_flange_tcp; q: (6,) [rad] for MoveAbsJ; conf of the goal.
        tool: (4, 4) T_flange_tcp, of a stationary tool T_base_tcp.
        mass [kg] and center (3,) [m] in tool0 of tool (or of the gripper that holds the work) plus grip load.
        zone: corner radius [m], 0 at stop points; fine; weld: the arc burns on the way to this goal.
        positional, optional: argument texts.
        axes: (6,) external axes of the target as it states them; unit: that moves the work object, empty for none. The
            work then stands in the frame of the unit, not in the base.
    """

    name: str
    kind: str
    statement: int
    line: int
    goal: np.ndarray
    via: np.ndarray | None
    q: np.ndarray | None
    conf: tuple[int, ...]
    tool: np.ndarray
    mass: float
    center: np.ndarray
    zone: float
    fine: bool
    weld: bool
    positional: tuple[str, ...]
    optional: dict[str, str] = field(default_factory=dict)
    stationary: bool = False
    axes: np.ndarray = field(default_factory=lambda: np.full(6, 9e9))
    unit: str = ""


@dataclass
class Module:
    """Read text: statements in file order, data by lower-case name, routines as statement ranges, parameters of functions."""

    text: str
    statements: list[Statement]
    data: dict[str, Any]
    kinds: dict[str, str]
    routines: dict[str, tuple[int, int]]
    functions: dict[str, list[str]] = field(default_factory=dict)


def read(text: str) -> Module:
    items = statements(text)
    module = Module(text, items, {}, {}, {})
    inside: str | None = None
    start = 0
    pending: list[tuple[str, str]] = []
    for i, s in enumerate(items):
        if s.block:
            m = re.match(r"(?:LOCAL\s+)?(?:PROC|TRAP|FUNC\s+\w+)\s+(\w+)", s.code, re.I)
            if m:
                inside, start = m[1].lower(), i + 1
                if re.match(r"(?:LOCAL\s+)?FUNC\b", s.code, re.I):
                    module.functions[inside] = [p.lower() for p in _FORMAL.findall(s.code[s.code.find("(") :])]
            elif inside and re.match(r"END(PROC|TRAP|FUNC)", s.code, re.I):
                module.routines[inside] = (start, i)
                inside = None
            continue
        m = DECLARATION.match(s.code)
        if m and inside is None:
            module.kinds[m[2].lower()] = m[1].lower()
            if m[4]:
                pending.append((m[2].lower(), m[4]))
    names = predefined()
    while pending:
        left = []
        for name, expression in pending:
            try:
                names[name] = evaluate(expression, names)
            except Unreadable:
                left.append((name, expression))
        if len(left) == len(pending):
            break
        pending = left
    module.data = names
    return module


_FORMAL = re.compile(r"(\w+)\s*(?:\{[^}]*\})?\s*(?=[,)|\\])")


class _Return(Exception):
    """Leaves a routine, with the value of a function."""

    def __init__(self, value: Any = None) -> None:
        super().__init__()
        self.value = value


class Runner:
    """Executes routines far enough to list the motion in order."""

    def __init__(self, module: Module, limit: int = 400_000) -> None:
        self.module, self.limit = module, limit
        self.motions: list[Motion] = []
        self.skipped: list[tuple[int, str]] = []
        self._displace(np.eye(4))
        self.grip: Any = None
        self.burning = False
        for name in module.functions:
            module.data[name] = partial(self._function, name)

    def run(self, routine: str | None = None) -> list[Motion]:
        routines = self.module.routines
        names = self.module.data
        if routine:
            self._routine(routine.lower(), {})
        elif "main" in routines:
            self._routine("main", {})
        else:
            called = {w.lower() for s in self.module.statements if not s.block for w in re.findall(r"^\w+", s.code)}
            for name in routines:
                if name not in called:
                    self._routine(name, {})
        del names
        return self.motions

    def _displace(self, displacement: np.ndarray) -> None:
        self.displacement = displacement
        self.module.data["c_progdisp"] = V([unpose(displacement), V([0.0] * 6)])

    def _routine(self, name: str, arguments: dict[str, Any]) -> None:
        start, end = self.module.routines[name]
        local = dict(arguments)
        try:
            self._run(start, end, local)
        except _Return:
            return

    def _function(self, name: str, *given: Any) -> Any:
        """What a function of the program returns; its variables are its own."""
        start, end = self.module.routines[name]
        local = dict(zip(self.module.functions[name], copy.deepcopy(given), strict=True))
        try:
            self._run(start, end, local)
        except _Return as found:
            return found.value
        raise Unreadable(f"`{name}` returns nothing")

    def _scope(self, local: dict[str, Any]) -> dict[str, Any]:
        return {**self.module.data, **local} if local else self.module.data

    def _matching(self, i: int, end: int, opening: str) -> Iterator[int]:
        """Indices of ELSEIF/ELSE and the END of the block opened at i."""
        depth = 0
        for k in range(i + 1, end):
            code = self.module.statements[k].code.upper()
            if not self.module.statements[k].block:
                continue
            if re.match(rf"{opening}\b", code):
                depth += 1
            elif code.startswith(f"END{opening}"):
                if depth == 0:
                    yield k
                    return
                depth -= 1
            elif depth == 0 and re.match(r"ELSEIF\b|ELSE\b", code):
                yield k

    def _run(self, i: int, end: int, local: dict[str, Any]) -> None:
        items = self.module.statements
        while i < end:
            s = items[i]
            upper = s.code.upper()
            if s.block and re.match(r"FOR\b", upper):
                stop = list(self._matching(i, end, "FOR"))[-1]
                m = re.match(r"FOR\s+(\w+)\s+FROM\s+(.*?)\s+TO\s+(.*?)(?:\s+STEP\s+(.*?))?\s+DO$", s.code, re.I | re.S)
                assert m
                scope = self._scope(local)
                a, b = evaluate(m[2], scope), evaluate(m[3], scope)
                step = evaluate(m[4], scope) if m[4] else (1 if b >= a else -1)
                counter, k = m[1].lower(), a
                while (k <= b) if step > 0 else (k >= b):
                    local[counter] = int(k)
                    self._run(i + 1, stop, local)
                    k += step
                local.pop(counter, None)
                i = stop + 1
            elif s.block and re.match(r"IF\b", upper):
                marks = [i, *self._matching(i, end, "IF")]
                for a, b in itertools.pairwise(marks):
                    m = re.match(r"(?:ELSE)?IF\b(.*)THEN$", items[a].code, re.I | re.S)
                    if m is None or evaluate(m[1], self._scope(local)):
                        self._run(a + 1, b, local)
                        break
                i = marks[-1] + 1
            elif s.block and re.match(r"(ERROR|UNDO|BACKWARD)\b", upper):
                return
            elif s.block and re.match(r"(WHILE|TEST)\b", upper):
                word = "WHILE" if upper.startswith("WHILE") else "TEST"
                self.skipped.append((s.line, s.code))
                i = list(self._matching(i, end, word))[-1] + 1
            else:
                if not s.block:
                    self._statement(i, s, local)
                i += 1
            if len(self.motions) > self.limit:
                raise Unreadable("too many motions")

    def _statement(self, i: int, s: Statement, local: dict[str, Any]) -> None:
        code = s.code.rstrip(";").strip()
        m = DECLARATION.match(s.code)
        if m:
            local[m[2].lower()] = evaluate(m[4], self._scope(local)) if m[4] else None
            return
        if re.match(r"RETURN\b", code, re.I):
            raise _Return(evaluate(code[6:], self._scope(local)) if code[6:].strip() else None)
        move = MOVES.match(code)
        if move:
            try:
                self.motions.append(self._motion(i, s, move[1], code[move.end() :], self._scope(local)))
            except (Unreadable, KeyError, IndexError, TypeError) as e:
                self.skipped.append((s.line, f"{code[:60]}: {e}"))
            return
        word = re.match(r"(\w+)\s*(.*)$", code, re.S)
        if not word:
            return
        name, rest = word[1].lower(), word[2]
        if name == "pdispset":
            self._displace(pose(evaluate(rest, self._scope(local))))
        elif name == "pdispoff":
            self._displace(np.eye(4))
        elif name == "gripload":
            self.grip = evaluate(rest, self._scope(local))
        elif name in self.module.routines and not rest.startswith(":="):
            header = self.module.statements[self.module.routines[name][0] - 1].code
            formal = _FORMAL.findall(header[header.find("(") :]) if "(" in header else []
            given, _ = split_arguments(rest) if rest else ([], {})
            scope = self._scope(local)
            self._routine(name, {f.lower(): evaluate(g, scope) for f, g in zip(formal, given, strict=False)})
        elif rest.startswith(":="):
            try:
                value = evaluate(rest[2:], self._scope(local))
            except Unreadable:
                return
            (local if name in local else self.module.data)[name] = value
        elif part := re.match(r"((?:\.\w+)+)\s*:=", rest):
            scope = self._scope(local)
            whole = item = copy.deepcopy(scope[name])
            *path, last = part[1].lower().lstrip(".").split(".")
            for step in path:
                item = getattr(item, step)
            item[PARTS[last]] = evaluate(rest[part.end() :], scope)
            (local if name in local else self.module.data)[name] = whole

    def _motion(self, i: int, s: Statement, name: str, rest: str, scope: dict[str, Any]) -> Motion:
        positional, optional = split_arguments(rest)
        lower = name.lower()
        arc = lower.startswith("arc")
        kind = (
            "A" if lower == "moveabsj" else "J" if lower == "movej" else "C" if re.match(r"movec|arcc", lower) else "L"
        )
        shift = 1 if kind == "C" else 0
        zone_at = shift + (4 if arc else 2)
        tool = evaluate(positional[zone_at + 1], scope)
        zone = evaluate(positional[zone_at], scope)
        wobj = evaluate(optional["wobj"], scope) if "wobj" in optional else scope["wobj0"]
        tframe = pose(tool[1])
        mass, center = float(tool[2][0]), np.asarray(tool[2][1], float) / 1000
        unit = "" if wobj[1] else str(wobj[2])
        carried = pose(wobj[4]) if unit else pose(wobj[3]) @ pose(wobj[4])
        if bool(tool[0]) == bool(wobj[0]):
            raise Unreadable("tool and work object are both held, or neither is")
        if self.grip is not None and self.grip[0] > 0:
            extra = ((tframe if tool[0] else carried) @ np.array([*(np.asarray(self.grip[1], float) / 1000), 1.0]))[:3]
            total = mass + self.grip[0]
            center, mass = (mass * center + self.grip[0] * extra) / total, total
        weld = arc and not lower.endswith("start")
        via, q, conf = None, None, (0, 0, 0, 0)
        if kind == "A":
            q = np.radians(np.asarray(evaluate(positional[0], scope)[0], float))
            goal = np.eye(4)
        else:
            frame = carried @ self.displacement
            target = evaluate(positional[shift], scope)
            goal = frame @ pose(target)
            conf = tuple(int(c) for c in target[2])
            if kind == "C":
                via = frame @ pose(evaluate(positional[0], scope))
        return Motion(
            name, kind, i, s.line, goal, via, q, conf, tframe, mass, center, 0.0 if zone[0] else float(zone[1]) / 1000, bool(zone[0]),
            weld, tuple(positional), optional, not tool[0], np.asarray(evaluate(positional[shift], scope)[1 if kind == "A" else 3], float), unit,
        )  # fmt: skip


def motions(text: str, routine: str | None = None) -> tuple[Module, list[Motion], list[tuple[int, str]]]:
    """Executed motion of a module's text, and what could not be read (line, why)."""
    module = read(text)
    runner = Runner(module)
    found = runner.run(routine)
    return module, found, runner.skipped
