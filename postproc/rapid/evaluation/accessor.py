"""Data read and written by the text of the routine that runs: expressions evaluated, assignments, counters."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.diagnostics import Span
from postproc.rapid.data.values import Data, Value
from postproc.rapid.evaluation.assign import forget, set_data, store
from postproc.rapid.evaluation.evaluate import evaluate
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.program.arguments import Piece, argument_name
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.trees import Expression
from postproc.rapid.unknown import Assumed, Kind, Unknown, assumed_for, joined_causes, without_causes

MAX_TREES = 20_000  # expressions kept for the next time they are executed


class Accessor:
    """Reads and writes data by spans of the present routine's file; trees of expressions are kept."""

    def __init__(self) -> None:
        """Start without any trees."""
        self.trees: dict[tuple[str, Span], Expression] = {}

    def tree(self, span: Span, memory: Memory) -> Expression:
        """The expression at a byte span of the file of the routine that runs; read once and kept.

        Raises:
            Unknown: the text is no expression.
        """
        source = memory.frame.routine.source
        tree = self.trees.get((source.path, span))
        if tree is None:
            tree = read_whole_expression(source.data, *span)
            if len(self.trees) < MAX_TREES:
                self.trees[source.path, span] = tree
        return tree

    def value(self, span: Span, memory: Memory) -> Data:
        """Data of the expression at a byte span, whether certain or only assumed.

        Raises:
            Unknown: the text alone does not give it.
        """
        return evaluate(self.tree(span, memory), memory).data

    def value_or_not(self, span: Span, memory: Memory) -> Data:
        """Value of the expression at a span: the bare data if certain, ``Assumed`` if not certain, else ``Unknown``."""
        value = self.evaluated(span, memory)
        if isinstance(value, Unknown):
            return value
        return Assumed(value.data, value.assumed) if value.assumed else value.data

    def evaluated(self, span: Span, memory: Memory) -> Value | Unknown:
        """Value of the expression at a span with type and causes of doubt; Unknown is returned, not raised."""
        try:
            return evaluate(self.tree(span, memory), memory)
        except Unknown as error:
            return error.kept()

    def assign(self, span: Span, data: Data, memory: Memory) -> None:
        """Write data to the variable, element or component that the text at a byte span names.

        If it is not known which part that is, the whole variable becomes unknown.
        """
        try:
            store(self.tree(span, memory), data, memory)
        except Unknown:
            forget(memory, memory.keys_of(argument_name(memory.frame.routine.source.data, span)), Kind.UNCERTAIN)

    def count(self, word: str, pieces: Sequence[Piece], memory: Memory) -> None:
        """Carry out Incr, Decr, Add or Clear (``word``, lower case) on the data that the first argument names.

        Args:
            pieces: arguments of the instruction.
        """
        if not pieces:
            return
        now = self.value_or_not(pieces[0][1], memory)
        step = self.value_or_not(pieces[1][1], memory) if word == "add" and len(pieces) > 1 else 1.0
        (now, first), (step, second) = without_causes(now), without_causes(step)
        data: Data = Unknown(Kind.COUNTER)
        if word == "clear":
            data = 0.0
        elif isinstance(now, float) and isinstance(step, float):
            data = assumed_for(now - step if word == "decr" else now + step, joined_causes(first, second))
        self.assign(pieces[0][1], data, memory)

    def by_name(self, word: str, pieces: Sequence[Piece], memory: Memory) -> bool:
        """Carry out GetDataVal or SetDataVal, whose first argument is the name of data as a text.

        Args:
            word: the instruction in lower case; pieces: its arguments.

        Returns:
            False if the data or the instruction is not known: then nothing is written.
        """
        plain = [span for option, span, _ in pieces if not option]
        name = self.value_or_not(plain[0], memory) if len(plain) == len(pieces) == 2 else None
        module = memory.frame.routine.module
        declaration = memory.program.declaration(name, module) if isinstance(name, str) else None
        if declaration is None or word not in ("getdataval", "setdataval"):
            return False
        if word == "getdataval":
            try:
                value = memory.value(declaration)
                self.assign(plain[1], assumed_for(value.data, value.assumed), memory)
            except Unknown as error:
                self.assign(plain[1], error.kept(), memory)
        elif declaration.storage != "CONST":
            set_data(declaration, self.value_or_not(plain[1], memory), memory)
        return True
