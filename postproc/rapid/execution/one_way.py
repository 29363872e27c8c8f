"""One way through a program: every condition has an answer, every jump is made, every turn of a loop is run."""

from __future__ import annotations

import math
from collections.abc import Sequence

from postproc.rapid.data.values import Value
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.execution.interpreter import Interpreter
from postproc.rapid.flow.constants import counted
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.unknown import Unknown


class Stopped(Exception):
    """The program ends: at EXIT, at an error, or because enough of it has been run."""


class OneWay(Interpreter):
    """Takes one way through a program.

    Args:
        goal: the label, in lower case, to which the last GOTO leads; None once it is reached.
        taken: how many statements and turns of WHILE loops have been run; most: how many may be run.
    """

    assumed_decides = True
    goal: str | None = None
    taken = 0
    most = math.inf

    def enter(self, routine: Routine, memory: Memory) -> Value | Unknown | None:
        """Run a routine's body on ``memory`` and return its value, None if it returns nothing."""
        for declaration in routine.declarations:
            memory.initialise(declaration)
        self.body(routine.body, memory)
        self.goal = None
        return memory.frame.exits[-1].value if memory.frame.exits else None

    def body(self, statements: Sequence[Statement], memory: Memory) -> bool:
        """Run statements on ``memory`` and follow every GOTO to its label.

        Returns:
            Whether their end is reached; False with ``goal`` set if a GOTO leads to a label outside of them.
        """
        at, labels = 0, dict[str, int]()
        while at < len(statements):
            if self.statement(statements[at], memory):
                at += 1
                continue
            if self.goal is not None and not labels:
                labels = {s.word: i for i, s in reversed([*enumerate(statements)]) if s.kind == "label"}
            if self.goal is None or self.goal not in labels:
                return False
            at, self.goal = labels[self.goal], None
        return True

    def jump(self, statement: Statement, memory: Memory) -> bool:
        """Go on behind a label; at a GOTO set ``goal`` to its label and leave the body (False)."""
        if statement.kind == "goto":
            self.goal = statement.word
        return statement.kind == "label"

    def branches(self, statement: Statement, memory: Memory) -> bool:
        """Run the first arm of IF or TEST whose condition holds; False if its body is left."""
        subject = self.subject(statement, memory)
        for branch in statement.branches:
            if self.chosen(statement, branch.conditions, subject, memory):
                return self.body(branch.body, memory)
        return True

    def turns(self, loop: Statement, memory: Memory) -> bool:
        """Run all turns of a FOR loop; False if its body is left.

        Two turns are run if the bounds are not known, none if there are more than ``MAX_TURNS``.
        """
        bounds = [self.deciding(span, memory) for span in loop.parts]
        known = all(isinstance(bound, float) for bound in bounds)
        for index in (counted(*bounds) or ()) if known else (1.0, 2.0):
            memory.frame.bindings[loop.word] = Value(index, "num")
            if not self.body(loop.branches[0].body, memory):
                return False
        return True

    def while_loop(self, loop: Statement, memory: Memory) -> bool:
        """Run a WHILE loop as long as its condition holds; False if its body is left."""
        while not loop.parts or self.truth(loop.parts[0], memory):
            self.spend()
            if not self.body(loop.branches[0].body, memory):
                return False
        return True

    def spend(self) -> None:
        """Count one statement, or one turn of a WHILE loop.

        Raises:
            Stopped: more than ``most`` have been run.
        """
        self.taken += 1
        if self.taken > self.most:
            raise Stopped
