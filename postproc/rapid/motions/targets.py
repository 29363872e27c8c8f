"""The target of a motion statement: its value and where its numbers stand."""

from __future__ import annotations

import math
from dataclasses import replace

from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import Origin, Root
from postproc.rapid.data.pose import about, add, quat_mult, subtract
from postproc.rapid.data.records import JointTarget, Pose, RobTarget, Vec3
from postproc.rapid.data.values import Value, to_jointtarget, to_robtarget
from postproc.rapid.evaluation.assign import store
from postproc.rapid.evaluation.evaluate import evaluate
from postproc.rapid.evaluation.literals import read_literal_target
from postproc.rapid.evaluation.memory import Memory, Reference
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.syntax.trees import Aggregate, Call, Component, Expression, Index, Name, Star
from postproc.rapid.unknown import Kind, Unknown

RUNTIME = Origin("runtime")


class Targets:
    """Reads targets; what declarations give is read once."""

    def __init__(self, rooted: bool) -> None:
        """Start with nothing read; ``rooted``: also find the target that Offs, RelTool or the like displaces."""
        self.rooted = rooted
        self.declared: dict[tuple[str, tuple[int, ...]], tuple[RobTarget, Origin]] = {}

    def robtarget(self, source: Source, span: Span, memory: Memory) -> tuple[RobTarget | Unknown, Origin]:
        """The robtarget (or why there is none, as Unknown) at a byte span, and the origin of its value."""
        try:
            literal = read_literal_target(source, *span) if source.data[span[0] : span[0] + 1] == b"[" else None
            if literal is not None:
                return literal[0], Origin("inline", literal[1])
            tree = read_whole_expression(source.data, *span, "the target")
        except Unknown as error:
            return error.kept(), RUNTIME
        if isinstance(tree, Star):
            return Unknown(Kind.STAR), Origin("star")
        declaration = _named(tree, memory)
        before = memory.aside() if isinstance(tree, Call) and self.rooted else memory
        try:
            plain = declaration is not None and isinstance(tree, Name) and tree.name not in memory.frame.bindings
            if declaration is not None and plain and memory.is_initial(declaration):
                value = self.declared.get((declaration.key, ())) or self._written(declaration, (), memory)
                if value is not None:
                    return value
            target, origin = self._of_value(evaluate(tree, memory), memory)
            if isinstance(tree, Call) and self.rooted:
                origin = replace(origin, root=self._root(tree, target, before))
            return target, origin
        except Unknown as error:
            return error.kept(), _runtime(declaration)

    def _root(self, tree: Expression, target: RobTarget, memory: Memory) -> Root | None:
        """The target that a nest of ``Offs``, ``RelTool`` and functions that only displace their argument starts from.

        None if any other function is in it.

        Args:
            target: value of the whole expression ``tree``; memory: the state before that was evaluated.
        """
        lever: Vec3 = (0.0, 0.0, 0.0)
        origin = Origin("expression")
        try:
            while isinstance(tree, Call) and tree.arguments:
                inner = tree.arguments[0]
                copy = memory.aside()
                outer, (target, origin) = target, self._of_value(evaluate(inner, copy), copy)
                function = memory.program.routine(tree.name, memory.frame.routine.module) is not None
                if tree.name == "reltool" and not function:
                    lever = add(lever, subtract(outer.trans, target.trans))
                elif (tree.name != "offs" or function) and not _displaces(tree, inner, target, outer, memory):
                    return None
                tree = inner
            if origin.kind == "expression" and isinstance(tree, Aggregate):
                written = read_literal_target(memory.frame.routine.source, *tree.span)
                origin = origin if written is None else Origin("inline", written[1])
        except Unknown:
            return None
        return Root(target, origin, lever)

    def _of_value(self, value: Value, memory: Memory) -> tuple[RobTarget, Origin]:
        """The robtarget that a value is, and its origin: a declaration, an argument handed over, or an expression.

        Raises:
            Unknown: the value is no robtarget.
        """
        handed = value.handed
        if value.declaration is None:
            written = read_literal_target(handed.source, *handed.span) if handed is not None else None
            if written is not None:
                return written[0], Origin("inline", written[1], handed=handed)
            return to_robtarget(value.data), Origin("expression", handed=handed)
        target, origin = self._declared(value.declaration, value.at, value, memory)
        return target, origin if handed is None else replace(origin, handed=handed)

    def _declared(self, name: str, at: tuple[int, ...], value: Value, memory: Memory) -> tuple[RobTarget, Origin]:
        """The robtarget of declared data, read from its literal numbers or converted from ``value``, and its origin.

        Args:
            name: key of the declaration; at: indices of the part, from 1, () for all of it.
        """
        done = self.declared.get((name, at))
        if done is None:
            declaration = memory.program.names[name]
            done = self._written(declaration, at, memory)
            if done is None:
                origin = Origin("expression", None, name, declaration.storage)
                done = self.declared[name, at] = (to_robtarget(value.data), origin)
        return done

    def _written(
        self, declaration: Declaration, at: tuple[int, ...], memory: Memory
    ) -> tuple[RobTarget, Origin] | None:
        """The target and its origin if the declaration, or its part with indices ``at``, is only numbers; else None."""
        span = memory.constants.part_span(declaration, at)
        literal = read_literal_target(declaration.source, *span) if span is not None else None
        if literal is None:
            return None
        origin = Origin("element" if at else "declared", literal[1], declaration.key, declaration.storage)
        result = self.declared[declaration.key, at] = literal[0], origin
        return result

    def jointtarget(self, source: Source, span: Span, memory: Memory) -> tuple[JointTarget | Unknown, Origin]:
        """The jointtarget (or why there is none, as Unknown) at a byte span, and the origin of its value."""
        declaration = None
        try:
            tree = read_whole_expression(source.data, *span, "the target")
            if isinstance(tree, Star):
                return Unknown(Kind.STAR), Origin("star")
            declaration = _named(tree, memory)
            value = evaluate(tree, memory)
            target = to_jointtarget(value.data)
        except Unknown as error:
            return error.kept(), _runtime(declaration)
        if value.declaration is None:
            return target, Origin("inline" if source.data[span[0] : span[0] + 1] == b"[" else "expression")
        storage = memory.program.names[value.declaration].storage
        return target, Origin("element" if value.at else "declared", None, value.declaration, storage)


