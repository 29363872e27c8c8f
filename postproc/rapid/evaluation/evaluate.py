"""The value of an expression, as far as the text alone gives it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import isfinite
from operator import add, eq, ge, gt, is_not, le, lt, ne, sub
from typing import Protocol

from postproc.rapid.data import builtins as functions
from postproc.rapid.data.arm import BY_ARM
from postproc.rapid.data.pose import cross, quat_mult
from postproc.rapid.data.values import Data, Fields, Value, as_type
from postproc.rapid.syntax import trees
from postproc.rapid.unknown import Kind, Unknown, joined_causes


class Scope(Protocol):
    """Where names get their meaning while an expression is evaluated; every method may raise Unknown.

    ``reads`` holds the causes why what has been read so far in the
    present expression is not certain; ``noted`` those of all expressions since somebody emptied it.
    """

    reads: list[Unknown]
    noted: list[Unknown]

    @property
    def records(self) -> Mapping[str, Fields]:
        """Fields (name, type) of each record type, by lower-case type name."""

    def lookup(self, name: trees.Name) -> Value:
        """The value of the data that a name means."""

    def element(self, name: trees.Name, indices: tuple[int, ...]) -> Value:
        """The value of an element of an array; indices count from 1."""

    def call(self, call: trees.Call) -> Value | None:
        """The result of a function that the program defines; None if it defines none of that name."""

    def present(self, name: str) -> bool:
        """Whether the routine that runs was called with this optional parameter (lower-case name)."""

    def by_arm(self, name: str, arguments: tuple[Data, ...], options: Mapping[str, Data]) -> Value:
        """The result of CalcRobT or CalcJointT (``name``), which need the kinematics of the arm.

        Args:
            arguments: values of the positional arguments; options: of the optional ones, by lower-case name.
        """


def evaluate(expression: trees.Expression, scope: Scope) -> Value:
    """The value of an expression; ``assumed`` holds the causes if some data that it reads is not certain.

    Raises:
        Unknown: it depends on something that only running the program tells, or its types do not fit.
    """
    reads, before = scope.reads, len(scope.reads)
    try:
        value = _evaluate(expression, scope)
        if len(reads) == before:
            return value
        causes = joined_causes(tuple(reads[before:]))
        scope.noted[:] = joined_causes(tuple(scope.noted), causes)
        return replace(value, assumed=causes)
    except RecursionError:
        raise Unknown(Kind.NESTED) from None
    except (TypeError, ValueError, LookupError, ArithmeticError) as error:
        raise Unknown(Kind.TYPES) from error
    finally:
        del reads[before:]


def _evaluate(expression: trees.Expression, scope: Scope) -> Value:
    """The value of an expression; causes of doubt of the data read go to ``scope.reads``, not into the value."""
    match expression:  # the most frequent first
        case trees.Name():
            return _read(scope.lookup(expression), scope)
        case trees.Component():
            return component(_evaluate(expression.base, scope), expression.name, scope.records)
        case trees.Binary():
            return _binary(expression.operator, expression.lhs, expression.rhs, scope)
        case trees.Number():
            return Value(expression.value, "num")
        case trees.Call():
            return _call(expression, scope)
        case trees.Aggregate():
            return Value(tuple([_evaluate(item, scope).data for item in expression.items]))
        case trees.Index(_, base, indices):
            at = tuple(as_integer(_evaluate(i, scope).data) for i in indices)
            return _read(
                scope.element(base, at) if isinstance(base, trees.Name) else pick(_evaluate(base, scope), at), scope
            )
        case trees.Unary(_, operator, operand):
            return _unary(operator, _evaluate(operand, scope))
        case trees.StringNode(_, text):
            return Value(as_string(text), "string")
        case trees.Truth(_, truth):
            return Value(truth, "bool")
        case trees.Star():
            raise Unknown(Kind.STAR)


def _read(value: Value, scope: Scope) -> Value:
    """The value itself; its causes of doubt are appended to ``scope.reads``."""
    scope.reads += value.assumed
    return value


def component(value: Value, name: str, records: Mapping[str, Fields]) -> Value:
    """The component with the lower-case name ``name`` of a record value.

    Args:
        records: fields (name, type) of each record type.

    Raises:
        Unknown: the record has none of that name.
    """
    fields = records.get(value.type, ())
    for at, (field, kind) in enumerate(fields):
        if field == name and isinstance(value.data, tuple) and at < len(value.data):
            part = value.declaration and (*value.at, at + 1)
            return Value(as_type(value.data[at], kind), kind, 0, value.declaration, part or (), None, value.assumed)
    raise Unknown(Kind.NO_COMPONENT, name)


def as_integer(data: Data) -> int:
    """An array index or size as an int.

    Raises:
        Unknown: it is no whole number.
    """
    if isinstance(data, bool) or not isinstance(data, (int, float)) or not isfinite(data) or data != int(data):
        raise Unknown(Kind.NOT_INTEGER)
    return int(data)


def as_string(text: str) -> str:
    """The text itself, if a ``string`` can hold it.

    Raises:
        Unknown: it is longer than ``MOST_LETTERS``; the controller stops there.
    """
    if len(text) > functions.MOST_LETTERS:
        raise Unknown(Kind.TEXT_TOO_LONG)
    return text


def pick(value: Value, indices: tuple[int, ...]) -> Value:
    """The element of an array value at these indices, which count from 1.

    Raises:
        Unknown: there is no such element.
    """
    data = value.data
    for index in indices:
        if not isinstance(data, tuple) or not 1 <= index <= len(data):
            raise Unknown(Kind.NO_SUCH_ELEMENT, ", ".join(map(str, indices)))
        data = data[index - 1]
    data = as_type(data, value.type)
    rank = max(0, value.rank - len(indices))
    return Value(data, value.type, rank, value.declaration, (*value.at, *indices), None, value.assumed)


def _unary(operator: str, value: Value) -> Value:
    """The value of ``not``, a sign or parentheses (``operator``: ``not``, ``+``, ``-``, ``()``) applied to a value."""
    if operator == "()":
        return value
    if operator == "not":
        if isinstance(value.data, bool):
            return Value(not value.data, "bool")
        raise Unknown(Kind.NEEDS_TRUTH)
    if isinstance(value.data, tuple):
        return Value(tuple(-x for x in value.data) if operator == "-" else value.data, value.type)
    if isinstance(value.data, (bool, str)):
        raise Unknown(Kind.NEEDS_NUMBER, operator)
    return Value(-value.data if operator == "-" else value.data, value.type)


_TRUTH: Mapping[str, Callable[[Data, Data], bool]] = {
    "=": eq, "<>": ne, "<": lt, ">": gt, "<=": le, ">=": ge, "xor": is_not,
}  # fmt: skip


def _binary(operator: str, lhs: trees.Expression, rhs: trees.Expression, scope: Scope) -> Value:
    """The value of two operands joined by an operator (lower case), computed in the precision of their type."""
    if operator in ("and", "or"):
        return _logical(operator == "or", lhs, rhs, scope)
    a, b = _evaluate(lhs, scope), _evaluate(rhs, scope)
    kind = "dnum" if "dnum" in (a.type, b.type) else "num"  # of numbers; what is written as a number is either
    x, y = as_type(a.data, kind), as_type(b.data, kind)
    try:
        if operator in _TRUTH:
            return Value(_TRUTH[operator](x, y), "bool")
        match operator:
            case "div":
                return Value(as_type(float(int(x / y)), kind), kind)
            case "mod":
                return Value(as_type(x - y * int(x / y), kind), kind)
            case "/":
                return Value(as_type(x / y, kind), kind)
            case "*":
                return _product(x, y, (a.type, b.type, kind))
            case "+" if isinstance(x, str) or isinstance(y, str):
                return Value(as_string(x + y), "string")
            case _:
                combine = add if operator == "+" else sub
                if isinstance(x, tuple):
                    return Value(tuple(map(combine, x, y)), a.type)
                return Value(as_type(combine(x, y), kind), kind)
    except (TypeError, ValueError, ArithmeticError) as error:
        raise Unknown(Kind.UNDEFINED_OPERATOR, operator) from error


def _product(x: Data, y: Data, kinds: tuple[str, str, str]) -> Value:
    """The product ``x * y``: of numbers, of number and pos, of two pos (vector product), or two orient (y first).

    Args:
        kinds: type of x, type of y, and type of the product if both are numbers.
    """
    if isinstance(x, tuple) and isinstance(y, tuple):
        if len(x) == 4:
            return Value(quat_mult(x, y), "orient")
        return Value(cross(x, y), "pos")
    if isinstance(y, tuple):
        return Value(tuple(x * item for item in y), kinds[1])
    if isinstance(x, tuple):
        return Value(tuple(item * y for item in x), kinds[0])
    return Value(as_type(x * y, kinds[2]), kinds[2])


def _logical(decisive: bool, lhs: trees.Expression, rhs: trees.Expression, scope: Scope) -> Value:
    """The value of OR (``decisive`` True) or AND (False): a side equal to it decides even if the other is unknown.

    Raises:
        Unknown: no side decides and one is unknown.
    """
    unknown: Unknown | None = None
    for side in (lhs, rhs):
        try:
            if _evaluate(side, scope).data is decisive:
                return Value(decisive, "bool")
        except Unknown as error:
            unknown = error.kept()
    if unknown is not None:
        raise unknown
    return Value(not decisive, "bool")


def _call(call: trees.Call, scope: Scope) -> Value:
    """The result of a function call: ``Present``, a function of the program, or a built-in one, in this order."""
    if call.name == "present" and len(call.arguments) == 1 and isinstance(call.arguments[0], trees.Name):
        return Value(scope.present(call.arguments[0].name), "bool")
    result = scope.call(call)
    if result is not None:
        return _read(result, scope)
    if call.name not in functions.FUNCTIONS and call.name not in BY_ARM:
        raise functions.unknown(call.text)
    arguments = tuple(_evaluate(argument, scope).data for argument in call.arguments)
    if call.name == "orobt":
        arguments = (*arguments, _read(scope.lookup(trees.Name(call.span, "c_progdisp")), scope).data)
    options = {name: True if value is None else _evaluate(value, scope).data for name, value in call.options}
    if call.name in BY_ARM:
        return _read(scope.by_arm(call.text, arguments, options), scope)
    kind, data = functions.call(call.name, arguments, options)
    return Value(as_string(data) if kind == "string" else as_type(data, kind), kind)


def names_in(tree: trees.Expression) -> set[str]:
    """Names of the data and functions an expression depends on, lower case."""
    return {node.name for node in trees.nodes(tree) if isinstance(node, trees.Name | trees.Call)}
