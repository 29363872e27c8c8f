"""A Python file of the user, run as a module whose name changes with its content."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from contextlib import redirect_stdout
from pathlib import Path
from types import ModuleType
from typing import Any

from postproc.diagnostics import PostprocError, Source
from postproc.effects.findings import describe, line_of, line_span
from postproc.files import read_file


def load_module(path: str | Path) -> tuple[ModuleType, Source]:
    """Run a Python file and return its module and its source; the same content is run only once.

    Raises:
        PostprocError: EFF001, the file cannot be read or does not run.
    """
    path = Path(os.path.realpath(path))
    try:
        data = read_file(path)
    except OSError as error:
        message, help_ = f"the effect file cannot be read: {error.strerror}", "check the spelling and the folder"
        raise PostprocError.of("EFF001", message, Source(str(path), b""), help=help_) from error
    # An edited file is loaded afresh, and an unchanged one is not.
    name = f"effects_in_{path.stem}_{hashlib.sha256(os.fsencode(path) + data).hexdigest()[:12]}"
    if name not in sys.modules:
        _run(name, path, data)
    return sys.modules[name], Source(str(path), data)


def _run(name: str, path: Path, data: bytes) -> None:
    """Run a file with this content as the module ``name``; EFF001 where that fails. Its prints go to stderr."""
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
