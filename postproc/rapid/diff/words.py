"""What routines say and declare apart from motion, compared by words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from postproc.rapid.diff.align import aligned
from postproc.rapid.diff.difference import Difference
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import tokenize

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
        yield Difference(
            kind, "statement", f"{routine.module}.{routine.name}", f"{routine.kind} {routine.name}", *lines
        )
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
