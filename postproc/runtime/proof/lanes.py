"""Data and expressions of a RAPID module in many lanes at once, in single precision.

Every number is an array with one entry for each lane; an error of a function or a division is kept by lane.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import Diagnostic, PostprocError, Source, Span
from postproc.rapid.data.values import known_records, zero
from postproc.rapid.syntax.expressions import ExpressionError, read_expression
from postproc.rapid.syntax.modules import parse
from postproc.rapid.syntax.nodes import Declaration, Routine
from postproc.rapid.syntax.trees import (
    Aggregate,
    Binary,
    Call,
    Component,
    Expression,
    Index,
    Name,
    Number,
    Text,
    Truth,
    Unary,
)

Lanes = NDArray[np.bool_]
Value = Any
"""Arrays (n,) of float32 or bool, a text, a table (numpy array of rank 1 in a `Table`), or a list of values."""
Answer = tuple[Value, Lanes | None]
"""Value of a function and the lanes in which it raises an error."""
SINGLE = np.float32


@dataclass(frozen=True)
class Table:
    """An array of numbers, the same in all lanes."""

    values: NDArray[np.float32]


@dataclass
class Place:
    """Where a value is kept, with its type; parameters by reference share it."""

    value: Value
    type: str


@dataclass
class Frame:
    """A call that runs: its data, which optional parameters it got, what it returns, where it raised an error."""

    routine: Routine
    names: dict[str, Place] = field(default_factory=dict)
    result: Value = None
    raised: Lanes | None = None


class Calculation(ABC):
    """A module in n lanes: its data, and the values of its expressions.

    Args:
        count: number of lanes. functions: those of the controller, by lower-case name: values of arguments by position
            and by name in, value and lanes of an error out.

    Raises:
        PostprocError: the text cannot be read, or holds what is not calculated here (RUN003).
    """

    def __init__(self, source: Source, count: int, functions: Mapping[str, Callable[..., Answer]]) -> None:
        modules, found = parse(source)
        if found or len(modules) != 1:
            raise PostprocError(found or [cannot(source, None, "a file with one module is expected")])
        self.source, self.count, self.functions = source, count, functions
        self.records = known_records(modules)
        self.routines = {r.name.lower(): r for r in modules[0].routines}
        self.trees: dict[Span, Expression] = {}
        self.raised: Lanes = np.zeros(count, dtype=bool)
        self.everywhere: Lanes = np.ones(count, dtype=bool)
        self.data = {d.name.lower(): self.declared(d, None) for d in modules[0].declarations}

    def declared(self, declaration: Declaration, frame: Frame | None) -> Place:
        kind = declaration.type.lower()
        if declaration.init is None:
            return Place(self._all(zero(kind, self.records)), kind)
        value = self.value_of(self.tree_at(declaration.init), frame, self.everywhere)
        if declaration.dims:
            value = Table(np.array([x if np.ndim(x) == 0 else x[0] for x in value], dtype=SINGLE))
        return Place(value, kind)

    def _all(self, data: Any) -> Value:
        """Data of one lane in all lanes."""
        if isinstance(data, tuple):
            return [self._all(part) for part in data]
        if isinstance(data, str):
            return data
        return np.full(self.count, data, dtype=bool if isinstance(data, bool) else SINGLE)

    def tree_at(self, span: Span) -> Expression:
        if span not in self.trees:
            try:
                self.trees[span] = read_expression(self.source.data, *span)
            except ExpressionError:
                raise PostprocError([cannot(self.source, span, "this is no expression")]) from None
        return self.trees[span]

    @abstractmethod
    def run(self, routine: Routine, given: Sequence[Place], options: Mapping[str, Place], active: Lanes) -> Value:
        """Run a routine in some lanes; what it returns."""

    def found(self, name: Name, frame: Frame | None) -> Place:
        known = (frame.names if frame else {}).get(name.name) or self.data.get(name.name)
        if known is None:
            raise PostprocError([cannot(self.source, name.span, f"`{name.text}` is not declared in this module")])
        return known

    def place_of(self, tree: Expression, frame: Frame | None, active: Lanes) -> Place:
        """Data that a name stands for, or the value of an expression."""
        if isinstance(tree, Name):
            return self.found(tree, frame)
        return Place(self.value_of(tree, frame, active), "")

    def assign(self, target: Expression, value: Value, frame: Frame, active: Lanes) -> None:
        path: list[str] = []
        while isinstance(target, Component):
            path.append(target.name)
            target = target.base
        if not isinstance(target, Name):
            raise PostprocError([cannot(self.source, target.span, "an element of an array is not written here")])
        place = self.found(target, frame)
        place.value = self._written(place.value, place.type, path[::-1], value, active)

    def _written(self, old: Value, kind: str, path: Sequence[str], value: Value, active: Lanes) -> Value:
        if not path:
            return chosen(active, value, old)
        fields = [name for name, _ in self.records[kind]]
        at = fields.index(path[0])
        parts = list(old)
        parts[at] = self._written(old[at], self.records[kind][at][1], path[1:], value, active)
        return parts

    def value_of(self, tree: Expression, frame: Frame | None, active: Lanes) -> Value:
        match tree:
            case Number(_, value):
                return np.full(self.count, value, dtype=SINGLE)
            case Truth(_, truth):
                return np.full(self.count, truth)
            case Text(_, text):
                return text
            case Name():
                return self.found(tree, frame).value
            case Aggregate(_, items):
                return [self.value_of(item, frame, active) for item in items]
            case Component(_, base, name):
                return self._component(base, name, frame, active)
            case Index(_, base, (index,)):
                return self._element(self.value_of(base, frame, active), self.value_of(index, frame, active), active)
            case Unary(_, operator, operand):
                inner = self.value_of(operand, frame, active)
                return inner if operator in ("()", "+") else ~inner if operator == "not" else -inner
            case Binary(_, operator, left, right):
                sides = self.value_of(left, frame, active), self.value_of(right, frame, active)
                return self._combined(operator, *sides, active)
            case Call():
                return self._called(tree, frame, active)
            case _:
                raise PostprocError([cannot(self.source, tree.span, "this expression is not calculated here")])

    def _component(self, base: Expression, name: str, frame: Frame | None, active: Lanes) -> Value:
        fields = self.records.get(self._type(base, frame), ())
        at = next((i for i, (field_, _) in enumerate(fields) if field_ == name), None)
        if at is None:
            raise PostprocError([cannot(self.source, base.span, f"`{name}` is no component of this")])
        return self.value_of(base, frame, active)[at]

    def _type(self, tree: Expression, frame: Frame | None) -> str:
        if isinstance(tree, Name):
            return self.found(tree, frame).type
        if isinstance(tree, Component):
            return dict(self.records.get(self._type(tree.base, frame), ())).get(tree.name, "")
        routine = self.routines.get(tree.name) if isinstance(tree, Call) else None
        return routine.type.lower() if routine else ""

    def _element(self, table: Value, index: Value, active: Lanes) -> Value:
        assert isinstance(table, Table)
        at = np.nan_to_num(index).astype(int) - 1
        outside = (at < 0) | (at >= len(table.values)) | (index != np.trunc(index))
        self.raised = self.raised | (outside & active)
        return table.values[np.clip(at, 0, len(table.values) - 1)]

    def _combined(self, operator: str, a: Value, b: Value, active: Lanes) -> Value:
        if isinstance(a, str) or isinstance(b, str):
            return ""
        with np.errstate(all="ignore"):
            match operator:
                case "+" | "-" | "*":
                    value = a + b if operator == "+" else a - b if operator == "-" else a * b
                case "/":
                    self.raised = self.raised | ((b == 0) & active)
                    value = a / np.where(b == 0, SINGLE(1), b)
                case "and" | "or" | "xor":
                    value = a & b if operator == "and" else a | b if operator == "or" else a ^ b
                case _:
                    compare = {"<": np.less, ">": np.greater, "<=": np.less_equal, ">=": np.greater_equal}
                    value = {**compare, "=": np.equal, "<>": np.not_equal}[operator](a, b)
        return value

    def _called(self, call: Call, frame: Frame | None, active: Lanes) -> Value:
        if call.name == "present":
            argument = call.arguments[0]
            given = frame is not None and isinstance(argument, Name) and argument.name in frame.names
            return np.full(self.count, given)
        routine = self.routines.get(call.name)
        options = {}
        for name, tree in call.options:
            handed_on = tree is not None and self._handed_on(tree)
            if handed_on and (frame is None or not isinstance(tree, Name) or tree.name not in frame.names):
                continue
            options[name] = Place(self.everywhere, "switch") if tree is None else self.place_of(tree, frame, active)
        if routine is not None:
            return self.run(routine, [self.place_of(a, frame, active) for a in call.arguments], options, active)
        if call.name not in self.functions:
            raise PostprocError([cannot(self.source, call.span, f"`{call.text}` is not calculated here")])
        arguments = [self.value_of(a, frame, active) for a in call.arguments]
        with np.errstate(all="ignore"):
            value, bad = self.functions[call.name](*arguments, **{name: p.value for name, p in options.items()})
        if bad is not None:
            self.raised = self.raised | (bad & active)
        return value

    def _handed_on(self, tree: Expression) -> bool:
        r"""Whether an optional argument is written ``\Opt?name``."""
        return self.source.data[: tree.span[0]].rstrip().endswith(b"?")


def chosen(lanes: Lanes, value: Value, old: Value) -> Value:
    """A value in some lanes, the old one in the others."""
    if isinstance(value, (list, tuple)):
        return [chosen(lanes, a, b) for a, b in zip(value, old, strict=True)]
    if isinstance(value, (str, Table)):
        return value
    return np.where(lanes, value, old)


def cannot(source: Source, span: Span | None, text: str) -> Diagnostic:
    return Diagnostic("RUN003", "error", text, source, span, "check modules that `postproc runtime write` wrote")
