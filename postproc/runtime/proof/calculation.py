"""A module of functions run for numbers by the package's interpreter: nothing is open, and errors are handled.

What has no value is an error of RAPID: the ERROR handler of the routine takes it, or of the routine that called it.
"""

from __future__ import annotations

from collections.abc import Sequence

from postproc.diagnostics import Diagnostic, PostprocError, Source, Span
from postproc.rapid.data.arm import ControllerArm
from postproc.rapid.data.values import Data, Value
from postproc.rapid.evaluation.accessor import Accessor, unbound_frame
from postproc.rapid.evaluation.evaluate import evaluate, pick
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.evaluation.state import AT_START
from postproc.rapid.execution.interpreter import Interpreter
from postproc.rapid.program.program import read_program
from postproc.rapid.syntax.nodes import Declaration, Routine, Statement
from postproc.rapid.syntax.trees import Name
from postproc.rapid.unknown import Kind, Unknown, without_causes

OPERATOR_MESSAGES = frozenset({"errwrite", "tpwrite", "tperase"})
"""Procedures that tell an operator something."""
ERRORS = frozenset({
    Kind.UNDEFINED, Kind.UNDEFINED_OPERATOR, Kind.CONTROLLER_FUNCTION, Kind.NO_SUCH_ELEMENT, Kind.NO_ELEMENT,
    Kind.NUMBER_EXPECTED, Kind.NEVER_TAUGHT, Kind.NO_FRAME, Kind.NOT_UNIT, Kind.CONFIGURATION,
})  # fmt: skip
"""Why something has no value on a controller either; all else this interpreter cannot work out."""


class RapidError(Exception):
    """A RAPID error that no ERROR handler has taken so far."""


