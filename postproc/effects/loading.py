"""Effects out of a Python file of the user: it is run, and what it defines goes through the conformance kit."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import os
import sys
from collections.abc import Iterable
from contextlib import redirect_stdout
from pathlib import Path
from types import ModuleType
from typing import Any

from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.effects.base import Effect
from postproc.effects.findings import describe, line_of, line_span


def load_effect_file(path: str | Path, check: bool = True) -> tuple[type[Effect], ...]:
    """Run a Python file of the user and take the effects it defines, through the conformance kit unless told not to.

    Raises:
        PostprocError: the file does not run (EFF001), has no effect (EFF008) or two classes of one name (EFF007), or an
            effect fails a check.
    """
    path = Path(os.path.realpath(path))
    try:
        data = path.read_bytes()
    except OSError as error:
        message, help_ = f"the effect file cannot be read: {error.strerror}", "check the spelling and the folder"
        raise PostprocError.of("EFF001", message, Source(str(path), b""), help=help_) from error
    # The name changes with the content, so that an edited file is loaded afresh and an unchanged one is not.
    name = f"effects_in_{path.stem}_{hashlib.sha256(os.fsencode(path) + data).hexdigest()[:12]}"
    if name not in sys.modules:
        _run(name, path, data)
    classes = tuple(effects_of(sys.modules[name]))
    if not classes:
        help = "define a class derived from `Effect` (postproc.effects.base)"
        message = "the file defines no effect"
        raise PostprocError.of("EFF008", message, Source(str(path), data), help=help)
    _check_names(Source(str(path), data))
    if check and (found := problems_of(classes)):
        raise PostprocError(found)
    return classes


def effects_of(module: ModuleType) -> list[type[Effect]]:
    """Effects that a module defines itself, in the order of the file; imported ones are not its own."""
    return [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Effect) and value.__module__ == module.__name__
    ]


def problems_of(classes: Iterable[type[Effect]]) -> tuple[Diagnostic, ...]:
    """Errors that the conformance kit finds."""
    from postproc.effects.conformance import check_effect

    return tuple(d for cls in classes for d in check_effect(cls) if d.severity == "error")


def _run(name: str, path: Path, data: bytes) -> None:
    spec: Any = importlib.util.spec_from_file_location(name, path)
    source = Source(str(path), data)
    if spec is None:
        raise PostprocError.of("EFF001", "an effect file must end in `.py`", source)
    module = importlib.util.module_from_spec(spec)
    # Pickle and inspect look classes up by the module's name.
    sys.modules[name] = module
    try:
        with redirect_stdout(sys.stderr):  # stdout is for results
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        line = line_of(error, str(path))
        span = line_span(source, line) if line else None
        message = f"the effect file does not run: {describe(error)}"
        help = "run it with `python` to see the whole error"
        if "no type annotation" in str(error):
            help = "write the type of every parameter: `step_rad: float = param(..)`, `Array` for several numbers"
        raise PostprocError.of("EFF001", message, source, span, help) from error


def _check_names(source: Source) -> None:
    """The second of two classes of one name would silently take the place of the first."""
    seen: set[str] = set()
    for node in ast.parse(source.data).body:
        if isinstance(node, ast.ClassDef):
            if node.name in seen:
                message, help = f"the class `{node.name}` is defined twice", "give each effect a name of its own"
                span = line_span(source, node.lineno)
                raise PostprocError.of("EFF007", message, source, span, help)
            seen.add(node.name)
