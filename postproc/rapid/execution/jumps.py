"""Loops and branches that are written with GOTO."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from postproc.diagnostics import Span
from postproc.rapid.program.program import statements_in
from postproc.rapid.syntax.nodes import Branch, Statement

UNTIL = "until"  # word of a loop that ends when its condition holds
MOST_SEEN = 50  # times the statements of a body: jumps across one another could make their square or more to look at

Jump = tuple[Statement, tuple[Statement, ...]]


def structured(body: tuple[Statement, ...], jumps: Mapping[str, int]) -> tuple[Statement, ...]:
    """The statements of a body in which loops and branches written with GOTO are replaced by WHILE and IF statements.

    ``l: S; IF c GOTO l;`` is S and then ``WHILE c`` S; ``l: S; GOTO l;`` is a loop without end; ``IF c GOTO l; S; l:``
    runs S unless c holds; ``l: S; IF c GOTO m; T; GOTO l; m:`` is S and then, as long as c does not hold, T and S.

    Args:
        jumps: number of GOTO statements by label; only a label with exactly one is rewritten.
    """
    if not jumps or not any(s.kind == "label" for s in body):
        return body
    rewritten = _Rewritten(body, jumps)
    while rewritten.at < len(body):
        rewritten.take(body[rewritten.at])
    return tuple(rewritten.steps)


class _Rewritten:
    """The statements of a body up to a place, with loops and branches in place of their jumps.

    Args:
        labels: by label, its index in ``steps`` and its statement.
        ahead: by label that has not come yet, index in ``steps`` and statement of the conditional jump to it.
        sizes: how many statements each of the steps contains, itself included.
        spare: how many statements may still be looked at.
    """

    def __init__(self, body: tuple[Statement, ...], jumps: Mapping[str, int]) -> None:
        """Start before the first statement of the body; ``jumps`` counts the GOTO statements by label."""
        self.body, self.jumps, self.at = body, jumps, 0
        self.steps: list[Statement] = []
        self.sizes: list[int] = []
        self.labels: dict[str, tuple[int, Statement]] = {}
        self.ahead: dict[str, tuple[int, Statement]] = {}
        self.spare = MOST_SEEN * len(body)

    def take(self, statement: Statement) -> None:
        """Append the next statement of the body to ``steps``; a loop or branch that it closes replaces its steps."""
        self.at += 1
        alone = self.jumps.get(statement.word) == 1
        if statement.kind == "label":
            if not (alone and self.skips(statement)):
                self.labels[statement.word] = len(self.steps), statement
                self.replace_from(len(self.steps), [statement])
            return
        jump = _jump(statement)
        if jump is not None and self.jumps.get(jump[0].word) == 1:
            if self.place(self.labels, jump[0].word) is not None:
                if self.loops(statement, jump):
                    return
            elif statement is not jump[0]:
                self.ahead[jump[0].word] = len(self.steps), statement
        self.replace_from(len(self.steps), [statement])

    def replace_from(self, at: int, steps: Sequence[Statement]) -> None:
        """Replace all steps from index ``at`` on by the given ones."""
        self.steps[at:] = steps
        self.sizes[at:] = [len(statements_in([step])) if step.branches else 1 for step in steps]

    def place(self, places: Mapping[str, tuple[int, Statement]], word: str) -> int | None:
        """Index in ``steps`` of a label, or of the jump to it; None if it has become part of a loop or branch.

        Args:
            places: ``labels`` or ``ahead``; word: the label in lower case.
        """
        at, statement = places.get(word, (0, None))
        return at if at < len(self.steps) and self.steps[at] is statement else None

    def within_budget(self, at: int) -> bool:
        """Subtract the number of statements from step ``at`` on from the budget ``spare``; False if it is exceeded."""
        self.spare -= sum(self.sizes[at:])
        return self.spare >= 0

    def skips(self, label: Statement) -> bool:
        """Put a branch in place of a conditional jump and the steps up to its label; False if that is not possible."""
        at = self.place(self.ahead, label.word)
        if at is None or not self.within_budget(at):
            return False
        statement, part = self.steps[at], tuple(self.steps[at + 1 :])
        jump = _jump(statement)
        if jump is None or any(self.leads_before(s, at) for s in part):
            return False
        span, branch = (statement.span[0], label.span[1]), Branch(statement.branches[0].conditions, jump[1])
        self.replace_from(at, [Statement("if", span, "", (), (branch, Branch((), part)))])
        return True

    def leads_before(self, statement: Statement, at: int) -> bool:
        """Whether a statement is a jump back to a label before step ``at``."""
        jump = _jump(statement)
        place = self.place(self.labels, jump[0].word) if jump is not None else None
        return place is not None and place < at

    def loops(self, statement: Statement, jump: Jump) -> bool:
        """Put a loop in place of the steps between a label and the jump back to it; False if that is not possible.

        Args:
            statement: holds the jump; jump: the GOTO, and what the statement does before it.
        """
        at = self.labels[jump[0].word][0]
        if not self.within_budget(at):
            return False
        part, (goto, before) = tuple(self.steps[at + 1 :]), jump
        span = self.steps[at].span[0], statement.span[1]
        gone = Statement("placeholder", self.steps[at].span)  # what follows the label keeps its place
        conditions = statement.branches[0].conditions if statement is not goto else ()
        if not conditions:
            if turns := self.until(part, span):
                self.replace_from(at, [gone, *turns])
                self.at += 1
                return True
            inside = {s.word for s in part if s.kind == "label"}
            if any(s.kind == "goto" and s.word not in inside for s in statements_in(part)):
                return False  # it leads out of the loop, nobody knows when
        loop = Statement("while", span, "", conditions, (Branch(conditions, (*before, *part)),))
        self.replace_from(at, [gone, *part, loop] if conditions else [loop])
        return True

    def until(self, part: tuple[Statement, ...], span: Span) -> tuple[Statement, ...]:
        """Steps of an endless loop that a conditional jump leaves to the label right behind it, with a loop UNTIL.

        Args:
            part: statements of the loop; span: of the loop statement to make.

        Returns:
            The steps in place of ``part``; empty if no condition leads out of the loop that way.
        """
        after = self.body[self.at] if self.at < len(self.body) else None
        if after is None or after.kind != "label" or self.jumps.get(after.word) != 1:
            return ()
        for k, statement in enumerate(part):
            jump = _jump(statement)
            if jump and statement.kind == "if" and jump[0].word == after.word:
                conditions = statement.branches[0].conditions
                loop = Statement("while", span, UNTIL, conditions, (Branch(conditions, (*part[k + 1 :], *part[:k])),))
                return (*part[:k], loop, *jump[1])
        return ()


def _jump(statement: Statement) -> Jump | None:
    """The GOTO that a statement is, or with which its only branch ends; None for other statements.

    Returns:
        The GOTO, and the statements before it in the branch.
    """
    if statement.kind == "goto":
        return statement, ()
    if statement.kind != "if" or len(statement.branches) != 1 or not statement.branches[0].body:
        return None
    *before, last = statement.branches[0].body
    return (last, tuple(before)) if last.kind == "goto" else None
