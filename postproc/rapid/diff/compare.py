"""Two programs compared by meaning: what the arm does and what else the routines do, not how it is written.

Motion statements are compared by the values that they run with, all else by its words.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import accumulate
from typing import Literal

from postproc.grouping import grouped
from postproc.rapid.data.builtins import PREDEFINED
from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.data.pose import subtract
from postproc.rapid.data.records import JointTarget, Quat, RobTarget, Vec3
from postproc.rapid.diff.difference import Difference, ProgramDiff
from postproc.rapid.diff.pairing import aligned, pair_motions
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import identifiers, tokenize


def compare_programs(a: Program, b: Program, tolerance_mm: float, tolerance_deg: float = 0.01) -> ProgramDiff:
    """Compare two programs statement by statement.

    Motion statements are compared by target, orientation, configuration and arguments (values, where names or spellings
    differ), all others by their words; declared targets count only through the statements that use them.

    Args:
        tolerance_mm, tolerance_deg: largest distance of two targets, and angle between them, that is no difference.
    """
    events_a, events_b = by_statement(walk(a)), by_statement(walk(b))
    differences: list[Difference] = []
    compared, most_mm, most_deg = 0, 0.0, 0.0
    paired: dict[str, tuple[Ranks, Ranks]] = {}
    for place, pairs in pair_statements(a, b, events_a, events_b).items():
        paired[place] = _ranks([y for x, y in pairs if x is not None]), _ranks([x for x, y in pairs if y is not None])
        for x, y in pairs:
            if x is None or y is None:
                differences.append(_unpaired(x, y))
                continue
            compared += 1
            changes = _compare((a, x, events_a.get(x.key, [])), (b, y, events_b.get(y.key, [])))
            most_mm, most_deg = max(most_mm, changes.distance_mm or 0.0), max(most_deg, changes.angle_deg or 0.0)
            far = (changes.distance_mm or 0.0) > tolerance_mm or (changes.angle_deg or 0.0) > tolerance_deg
            if far or changes.conf or changes.arguments:
                differences.append(changes)
    differences += compare_statements(a, b, paired)
    differences += compare_declarations(a, b)
    return ProgramDiff(tuple(differences), compared, most_mm, most_deg, tolerance_mm, tolerance_deg)


Executions = Mapping[StatementKey, Sequence[MotionEvent]]
"""The events of each motion statement, in the order in which they run."""
Pairs = list[tuple[MotionStatement | None, MotionStatement | None]]
"""Motion statements of two programs in order; None in place of the partner of one that was added or removed."""


def pair_statements(a: Program, b: Program, events_a: Executions, events_b: Executions) -> dict[str, Pairs]:
    """Pair the motion statements of two programs routine by routine (`pair_motions`), by lower-case ``module.routine``.

    Args:
        events_a, events_b: executions of the statements of each program (`by_statement`).
    """
    ours, theirs = _motions(a), _motions(b)
    places = dict.fromkeys([*ours, *theirs])
    return {place: pair_motions(ours.get(place, []), theirs.get(place, []), events_a, events_b) for place in places}


def by_statement(events: Sequence[MotionEvent]) -> dict[StatementKey, list[MotionEvent]]:
    """The events of each motion statement, by statement key and in the order in which they run."""
    return grouped((event.statement.key, event) for event in events)


def _motions(program: Program) -> dict[str, list[MotionStatement]]:
    """The motion statements of each routine in text order, by lower-case ``module.routine``."""
    return grouped((_place(statement).lower(), statement) for statement in program.statements)


def _ranks(partners: Sequence[MotionStatement | None]) -> Ranks:
    """Count the partners: element k is how many of the first k motion statements have one (n + 1 elements for n)."""
    return tuple(accumulate((partner is not None for partner in partners), initial=0))


def _unpaired(x: MotionStatement | None, y: MotionStatement | None) -> Difference:
    """The difference for a statement of one program only: ``x`` was removed, or ``y`` was added; the other is None."""
    present = x or y
    assert present is not None
    kind: Literal["added", "removed"] = "removed" if x else "added"
    lines = x.line if x else None, y.line if y else None
    difference = Difference(kind, "motion", _place(present), present.instruction, *lines, target=present.target)
    return replace(difference, text_a=x.text if x else "", text_b=y.text if y else "")


def _place(statement: MotionStatement) -> str:
    """``module.routine`` in which a motion statement stands, as spelt in the text."""
    return f"{statement.module}.{statement.routine}"


Side = tuple[Program, MotionStatement, Sequence[MotionEvent]]
"""A statement of a program with its executions."""


def _compare(first: Side, second: Side) -> Difference:
    """Difference of two paired statements: the largest distances over their executions, which are paired in order."""
    (_, x, a), (_, y, b) = first, second
    distance: float | None = None
    angle: float | None = None
    shift: Vec3 | None = None
    points: tuple[Vec3, Vec3] | None = None
    at_via = False
    conf = None
    texts: dict[str, tuple[str, str]] = {}
    if x.instruction != y.instruction:
        texts["instruction"] = (x.instruction, y.instruction)
    if len(a) != len(b):
        texts["executions"] = (str(len(a)), str(len(b)))
    for one, two in zip(a, b, strict=False):
        for p, q in ((one.target, two.target), (one.via, two.via)):
            if isinstance(p, RobTarget) and isinstance(q, RobTarget):
                far = math.dist(p.trans, q.trans)
                if distance is None or far > distance:
                    distance, shift, at_via = far, subtract(q.trans, p.trans), p is one.via
                    points = p.trans, q.trans
                angle = max(angle or 0.0, angle_between(p.rot, q.rot))
                if p.robconf != q.robconf:
                    conf = (p.robconf, q.robconf)
            elif isinstance(p, JointTarget) and isinstance(q, JointTarget):
                angle = max(angle or 0.0, *(abs(m - n) for m, n in zip(p.robax, q.robax, strict=True)))
            elif p != q:
                texts["target"] = (_shown(p), _shown(q))
                continue
            if p is not None and q is not None and p.extax != q.extax:
                texts["external axes"] = (str(p.extax), str(q.extax))
        texts.update(_values(one, two))
    known = _roles_by_value(*first) & _roles_by_value(*second)
    texts.update({role: pair for role, pair in _arguments(x, y).items() if role not in known})
    rows = tuple((role, *pair) for role, pair in texts.items())
    place, speed = _place(y), _speeds(a, b)
    amounts = (distance, angle, conf, rows, shift, speed, at_via)
    return Difference(
        "changed", "motion", place, y.instruction, x.line, y.line, *amounts, y.target, x.text, y.text, points
    )


def _speeds(a: Sequence[MotionEvent], b: Sequence[MotionEvent]) -> tuple[float, float] | None:
    """TCP speeds [mm/s] at the first pair of executions where they differ; None if no pair differs."""
    for one, two in zip(a, b, strict=False):
        p, q = _speed(one), _speed(two)
        if p is not None and q is not None and p != q:
            return p, q
    return None


def _speed(event: MotionEvent) -> float | None:
    """TCP speed [mm/s] of an event: of its welddata in the seam (not at its start) if known, else its speeddata."""
    if event.weld is not None and event.weld.phase != "start" and event.weld.speed is not None:
        return event.weld.speed
    return None if event.speed is None else event.speed.v_tcp


def angle_between(p: Quat, q: Quat) -> float:
    """Angle [deg] between two orientations, exact for small angles: ``4 asin(min |p -+ q| / 2)``."""
    minus = math.sqrt(sum((m - n) ** 2 for m, n in zip(p, q, strict=True)))
    plus = math.sqrt(sum((m + n) ** 2 for m, n in zip(p, q, strict=True)))
    return math.degrees(4 * math.asin(min(1.0, min(minus, plus) / 2)))


def _values(a: MotionEvent, b: MotionEvent) -> dict[str, tuple[str, str]]:
    """Tool, frames, speed, zone, weld, load and displacement that differ between two events: both as text, by role."""
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
    """Write a value or record as RAPID does, ``[100,500,5000,1000]``, with nine digits; "not known" for None."""
    if value is None:
        return "not known"
    if isinstance(value, bool):
        return str(value).upper()
    if is_dataclass(value) and not isinstance(value, type):
        value = tuple(getattr(value, field.name) for field in fields(value))
    if isinstance(value, tuple):
        return f"[{','.join(map(_shown, value))}]"
    return f"{value:.9g}" if isinstance(value, float) else str(value)


TARGET_ROLES = frozenset({"to", "via"})
BY_VALUE = frozenset({"speed", "zone", "tool", "\\wobj", "\\v", "\\t", "\\z", "\\tload"})


def _roles_by_value(program: Program, statement: MotionStatement, events: Sequence[MotionEvent]) -> frozenset[str]:
    """Roles whose arguments are compared by value, not by text: their names are known in the program's files.

    ``to`` and ``via`` are among them if every event has a target; without events the result is empty.
    """
    if not events:
        return frozenset()
    routine = program.routine(statement.routine, statement.module)
    parameters = {p.name for p in routine.parameters} if routine is not None else set()

    def declared(name: str) -> bool:
        """Whether a name means declared or predefined data or a parameter of the statement's routine."""
        declaration = program.declaration(name, statement.module, statement.routine)
        return declaration is not None or name in PREDEFINED or name in parameters

    unknown = {
        argument.role
        for argument in statement.arguments
        if argument.role in BY_VALUE and not all(map(declared, identifiers(argument.text.encode("latin-1"))))
    }
    return (BY_VALUE - unknown) | (TARGET_ROLES if all(e.target is not None for e in events) else frozenset())


