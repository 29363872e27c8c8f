"""What routines say and declare apart from motion, compared by words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from postproc.rapid.align import aligned
from postproc.rapid.difference import Difference
from postproc.rapid.program import Program, bodies, statements_in
from postproc.rapid.tokens import tokenize


def words(text: str) -> tuple[str, ...]:
    """The tokens of a piece of text without blanks and comments, in lower case but for strings."""
    data = text.encode("latin-1", "replace")
    return tuple(
        (piece if kind == "string" else piece.lower()).decode("latin-1")
        for kind, (start, end) in tokenize(data)
        if kind not in ("blank", "comment")
        for piece in (data[start:end],)
    )


def compare_statements(a: Program, b: Program) -> Iterator[Difference]:
    """Statements that do not move the arm, by their words."""
    ours, theirs = _plain(a), _plain(b)
    for place in dict.fromkeys([*ours, *theirs]):
        rows_a, rows_b = ours.get(place, []), theirs.get(place, [])
        if [row[0] for row in rows_a] == [row[0] for row in rows_b]:
            continue
        for x, y in aligned(rows_a, rows_b, lambda p, q: p[0] == q[0]):
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


def compare_declarations(a: Program, b: Program) -> Iterator[Difference]:
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
