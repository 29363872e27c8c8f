"""Targets chosen by a number that only the controller knows: each element of the array may be meant.

``MoveL pPlace{nPlace}`` with an ``nPlace`` from an input goes to one of the places that the text holds. Where nothing
writes the array, the statement is followed to each of them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

from postproc.rapid.data.events import MotionStatement
from postproc.rapid.data.values import Data, Value
from postproc.rapid.evaluation.evaluate import evaluate, whole
from postproc.rapid.evaluation.memory import Memory, Reference
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.trees import Expression, Index, Name, nodes
from postproc.rapid.unknown import Kind, Unknown

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
        trees = [read_whole_expression(statement.source.data, *span, "the target") for span in spans]
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
        copy = memory.aside()
        copy.frame.bindings.update({name: Value(float(n), "num") for name, n in zip(values, numbers, strict=True)})
        yield tuple(zip(values, contents, map(float, numbers), strict=True)), copy


def _all_exist(indexed: Sequence[Index], memory: Memory) -> bool:
    """Whether all indices lie within their arrays in this memory."""
    for node in indexed:
        try:
            indices = [whole(evaluate(index, memory).data) for index in node.indices]
        except Unknown:
            return False
        if any(not 1 <= i <= size for i, size in zip(indices, _sizes(node.base, memory), strict=False)):
            return False
    return True