def _arguments(x: MotionStatement, y: MotionStatement) -> dict[str, tuple[str, str]]:
    """Texts of the arguments of two statements where their words differ, by role; empty for one that is missing."""
    ours, theirs = (
        {(a.role, [b.role for b in s.arguments[:k]].count(a.role)): a.text for k, a in enumerate(s.arguments)}
        for s in (x, y)
    )
    arguments = {}
    for role, at in dict.fromkeys([*ours, *theirs]):
        p, q = ours.get((role, at)), theirs.get((role, at))
        if (p is None) != (q is None) or (p is not None and q is not None and words(p) != words(q)):
            arguments[role] = (p if p is not None else "", q if q is not None else "")
    return arguments


Ranks = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Row:
    """A statement that does not move the arm, or the end of a branch.

    Args:
        before: how many motion statements of its routine stand before it.
    """

    words: tuple[str, ...]
    line: int
    before: int


def words(text: str) -> tuple[str, ...]:
    """Tokens of RAPID text without blanks and comments: in lower case except strings; numbers with nine digits."""
    data = text.encode("latin-1", "replace")
    return tuple(
        _number(piece) if kind == "number" else (piece if kind == "string" else piece.lower()).decode("latin-1")
        for kind, (start, end) in tokenize(data)
        if kind not in ("blank", "comment")
        for piece in (data[start:end],)
    )


