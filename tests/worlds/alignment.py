"""Which statement of a corrected program is which of the original, and which ones were added.

Routine by routine the two lists of statements are aligned at the least cost. A motion may have another target, everything
else of it is compared; other statements are compared by their words. What the original lacks was added, and belongs to
the next motion of the original that is behind it.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from tests.worlds.geometry import Array, matrix_of_quaternion
from tests.worlds.motions import ROLES, family
from tests.worlds.syntax import Expr, Module, Routine, Statement
from tests.worlds.task import Identity

ADDED_MOTION, OTHER = 1.0, 100.0


def names_in(e: Any) -> set[str]:
    """Names that an expression mentions."""
    if isinstance(e, tuple) and e and e[0] in ("ref", "call"):
        return {str(e[1])} | names_in(e[2:])
    if hasattr(e, "value"):
        return names_in(e.value)
    return set().union(*(names_in(x) for x in e)) if isinstance(e, tuple) else set()


def _is_motion(s: Statement) -> bool:
    return s.kind == "call" and s.parts["name"] in ROLES


def _split(s: Statement) -> tuple[Expr | None, Expr | None, tuple[Any, ...]]:
    """Target, circle point, all other arguments of a motion."""
    roles = ROLES[s.parts["name"]]
    given = [a for a in s.parts["args"] if a.kind in ("pos", "named")]
    at = dict(zip(roles, (a.value for a in given), strict=False))
    rest = tuple(a for a in s.parts["args"] if a.value is None or a.value not in (at.get("to"), at.get("cir")))
    return at.get("to", at.get("joints")), at.get("cir"), rest


def _cost(a: Statement, b: Statement, declared: dict[str, Expr]) -> float:
    """What it costs to take b for a; OTHER where it cannot be."""
    if a.words == b.words and a.kind == b.kind:
        return 0.0
    if not (_is_motion(a) and _is_motion(b)):
        return _other_cost(a, b)
    if family(a.parts["name"]) != family(b.parts["name"]):
        return OTHER
    (to_a, _, rest_a), (to_b, _, rest_b) = _split(a), _split(b)
    cost = 0.0 if a.parts["name"] == b.parts["name"] else 3.0
    cost += 0.0 if rest_a == rest_b else 0.6
    apart = float(np.linalg.norm(_place(to_a, declared) - _place(to_b, declared)))
    return cost + 0.95 * apart / (apart + 30)


def _other_cost(a: Statement, b: Statement) -> float:
    """Calls of one routine and assignments to one place may have other arguments: corrections can stand in them."""
    if a.kind != b.kind or _is_motion(a) or _is_motion(b):
        return OTHER
    if a.kind == "call" and a.parts["name"] == b.parts["name"] and len(a.parts["args"]) == len(b.parts["args"]):
        return 0.5
    if a.kind == "late" and a.parts["name"] == b.parts["name"]:
        return 0.5
    if a.kind == "assign" and a.parts["target"] == b.parts["target"]:
        return 0.5
    if a.kind == "if" and len(a.parts["arms"]) == len(b.parts["arms"]):  # a function with a target in its condition
        return 0.5 if _calls(a) == _calls(b) != set() else OTHER
    return 0.5 if a.kind == "return" else OTHER


def _calls(s: Statement) -> set[str]:
    """Functions that the conditions of an IF call."""
    return {
        str(e[1]) for condition, _ in s.parts["arms"] for e in _parts(condition) if e[0] == "call" and e[1] != "offs"
    }


def _parts(e: Any) -> list[Any]:
    """An expression and all expressions inside it."""
    if hasattr(e, "value"):
        return _parts(e.value)
    if not isinstance(e, tuple) or not e:
        return []
    own = [e] if isinstance(e[0], str) else []
    return own + [x for item in e for x in _parts(item)]


def _place(e: Expr | None, declared: dict[str, Expr]) -> Array:
    """Roughly where a target lies: declared data as declared, any other name some value of its own."""
    if e is None:
        return np.zeros(3)
    if e[0] == "agg":
        first = e[1][0]
        items = first[1] if first[0] == "agg" else e[1][:3]
        return np.array([_number(x, declared) for x in items][:3] or [0.0] * 3)
    if e[0] == "ref" and not e[2] and declared.get(e[1], ("",))[0] == "agg":
        return _place(declared[e[1]], declared)
    if e[0] == "ref" and len(e[2]) == 1 and e[2][0][0] == "index":
        element = _element(declared.get(e[1]), [_number(i, declared) for i in e[2][0][1]])
        if element is not None:
            return _place(element, declared)
    if e[0] == "call" and e[1] in ("offs", "reltool") and len(e[2]) >= 4:
        by = np.array([_number(a.value, declared) for a in e[2][1:4] if a.value is not None])
        base = _place(e[2][0].value, declared)
        return base + (by if e[1] == "offs" else _turn(e[2][0].value, declared) @ by)
    return 300 * np.array([_some(e, k) for k in range(3)])


def _element(e: Expr | None, indices: list[float]) -> Expr | None:
    for i in indices:
        if e is None or e[0] != "agg" or not 1 <= int(i) <= len(e[1]):
            return None
        e = e[1][int(i) - 1]
    return e


def _turn(e: Expr | None, declared: dict[str, Expr]) -> Array:
    """(3, 3) orientation of a literal or declared target, otherwise none."""
    while e is not None and e[0] == "call" and e[1] in ("offs", "reltool"):
        e = e[2][0].value
    if e is not None and e[0] == "ref":
        e = declared.get(e[1]) if not e[2] else None
    if e is None or e[0] != "agg" or len(e[1]) < 2 or e[1][1][0] != "agg" or len(e[1][1][1]) != 4:
        return np.eye(3)
    return matrix_of_quaternion([_number(x, declared) for x in e[1][1][1]])


def _some(e: Any, k: int = 0) -> float:
    return hashlib.blake2b(repr((e, k)).encode(), digest_size=2).digest()[0] / 255


_OPERATORS = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / (b or 1.0),
}


def _number(e: Expr | None, declared: dict[str, Expr]) -> float:
    if e is None:
        return 0.0
    if e[0] == "num":
        return float(int(e[1], 16)) if e[1][:2].lower() == "0x" else float(e[1])
    if e[0] == "un" and e[1] == "-":
        return -_number(e[2], declared)
    if e[0] == "bin" and e[1] in _OPERATORS:
        return float(_OPERATORS[e[1]](_number(e[2], declared), _number(e[3], declared)))
    if e[0] == "ref" and not e[2] and e[1] in declared:
        return _number(declared[e[1]], declared)
    return 1 + 2 * _some(e)


def _align(a: list[Statement], b: list[Statement], declared: dict[str, Expr]) -> list[int | None]:
    """For each of b the index of the same statement of a, None where it was added."""
    n, m = len(a), len(b)
    total = np.full((n + 1, m + 1), np.inf)
    total[:, 0] = OTHER * np.arange(n + 1)
    total[0, :] = np.concatenate([[0.0], np.cumsum([ADDED_MOTION if _is_motion(s) else OTHER for s in b])])
    cost = np.full((n, m), np.inf)
    for i in range(n):
        for j in range(max(0, i - 40), m):
            cost[i, j] = _cost(a[i], b[j], declared)
            added = ADDED_MOTION if _is_motion(b[j]) else OTHER
            total[i + 1, j + 1] = min(total[i, j] + cost[i, j], total[i + 1, j] + added, total[i, j + 1] + OTHER)
    out: list[int | None] = [None] * m
    i, j = n, m
    while i and j:
        if total[i, j] == total[i - 1, j - 1] + cost[i - 1, j - 1]:
            out[j - 1] = i - 1 if cost[i - 1, j - 1] < OTHER else None
            i, j = i - 1, j - 1
        elif total[i, j] == total[i - 1, j] + OTHER:
            i -= 1
        else:
            j -= 1
    return out


def _routines(modules: list[Module]) -> dict[tuple[str, str], Routine]:
    return {(m.name, r.name): r for m in modules for r in m.routines}


def _declared(modules: list[Module]) -> dict[str, Expr]:
    """Initial values of targets and numbers by name."""
    data = [d for m in modules for d in [*m.data, *(d for r in m.routines for d in r.data)]]
    return {d.name: d.value for d in data if d.type in ("robtarget", "num") and d.value is not None}


_known: list[tuple[list[Module], list[Module], dict[Statement, tuple[Identity, bool]]]] = []


def identities(original: list[Module], corrected: list[Module]) -> dict[Statement, tuple[Identity, bool]]:
    """For each statement of the corrected program: its identity in the original, and whether it was added.

    The last answer is kept: a pair of programs is compared in several worlds, one after the other.
    """
    if not (_known and _known[0][0] is original and _known[0][1] is corrected):
        _known[:] = [(original, corrected, _matched(original, corrected))]
    return _known[0][2]


def _matched(original: list[Module], corrected: list[Module]) -> dict[Statement, tuple[Identity, bool]]:
    old, out = _routines(original), {}
    modules = {m.name for m in original}
    places = {**_declared(corrected), **_declared(original)}
    for key, routine in _routines(corrected).items():
        if key[0] not in modules:
            continue
        before = old.get(key)
        matched = _align(before.flat, routine.flat, places) if before else [None] * len(routine.flat)
        following = len(before.flat) if before else 0
        for s, k in zip(reversed(routine.flat), reversed(matched), strict=True):
            if k is not None:
                following = k
            out[s] = ((*key, following), k is None)
    return out


def name_kept(a: Statement, b: Statement) -> bool:
    """A name that the original's target states is still there."""
    return bool(names_in(_split(a)[0]) <= names_in(_split(b)[0]))
