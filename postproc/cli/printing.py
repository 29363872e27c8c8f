"""How results and findings are printed: documents on stdout, everything for people on stderr."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextvars import ContextVar
from json import dumps
from pathlib import Path
from typing import Any, TextIO

from postproc import __version__
from postproc.diagnostics import Diagnostic, visible
from postproc.excerpt import wrapped
from postproc.report.blocks import plain
from postproc.report.terminal import Line

COLORS = {"error": "\x1b[1;31m", "warning": "\x1b[1;33m", "info": "\x1b[1;36m", "good": "\x1b[1;32m"}
RESET = "\x1b[0m"
STDIN = "<stdin>"  # what `-` on the command line is called
MOST_SHOWN = {"error": 10, "warning": 3, "info": 3}
"""Findings of one code and wording that are printed in full: each error has to be mended."""
NARROWEST = 40  # columns; on narrower terminals nothing is wrapped
MOST_LISTED_PLACES = 12  # lines that are named of the findings that are not printed
VERBOSE: ContextVar[bool] = ContextVar("VERBOSE", default=False)
"""Whether every finding is printed in full, ``--verbose``."""


def show(diagnostics: Iterable[Diagnostic]) -> None:
    """Print findings on stderr, one of each code, place and wording.

    Findings that differ only in names and numbers form a group: 10 errors or 3 warnings of it are printed in full, and
    the lines of the others are listed, unless ``--verbose`` asks for all.
    """
    groups: dict[tuple[str, str, str], dict[object, Diagnostic]] = {}
    for d in diagnostics:
        wording = re.sub(r"[-+.\d]+", "", d.message)
        group = groups.setdefault((d.code, d.severity, re.sub("`[^`]*`", "", wording)), {})
        group.setdefault((d.place, d.span, wording) if d.span else d.message, d)
    width = width_of(sys.stderr)
    colored = _takes_colors(sys.stderr)
    for (code, severity, _), group in groups.items():
        findings = list(group.values())
        most = len(findings) if VERBOSE.get() else MOST_SHOWN[severity]
        for d in findings[:most]:
            text = d.render(width)  # which is fit for a terminal
            print_stderr(_colored(text, d) if colored else text)
        if len(findings) > most:
            say(f"{code}: {len(findings) - most} more like this{_lines(findings[most:])}; `--verbose` shows them")


def _lines(findings: Sequence[Diagnostic]) -> str:
    """Return a clause with the line numbers of findings, if they are all in one file; else an empty text."""
    places = [(d.source.path, d.source.position(d.span[0])[0]) for d in findings if d.source and d.span]
    if not places or len({path for path, _ in places}) > 1:
        return ""
    lines = list(dict.fromkeys(line for _, line in places))
    listed = ", ".join(map(str, lines[:MOST_LISTED_PLACES])) + (", .." if len(lines) > MOST_LISTED_PLACES else "")
    return f" in line{'s' * (len(lines) > 1)} {listed}"


def _colored(text: str, finding: Diagnostic) -> str:
    """Return a finding's rendered text with severity, code and carets in the colour of its severity."""
    color, head = COLORS[finding.severity], len(finding.severity) + len(finding.code) + 2
    carets = re.sub(r"(?m)^( +\| *)(\^+)$", rf"\g<1>{color}\g<2>{RESET}", text[head:], count=1)
    return f"{color}{text[:head]}{RESET}{carets}"


def _takes_colors(stream: TextIO) -> bool:
    """Return whether a stream is a terminal that may be given colours (https://no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


def print_lines(lines: Iterable[Line], stream: TextIO) -> None:
    """Print the lines of a document, wrapped and without control characters, in the colour of what they say."""
    colored = _takes_colors(stream)
    for tone, line in lines:
        text = _fitted(line, stream)
        text = f"{COLORS[tone]}{text}{RESET}" if tone and colored else text
        print_stderr(text) if stream is sys.stderr else print(text, file=stream)


def width_of(stream: TextIO) -> int | None:
    """Return the columns of a terminal; None where the stream is none, or it is too narrow for wrapping."""
    if not stream.isatty():
        return None
    try:
        width = int(os.environ.get("COLUMNS") or os.get_terminal_size(stream.fileno()).columns)
    except (OSError, ValueError):
        return None
    return width if width >= NARROWEST else None


def print_stderr(text: str, end: str = "\n") -> None:
    """Print on stderr; a reader that has gone (``2>&1 | head``) is no error."""
    try:
        print(text, end=end, file=sys.stderr, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def say(text: str) -> None:
    """Print text for people on stderr, wrapped and without control characters."""
    print_stderr(_fitted(text, sys.stderr))


def put(text: str) -> None:
    """Print text that is the result on stdout, wrapped and without control characters."""
    print(_fitted(text, sys.stdout))


def _fitted(text: str, stream: TextIO) -> str:
    """Return text without control characters, its lines wrapped between words to the width of the terminal."""
    width = width_of(stream)
    return "\n".join(wrapped(line, width) for line in visible(text).split("\n"))


def say_next(what: str, *words: object, lead: str = "next") -> None:
    """Print the command that may come next, quoted for a shell, and what it does.

    Args:
        what: what it does, as a clause that follows the command. words: of the command after ``postproc``.
        lead: the word before it.
    """
    shown = ["-" if str(word) == STDIN else str(word) for word in words]
    # Not wrapped: what a terminal breaks by itself is copied whole.
    print_stderr(visible(f"{lead}: `postproc {shlex.join(shown)}` {what}"))


def print_document(document: Mapping[str, Any], form: str = "json", root: Path = Path()) -> None:
    """Print a document on stdout as JSON with the version that wrote it, or its findings and welds as SARIF.

    Args:
        form: ``json`` or ``sarif``.
        root: folder at which the paths of its findings start; those of SARIF start at the working folder.
    """
    if form == "sarif":
        from postproc.report.sarif import sarif
        from postproc.results.convert.figures import weld_notes

        parts = [document, *document.get("tasks", ())]  # of a batch, also those of its tasks
        findings = [finding for part in parts for finding in (*part.get("diagnostics", ()), *weld_notes(part))]
        document = sarif([f if f["path"] is None else {**f, "path": str(root / f["path"])} for f in findings])
    else:
        document = {"schema": document["schema"], "tool": __version__, **document}
    print(dumps(plain(document), indent=1, allow_nan=False))
