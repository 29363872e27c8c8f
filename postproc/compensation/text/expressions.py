"""Targets as expressions: how an offset goes into one."""

from __future__ import annotations

from dataclasses import dataclass

from postproc.compensation.text.values import Form
from postproc.diagnostics import Source, Span
from postproc.rapid.motions.regressors import DATA_NAME
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.trees import Call, Expression
from postproc.rapid.unknown import Unknown

DISPLACING = ("offs", "reltool")
AMOUNTS = 3  # along x, y, z


@dataclass(frozen=True, slots=True)
class TargetExpression:
    """How the text of a target argument can be changed.

    Args:
        form: how an offset is written, None where there is no way.
        in_tool: the offset is along the axes of the tool.
    """

    form: Form | None
    in_tool: bool = False


def target_expression(source: Source, span: Span, program: Program) -> TargetExpression:
    """How an offset can be put into the target expression at ``span`` (begin and end in the text of ``source``).

    That depends on whether the program declares an ``Offs`` or ``RelTool`` of its own.
    """
    text = source.data[slice(*span)].decode("latin-1")
    module, routine = program.place(source, span[0])
    own = {name for name in DISPLACING if program.hides(name, module, routine)}
    around: Form | None = None if "offs" in own else "offset"
    if text[:1] == "[":
        return TargetExpression(around)
    if DATA_NAME.fullmatch(text) is not None:
        return TargetExpression(around or "components")
    try:
        tree = read_whole_expression(source.data, *span)
    except Unknown:
        return TargetExpression(around)
    if amounts_of(tree) and isinstance(tree, Call) and tree.name not in own:
        return TargetExpression("amounts", tree.name == "reltool")
    return TargetExpression(around)


def amounts_of(tree: Expression) -> tuple[Expression, ...]:
    """The displacements along x, y, z in a call of ``Offs``, or of ``RelTool`` without rotations.

    Empty for any other expression.
    """
    if isinstance(tree, Call) and tree.name in DISPLACING and not tree.options and len(tree.arguments) == 1 + AMOUNTS:
        return tree.arguments[1:]
    return ()
