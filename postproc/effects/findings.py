"""Findings about effects, placed where they are written."""

from __future__ import annotations

import inspect
import traceback
from pathlib import Path

from postproc.diagnostics import Diagnostic, Source, Span


def origin(cls: type) -> str:
    """Return ``file:line`` where an effect is defined; its module where it has no file."""
    return finding("", "", cls).place.rpartition(":")[0] or cls.__module__


def finding(
    code: str, message: str, cls: type, *, member: str = "", line: int = 0, help: str = "", warn: bool = False
) -> Diagnostic:
    """Return a diagnostic placed at an effect's class, at one of its members, or at a line of its file.

    Args:
        member: name of a field or method, empty for the class.
        line: of the file, from 1; 0 for the place of class or member.
        warn: a warning, not an error.
    """
    source, span = None, None
    try:
        lines, start = inspect.getsourcelines(cls)
        path = inspect.getsourcefile(cls) or ""
        source = Source(path, Path(path).read_bytes())
        marks = (f"{member}:", f"{member} =", f"def {member}(")
        at = next((i for i, text in enumerate(lines) if member and text.lstrip().startswith(marks)), 0)
        span = line_span(source, line or start + at)
    except (OSError, TypeError):
        pass  # A class made at a prompt has no source; the message still names it.
    return Diagnostic(code, "warning" if warn else "error", message, source, span, help)


def line_span(source: Source, line: int) -> Span:
    """Return the byte offsets of the text of a line (from 1), without its indentation and blanks at its end."""
    raw = source.data[source.line_starts[line - 1] :].split(b"\n", 1)[0].rstrip()
    start = source.line_starts[line - 1] + len(raw) - len(raw.lstrip())
    return start, start + len(raw.strip())


def line_of(error: BaseException, path: str) -> int:
    """Return the last line of the file at ``path`` in an exception's traceback; 0 where the file is not in it."""
    if isinstance(error, SyntaxError) and error.filename == path:
        return error.lineno or 0
    frames = [f.lineno or 0 for f in traceback.extract_tb(error.__traceback__) if f.filename == path]
    return frames[-1] if frames else 0


def describe(error: BaseException) -> str:
    """Return an exception's type and message; of a syntax error without the place."""
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
