"""One way through functions that only calculate: every condition and every bound of a loop has a value."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.rapid.data.values import Value
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.execution.interpreter import Interpreter
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.unknown import Unknown


class OneWay(Interpreter):
    """Takes one way through a program without WHILE, GOTO and labels.

    Args:
        taken: how many statements have been run.
    """

    assumed_decides = True
    taken = 0

    def enter(self, routine: Routine, memory: Memory) -> Value | Unknown | None:
        """Run a routine's body on ``memory`` and return its value, None if it returns nothing."""
        for declaration in routine.declarations:
            memory.initialise(declaration)
        self.body(routine.body, memory)
        return memory.frame.exits[-1].value if memory.frame.exits else None

    def body(self, statements: Sequence[Statement], memory: Memory) -> bool:
        """Run statements on ``memory``; False if one of them leaves them."""
        return all(self.statement(statement, memory) for statement in statements)

    def branches(self, statement: Statement, memory: Memory) -> bool:
        """Run the first arm of IF or TEST whose condition holds; False if its body is left."""
        subject = self.subject(statement, memory)
        for branch in statement.branches:
            if self.chosen(statement, branch.conditions, subject, memory):
                return self.body(branch.body, memory)
        return True

    def turns(self, loop: Statement, memory: Memory) -> bool:
        """Run all turns of a FOR loop, none if its bounds are not known; False if its body is left."""
        for index in self.indices(loop, memory) or ():
            memory.frame.bindings[loop.word] = Value(index, "num")
            if not self.body(loop.branches[0].body, memory):
                return False
        return True

    def while_loop(self, loop: Statement, memory: Memory) -> bool:
        """Not run here."""
        raise NotImplementedError

    def jump(self, statement: Statement, memory: Memory) -> bool:
        """Not run here."""
        raise NotImplementedError
