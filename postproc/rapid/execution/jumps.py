"""Loops and branches that are written with GOTO."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from postproc.diagnostics import Span
from postproc.rapid.program.program import statements_in, statements_of
from postproc.rapid.syntax.nodes import Branch, Routine, Statement

UNTIL = "until"  # word of a loop that ends when its condition holds


def jumps_in(routine: Routine) -> Mapping[str, int]:
    """How many GOTOs lead to each label of a routine."""
    return Counter(s.word for s in statements_of(routine) if s.kind == "goto")


def structured(body: tuple[Statement, ...], jumps: Mapping[str, int]) -> tuple[Statement, ...]:
    """A body with jumps between its own statements as what they do, where no other leads to the same label.

    ``l: S; IF c GOTO l;`` is S and then ``WHILE c`` S; ``l: S; GOTO l;`` is a loop without end; ``IF c GOTO l; S; l:``
    runs S unless c holds; ``l: S; IF c GOTO m; T; GOTO l; m:`` is S and then, as long as c does not hold, T and S.
    """
    if not jumps:
        return body
    labels = {s.word: i for i, s in enumerate(body) if s.kind == "label" and jumps.get(s.word) == 1}
    for j, statement in enumerate(body if labels else ()):
        jump = _jump(statement)
        i = labels.get(jump[0].word) if jump is not None else None
        if jump is None or i is None:
            continue
        (goto, before), part = jump, body[min(i, j) + 1 : max(i, j)]
        span = (min(body[i].span[0], statement.span[0]), max(body[i].span[1], statement.span[1]))
        conditions = statement.branches[0].conditions if statement is not goto else ()
        if i < j:
            if not conditions and (turns := _until(part, body[j + 1 :], labels, span)):
                return structured((*body[:i], *turns, *body[j + 2 :]), jumps)
            inside = {s.word for s in part if s.kind == "label"}
            if not conditions and any(s.kind == "goto" and s.word not in inside for s in statements_in(part)):
                continue  # it leads out of the loop, nobody knows when
            loop = Statement("while", span, "", conditions, (Branch(conditions, (*before, *part)),))
            return structured((*body[:i], *(part if conditions else ()), loop, *body[j + 1 :]), jumps)
        if conditions and not any(_leads_before(s, body[:j]) for s in part):
            skip = Statement("if", span, "", (), (Branch(conditions, before), Branch((), part)))
            return structured((*body[:j], skip, *body[i + 1 :]), jumps)
    return body


def _until(
    part: tuple[Statement, ...], after: tuple[Statement, ...], labels: Mapping[str, int], span: Span
) -> tuple[Statement, ...]:
    """A part that is repeated until a condition in it leads to the label directly after it; empty if it is none."""
    for k, statement in enumerate(part):
        jump = _jump(statement)
        if jump and statement.kind == "if" and jump[0].word in labels and after and after[0].word == jump[0].word:
            conditions = statement.branches[0].conditions
            loop = Statement("while", span, UNTIL, conditions, (Branch(conditions, (*part[k + 1 :], *part[:k])),))
            return (*part[:k], loop, *jump[1])
    return ()


def _leads_before(statement: Statement, body: tuple[Statement, ...]) -> bool:
    """Whether a statement jumps back to a label of the body before it: what it skips is part of a loop."""
    jump = _jump(statement)
    return jump is not None and any(s.kind == "label" and s.word == jump[0].word for s in body)


def _jump(statement: Statement) -> tuple[Statement, tuple[Statement, ...]] | None:
    """The GOTO with which a statement or its only branch ends, and what that branch does before."""
    if statement.kind == "goto":
        return statement, ()
    if statement.kind != "if" or len(statement.branches) != 1 or not statement.branches[0].body:
        return None
    *before, last = statement.branches[0].body
    return (last, tuple(before)) if last.kind == "goto" else None
