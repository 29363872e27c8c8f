"""A small RAPID reader by regular expressions, for checking weld modules: statements, values, executed motion.

It reads what the checks need (declarations, aggregates, Offs, RelTool, calls, FOR and IF with known values) and
raises ``Unreadable`` on the rest. Lengths in metres and angles in radians leave it; the text keeps mm and degrees.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.independent.arm import rotation, transform

MOVES = re.compile(r"(Move(?:Abs)?J|MoveL|MoveC|Arc[LC]\d?(?:Start|End)?)(?![A-Za-z0-9_])", re.I)
STORAGE = r"(?:(?:LOCAL|TASK)\s+)?(?:CONST|PERS|VAR)"
DECLARATION = re.compile(rf"{STORAGE}\s+(\w+)\s+(\w+)\s*(\{{[^}}]*\}})?\s*(?::=(.*))?;$", re.I | re.S)
BLOCK = re.compile(
    r"""MODULE\s+\w+(\s*\([^)]*\))?|ENDMODULE|(LOCAL\s+)?(PROC|TRAP)\s+\w+\s*(\([^)]*\))?|(LOCAL\s+)?FUNC\s+\w+\s+\w+\s*\([^)]*\)
    |END(?:PROC|TRAP|FUNC|FOR|IF|WHILE|TEST|RECORD)\b\s*;?|(?:LOCAL\s+)?RECORD\s+\w+
    |FOR\b.*?\bDO\b|WHILE\b.*?\bDO\b|IF\b[^;]*?\bTHEN\b|ELSEIF\b[^;]*?\bTHEN\b|ELSE\b|TEST\b[^\n]*|CASE\b[^:]*:|DEFAULT\s*:
    |(?:ERROR|UNDO|BACKWARD)\b(?!\s*[;:(,])|%%%.*?%%%|\w+\s*:(?!=)""",
    re.I | re.S | re.X,
)


class Unreadable(Exception):
    pass


@dataclass(frozen=True)
class Statement:
    """One statement or block word: source span, code without comments, line number (from 1)."""

    start: int
    end: int
    code: str
    line: int
    block: bool


def mask_comments(text: str) -> str:
    """The text with comments blanked, same length."""
    pattern = re.compile(r'"(?:[^"\r\n]|"")*"|![^\r\n]*')
    return pattern.sub(lambda m: " " * len(m[0]) if m[0][0] == "!" else m[0], text)


def comments(text: str) -> list[tuple[int, str]]:
    pattern = re.compile(r'"(?:[^"\r\n]|"")*"|![^\r\n]*')
    return [(m.start(), m[0]) for m in pattern.finditer(text) if m[0][0] == "!"]


_BITS = re.compile(r'"(?:[^"\r\n]|"")*"|[\[\](){};]')


def statements(text: str) -> list[Statement]:
    code = mask_comments(text)
    newlines = [m.start() for m in re.finditer("\n", text)]
    out: list[Statement] = []
    i, line = 0, 0
    while True:
        blank = re.compile(r"\s*").match(code, i)
        assert blank is not None
        i = blank.end()
        if i >= len(code):
            return out
        while line < len(newlines) and newlines[line] < i:
            line += 1
        m = BLOCK.match(code, i)
        if m and m.end() > i:
            out.append(Statement(i, m.end(), code[i : m.end()].strip(), line + 1, True))
            i = m.end()
            continue
        depth, end = 0, len(code)
        for bit in _BITS.finditer(code, i):
            c = bit[0]
            depth += (c in "[({") - (c in "])}")
            if c == ";" and depth <= 0:
                end = bit.end()
                break
        out.append(Statement(i, end, code[i:end].strip(), line + 1, False))
        i = end


_PARTS = {
    "trans": 0, "rot": 1, "robconf": 2, "extax": 3, "x": 0, "y": 1, "z": 2, "q1": 0, "q2": 1, "q3": 2, "q4": 3, "cf1": 0, "cf4": 1,
    "cf6": 2, "cfx": 3, "robhold": 0, "tframe": 1, "tload": 2, "uframe": 3, "oframe": 4, "mass": 0, "cog": 1, "robax": 0, "rax_1": 0,
    "rax_2": 1, "rax_3": 2, "rax_4": 3, "rax_5": 4, "rax_6": 5, "weld_speed": 0, "v_tcp": 0, "v_ori": 1, "pzone_tcp": 1,
}  # fmt: skip


class V(list):  # type: ignore[type-arg]
    """A RAPID aggregate: named parts, elementwise sum."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[_PARTS[name]]
        except KeyError:
            raise AttributeError(name) from None

    def __add__(self, other: Any) -> V:
        return V(a + b for a, b in zip(self, other, strict=True))

    def __sub__(self, other: Any) -> V:
        return V(a - b for a, b in zip(self, other, strict=True))

    def __mul__(self, k: Any) -> V:
        return V(a * k for a in self)

    __rmul__ = __mul__


def quaternion_matrix(q: Any) -> np.ndarray:
    w, x, y, z = np.asarray(q, float) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def matrix_quaternion(r: np.ndarray) -> np.ndarray:
    """(w, x, y, z) with w >= 0, from the largest diagonal combination."""
    k = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [0, r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [0, 0, r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [0, 0, 0, r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    k = k + np.triu(k, 1).T
    q = np.linalg.eigh(k)[1][:, -1]
    return q if q[0] >= 0 else -q


def pose(p: Any) -> np.ndarray:
    """(4, 4) [m] from a RAPID pose [pos, orient] in mm."""
    return transform(quaternion_matrix(p[1]), np.asarray(p[0], float) / 1000)


def unpose(t: np.ndarray) -> V:
    return V([V(float(v) for v in t[:3, 3] * 1000), V(float(v) for v in matrix_quaternion(t[:3, :3]))])


def _offs(p: V, x: float, y: float, z: float) -> V:
    return V([V([p[0][0] + x, p[0][1] + y, p[0][2] + z]), *p[1:]])


def _reltool(p: V, x: float, y: float, z: float, rx: float = 0.0, ry: float = 0.0, rz: float = 0.0) -> V:
    r = np.eye(3)
    for axis, angle in zip(np.eye(3), (rx, ry, rz), strict=True):
        r = r @ rotation(axis, np.array(math.radians(angle)))
    t = unpose(pose(p) @ transform(r, np.array([x, y, z]) / 1000))
    return V([t[0], t[1], *p[2:]])


def _orientzyx(z: float, y: float, x: float) -> V:
    r = np.eye(3)
    for axis, angle in (((0, 0, 1.0), z), ((0, 1.0, 0), y), ((1.0, 0, 0), x)):
        r = r @ rotation(np.array(axis), np.array(math.radians(angle)))
    return V(float(v) for v in matrix_quaternion(r))


FUNCTIONS: dict[str, Any] = {
    "offs": _offs,
    "reltool": _reltool,
    "orientzyx": _orientzyx,
    "posemult": lambda a, b: unpose(pose(a) @ pose(b)),
    "poseinv": lambda a: unpose(np.linalg.inv(pose(a))),
    "posevect": lambda a, p: V(float(v) for v in (pose(a) @ np.array([*(np.array(p) / 1000), 1.0]))[:3] * 1000),
    "sqrt": math.sqrt,
    "abs": abs,
    "sin": lambda d: math.sin(math.radians(d)),
    "cos": lambda d: math.cos(math.radians(d)),
    "V": V,
    "__builtins__": {},
}
NO_TURN = [1.0, 0, 0, 0]
_ZONES = {
    0: 0.3,
    1: 1,
    5: 5,
    10: 10,
    15: 15,
    20: 20,
    30: 30,
    40: 40,
    50: 50,
    60: 60,
    80: 80,
    100: 100,
    150: 150,
    200: 200,
}


def _predefined() -> dict[str, Any]:
    speeds = (5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800)
    names: dict[str, Any] = {f"v{v}": V([v, 500, 5000, 1000]) for v in (*speeds, *range(1000, 8000, 500))}
    names |= {f"z{z}": V([False, r, r * 1.5, r * 1.5, r * 0.15, r * 1.5, r * 0.15]) for z, r in _ZONES.items()}
    names["fine"] = V([True, 0, 0, 0, 0, 0, 0])
    names["vmax"] = V([7000, 500, 5000, 1000])
    zero = V([V([0, 0, 0]), V(NO_TURN)])
    names["load0"] = V([0.001, V([0, 0, 0.001]), V(NO_TURN), 0, 0, 0])
    names["tool0"] = V([True, zero, names["load0"]])
    names["wobj0"] = V([False, True, "", zero, zero])
    names |= {"true": True, "false": False, "pi": math.pi}
    return names


_WORD = re.compile(
    r'"(?:[^"\r\n]|"")*"|\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?|[a-z_]\w*|:=|<>|<=|>=|.', re.I | re.S
)


def to_python(expression: str) -> str:
    """RAPID expression as a Python one: aggregates V([..]), arrays from 1, names in lower case."""
    out: list[str] = []
    stack: list[str] = []
    for m in _WORD.finditer(expression):
        w = m[0]
        if w == "[":
            stack.append("[")
            out.append("V([")
        elif w == "]":
            stack.pop()
            out.append("])")
        elif w == "{":
            stack.append("{")
            out.append("[-1+(")
        elif w == "}":
            stack.pop()
            out.append(")]")
        elif w in "()":
            stack.append("(") if w == "(" else stack.pop()
            out.append(w)
        elif w == "," and stack and stack[-1] == "{":
            out.append(")][-1+(")
        elif w == "\\":
            out.append(",")
        elif w == ":=":
            out.append("=")
        elif w in ("<>", "="):
            out.append("!=" if w == "<>" else "==")
        elif w.upper() in ("AND", "OR", "NOT"):
            out.append(f" {w.lower()} ")
        elif w.upper() in ("DIV", "MOD"):
            out.append(" // " if w.upper() == "DIV" else " % ")
        elif w[0] == '"':
            out.append(repr(w[1:-1]))
        else:
            out.append(
                w.lower()
                if w[0].isalpha() or w[0] == "_" or w[0].isdigit() or w[0] == "."
                else (w if w.strip() else " ")
            )
    # A comma before an optional argument is allowed in the wild.
    return re.sub(r",\s*,", ",", "".join(out)).strip()


def split_arguments(code: str) -> tuple[list[str], dict[str, str]]:
    """Positional argument texts, and optional ones by lower-case name."""
    depth, pieces, mark = 0, [], 0
    marks: list[str] = [","]
    for bit in re.finditer(r'"(?:[^"\r\n]|"")*"|[\[\](){},\\]', code):
        c = bit[0]
        depth += (c in "[({") - (c in "])}")
        if depth == 0 and c in ",\\":
            pieces.append(code[mark : bit.start()].strip())
            marks.append(c)
            mark = bit.end()
    pieces.append(code[mark:].strip())
    positional, optional = [], {}
    for kind, piece in zip(marks, pieces, strict=True):
        if kind == "\\":
            name, _, value = piece.partition(":=")
            optional[name.strip().lower()] = value.strip()
        elif piece:
            positional.append(piece)
    return positional, optional


@dataclass(frozen=True)
class Motion:
    """One executed motion statement, in base coordinates [m].

    Args:
        name: instruction as written; kind: J, L, C or A; statement: its index in the file; line of it.
        goal, via: (4, 4) T_base_tcp; q: (6,) [rad] for MoveAbsJ; conf of the goal.
        tool: (4, 4) T_flange_tcp; mass [kg] and center (3,) [m] in tool0 of tool plus grip load.
        zone: corner radius [m], 0 at stop points; fine; weld: the arc burns on the way to this goal.
        positional, optional: argument texts.
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


@dataclass
class Module:
    """Read text: statements in file order, data by lower-case name, routines as statement ranges."""

    text: str
    statements: list[Statement]
    data: dict[str, Any]
    kinds: dict[str, str]
    routines: dict[str, tuple[int, int]]


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
            elif inside and re.match(r"END(PROC|TRAP|FUNC)", s.code, re.I):
                module.routines[inside] = (start, i)
                inside = None
            continue
        m = DECLARATION.match(s.code)
        if m and inside is None:
            module.kinds[m[2].lower()] = m[1].lower()
            if m[4]:
                pending.append((m[2].lower(), m[4]))
    names = _predefined()
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


def evaluate(expression: str, names: dict[str, Any]) -> Any:
    try:
        return eval(to_python(expression), FUNCTIONS, names)
    except Exception as e:
        raise Unreadable(f"{expression.strip()[:80]}: {e}") from e


class _Return(Exception):
    pass


class Runner:
    """Executes routines far enough to list the motion in order."""

    def __init__(self, module: Module, limit: int = 400_000) -> None:
        self.module, self.limit = module, limit
        self.motions: list[Motion] = []
        self.skipped: list[tuple[int, str]] = []
        self.displacement = np.eye(4)
        self.grip: Any = None
        self.burning = False

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

    def _routine(self, name: str, arguments: dict[str, Any]) -> None:
        start, end = self.module.routines[name]
        local = dict(arguments)
        try:
            self._run(start, end, local)
        except _Return:
            return

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
                k = a
                while (k <= b) if step > 0 else (k >= b):
                    self._run(i + 1, stop, local := {**local, m[1].lower(): int(k)})
                    k += step
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
            if m[4]:
                local[m[2].lower()] = evaluate(m[4], self._scope(local))
            return
        if re.match(r"RETURN\b", code, re.I):
            raise _Return
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
            self.displacement = pose(evaluate(rest, self._scope(local)))
        elif name == "pdispoff":
            self.displacement = np.eye(4)
        elif name == "gripload":
            self.grip = evaluate(rest, self._scope(local))
        elif name in self.module.routines and not rest.startswith(":="):
            header = self.module.statements[self.module.routines[name][0] - 1].code
            formal = (
                re.findall(r"(\w+)\s*(?:\{[^}]*\})?\s*(?=[,)|\\])", header[header.find("(") :]) if "(" in header else []
            )
            given, _ = split_arguments(rest) if rest else ([], {})
            scope = self._scope(local)
            self._routine(name, {f.lower(): evaluate(g, scope) for f, g in zip(formal, given, strict=False)})
        elif rest.startswith(":="):
            try:
                value = evaluate(rest[2:], self._scope(local))
            except Unreadable:
                return
            (local if name in local else self.module.data)[name] = value

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
        if self.grip is not None and self.grip[0] > 0:
            extra = (tframe @ np.array([*(np.asarray(self.grip[1], float) / 1000), 1.0]))[:3]
            total = mass + self.grip[0]
            center, mass = (mass * center + self.grip[0] * extra) / total, total
        weld = arc and not lower.endswith("start")
        via, q, conf = None, None, (0, 0, 0, 0)
        if kind == "A":
            q = np.radians(np.asarray(evaluate(positional[0], scope)[0], float))
            goal = np.eye(4)
        else:
            frame = pose(wobj[3]) @ pose(wobj[4]) @ self.displacement
            target = evaluate(positional[shift], scope)
            goal = frame @ pose(target)
            conf = tuple(int(c) for c in target[2])
            if kind == "C":
                via = frame @ pose(evaluate(positional[0], scope))
        return Motion(
            name, kind, i, s.line, goal, via, q, conf, tframe, mass, center, 0.0 if zone[0] else float(zone[1]) / 1000, bool(zone[0]),
            weld, tuple(positional), optional,
        )  # fmt: skip


def motions(text: str, routine: str | None = None) -> tuple[Module, list[Motion], list[tuple[int, str]]]:
    """Executed motion of a module's text, and what could not be read (line, why)."""
    module = read(text)
    runner = Runner(module)
    found = runner.run(routine)
    return module, found, runner.skipped
