"""RAPID values: aggregates, poses, functions and expressions with known operands."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from tests.independent.arm import rotation, transform
from tests.independent.rapid_text import Unreadable

PARTS = {
    "trans": 0, "rot": 1, "robconf": 2, "extax": 3, "x": 0, "y": 1, "z": 2, "q1": 0, "q2": 1, "q3": 2, "q4": 3, "cf1": 0, "cf4": 1,
    "cf6": 2, "cfx": 3, "robhold": 0, "tframe": 1, "tload": 2, "uframe": 3, "oframe": 4, "mass": 0, "cog": 1, "robax": 0, "rax_1": 0,
    "rax_2": 1, "rax_3": 2, "rax_4": 3, "rax_5": 4, "rax_6": 5, "weld_speed": 0, "v_tcp": 0, "v_ori": 1, "pzone_tcp": 1, "pdisp": 0,
    "eoffs": 1, "eax_a": 0, "eax_b": 1, "eax_c": 2, "eax_d": 3, "eax_e": 4, "eax_f": 5,
}  # fmt: skip


class V(list):  # type: ignore[type-arg]
    """A RAPID aggregate: named parts, elementwise sum, vector product."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[PARTS[name]]
        except KeyError:
            raise AttributeError(name) from None

    def __add__(self, other: Any) -> V:
        return V(a + b for a, b in zip(self, other, strict=True))

    def __sub__(self, other: Any) -> V:
        return V(a - b for a, b in zip(self, other, strict=True))

    def __mul__(self, k: Any) -> V:
        if isinstance(k, V):  # of two vectors
            return V(float(c) for c in np.cross(self, k))
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
    "pow": math.pow,
    "distance": math.dist,
    "dotprod": lambda a, b: float(np.dot(a, b)),
    "vectmagn": lambda a: float(np.linalg.norm(a)),
    "atan2": lambda y, x: math.degrees(math.atan2(y, x)),
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


def predefined() -> dict[str, Any]:
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


def evaluate(expression: str, names: dict[str, Any]) -> Any:
    try:
        return eval(to_python(expression), FUNCTIONS, names)
    except Exception as e:
        raise Unreadable(f"{expression.strip()[:80]}: {e}") from e
