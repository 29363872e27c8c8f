"""Two programs compared by meaning: what the arm does and what else the routines do, not how it is written."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from postproc.rapid.events import MotionEvent, MotionStatement
from postproc.rapid.program import Program, bodies, statements_in
from postproc.rapid.records import JointTarget, Quat, RobTarget
from postproc.rapid.tokens import tokenize
from postproc.rapid.walk import walk

T = TypeVar("T")
NEAR_MM = 5.0  # targets this close are taken for the same one when statements were added or removed
LOOK_AHEAD = 400


@dataclass(frozen=True, slots=True)
class Difference:
    """One statement that differs.

    Args:
        kind: ``changed``, ``added`` (only in the second program) or ``removed`` (only in the first).
        what: ``motion``, ``statement`` or ``declaration``.
        place: ``module.routine``, or ``module`` for data.
        name: the instruction, or the name of the data.
        line_a, line_b: line in each file, as far as it stands there.
        distance_mm: largest distance of the targets (None if not both are known).
        angle_deg: largest angle between their orientations, or between joints.
        conf: configurations of both where they differ.
        arguments: role and both texts of arguments that differ.
    """

    kind: Literal["changed", "added", "removed"]
    what: Literal["motion", "statement", "declaration"]
    place: str
    name: str
    line_a: int | None
    line_b: int | None
    distance_mm: float | None = None
    angle_deg: float | None = None
    conf: tuple[tuple[int, ...], tuple[int, ...]] | None = None
    arguments: tuple[tuple[str, str, str], ...] = ()

    def render(self) -> str:
        """One line for a terminal."""
        lines = "/".join("-" if line is None else str(line) for line in (self.line_a, self.line_b))
        parts = [f"{self.kind:8}{self.place}:{lines} {self.name}"]
        if self.distance_mm is not None and self.kind == "changed":
            parts.append(f"{self.distance_mm:.3f} mm")
        if self.angle_deg is not None and self.kind == "changed":
            parts.append(f"{self.angle_deg:.4f} deg")
        if self.conf is not None:
            parts.append(f"conf {list(self.conf[0])} -> {list(self.conf[1])}")
        parts += [f"{role}: {a or '-'} -> {b or '-'}" for role, a, b in self.arguments]
        return "  ".join(parts)

    def as_json(self) -> dict[str, Any]:
        return {
            "kind": self.kind, "what": self.what, "place": self.place, "name": self.name,
            "line_a": self.line_a, "line_b": self.line_b,
            "distance_mm": self.distance_mm, "angle_deg": self.angle_deg,
            "conf": [list(c) for c in self.conf] if self.conf else None,
            "arguments": [{"role": role, "a": a, "b": b} for role, a, b in self.arguments],
        }  # fmt: skip


@dataclass(frozen=True)
class ProgramDiff:
    """Differences of two programs beyond the tolerance, and the largest ones of all that were compared."""

    differences: tuple[Difference, ...]
    compared: int = 0
    max_distance_mm: float = 0.0
    max_angle_deg: float = 0.0
    tolerance_mm: float = 0.0

    @property
    def equal(self) -> bool:
        return not self.differences

    def render(self) -> str:
        """Text for a terminal."""
        summary = (
            f"{self.compared} motion statements compared, largest distance {self.max_distance_mm:.3f} mm, largest angle"
            f" {self.max_angle_deg:.4f} deg, {len(self.differences)} differences beyond {self.tolerance_mm:g} mm"
        )
        return "\n".join([*(d.render() for d in self.differences), summary])

    def as_json(self) -> dict[str, Any]:
        return {
            "schema": "postproc/diff/1",
            "equal": self.equal,
            "tolerance_mm": self.tolerance_mm,
            "compared": self.compared,
            "max_distance_mm": self.max_distance_mm,
            "max_angle_deg": self.max_angle_deg,
            "differences": [d.as_json() for d in self.differences],
        }


def compare_programs(a: Program, b: Program, tolerance_mm: float, tolerance_deg: float = 0.01) -> ProgramDiff:
    """Compare two programs statement by statement.

    Motion statements are compared by target, orientation, configuration and arguments (values, where names or spellings
    differ), all others by their words; declared targets count only through the statements that use them.
    """
    events_a, events_b = _by_statement(walk(a)), _by_statement(walk(b))
    differences: list[Difference] = []
    compared, most_mm, most_deg = 0, 0.0, 0.0
    routines_a, routines_b = _motions(a), _motions(b)
    for place in dict.fromkeys([*routines_a, *routines_b]):
        ours, theirs = routines_a.get(place, []), routines_b.get(place, [])

        def near(x: MotionStatement, y: MotionStatement) -> bool:
            return x.instruction == y.instruction and _near(events_a.get(_key(x), []), events_b.get(_key(y), []))

        for x, y in _aligned(ours, theirs, near):
            if x is None or y is None:
                differences.append(_lonely(place, x, y))
                continue
            compared += 1
            found = _compare(place, x, y, events_a.get(_key(x), []), events_b.get(_key(y), []))
            most_mm, most_deg = max(most_mm, found.distance_mm or 0.0), max(most_deg, found.angle_deg or 0.0)
            far = (found.distance_mm or 0.0) > tolerance_mm or (found.angle_deg or 0.0) > tolerance_deg
            if far or found.conf or found.arguments:
                differences.append(found)
    differences += _other_statements(a, b)
    differences += _declarations(a, b)
    return ProgramDiff(tuple(differences), compared, most_mm, most_deg, tolerance_mm)


Key = tuple[str, int]


def _key(statement: MotionStatement) -> Key:
    return statement.source.path, statement.span[0]


def _by_statement(events: Sequence[MotionEvent]) -> dict[Key, list[MotionEvent]]:
    found: dict[Key, list[MotionEvent]] = {}
    for event in events:
        found.setdefault(_key(event.statement), []).append(event)
    return found


def _motions(program: Program) -> dict[str, list[MotionStatement]]:
    found: dict[str, list[MotionStatement]] = {}
    for statement in program.statements:
        found.setdefault(f"{statement.module}.{statement.routine}".lower(), []).append(statement)
    return found


def _aligned(a: Sequence[T], b: Sequence[T], same: Callable[[T, T], bool]) -> Iterator[tuple[T | None, T | None]]:
    """Pairs in order; None where one side has nothing. Sequences of one length are paired one to one."""
    if len(a) == len(b):
        yield from zip(a, b, strict=True)
        return
    i = j = 0
    while i < len(a) and j < len(b):
        if not same(a[i], b[j]):
            skipped = _skip(a, b, i, j, same)
            if skipped is not None:
                for _ in range(skipped[0]):
                    yield a[i], None
                    i += 1
                for _ in range(skipped[1]):
                    yield None, b[j]
                    j += 1
        yield a[i], b[j]
        i, j = i + 1, j + 1
    for item in a[i:]:
        yield item, None
    for item in b[j:]:
        yield None, item


def _skip(a: Sequence[T], b: Sequence[T], i: int, j: int, same: Callable[[T, T], bool]) -> tuple[int, int] | None:
    """How many items to pass over on one side until both agree again; None if the two are a changed pair."""
    for ahead in range(1, LOOK_AHEAD):
        if j + ahead < len(b) and same(a[i], b[j + ahead]):
            return 0, ahead
        if i + ahead < len(a) and same(a[i + ahead], b[j]):
            return ahead, 0
        if i + ahead < len(a) and j + ahead < len(b) and same(a[i + ahead], b[j + ahead]):
            return None
    return None


def _near(a: Sequence[MotionEvent], b: Sequence[MotionEvent]) -> bool:
    if not a or not b:
        return False
    x, y = a[0].target, b[0].target
    if isinstance(x, RobTarget) and isinstance(y, RobTarget):
        return math.dist(x.trans, y.trans) < NEAR_MM
    if isinstance(x, JointTarget) and isinstance(y, JointTarget):
        return math.dist(x.robax, y.robax) < 1.0
    return x is None and y is None


def _lonely(place: str, x: MotionStatement | None, y: MotionStatement | None) -> Difference:
    name = x.instruction if x else y.instruction if y else ""
    kind: Literal["added", "removed"] = "removed" if x else "added"
    return Difference(kind, "motion", place, name, x.line if x else None, y.line if y else None)


def _compare(
    place: str, x: MotionStatement, y: MotionStatement, a: Sequence[MotionEvent], b: Sequence[MotionEvent]
) -> Difference:
    distance: float | None = None
    angle: float | None = None
    conf = None
    texts: dict[str, tuple[str, str]] = {}
    if x.instruction != y.instruction:
        texts["instruction"] = (x.instruction, y.instruction)
    if len(a) != len(b):
        texts["executions"] = (str(len(a)), str(len(b)))
    for one, two in zip(a, b, strict=False):
        for p, q in ((one.target, two.target), (one.via, two.via)):
            if isinstance(p, RobTarget) and isinstance(q, RobTarget):
                distance = max(distance or 0.0, math.dist(p.trans, q.trans))
                angle = max(angle or 0.0, angle_between(p.rot, q.rot))
                if p.robconf != q.robconf:
                    conf = (p.robconf, q.robconf)
                if p.extax != q.extax:
                    texts["external axes"] = (str(p.extax), str(q.extax))
            elif isinstance(p, JointTarget) and isinstance(q, JointTarget):
                angle = max(angle or 0.0, *(abs(m - n) for m, n in zip(p.robax, q.robax, strict=True)))
                if p.extax != q.extax:
                    texts["external axes"] = (str(p.extax), str(q.extax))
            elif p != q:
                texts["target"] = (_shown(p), _shown(q))
        texts.update(_values(one, two))
    texts.update(_arguments(x, y, bool(a) and bool(b)))
    rows = tuple((role, *pair) for role, pair in texts.items())
    return Difference("changed", "motion", place, y.instruction, x.line, y.line, distance, angle, conf, rows)


def angle_between(p: Quat, q: Quat) -> float:
    """Angle [deg] between two orientations, exact for small angles: ``4 asin(min |p -+ q| / 2)``."""
    minus = math.sqrt(sum((m - n) ** 2 for m, n in zip(p, q, strict=True)))
    plus = math.sqrt(sum((m + n) ** 2 for m, n in zip(p, q, strict=True)))
    return math.degrees(4 * math.asin(min(1.0, min(minus, plus) / 2)))


def _values(a: MotionEvent, b: MotionEvent) -> dict[str, tuple[str, str]]:
    """What is in force at the two events, compared by value."""
    pairs = {
        "tool": ((a.tool.robhold, a.tool.tframe), (b.tool.robhold, b.tool.tframe)),
        "load of the tool": (a.tool.tload, b.tool.tload),
        "\\wobj": ((a.wobj.robhold, a.wobj.uframe, a.wobj.oframe), (b.wobj.robhold, b.wobj.uframe, b.wobj.oframe)),
        "speed": (a.speed, b.speed),
        "zone": (a.zone, b.zone),
        "weld": (a.weld, b.weld),
        "duration": (a.duration, b.duration),
        "payload": (a.gripload, b.gripload),
        "displacement": (a.displacement, b.displacement),
    }
    return {role: (_shown(p), _shown(q)) for role, (p, q) in pairs.items() if p != q}


def _shown(value: object) -> str:
    return "not known" if value is None else str(value)


BY_VALUE = ("to", "via", "speed", "zone", "tool", "\\wobj", "\\v", "\\t", "\\z", "\\tload")


def _arguments(x: MotionStatement, y: MotionStatement, valued: bool) -> dict[str, tuple[str, str]]:
    """Arguments that differ in their words; those with values only if the values could not be compared."""
    ours, theirs = ({a.role: a.text for a in s.arguments} for s in (x, y))
    found = {}
    for role in dict.fromkeys([*ours, *theirs]):
        if valued and role in BY_VALUE:
            continue
        p, q = ours.get(role), theirs.get(role)
        if (p is None) != (q is None) or (p is not None and q is not None and words(p) != words(q)):
            found[role] = (p if p is not None else "", q if q is not None else "")
    return found


def words(text: str) -> tuple[str, ...]:
    """The tokens of a piece of text without blanks and comments, in lower case but for strings."""
    data = text.encode("latin-1", "replace")
    return tuple(
        (piece if kind == "string" else piece.lower()).decode("latin-1")
        for kind, (start, end) in tokenize(data)
        if kind not in ("blank", "comment")
        for piece in (data[start:end],)
    )


def _other_statements(a: Program, b: Program) -> Iterator[Difference]:
    """Statements that do not move the arm, by their words."""
    ours, theirs = _plain(a), _plain(b)
    for place in dict.fromkeys([*ours, *theirs]):
        rows_a, rows_b = ours.get(place, []), theirs.get(place, [])
        if [row[0] for row in rows_a] == [row[0] for row in rows_b]:
            continue
        for x, y in _aligned(rows_a, rows_b, lambda p, q: p[0] == q[0]):
            if x is not None and y is not None:
                if x[0] != y[0]:
                    pair = ("text", " ".join(x[0]), " ".join(y[0]))
                    yield Difference("changed", "statement", place, y[0][0], x[1], y[1], arguments=(pair,))
            elif x is not None:
                yield Difference("removed", "statement", place, " ".join(x[0]), x[1], None)
            elif y is not None:
                yield Difference("added", "statement", place, " ".join(y[0]), None, y[1])


def _plain(program: Program) -> dict[str, list[tuple[tuple[str, ...], int]]]:
    found: dict[str, list[tuple[tuple[str, ...], int]]] = {}
    for routine in program.all_routines():
        rows = found.setdefault(routine.key, [])
        data = routine.source.data
        for body in bodies(routine):
            for statement in statements_in(body):
                if program.motion(routine.source, statement) is not None:
                    continue
                # Of a block, the head: its body is compared statement by statement.
                spans = [statement.span]
                if statement.branches:
                    spans = [*statement.parts, *(c for branch in statement.branches for c in branch.conditions)]
                text = " ".join([statement.kind, *(data[s:e].decode("latin-1") for s, e in spans)])
                line = routine.source.position(statement.span[0])[0]
                rows.append((words(text)[0 if statement.branches else 1 :], line))
    return {place: rows for place, rows in found.items() if rows}


def _declarations(a: Program, b: Program) -> Iterator[Difference]:
    """Data other than targets, by key and words."""
    ours, theirs = ({d.key: d for d in p.declarations if d.type not in ("robtarget", "jointtarget")} for p in (a, b))
    for key in dict.fromkeys([*ours, *theirs]):
        x, y = ours.get(key), theirs.get(key)
        texts = [d.source.data[slice(*d.init)].decode("latin-1") if d and d.init else "" for d in (x, y)]
        if (
            x is not None
            and y is not None
            and (x.storage, x.type, words(texts[0])) == (y.storage, y.type, words(texts[1]))
        ):
            continue
        kind: Literal["changed", "added", "removed"] = "changed" if x and y else "removed" if x else "added"
        either = y or x
        lines = [d.source.position(d.span[0])[0] if d else None for d in (x, y)]
        if either is not None:
            row = (("value", texts[0], texts[1]),) if kind == "changed" else ()
            yield Difference(kind, "declaration", either.module, either.name, lines[0], lines[1], arguments=row)
