"""Targets as expressions: how an offset goes into one."""

from __future__ import annotations

from dataclasses import dataclass

from postproc.compensation.text.values import Form
from postproc.diagnostics import Source, Span
from postproc.rapid.motions.regressors import NAME
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
        stated: it can be written as an aggregate of its components (by `components_of`), with other configuration data.
    """

    form: Form | None
    in_tool: bool = False
    stated: bool = False


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
    if NAME.fullmatch(text) is not None:
        return TargetExpression(around or "components", stated=True)
    try:
        tree = read_whole_expression(source.data, *span)
    except Unknown:
        return TargetExpression(around)
    if amounts_of(tree) and isinstance(tree, Call) and tree.name not in own:
        stated = around is not None and components_of(text) is not None
        return TargetExpression("amounts", tree.name == "reltool", stated)
    return TargetExpression(around)


def components_of(text: str) -> tuple[str, tuple[str, str, str]] | None:
    """The name in a target expression, and for x, y and z the text of the sum that ``Offs`` adds to it.

    A text is empty where nothing is added. None if the expression is not a name, bare or displaced by ``Offs`` once or
    several times.
    """
    data = text.encode("latin-1")
    sums: list[list[str]] = [[], [], []]
    try:
        tree = read_whole_expression(data, 0, len(data))
    except Unknown:
        return None
    while isinstance(tree, Call) and tree.name == "offs" and (amounts := amounts_of(tree)):
        for axis, part in zip(sums, amounts, strict=True):
            words = data[slice(*part.span)].decode("latin-1")
            axis[:0] = [words] if words != "0" else []
        tree = tree.arguments[0]
    name = data[slice(*tree.span)].decode("latin-1")
    if NAME.fullmatch(name) is None:
        return None
    x, y, z = ("+".join(axis).replace("+-", "-") for axis in sums)
    return name, (x, y, z)


def amounts_of(tree: Expression) -> tuple[Expression, ...]:
    """The displacements along x, y, z in a call of ``Offs``, or of ``RelTool`` without rotations.

    Empty for any other expression.
    """
    if isinstance(tree, Call) and tree.name in DISPLACING and not tree.options and len(tree.arguments) == 1 + AMOUNTS:
        return tree.arguments[1:]
    return ()