def _number(text: bytes) -> str:
    """A numeric literal with nine significant digits, so that ``1.0`` and ``1`` are equal; others in lower case."""
    try:
        return f"{float(text):.9g}"
    except ValueError:
        return text.decode("latin-1").lower()  # 0x1F


def compare_statements(a: Program, b: Program, paired: Mapping[str, tuple[Ranks, Ranks]]) -> Iterator[Difference]:
    """Yield the differences of all statements that do not move the arm.

    They differ by their words, or by the number of motion statements before them that have a partner. A routine that
    only one program has is a single difference.

    Args:
        paired: by lower-case ``module.routine``, for both programs: element k is how many of the first k motion
            statements have a partner in the other program.
    """
    ours, theirs = _rows(a), _rows(b)
    unpaired = {routine.key: (kind, routine) for kind, routine in _unpaired_routines(a, b)}
    for kind, routine in unpaired.values():
        line = routine.source.row(routine.span[0])
        lines = (line, None) if kind == "removed" else (None, line)
        text = f"{routine.kind} {routine.name}"
        yield Difference(kind, "statement", f"{routine.module}.{routine.name}", text, *lines)
    for place in dict.fromkeys([*ours, *theirs]):
        if place in unpaired:
            continue
        rows_a, rows_b = ours.get(place, []), theirs.get(place, [])
        ranks_a, ranks_b = paired.get(place, ((0,), (0,)))
        for x, y in aligned(rows_a, rows_b, lambda p, q: p.words == q.words):
            if x is not None and y is not None:
                rank_x, rank_y = ranks_a[x.before], ranks_b[y.before]
                if x.words != y.words:
                    pair = ("text", " ".join(x.words), " ".join(y.words))
                elif rank_x != rank_y:
                    pair = ("motion statements before it", str(rank_x), str(rank_y))
                else:
                    continue
                yield Difference("changed", "statement", place, y.words[0], x.line, y.line, arguments=(pair,))
            elif x is not None:
                yield Difference("removed", "statement", place, " ".join(x.words), x.line, None)
            elif y is not None:
                yield Difference("added", "statement", place, " ".join(y.words), None, y.line)


