"""What a called routine gets: its parameters bound to the caller's arguments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from postproc.diagnostics import Span
from postproc.rapid.data.events import ByValueArgument
from postproc.rapid.data.values import as_type
from postproc.rapid.evaluation.evaluate import evaluate
from postproc.rapid.evaluation.memory import Binding, CallFrame, Memory, Reference, part_of
from postproc.rapid.program.arguments import BY_REFERENCE, Piece, paired
from postproc.rapid.syntax.nodes import Routine, RoutineParameter
from postproc.rapid.syntax.trees import Expression
from postproc.rapid.unknown import Kind, Unknown, joined_causes

Tree = Callable[[Span, Memory], Expression]


def unbound_frame(routine: Routine) -> CallFrame:
    """A call of a routine all of whose parameters are Unknown."""
    unknown = {p.name: Unknown(Kind.PARAMETER, p.name) for p in routine.parameters}
    return CallFrame(routine, dict(unknown))


def bound_frame(routine: Routine, pieces: Sequence[Piece], memory: Memory, tree: Tree) -> CallFrame:
    r"""A call with the parameters bound to arguments, which are evaluated in the caller's ``memory``.

    ``\Opt?name`` passes a parameter on only if the caller got it.

    Args:
        pieces: arguments of the call (option, span of expression, span of whole) in the file of the calling routine.
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
