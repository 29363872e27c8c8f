"""Which statement of a corrected program is which of the original, and which ones were added.

Routine by routine the two lists of statements are aligned at the least cost. A motion may have another target, everything
else of it is compared; other statements are compared by their words. What the original lacks was added, and belongs to
the next motion of the original that is behind it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.worlds.interpreter import Identity
from tests.worlds.motions import ROLES, family
from tests.worlds.syntax import Expr, Module, Routine, Statement

ADDED_MOTION, OTHER = 1.0, 100.0


def names_in(e: Any) -> set[str]:
    """Names that an expression mentions."""
    if isinstance(e, tuple) and e and e[0] in ("ref", "call"):
        return {str(e[1])} | names_in(e[2:])
    if hasattr(e, "value"):
        return names_in(e.value)
    return set().union(*(names_in(x) for x in e)) if isinstance(e, tuple) else set()


def numbers_in(e: Any) -> list[float]:
    if isinstance(e, tuple):
        if len(e) == 2 and e[0] == "num":
            return [float(e[1])]
        if len(e) == 3 and e[:2] == ("un", "-"):
            return [-v for v in numbers_in(e[2])]
        return [v for x in e for v in numbers_in(x)]
    return numbers_in(e.value) if hasattr(e, "value") else []


def _is_motion(s: Statement) -> bool:
    return s.kind == "call" and s.parts["name"] in ROLES


def _split(s: Statement) -> tuple[Expr | None, Expr | None, tuple[Any, ...]]:
    """Target, circle point, all other arguments of a motion."""
    roles = ROLES[s.parts["name"]]
    given = [a for a in s.parts["args"] if a.kind in ("pos", "named")]
    at = dict(zip(roles, (a.value for a in given), strict=False))
    rest = tuple(a for a in s.parts["args"] if a.value is None or a.value not in (at.get("to"), at.get("cir")))
    return at.get("to", at.get("joints")), at.get("cir"), rest


def _cost(a: Statement, b: Statement, declared: dict[str, list[float]]) -> float:
    """What it costs to take b for a; OTHER where it cannot be."""
    if not (_is_motion(a) and _is_motion(b)):
        return 0.0 if a.words == b.words else OTHER
    if a.words == b.words:
        return 0.0
    if family(a.parts["name"]) != family(b.parts["name"]):
        return OTHER
    (to_a, _, rest_a), (to_b, _, rest_b) = _split(a), _split(b)
    cost = 0.0 if a.parts["name"] == b.parts["name"] else 3.0
    cost += 0.0 if rest_a == rest_b else 0.6
    lost, new = names_in(to_a) - names_in(to_b), names_in(to_b) - names_in(to_a)
    place_a, place_b = _place(to_a, declared), _place(to_b, declared)
    if place_a is not None and place_b is not None:
        return cost + min(0.9, float(np.linalg.norm(np.subtract(place_a, place_b))) / 20)
    return cost + 0.4 * bool(lost) + 0.2 * bool(new)


def _place(e: Expr | None, declared: dict[str, list[float]]) -> list[float] | None:
    """Numbers of a literal or declared target, roughly: Offs adds, RelTool and the rest are not calculated."""
    if e is None:
        return None
    if e[0] == "agg" and not names_in(e):
        found = numbers_in(e)
        return found[:3] if len(found) >= 7 else None
    if e[0] == "ref" and not e[2]:
        return declared.get(e[1])
    if e[0] == "call" and e[1] == "offs" and len(e[2]) == 4:
        base = _place(e[2][0].value, declared)
        shifts = [numbers_in(a.value) for a in e[2][1:]]
        if base is not None and all(len(s) == 1 and not names_in(a.value) for s, a in zip(shifts, e[2][1:], strict=True)):
            return [x + s[0] for x, s in zip(base, shifts, strict=True)]
    return None


def _align(a: list[Statement], b: list[Statement], declared: dict[str, list[float]]) -> list[int | None]:
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


def declared_places(modules: list[Module]) -> dict[str, list[float]]:
    out = {}
    for m in modules:
        for d in [*m.data, *(d for r in m.routines for d in r.data)]:
            if d.type == "robtarget" and not d.dims and d.value is not None and d.value[0] == "agg":
                out[d.name] = numbers_in(d.value)[:3]
    return out


def identities(original: list[Module], corrected: list[Module]) -> dict[Statement, tuple[Identity, bool]]:
    """For each statement of the corrected program: its identity in the original, and whether it was added."""
    old, out = _routines(original), {}
    places = {**declared_places(corrected), **declared_places(original)}
    for key, routine in _routines(corrected).items():
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


