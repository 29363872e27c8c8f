"""Effects out of a Python file of the user: it is run, and what it defines goes through the conformance kit."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.effects.base import Effect
from postproc.effects.findings import line_span
from postproc.effects.modules import load_module


def load_effect_file(path: str | Path, check: bool = True) -> tuple[type[Effect], ...]:
    """Run a Python file of the user and return its effect classes; ``check``: they have to pass the conformance kit.

    Raises:
        PostprocError: the file does not run (EFF001), has no effect (EFF008) or two classes of one name (EFF007), or an
            effect fails a check.
    """
    module, source = load_module(path)
    classes = tuple(effects_of(module))
    if not classes:
        help = "define a class derived from `Effect` (postproc.effects.base)"
        message = "the file defines no effect"
        raise PostprocError.of("EFF008", message, source, help=help)
    _check_names(source)
    if check and (problems := problems_of(classes)):
        raise PostprocError(problems)
    return classes


def effects_of(module: ModuleType) -> list[type[Effect]]:
    """Return the effects that a module defines itself, in the order of the file, without imported ones."""
    return [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Effect) and value.__module__ == module.__name__
    ]


def problems_of(classes: Iterable[type[Effect]]) -> tuple[Diagnostic, ...]:
    """Return the errors that the conformance kit finds in these effect classes."""
    from postproc.effects.conformance.kit import check_effect

    return tuple(d for cls in classes for d in check_effect(cls) if d.severity == "error")


def _check_names(source: Source) -> None:
    """Raise EFF007 where a file has two classes of one name: the second would silently replace the first."""
    seen: set[str] = set()
    for node in ast.parse(source.data).body:
        if isinstance(node, ast.ClassDef):
            if node.name in seen:
                message, help = f"the class `{node.name}` is defined twice", "give each effect a name of its own"
                span = line_span(source, node.lineno)
                raise PostprocError.of("EFF007", message, source, span, help)
            seen.add(node.name)
