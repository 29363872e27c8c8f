"""How results and findings are printed: documents on stdout, everything for people on stderr."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from postproc import __version__
from postproc.diagnostics import Diagnostic, visible
from postproc.report.document import to_json

COLORS = {"error": "\x1b[1;31m", "warning": "\x1b[1;33m", "info": "\x1b[1;36m"}
RESET = "\x1b[0m"
STDIN = "<stdin>"  # what `-` on the command line is called
SHOWN = 10  # places of one code that are printed in full


def show(diagnostics: Iterable[Diagnostic]) -> None:
    """Print findings on stderr, one of each code, place and wording: a statement in a loop is wrong once.

    Wordings that differ in numbers alone are one; no error is left out behind warnings.

    The severity is coloured on a terminal (unless NO_COLOR is set), the rest is printed as it is.
    """
    colored = sys.stderr.isatty() and not os.environ.get("NO_COLOR")
    seen: dict[tuple[str, str], set[object]] = {}
    for diagnostic in diagnostics:
        places = seen.setdefault((diagnostic.code, diagnostic.severity), set())
        wording = re.sub(r"[-+.\d]+", "", diagnostic.message)
        place = (diagnostic.place, diagnostic.span, wording) if diagnostic.span else diagnostic.message
        if place in places:
            continue
        places.add(place)
        if len(places) > SHOWN:
            continue
        text = diagnostic.render()  # which is fit for a terminal
        if colored:
            head, rest = text[: len(diagnostic.severity)], text[len(diagnostic.severity) :]
            text = f"{COLORS[diagnostic.severity]}{head}{RESET}{rest}"
        print(text, file=sys.stderr)
    for (code, _), places in seen.items():
        if len(places) > SHOWN:
            say(f"{code}: {len(places) - SHOWN} more places")


def say(text: str) -> None:
    """Text for people, on stderr, which escapes what the terminal cannot show."""
    print(visible(text), file=sys.stderr)


def put(text: str) -> None:
    """Text that is the result, on stdout."""
    print(visible(text))


def say_next(what: str, *words: object, lead: str = "next") -> None:
    """The command that follows, as it can be copied, and what it does."""
    told = ["-" if str(word) == STDIN else str(word) for word in words]
    say(f"{lead}: `postproc {shlex.join(told)}` {what}")


def unmeasured(findings: Iterable[Diagnostic] = ()) -> str:
    """That nothing tells how near the real torch comes, and why."""
    known = "CMP016" not in {d.code for d in findings}
    why = "the model was not fitted to measurements of this arm" if known else "not all of the model holds here"
    return f"{why}: these are deviations in the model, and how near the real torch comes is not known (`postproc fit`)"


def print_result(document: Mapping[str, Any], text: str, json: bool, both: bool) -> None:
    """Print a result on stdout, as a document or as text; with the document the text on stderr where both are asked."""
    if json:
        print_json(document)
        if both:
            say(text)
    else:
        put(text)


def print_document(document: Mapping[str, Any], form: str) -> None:
    """Print a document on stdout as JSON, or its findings as SARIF (``form``)."""
    if form == "sarif":
        from postproc.report.sarif import findings_in, sarif

        print(to_json(sarif(findings_in(document))))
    else:
        print_json(document)


def asked_form(arguments: Sequence[str]) -> str | None:
    """Which form of document a command line asks for, as far as it can be read without knowing the command."""
    words = [word for argument in arguments for word in argument.split("=")]
    stated = next((form for option, form in pairwise(words) if option == "--format"), None)
    return "json" if "--json" in words else stated


def print_json(document: Mapping[str, Any]) -> None:
    """Print a document on stdout, with the version that wrote it; numbers that are not finite become null."""
    print(to_json({"schema": document["schema"], "tool": __version__, **document}))
