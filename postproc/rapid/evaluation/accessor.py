"""Data read and written by the text of the routine that runs, and parameters of a called routine bound to arguments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from postproc.diagnostics import Span
from postproc.rapid.data.events import ByValueArgument
from postproc.rapid.data.values import Data, Value, as_type
from postproc.rapid.evaluation.assign import forget, set_data, store
from postproc.rapid.evaluation.evaluate import evaluate
from postproc.rapid.evaluation.memory import Binding, CallFrame, Memory, Reference, part_of
from postproc.rapid.program.arguments import BY_REFERENCE, Piece, argument_name, paired
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.nodes import Routine, RoutineParameter
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
            tree = read_full_expression(source.data, *span)
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


Tree = Callable[[Span, Memory], Expression]


def unbound_frame(routine: Routine) -> CallFrame:
    """A call of a routine all of whose parameters are Unknown."""
    unknown = {p.name: Unknown(Kind.PARAMETER, p.name) for p in routine.parameters}
    return CallFrame(routine, dict(unknown))


def bound_frame(routine: Routine, pieces: Sequence[Piece], memory: Memory, tree: Tree) -> CallFrame:
    r"""A call with the parameters bound to arguments, which are evaluated in the caller's ``memory``.

    ``\Opt?name`` passes a parameter on only if the caller got it.

    Args:
        pieces: arguments of the call (option, span of expression, full span) in the file of the calling routine.
        tree: reads the expression at a span.
    """
    frame = CallFrame(routine, caller=memory.frame, conditional=memory.conditional, supposed=memory.frame.supposed)
    for parameter, span in paired(routine.parameters, pieces):
        if parameter.optional and not passed_on(span, memory):
            continue
        frame.present.add(parameter.name)
        if span[0] < span[1]:
            frame.bindings[parameter.name] = _binding(
                span, parameter, routine.parameter_key(parameter.name), memory, tree
            )
    for parameter in routine.parameters:
        if not parameter.optional and parameter.name not in frame.bindings:
            frame.bindings[parameter.name] = Unknown(Kind.PARAMETER, parameter.name)
    return frame


def passed_on(span: Span, memory: Memory) -> bool:
    r"""Whether the optional argument at a span counts: ``\Opt?name`` only if the present routine got ``name``."""
    data = memory.frame.routine.source.data
    words = data[span[0] : span[1]].decode("latin-1").strip().lower()
    return not data[max(0, span[0] - 80) : span[0]].rstrip().endswith(b"?") or words in memory.frame.present


def _binding(span: Span, parameter: RoutineParameter, key: str, memory: Memory, tree: Tree) -> Binding:
    """What one parameter is bound to: a reference to the caller's data, a value, or Unknown if there is none.

    Args:
        span: of the argument in the caller's file; key: ``module.routine.%name`` of the parameter.
    """
    try:
        expression = tree(span, memory)
        reference = _reference(expression, memory) if parameter.mode in BY_REFERENCE else None
        if reference is not None:
            return reference
        value = evaluate(expression, memory)
        value = value if value.type else replace(value, type=parameter.type)  # an aggregate
        if parameter.type in ("num", "dnum"):
            value = replace(value, data=as_type(value.data, parameter.type), type=parameter.type)
    except Unknown as error:
        return error.kept()
    if parameter.mode or parameter.type != "robtarget":
        return value if value.handed is None else replace(value, handed=None)
    first = value.handed or ByValueArgument(memory.frame.routine.source, span, ())
    return replace(value, handed=replace(first, parameters=(*first.parameters, key)))


def _reference(tree: Expression, memory: Memory) -> Reference | None:
    """Caller's data for which a parameter by reference stands; None if the argument is no name or part of one."""
    part = part_of(tree, memory)
    if part is None:
        return None
    name, path, causes = part
    bound = memory.frame.bindings.get(name)
    if isinstance(bound, Reference):
        return Reference(bound.declaration, (*bound.path, *path), joined_causes(bound.assumed, causes))
    declaration = memory.find(name) if bound is None else None
    return Reference(declaration, path, causes) if declaration is not None else None