def _named(tree: Expression, memory: Memory) -> Declaration | None:
    """The declaration that a name, or the array of an element, means; also by reference; else None."""
    base = tree.base if isinstance(tree, Index) else tree
    if not isinstance(base, Name):
        return None
    bound = memory.frame.bindings.get(base.name)
    if bound is None:
        return memory.find(base.name)
    return bound.declaration if isinstance(bound, Reference) else None


_TRIED = Pose((7.0, -11.0, 13.0), about(0, 2.0))  # any move tells one that displaces from one that does more


def _displaces(tree: Call, inner: Expression, before: RobTarget, after: RobTarget, memory: Memory) -> bool:
    """Whether a function of the program displaces its first argument and does no more: tried with a moved argument.

    Args:
        inner: the first argument; before: its value; after: the function's result for it.

    Raises:
        Unknown: with another value it has no result.
    """
    data = inner
    while isinstance(data, Index | Component):
        data = data.base
    if not isinstance(data, Name):
        return False
    copy = memory.aside()
    copy.frame.bindings[data.name] = copy.lookup(data)
    moved = replace(before, trans=add(before.trans, _TRIED.trans), rot=quat_mult(_TRIED.rot, before.rot))
    store(inner, (moved.trans, moved.rot, tuple(map(float, moved.robconf)), moved.extax), copy)
    target = to_robtarget(evaluate(tree, copy).data)
    wanted = (*add(after.trans, _TRIED.trans), *quat_mult(_TRIED.rot, after.rot))
    return math.dist(wanted, (*target.trans, *target.rot)) < 1e-6


def _runtime(declaration: Declaration | None) -> Origin:
    """An origin for a value known only at run time, with the declaration that the argument names, if any."""
    if declaration is None:
        return RUNTIME
    return Origin("runtime", None, declaration.key, declaration.storage)
