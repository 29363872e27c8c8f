"""How effects are stored: tables of a model file checked before the effect is made, pickles rebuilt."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from postproc.diagnostics import Diagnostic, Source, Span, did_you_mean
from postproc.effects.modules import load_module
from postproc.effects.parameters import Parameter, Structure, broadcast


class DeclaredEffect(Protocol):
    """An effect, as far as its table is concerned."""

    key: ClassVar[str]

    def __init__(self, **fields: Any) -> None: ...

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """Return the declared parameters by name."""

    @classmethod
    def structures(cls) -> dict[str, Structure]:
        """Return the declared structural choices by name."""

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the shape of the parameter of this name."""


@dataclass(frozen=True, slots=True)
class FieldProblem:
    """One wrong entry of ``[effects.KEY]``.

    Args:
        code: EFF021 unknown key, EFF022 wrong length, EFF023 wrong type, EFF024 out of range.
        field: the key in the table; message, help: for the diagnostic.
    """

    code: str
    field: str
    message: str
    help: str = ""

    def diagnostic(self, source: Source | None = None, span: Span | None = None) -> Diagnostic:
        """Return the problem as a diagnostic at a place of a file."""
        return Diagnostic(self.code, "error", self.message, source, span, self.help)


def check_table(cls: type[DeclaredEffect], table: Mapping[str, Any]) -> list[FieldProblem]:
    """Return everything wrong with an effect's table of a model file (EFF021 to EFF024).

    Parameters are checked only where names and structural choices are right, as these decide shapes.
    """
    allowed = [*cls.structures(), *cls.parameters()]
    problems: list[FieldProblem] = []
    for name in table:
        if name not in allowed:
            hint = did_you_mean(name, allowed) or "allowed: " + ", ".join(f"`{a}`" for a in allowed)
            problems.append(FieldProblem("EFF021", name, f"`{cls.key}` has no parameter `{name}`", hint))
    chosen = {name: table[name] for name in cls.structures() if name in table}
    for name, value in chosen.items():
        problems += _check_structure(cls, name, value)
    if problems:
        return problems
    like = cls(**chosen)
    for name in cls.parameters():
        if name in table:
            problems += _check_parameter(like, name, table[name])
    return problems


def restore(module: str, file: str | None, name: str, fields: dict[str, Any]) -> Any:
    """Rebuild a pickled effect of the class ``name``; its module is imported, or loaded from the user's ``file``."""
    if module not in sys.modules:
        import importlib

        try:
            importlib.import_module(module)
        except ModuleNotFoundError:
            if file is None:
                raise
            load_module(file)
    cls: Any = sys.modules[module]
    for part in name.split("."):
        cls = getattr(cls, part)
    return cls(**fields)


def _check_structure(cls: type[DeclaredEffect], name: str, value: Any) -> list[FieldProblem]:
    """Return what is wrong with the value of a structural choice: its type or range, or it is no allowed word."""
    meta = cls.structures()[name]
    default = getattr(cls, name)
    if meta.choices:
        if value in meta.choices:
            return []
        allowed = ", ".join(f'"{c}"' for c in meta.choices)
        message = f"`{name}` of `{cls.key}` is not one of its choices"
        return [FieldProblem("EFF023", name, message, f"allowed: {allowed}")]
    many = isinstance(default, tuple)
    if many and all(isinstance(word, str) for word in default):
        if isinstance(value, (list, tuple)) and all(isinstance(v, str) for v in value):
            return []
        return [FieldProblem("EFF023", name, f"`{name}` of `{cls.key}` is not a list of words")]
    numbers = value if isinstance(value, (list, tuple)) else [value]
    if many != isinstance(value, (list, tuple)) or not all(_is_number(v) for v in numbers):
        wanted = "a list of numbers" if many else "one number"
        return [FieldProblem("EFF023", name, f"`{name}` of `{cls.key}` is not {wanted}", f"write {wanted}")]
    integer = all(isinstance(v, int) for v in (default if many else [default]))
    if integer and not all(isinstance(v, int) for v in numbers):
        text = f"`{name}` of `{cls.key}` is not a whole number"
        return [FieldProblem("EFF023", name, text, "write it without a decimal point")]
    return [
        FieldProblem("EFF024", name, f"`{name}` of `{cls.key}` is {v:g}", f"allowed: {meta.low:g} to {meta.high:g}")
        for v in numbers
        if not meta.low <= v <= meta.high
    ]


def _check_parameter(like: DeclaredEffect, name: str, value: Any) -> list[FieldProblem]:
    """Return what is wrong with the value of a parameter: type, shape or bounds.

    Args:
        like: the effect with the structural choices of the table, which decide shapes.
    """
    meta, shape = like.parameters()[name], like.shape(name)
    wanted = f"a list of {' x '.join(map(str, shape))} numbers" if shape else "one number"
    wanted += f" [{meta.unit}]"
    if not _all_numbers(value):
        return [FieldProblem("EFF023", name, f"`{name}` of `{like.key}` is not {wanted}", f"write {wanted}")]
    try:
        array = np.asarray(value, dtype=float)
    except ValueError:
        message = f"`{name}` of `{like.key}` has rows of different lengths"
        return [FieldProblem("EFF022", name, message, f"give {wanted}")]
    if array.shape != shape:
        has = f"has {' x '.join(map(str, array.shape))} numbers" if array.shape else "is a single number"
        return [FieldProblem("EFF022", name, f"`{name}` of `{like.key}` {has}", f"give {wanted}")]
    low, high = broadcast(meta.low, shape), broadcast(meta.high, shape)
    beyond = ~((array >= low) & (array <= high))  # NaN is outside as well
    if not beyond.any():
        return []
    at = tuple(np.argwhere(beyond)[0])
    limits = f"allowed: {low[at]:g} to {high[at]:g} {meta.unit}"
    return [FieldProblem("EFF024", name, f"`{name}` of `{like.key}` is {array[at]:g} {meta.unit}", limits)]


def _is_number(value: Any) -> bool:
    """Whether a value is a number that a float can hold (TOML's integers may have thousands of digits)."""
    if isinstance(value, int) and not isinstance(value, bool):
        return value.bit_length() < 1024
    return isinstance(value, float)


def _all_numbers(value: Any) -> bool:
    """Tell whether a value is a number, or lists nested to any depth that hold only numbers."""
    return all(map(_all_numbers, value)) if isinstance(value, (list, tuple)) else _is_number(value)
