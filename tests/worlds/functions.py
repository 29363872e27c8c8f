"""RAPID's own functions and operators (Functions and data types; RL: abb-rws-vscode's extract of 3HAC050917-001)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.worlds import outside
from tests.worlds.state import target_of_joints, with_offsets
from tests.worlds.syntax import Arg
from tests.worlds.values import Dnum, Fault, clone, euler, matrix_pose, orient_zyx, pose_matrix, single, singles

if TYPE_CHECKING:
    from tests.worlds.interpreter import Interpreter

RESULTS = {"crobt": "robtarget", "offs": "robtarget", "reltool": "robtarget", "posemult": "pose", "poseinv": "pose", "defframe": "pose", "defdframe": "pose", "cpos": "pos", "posevect": "pos", "ctool": "tooldata", "cwobj": "wobjdata"}  # fmt: skip


def operate(op: str, a: Any, b: Any, error: Callable[[float], Exception]) -> Any:
    """The value of ``a op b``: each result in the precision of the operands (K3: num single; RL: dnum double)."""
    if op in ("=", "<>"):
        same = bool(a == b)
        return same if op == "=" else not same
    if op in ("<", "<=", ">", ">="):
        return {"<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b}[op]
    if isinstance(a, str) or isinstance(b, str):
        if op != "+" or not (isinstance(a, str) and isinstance(b, str)):
            raise Fault(f"`{op}` of a string")
        return a + b
    if isinstance(a, list) and isinstance(b, list):
        if op == "*" and len(a) == 4:  # orient * orient: both turns, the right one in the frame of the left
            t = pose_matrix([[0, 0, 0], a]) @ pose_matrix([[0, 0, 0], b])
            return matrix_pose(t)[1]
        if op == "*":  # pos * pos: the vector product
            return singles(np.cross(a, b))
        return [operate(op, x, y, error) for x, y in zip(a, b, strict=True)]
    if isinstance(a, list):
        return [operate(op, x, b, error) for x in a]
    if isinstance(b, list):
        return [operate(op, a, x, error) for x in b]
    return _number(op, a, b, error)


def _number(op: str, a: float, b: float, error: Callable[[float], Exception]) -> float:
    made = Dnum if isinstance(a, Dnum) or isinstance(b, Dnum) else single
    if op in ("/", "div", "mod") and b == 0:
        raise error(1003.0)  # ERR_DIVZERO
    if op == "div":
        return made(math.trunc(a / b))
    if op == "mod":
        return made(math.fmod(a, b))
    return made({"+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b, "/": lambda: a / b}[op]())


def values(task: Interpreter, arguments: tuple[Arg, ...], *types: str) -> tuple[list[Any], dict[str, Any]]:
    """Positional values, and optional ones by name (True for a switch)."""
    given = [a.value for a in arguments if a.kind in ("pos", "named")]
    wanted = [*types, *["num"] * (len(given) - len(types))]
    out = [task.evaluate(v, t) for v, t in zip(given, wanted, strict=False) if v is not None]
    options = {a.name: True if a.value is None else task.evaluate(a.value, "num") for a in arguments if a.kind == "opt"}
    for a in arguments:
        if a.kind == "cond" and a.value and a.value[1] not in task.frames[-1].absent:
            options[a.name] = task.evaluate(a.value)
    return out, options


def _offs(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (p, *d), _ = values(task, arguments, "robtarget")
    return [[single(a + b) for a, b in zip(p[0], d, strict=True)], *clone(p[1:])]


def _reltool(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (p, *d), o = values(task, arguments, "robtarget")
    step = np.eye(4)
    step[:3, :3], step[:3, 3] = euler(o.get("rx", 0.0), o.get("ry", 0.0), o.get("rz", 0.0)), d
    moved = pose_matrix(p) @ step
    rot = matrix_pose(moved)[1] if {"rx", "ry", "rz"} & set(o) else list(p[1])
    return [singles(moved[:3, 3]), rot, *clone(p[2:])]


def _pose_mult(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (a, b), _ = values(task, arguments, "pose", "pose")
    return matrix_pose(pose_matrix(a) @ pose_matrix(b))


def _pose_inv(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (a,), _ = values(task, arguments, "pose")
    return matrix_pose(np.linalg.inv(pose_matrix(a)))


def _pose_vect(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (a, p), _ = values(task, arguments, "pose", "pos")
    return singles((pose_matrix(a) @ np.array([*p, 1.0]))[:3])


def _def_frame(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    """DefFrame NewP1, NewP2, NewP3 [\\Origin]: x through the first two, the third on the side of +y."""
    points, o = values(task, arguments, "robtarget", "robtarget", "robtarget")
    return matrix_pose(_frame(points, o.get("origin", 1.0)))


def _def_dframe(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    """DefDFrame OldP1, OldP2, OldP3, NewP1, NewP2, NewP3: the displacement that carries the old points to the new ones."""
    points, o = values(task, arguments, *["robtarget"] * 6)
    if o:
        raise Fault("DefDFrame with \\Origin")
    return matrix_pose(_frame(points[3:], 1.0) @ np.linalg.inv(_frame(points[:3], 1.0)))


def _frame(points: list[Any], origin: float) -> Any:
    p, q, r = (np.array(v[0]) for v in points)
    x = (q - p) / np.linalg.norm(q - p)
    z = np.cross(x, r - p)
    z /= np.linalg.norm(z)
    t = np.eye(4)
    t[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    t[:3, 3] = {1.0: p, 2.0: q, 3.0: p + x * float((r - p) @ x)}[origin]
    return t


def _orobt(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    """ORobT p [\\InPDisp] | [\\InEOffs]: p without program displacement and offset of external axes."""
    (p,), o = values(task, arguments, "robtarget")
    place = p[:2] if "inpdisp" in o else matrix_pose(task.motion.displacement(task) @ pose_matrix(p))
    axes = p[3] if "ineoffs" in o else with_offsets(task, p[3])
    return [*clone(place), list(p[2]), list(axes)]


def _crobt(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    o = {
        a.name: task.evaluate(a.value)
        for a in arguments
        if a.kind == "opt" and a.value is not None and a.name != "taskref"
    }
    return task.motion.target(task, o.get("tool"), o.get("wobj"))


def _calc_robt(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    given = [a.value for a in arguments if a.kind == "pos" and a.value]
    joints, tool = task.evaluate(given[0], "jointtarget"), task.evaluate(given[1], "tooldata")
    wobj = next((task.evaluate(a.value) for a in arguments if a.name == "wobj" and a.value), None)
    return target_of_joints(task, joints, tool, wobj)


def _present(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    assert arguments[0].value is not None
    return arguments[0].value[1] not in task.frames[-1].absent


def _dim(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (array, n), _ = values(task, arguments, "", "num")
    for _ in range(int(n) - 1):
        array = array[0]
    return float(len(array))


def _rounded(trunc: bool) -> Any:
    def f(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
        (x,), o = values(task, arguments)
        k = 10.0 ** o.get("dec", 0.0)
        whole = math.trunc(x * k) if trunc else math.floor(abs(x) * k + 0.5) * (1 if x >= 0 else -1)
        return Dnum(whole / k) if isinstance(x, Dnum) else single(whole / k)

    return f


def _single(f: Callable[..., float]) -> Any:
    def g(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
        given, _ = values(task, arguments)
        try:
            return single(f(*given))
        except (ValueError, ZeroDivisionError):
            raise Fault("a function outside its domain") from None

    return g


def text_of(value: Any) -> str:
    """ValToStr: numbers with at most six significant digits of a single, records in brackets."""
    if isinstance(value, list):
        return "[" + ",".join(text_of(v) if not isinstance(v, str) else f'"{v}"' for v in value) + "]"
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    return value if isinstance(value, str) else f"{value:.6g}".replace("e+", "E+").replace("e-", "E-")


def _num_to_str(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (x, digits), _ = values(task, arguments)
    return f"{x:.{int(digits)}f}"


def _str_to_val(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    """StrToVal Str Val: FALSE where the text is no value of that type."""
    assert arguments[0].value is not None and arguments[1].value is not None
    text, ref = str(task.evaluate(arguments[0].value, "string")), task.ref(arguments[1].value)
    found = re.fullmatch(r"\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*", text)
    if ref.type in ("num", "dnum"):
        if found is None:
            return False
        ref.set(float(found[1]), task.records)
        return True
    if ref.type == "bool":
        ref.set(text.strip().upper() == "TRUE", task.records)
        return text.strip().upper() in ("TRUE", "FALSE")
    if not re.fullmatch(r"[\[\]\d.,\s+\-eE]+", text) or not text.strip().startswith("["):
        return False
    flat = [float(v) for v in re.findall(r"[+-]?[\d.]+(?:[eE][+-]?\d+)?", text)]

    def fill(type_: str) -> Any:
        parts = task.records.get(type_)
        return [fill(t) for _, t in parts] if parts else flat.pop(0)

    ref.set(fill(ref.type), task.records)
    return True


def _str_part(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (s, at, n), _ = values(task, arguments, "string")
    if not 1 <= at <= len(s) + 1 or at + n - 1 > len(s):
        raise Fault("StrPart outside the string")
    return s[int(at) - 1 : int(at + n) - 1]


def _str_match(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    """StrMatch Str ChPos Pattern: where the pattern begins, else one more than the length."""
    (s, at, pattern), _ = values(task, arguments, "string", "num", "string")
    found = s.find(pattern, int(at) - 1)
    return float(len(s) + 1 if found < 0 else found + 1)


def _str_find(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    """StrFind Str ChPos Set [\\NotInSet]: where a character of the set (not of it) is."""
    (s, at, chars), o = values(task, arguments, "string", "num", "string")
    for i in range(int(at) - 1, len(s)):
        if (s[i] in chars) != ("notinset" in o):
            return float(i + 1)
    return float(len(s) + 1)


def _string(f: Callable[[str], Any]) -> Any:
    return lambda task, arguments: f(str(values(task, arguments, "string")[0][0]))


def _signal_value(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    assert arguments[0].value is not None
    return outside.signal(task, arguments[0].value[1])


def _test_di(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    return _signal_value(task, arguments) == 1.0


def _answer(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    return outside.answer(task, "answer")


def _euler_zyx(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    """EulerZYX [\\X] | [\\Y] | [\\Z] Rotation."""
    r = pose_matrix([[0, 0, 0], values(task, arguments, "orient")[0][0]])
    names = {a.name for a in arguments}
    if "z" in names:
        return single(math.degrees(math.atan2(r[1, 0], r[0, 0])))
    if "y" in names:
        return single(math.degrees(math.asin(max(-1.0, min(1.0, -r[2, 0])))))
    return single(math.degrees(math.atan2(r[2, 1], r[2, 2])))


def _norient(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (q,), _ = values(task, arguments, "orient")
    return singles(np.array(q) / np.linalg.norm(q))


def _distance(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (a, b), _ = values(task, arguments, "pos", "pos")
    return single(math.dist(a, b))


def _dot(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (a, b), _ = values(task, arguments, "pos", "pos")
    return single(float(np.dot(a, b)))


def _magnitude(task: Interpreter, arguments: tuple[Arg, ...]) -> Any:
    (a,), _ = values(task, arguments, "pos")
    return single(float(np.linalg.norm(a)))


def _current(kind: str) -> Any:
    return lambda task, arguments: clone(getattr(task.motion, kind))


FUNCTIONS: dict[str, Any] = {
    "offs": _offs,
    "reltool": _reltool,
    "posemult": _pose_mult,
    "poseinv": _pose_inv,
    "posevect": _pose_vect,
    "defframe": _def_frame,
    "defdframe": _def_dframe,
    "orientzyx": lambda task, a: orient_zyx(*values(task, a)[0]),
    "eulerzyx": _euler_zyx,
    "norient": _norient,
    "orobt": _orobt,
    "crobt": _crobt,
    "cpos": lambda task, a: _crobt(task, a)[0],
    "calcrobt": _calc_robt,
    "ctool": _current("tool"),
    "cwobj": _current("wobj"),
    "present": _present,
    "dim": _dim,
    "round": _rounded(False),
    "trunc": _rounded(True),
    "abs": _single(abs),
    "sqrt": _single(math.sqrt),
    "exp": _single(math.exp),
    "pow": _single(math.pow),
    "sin": _single(lambda x: math.sin(math.radians(x))),
    "cos": _single(lambda x: math.cos(math.radians(x))),
    "tan": _single(lambda x: math.tan(math.radians(x))),
    "asin": _single(lambda x: math.degrees(math.asin(x))),
    "acos": _single(lambda x: math.degrees(math.acos(x))),
    "atan": _single(lambda x: math.degrees(math.atan(x))),
    "atan2": _single(lambda y, x: math.degrees(math.atan2(y, x))),
    "max": _single(max),
    "min": _single(min),
    "distance": _distance,
    "dotprod": _dot,
    "vectmagn": _magnitude,
    "dnumtonum": lambda task, a: single(values(task, a, "dnum")[0][0]),
    "numtodnum": lambda task, a: Dnum(values(task, a)[0][0]),
    "valtostr": lambda task, a: text_of(values(task, a, "")[0][0]),
    "numtostr": _num_to_str,
    "strtoval": _str_to_val,
    "strlen": _string(lambda s: float(len(s))),
    "strpart": _str_part,
    "strmatch": _str_match,
    "strfind": _str_find,
    "testdi": _test_di,
    "dinput": _signal_value,
    "doutput": _signal_value,
    "ainput": _signal_value,
    "aoutput": _signal_value,
    "ginput": _signal_value,
    "goutput": _signal_value,
    "uinumentry": _answer,
    "uinumtune": _answer,
    "uimessagebox": _answer,
    "uilistview": _answer,
    "clkread": _answer,
    "gettime": _answer,
    "opmode": lambda task, a: 1.0,
    "ctime": lambda task, a: "12:00:00",
    "cdate": lambda task, a: "2025-01-01",
    "robos": lambda task, a: True,
}
