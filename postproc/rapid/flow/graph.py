"""The flow of control of a routine: blocks of steps, and which may run after which."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from postproc.rapid.data.values import Data
from postproc.rapid.flow.constants import Constants, counted
from postproc.rapid.flow.steps import Step, StepReader, Write
from postproc.rapid.syntax.nodes import Branch, Routine, Statement

EXIT = 1  # the block at which all ways end by which a routine is left


@dataclass(slots=True)
class FlowBlock:
    """Steps that run one after the other, and the indices of the blocks of which one runs next."""

    steps: list[Step] = field(default_factory=list)
    then: list[int] = field(default_factory=list)


@dataclass(slots=True)
class Graph:
    """The flow of control in a routine, which begins at its first block and ends at the block ``EXIT``.

    Args:
        handlers: index of the first block of each handler; inside: blocks from this index on belong to handlers.
        retries, skips, raises: whether a handler may repeat the statement that failed (RETRY), go on behind it
            (TRYNEXT), or leave the error to the caller's handler (RAISE).
        open: whether anything but constants of the text decides which way is taken.
        counters: names of the routine's loop counters.
    """

    blocks: list[FlowBlock]
    handlers: list[int] = field(default_factory=list)
    inside: int = 0
    retries: bool = False
    skips: bool = False
    raises: bool = False
    open: bool = False
    counters: set[str] = field(default_factory=set)


def draw(routine: Routine, reader: StepReader, constants: Constants) -> Graph:
    """The flow graph of a routine's body and handlers.

    Args:
        reader: gives the steps of a statement; constants: evaluates conditions and bounds of loops.
    """
    return _Drawing(routine, reader, constants).graph


class _Drawing:
    """Draws the flow graph of a routine.

    Args:
        now: index of the block to which the next step is appended; None behind a statement that leaves.
        labels: index of the block that begins at each label.
        counters: names of the counters of the loops around the present statement.
    """

    def __init__(self, routine: Routine, reader: StepReader, constants: Constants) -> None:
        """Draw the whole graph of a routine: its body from block 0 to ``EXIT``, then its handlers."""
        self.routine, self.reader, self.constants = routine, reader, constants
        self.graph = Graph([FlowBlock(), FlowBlock()])
        self.labels: dict[str, int] = {}
        self.counters: list[str] = []  # of the loops that are running
        self.now: int | None = 0
        self.body(routine.body)
        self.leave(EXIT)
        self.graph.inside = len(self.graph.blocks)
        for handler in routine.handlers:
            self.now = self.block()
            self.graph.handlers.append(self.now)
            self.graph.open = True
            self.body(handler)
            self.leave(EXIT)

    def block(self) -> int:
        """Append an empty block to the graph and return its index."""
        self.graph.blocks.append(FlowBlock())
        return len(self.graph.blocks) - 1

    def leave(self, to: int) -> None:
        """Add an edge from the present block to block ``to``; no block is the present one afterwards."""
        if self.now is not None:
            self.graph.blocks[self.now].then.append(to)
        self.now = None

    def step(self, steps: Iterable[Step]) -> None:
        """Append steps to the present block; they are dropped if there is none (behind a jump or RETURN)."""
        if self.now is not None:
            self.graph.blocks[self.now].steps += steps

    def body(self, statements: Sequence[Statement]) -> None:
        """Add the statements to the graph; behind a jump, those without label or branches are skipped."""
        for statement in statements:
            if self.now is not None or statement.kind == "label" or statement.branches:
                self.statement(statement)

    def statement(self, statement: Statement) -> None:
        """Add one statement to the graph, with its blocks and edges if it branches, loops or jumps."""
        match statement.kind:
            case "if" | "test":
                self.branches(statement)
            case "for":
                self.for_loop(statement)
            case "while":
                self.while_loop(statement)
            case "label":
                at = self.label(statement.word)
                self.leave(at)
                self.now = at
            case "goto":
                self.step([Write(frozenset(f"#{name}" for name in self.counters))] if self.counters else ())
                self.leave(self.label(statement.word))
            case "return":
                self.step(self.reader.functions(statement, self.routine))
                self.leave(EXIT)
            case "leave":
                self.out(statement)
            case _:
                self.step(self.reader.steps(statement, self.routine))

    def label(self, word: str) -> int:
        """Index of the block that begins at a label; the block is made if it does not exist yet.

        Args:
            word: the label in lower case.
        """
        if word not in self.labels:
            self.labels[word] = self.block()
        return self.labels[word]

    def out(self, statement: Statement) -> None:
        """Add RETRY, TRYNEXT, RAISE, EXIT or ExitCycle: nothing runs behind it. The graph records the first three."""
        text = self.routine.source.data[slice(*statement.span)].lower()
        self.graph.retries |= text.startswith(b"retry")
        self.graph.skips |= text.startswith(b"trynext")
        self.graph.raises |= text.startswith(b"raise")
        self.now = None

    def branches(self, statement: Statement) -> None:
        """Add IF or TEST with an edge to each arm that constants do not rule out."""
        self.step(self.reader.functions(statement, self.routine))
        start, behind = self.now, self.block()
        for branch in statement.branches:
            verdict = self.verdict(statement, branch)
            self.graph.open |= verdict is None
            self.now = start if verdict is not False else None
            if self.now is not None:
                arm = self.block()
                self.leave(arm)
                self.now = arm
            self.body(branch.body)
            self.leave(behind)
            if verdict is True:
                start = None
        self.now = start
        self.leave(behind)
        self.now = behind

    def verdict(self, statement: Statement, branch: Branch) -> bool | None:
        """Whether an arm is taken once it is reached; True for ELSE and DEFAULT, None if constants do not decide.

        Args:
            statement: IF or TEST; branch: the arm.
        """
        hidden = frozenset(self.counters)
        if not branch.conditions:
            return True
        if statement.kind == "if":
            return self.constants.truth(self.routine, branch.conditions[0], hidden)
        return self.constants.is_case(self.routine, statement.parts[0], branch.conditions, hidden)

    def for_loop(self, loop: Statement) -> None:
        """Add a FOR loop: its body may be skipped or repeated unless constants decide how often it runs."""
        self.step(self.reader.functions(loop, self.routine))
        bounds = [self.constants.value(self.routine, span, frozenset(self.counters)) for span in loop.parts]
        turns = _turns(bounds)
        self.graph.open |= turns is None
        start, body, behind = self.now, self.block(), self.block()
        again = Write(frozenset([f"#{loop.word}"]))
        if turns is None and start is not None:
            self.graph.blocks[start].then.append(behind)
        if turns == 0:
            self.leave(behind)
        self.leave(body)
        self.now = body
        self.step([again])
        self.counters.append(loop.word)
        self.graph.counters.add(loop.word)
        self.body(loop.branches[0].body)
        self.counters.pop()
        self.step([again])
        if self.now is not None and turns != 1:
            self.graph.blocks[self.now].then.append(body)
        self.leave(behind)
        self.now = behind

    def while_loop(self, loop: Statement) -> None:
        """Add a WHILE loop: its body may be skipped or repeated unless constants decide its condition."""
        head, body, behind = self.block(), self.block(), self.block()
        self.leave(head)
        self.now = head
        self.step(self.reader.functions(loop, self.routine))
        holds = self.constants.truth(self.routine, loop.parts[0], frozenset(self.counters)) if loop.parts else True
        self.graph.open |= holds is None
        if holds is not True:
            self.graph.blocks[head].then.append(behind)
        if holds is not False:
            self.graph.blocks[head].then.append(body)
        self.now = body
        self.body(loop.branches[0].body)
        self.leave(head)
        self.now = behind


def _turns(bounds: Sequence[Data | None]) -> int | None:
    """How often a FOR loop runs: 0, 1, or 2 for two turns and more; None if a bound is not constant.

    Args:
        bounds: first and last value of the index and, if it is given, the step; None if not constant.
    """
    numbers = [bound for bound in bounds if isinstance(bound, float)]
    if len(numbers) < len(bounds):
        return None
    found = counted(*numbers)
    return 2 if found is None else min(len(found), 2)
