"""How results and findings are printed: documents on stdout, everything for people on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from postproc.diagnostics import Diagnostic
from postproc.report.document import to_json

COLORS = {"error": "\x1b[1;31m", "warning": "\x1b[1;33m", "info": "\x1b[1;36m"}
RESET = "\x1b[0m"
SHOWN = 20  # findings of one code that are printed in full


def show(diagnostics: Iterable[Diagnostic]) -> None:
    """Print findings on stderr: the severity in colour on a terminal (unless NO_COLOR is set), the rest as it is."""
    colored = sys.stderr.isatty() and not os.environ.get("NO_COLOR")
    seen: dict[str, int] = {}
    for diagnostic in diagnostics:
        seen[diagnostic.code] = seen.get(diagnostic.code, 0) + 1
        if seen[diagnostic.code] > SHOWN:
            continue
        text = diagnostic.render()
        if colored:
            head, rest = text[: len(diagnostic.severity)], text[len(diagnostic.severity) :]
            text = f"{COLORS[diagnostic.severity]}{head}{RESET}{rest}"
        say(text)
    for code, count in seen.items():
        if count > SHOWN:
            say(f"{code}: {count - SHOWN} more of the same")


def say(text: str) -> None:
    """A line for people, on stderr; characters that the terminal cannot show are escaped."""
    encoding = sys.stderr.encoding or "utf-8"
    print(text.encode(encoding, "backslashreplace").decode(encoding), file=sys.stderr)


def print_json(document: Mapping[str, Any]) -> None:
    """Print a document on stdout; numbers that are not finite become null."""
    print(to_json(document))