class Calculation(Interpreter):
    """Runs the functions of RAPID modules again and again; module data keeps its values between calls.

    Every condition and every bound of a loop has a value, so that there is one way through a function.

    Args:
        sources: the files; no two of them declare data or routines of one name.
        arm: calculates CalcRobT and CalcJointT (protocol `rapid.data.arm.Arm`).

    Raises:
        PostprocError: a file cannot be read, or holds what is not calculated here (RUN003).
    """

    assumed_decides = True
    taken = 0  # statements that have been run

    def __init__(self, sources: Sequence[Source], arm: ControllerArm) -> None:
        program = read_program(sources, arm=arm)
        errors = [d for d in program.diagnostics if d.severity == "error"]
        if errors:
            raise PostprocError(errors)
        super().__init__(program)
        self.data = self.values = _Values()
        routine = next(program.all_routines())
        self.caller = _Data(program, self.changes, self.constants, unbound_frame(routine), self.function)
        self.caller.changed = dict(AT_START)

    def declaration(self, name: str) -> Declaration | None:
        """The declaration of module data with that name, None if there is none."""
        return next((d for d in self.program.declarations if not d.routine and d.name.lower() == name.lower()), None)

    def set(self, name: str, data: Data) -> None:
        """Assign a value to module data of that name; nothing happens if there is none."""
        declaration = self.declaration(name)
        if declaration is not None:
            self.caller.changed[declaration.key] = data

    def get(self, name: str) -> Data:
        """The value of module data, None if there is none of that name."""
        declaration = self.declaration(name)
        return None if declaration is None else self.caller.value(declaration).data

    def run(self, name: str) -> int:
        """Run a procedure without parameters, and return the number of statements executed.

        Raises:
            RapidError: an error is not handled.
        """
        routine = self.program.routine(name)
        assert routine is not None
        self.taken = 0
        self.call_routine(routine, (), self.caller)
        return self.taken

    def enter(self, routine: Routine, memory: Memory) -> Value | Unknown | None:
        """Run a routine and return its value, if any; its first ERROR handler takes an error and then gives it."""
        for declaration in routine.declarations:
            memory.initialise(declaration)
        try:
            self.body(routine.body, memory)
        except RapidError:
            if not routine.handlers:
                raise
            self.body(routine.handlers[0], memory)
        exits = memory.frame.exits
        return exits[-1].value if exits else None

    def body(self, statements: Sequence[Statement], memory: Memory) -> bool:
        """Run statements on ``memory``; False if one of them leaves them."""
        return all(self.statement(statement, memory) for statement in statements)

    def branches(self, statement: Statement, memory: Memory) -> bool:
        """Run the first arm of IF whose condition holds; False if its body is left."""
        for branch in statement.branches:
            if self.chosen(statement, branch.conditions, (), memory):
                return self.body(branch.body, memory)
        return True

    def turns(self, loop: Statement, memory: Memory) -> bool:
        """Run all turns of a FOR loop, none if its bounds are not known; False if its body is left."""
        for index in self.indices(loop, memory) or ():
            memory.frame.bindings[loop.word] = Value(index, "num")
            if not self.body(loop.branches[0].body, memory):
                return False
        return True

    def statement(self, statement: Statement, memory: Memory) -> bool:
        """Run one statement and count it; False if it leaves the body in which it stands.

        Raises:
            PostprocError: RUN003, it is no assignment, IF, FOR, RETURN or call.
        """
        self.taken += 1
        self.values.place = statement.span
        if statement.kind not in ("assign", "if", "for", "while", "goto", "label", "return", "call"):
            raise _cannot(memory, statement.span, "this statement is not calculated here")
        return super().statement(statement, memory)

    def while_loop(self, loop: Statement, memory: Memory) -> bool:
        """Refuse a WHILE loop: how often it turns is not bounded.

        Raises:
            PostprocError: RUN003.
        """
        raise _cannot(memory, loop.span, "this statement is not calculated here")

    def jump(self, statement: Statement, memory: Memory) -> bool:
        """Refuse GOTO and labels.

        Raises:
            PostprocError: RUN003.
        """
        raise _cannot(memory, statement.span, "this statement is not calculated here")

    def call(self, statement: Statement, memory: Memory) -> None:
        """Run a procedure call; those that only write to the operator do nothing.

        Raises:
            PostprocError: RUN003, the procedure is not in the program.
        """
        if statement.word in OPERATOR_MESSAGES:
            return
        if self.program.routine(statement.word, memory.frame.routine.module) is None:
            raise _cannot(memory, statement.span, f"`{statement.word}` is not calculated here")
        super().call(statement, memory)

    def decide(self, condition: Span, memory: Memory) -> bool:
        """Refuse a condition that is no truth value.

        Raises:
            PostprocError: RUN003.
        """
        raise _cannot(memory, condition, "this condition is no truth value")


class _Values(Accessor):
    """Evaluates expressions, all of which must have a value."""

    def __init__(self) -> None:
        super().__init__()
        self.place: Span = (0, 0)

    def evaluated(self, span: Span, memory: Memory) -> Value:
        """The value of the expression at a place of the running routine.

        Raises:
            RapidError: it is an error on a controller, too.
            PostprocError: RUN003, it cannot be evaluated here.
        """
        place = self.place
        try:
            return evaluate(self.tree(span, memory), memory)
        except Unknown as why:
            if why.root.kind not in ERRORS or isinstance(why.__cause__, TypeError):
                raise _cannot(memory, place, why.reason) from None
            raise RapidError(why.reason) from None


class _Data(Memory):
    """Memory in which data has the value of its declaration until something is assigned to it."""

    def value(self, declaration: Declaration) -> Value:
        """The current value of declared data.

        Raises:
            Unknown: it has none.
        """
        data = without_causes(self.changed.get(declaration.key))[0]
        if data is None:
            return self.declared(declaration)
        if isinstance(data, Unknown):
            raise data.kept()
        return Value(data, declaration.type, len(declaration.dims))

    def element(self, name: Name, indices: tuple[int, ...]) -> Value:
        """The value of one element of array data, by indices as RAPID counts them."""
        return pick(self.lookup(name), indices)


def _cannot(memory: Memory, span: Span, text: str) -> PostprocError:
    """RUN003 at a place in the routine that runs: ``text`` says what cannot be calculated."""
    help_ = "check modules that `postproc runtime write` wrote"
    return PostprocError([Diagnostic("RUN003", "error", text, memory.frame.routine.source, span, help_)])