def _unpaired_routines(a: Program, b: Program) -> Iterator[tuple[Literal["added", "removed"], Routine]]:
    """Routines that only one program has: "removed" those only in ``a``, then "added" those only in ``b``."""
    ours, theirs = ({r.key: r for r in p.all_routines()} for p in (a, b))
    yield from (("removed", ours[key]) for key in sorted(ours.keys() - theirs.keys()))
    yield from (("added", theirs[key]) for key in sorted(theirs.keys() - ours.keys()))


def _rows(program: Program) -> dict[str, list[_Row]]:
    """Statements that do not move the arm, by routine key in text order; a handler begins with the row ``handler``."""
    rows_by_name: dict[str, list[_Row]] = {}
    for routine in program.all_routines():
        rows: list[_Row] = []
        before = 0
        for number, body in enumerate((routine.body, *routine.handlers)):
            if number:
                rows.append(_Row(("handler",), routine.source.row(body[0].span[0]) if body else 0, before))
            before = _add_rows(program, routine, body, before, rows)
        if rows:
            rows_by_name.setdefault(routine.key, []).extend(rows)
    return rows_by_name


def _add_rows(program: Program, routine: Routine, body: Sequence[Statement], before: int, rows: list[_Row]) -> int:
    """Append to ``rows`` the statements of a body that do not move the arm, blocks and what is inside them included.

    Args:
        before: number of motion statements of the routine in front of the body.

    Returns:
        The same number behind the body.
    """
    source = routine.source
    for statement in body:
        if program.motion(source, statement) is not None:
            before += 1
            continue
        # Of a block, the head: its body is compared statement by statement.
        spans = [statement.span]
        if statement.branches:
            spans = [*statement.parts, *(c for branch in statement.branches for c in branch.conditions)]
        text = " ".join([statement.kind, *(source.data[s:e].decode("latin-1") for s, e in spans)])
        line, end = (source.row(at) for at in (statement.span[0], statement.span[1] - 1))
        rows.append(_Row(words(text)[0 if statement.branches else 1 :], line, before))
        for number, branch in enumerate(statement.branches, 1):
            before = _add_rows(program, routine, branch.body, before, rows)
            rows.append(_Row(("end", "of", statement.kind, str(number)), end, before))
    return before


def compare_declarations(a: Program, b: Program) -> Iterator[Difference]:
    """Yield the differences of declared data other than targets: storage, type or the words of the value differ.

    Data of a routine that only one program has is left out: it is part of that routine's difference.
    """
    unpaired = {(r.module.lower(), r.name.lower()) for _, r in _unpaired_routines(a, b)}
    ours, theirs = (
        {
            d.key: d
            for d in p.declarations
            if d.type not in ("robtarget", "jointtarget") and (d.module.lower(), d.routine.lower()) not in unpaired
        }
        for p in (a, b)
    )
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
        lines = [d.source.row(d.span[0]) if d else None for d in (x, y)]
        if either is not None:
            row = (("value", texts[0], texts[1]),) if kind == "changed" else ()
            yield Difference(kind, "declaration", either.module, either.name, lines[0], lines[1], arguments=row)
