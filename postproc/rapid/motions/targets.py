"""Targets of motions: their values, where these come from, and elements that a number of the controller chooses.

``MoveL pPlace{nPlace}`` with an ``nPlace`` from an input goes to one of the places that the text holds. Where nothing
writes the array, the statement is followed to each of them (`elements`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import MotionStatement, Origin, Root
from postproc.rapid.data.pose import about, add, quat_mult, subtract
from postproc.rapid.data.records import JointTarget, Pose, RobTarget, Vec3
from postproc.rapid.data.values import Data, Value, to_jointtarget, to_robtarget
from postproc.rapid.evaluation.assign import store
from postproc.rapid.evaluation.declared import read_literal_target
from postproc.rapid.evaluation.evaluate import as_integer, evaluate
from postproc.rapid.evaluation.memory import Memory, Reference
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.syntax.trees import Aggregate, Call, Component, Expression, Index, Name, Star, nodes
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
            tree = read_full_expression(source.data, *span, "the target")
        except Unknown as error:
            return error.kept(), RUNTIME
        if isinstance(tree, Star):
            return Unknown(Kind.STAR), Origin("star")
        declaration = _named(tree, memory)
        before = memory.trial_copy() if isinstance(tree, Call) and self.rooted else memory
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
                copy = memory.trial_copy()
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
            tree = read_full_expression(source.data, *span, "the target")
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
    copy = memory.trial_copy()
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


MOST_ELEMENTS = 200  # of one statement; with more it is left alone
# A number by lower-case name, what the memory holds for it (one object as long as nothing writes it), and its value.
IndexValues = tuple[tuple[str, object, float], ...]


def elements(statement: MotionStatement, memory: Memory) -> list[tuple[IndexValues, Memory]]:
    """Every case of a motion statement whose targets are array elements of unknown index, in arrays nothing writes.

    Returns:
        For each combination of index values: the values as a ``Choice``, and a memory in which the indices have them.
        Empty if anything else is unknown or there are more than ``MOST_ELEMENTS``.
    """
    arguments = [statement.argument(role) for role in ("to", "via")]
    try:
        spans = [argument.span for argument in arguments if argument is not None]
        trees = [read_full_expression(statement.source.data, *span, "the target") for span in spans]
        indexed = [node for tree in trees for node in nodes(tree) if isinstance(node, Index)]
        values: dict[str, range] = {}
        for node in indexed:
            _add_choosing(node, memory, values)
        if not values or math.prod(map(len, values.values())) > MOST_ELEMENTS**2:
            return []
        cases = [case for case in _cases(values, memory) if _all_exist(indexed, case[1])]
    except Unknown:
        return []
    return cases if len(cases) <= MOST_ELEMENTS else []


def _add_choosing(node: Index, memory: Memory, values: dict[str, range]) -> None:
    """Add to ``values`` the unknown numbers in the indices of an element, each with the range in which it may lie.

    Args:
        node: the element; values: ranges by lower-case name.

    Raises:
        Unknown: the array has no certain value.
    """
    for index in node.indices:
        for name in (part for part in nodes(index) if isinstance(part, Name) and not _known(part, memory)):
            most = max(_sizes(node.base, memory))
            # In a sum as `{n+1}` or a product the number itself may be less or more than the element's.
            indices = range(1, most + 1) if isinstance(index, Name) else range(-most, 2 * most + 1)
            before = values.get(name.name, indices)
            values[name.name] = range(max(before.start, indices.start), min(before.stop, indices.stop))


def _sizes(base: Expression, memory: Memory) -> list[int]:
    """Number of elements along each dimension of an array that nothing writes.

    Raises:
        Unknown: the expression is anything else.
    """
    if isinstance(base, Name):
        bound = memory.frame.bindings.get(base.name)
        array = memory.find(base.name) if bound is None else None
        if isinstance(bound, Reference) and not bound.path:
            array = bound.declaration
        if array is not None and array.dims and memory.is_initial(array):
            data: Data = memory.value(array).data
            sizes = []
            for _ in array.dims:
                sizes.append(len(data))
                data = data[0]
            return sizes
    raise Unknown(Kind.NOT_A, "array that nothing writes")


def _known(name: Name, memory: Memory) -> bool:
    """Whether the name has a value in this memory, certain or assumed."""
    try:
        memory.lookup(name)
    except Unknown:
        return False
    return True


def _cases(values: dict[str, range], memory: Memory) -> Iterator[tuple[IndexValues, Memory]]:
    """Every combination of values of the numbers, with what memory now holds for them, and a memory with these values.

    Args:
        values: range of each number by lower-case name.
    """
    contents: list[object] = []
    for name in values:
        bound = memory.frame.bindings.get(name)
        declaration = memory.find(name) if bound is None else None
        contents.append(bound if declaration is None else memory.changed.get(declaration.key, object()))
    for numbers in itertools.product(*values.values()):
        copy = memory.trial_copy()
        copy.frame.bindings.update({name: Value(float(n), "num") for name, n in zip(values, numbers, strict=True)})
        yield tuple(zip(values, contents, map(float, numbers), strict=True)), copy


def _all_exist(indexed: Sequence[Index], memory: Memory) -> bool:
    """Whether all indices lie within their arrays in this memory."""
    for node in indexed:
        try:
            indices = [as_integer(evaluate(index, memory).data) for index in node.indices]
        except Unknown:
            return False
        if any(not 1 <= i <= size for i, size in zip(indices, _sizes(node.base, memory), strict=False)):
            return False
    return True
