"""Targets as expressions: how an offset goes into one, and what its position is made of."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.compensate.text.values import Form
from postproc.diagnostics import Source, Span
from postproc.rapid.data.records import RobTarget, Vec3
from postproc.rapid.motions.regressors import NAME
from postproc.rapid.motions.units import pose_matrix
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.trees import Aggregate, Call, Expression, Name, Number, Unary
from postproc.rapid.unknown import Unknown

DISPLACING = ("offs", "reltool")
AMOUNTS = 3  # along x, y, z


@dataclass(frozen=True, slots=True)
class TargetExpression:
    """The text of a target argument.

    Args:
        form: how an offset is written, None where there is no way; in_tool: it goes along the axes of the tool.
        stated: its components can be written one by one (see `components_of`), with other configuration data.
    """

    form: Form | None
    in_tool: bool = False
    stated: bool = False


def target_expression(source: Source, span: Span, program: Program, module: str) -> TargetExpression:
    """How an offset goes into the target expression at ``span``."""
    text = source.data[slice(*span)].decode("latin-1")
    own = {name for name in DISPLACING if program.routine(name, module) is not None}
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
    """The name of a target and sums that ``Offs`` adds to its coordinates, empty where it adds nothing.

    None where the text is more than a name, displaced by ``Offs`` once or several times.
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
    """What ``Offs``, or ``RelTool`` without rotations, displaces by along x, y, z; empty for other expressions."""
    if isinstance(tree, Call) and tree.name in DISPLACING and not tree.options and len(tree.arguments) == 1 + AMOUNTS:
        return tree.arguments[1:]
    return ()


@dataclass(frozen=True, slots=True)
class Position:
    """What the position of a target is made of, apart from a constant.

    Args:
        reference: the text of the target whose coordinates it starts from, None where numbers say it.
        terms: texts of numbers and what each unit of them adds [mm], object axes.
    """

    reference: str | None
    terms: tuple[tuple[str, Vec3], ...] = ()

    @property
    def all_terms(self) -> tuple[tuple[str, Vec3], ...]:
        """The terms with the coordinates of the reference among them."""
        if self.reference is None:
            return self.terms
        axes = zip("xyz", ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), strict=True)
        return (*((f"{self.reference}.trans.{axis}", direction) for axis, direction in axes), *self.terms)

    def at(self, target: RobTarget | None, regressors: Mapping[str, float]) -> Array:
        """(3,) [mm] where the reference is ``target``.

        Raises:
            KeyError: a number is not among the regressors.
        """
        place = np.zeros(3) if self.reference is None or target is None else np.array(target.trans)
        for text, direction in self.terms:
            place = place + regressors[text] * np.array(direction)
        return np.asarray(place)


def position_of(text: str, target: RobTarget, program: Program, module: str) -> Position | None:
    """What a target that is written ``text`` is made of; None where that cannot be said.

    Args:
        target: its value, whose orientation tells where ``RelTool`` displaces.
    """
    data = text.encode("latin-1")
    try:
        tree = read_whole_expression(data, 0, len(data))
    except Unknown:
        return None
    terms: list[tuple[str, Vec3]] = []
    turned = False  # by `RelTool`, after what it displaces
    while True:
        if isinstance(tree, Unary) and tree.operator == "()":
            tree = tree.operand
            continue
        if not isinstance(tree, Call) or tree.name not in DISPLACING or program.routine(tree.name, module) is not None:
            break
        base, *amounts = tree.arguments
        turned = turned or bool(tree.options)
        if any(not isinstance(angle, Number) for _, angle in tree.options):
            return None
        if turned and tree.name == "reltool" and any(not isinstance(part, Number) for part in amounts):
            return None  # along the axes of a tool that is turned beyond that
        axes = np.eye(3) if tree.name == "offs" else pose_matrix((0.0, 0.0, 0.0), target.rot)[:3, :3]
        for axis, part in enumerate(amounts):
            if not isinstance(part, Number):
                words = data[slice(*part.span)].decode("latin-1")
                x, y, z = axes[:, axis].tolist()
                terms.append((words.lower() if isinstance(part, Name) else f"({words})", (x, y, z)))
        tree = base
    written = data[slice(*tree.span)].decode("latin-1")
    if isinstance(tree, Aggregate):
        return Position(None, tuple(terms)) if re.fullmatch(r"[\[\]\d.,eE+\-\s]*", written) else None
    return Position(written, tuple(terms)) if NAME.fullmatch(written) else None
