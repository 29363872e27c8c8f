"""Findings about the user's files: collected as values, rendered with position, caret and help.

Positions are byte offsets into the file; line and column are computed only when somebody reads them.
Lines are counted by LF alone (``str.splitlines`` also splits on NEL, VT and FS, which shifts line numbers).
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from enum import Enum, auto
from functools import cached_property
from itertools import accumulate
from typing import Any, Literal, Self

from postproc.excerpt import underlined, wrapped

Severity = Literal["error", "warning", "info"]
Span = tuple[int, int]

_BLOCK = 4096
_CONTINUED = bytes(range(0x80, 0xC0))  # bytes within a character of UTF-8


_CONTROL = "\r(?!\n)|[\0-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f"
_DIRECTION = "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff"
_INVISIBLE = re.compile(f"{_CONTROL}{_DIRECTION}\ud800-\udfff]")


def visible(text: str) -> str:
    r"""Return text with control characters as escapes, ``\x1b``, as a terminal may show it.

    A program could otherwise move the cursor, change the clipboard (OSC 52), or turn the direction of what is read.
    """
    return _INVISIBLE.sub(lambda match: match[0].encode("unicode_escape", "surrogatepass").decode(), text)


def one_line(text: str) -> str:
    """Return text as `visible` does, with line feeds escaped too, as file names may hold them."""
    return visible(text).replace("\n", "\\n")


@dataclass(frozen=True)
class Source:
    """A file as it was read.

    Args:
        path: name shown to the user.
        data: the bytes of the file.
        read_only: it is read along with others for what it declares and defines, and never changed.
    """

    path: str
    data: bytes = field(repr=False)
    read_only: bool = False

    @cached_property
    def line_starts(self) -> list[int]:
        """Byte offsets at which the lines begin, separated by LF."""
        return [0, *(feed.end() for feed in re.finditer(b"\n", self.data))]

    @cached_property
    def encoding(self) -> str:
        """Encoding of the bytes: UTF-8 where they are valid UTF-8, else latin-1."""
        try:
            self.data.decode("utf-8")
        except UnicodeDecodeError:
            return "latin-1"
        return "utf-8"

    @cached_property
    def _characters(self) -> list[int]:
        """Numbers of characters before every block of ``_BLOCK`` bytes, for fast positions in long lines."""
        begins = range(0, len(self.data), _BLOCK)
        return [0, *accumulate(self._count_characters(at, at + _BLOCK) for at in begins)]

    def _count_characters(self, start: int, end: int) -> int:
        """Return the number of characters that begin between two byte offsets."""
        part = self.data[start:end]
        return len(part if self.encoding == "latin-1" else part.translate(None, _CONTINUED))

    def _characters_before(self, offset: int) -> int:
        """Return the number of characters before a byte offset."""
        block = min(offset, len(self.data)) // _BLOCK
        return self._characters[block] + self._count_characters(block * _BLOCK, offset)

    def row(self, offset: int) -> int:
        """Return the line number, from 1, of a byte offset."""
        return bisect_right(self.line_starts, offset)

    def position(self, offset: int) -> tuple[int, int]:
        """Return line and column of a byte offset, both counted from 1, columns in characters."""
        row = self.row(offset)
        start = self.line_starts[row - 1]
        return row, self._characters_before(offset) - self._characters_before(start) + 1

    def line_span(self, number: int) -> Span:
        """Return the byte offsets of a line, counted from 1, without its line end."""
        start = self.line_starts[number - 1]
        return start, start + len(self.line(number).encode(self.encoding))

    def line(self, number: int) -> str:
        """Return the text of a line, counted from 1, without its line end."""
        start = self.line_starts[number - 1]
        end = self.line_starts[number] if number < len(self.line_starts) else len(self.data)
        return self.data[start:end].decode(self.encoding, "replace").rstrip("\r\n")


class Matter(Enum):
    """What a finding is about, by which the package decides; the code and words of a finding are for people alone."""

    NO_MODULE = auto()  # a program file that is no RAPID text
    UNDECLARED = auto()  # data that has no value in any of the files
    UNSEEN = auto()  # a routine in none of the files, which is taken to do nothing
    UNFOLLOWABLE = auto()  # a way to a target that the arm cannot follow as it is programmed
    CELL = auto()  # what holds tool and work or moves them, which no other value of a target changes
    MEASURED = auto()  # data that the program itself measures
    TAUGHT_MOVED = auto()  # data that is to be taught, and that the program moves
    SKIPPED = auto()  # a statement that is left as it is
    STILL = auto()  # a program that moves nothing
    OMITTED = auto()  # a part of the model that does not hold for the program
    CONTROLLER = auto()  # what the controller does, or could do
    OFF = auto()  # a statement that stays farther off than its tolerance
    READ_ALONG = auto()  # a file near a program that declares what it lacks
    UNREADABLE = auto()  # an input that cannot be read now, and is not gone
    CONTRADICTED = auto()  # measurements that contradict each other, or the arm: no promise follows from them
    EDITED = auto()  # a file that somebody changed where it is written anew


@dataclass(frozen=True, slots=True)
class Finding:
    """A `Diagnostic` without the file that it stands in: what documents list, and what leaves a process.

    Args:
        path, line, column: where it stands, line and column from 1; None where that is not known.
        offset: bytes before it in the file. help: None without one.
    """

    code: str
    severity: Severity
    message: str
    path: str | None = None
    line: int | None = None
    column: int | None = None
    offset: int | None = None
    help: str | None = None
    matter: Matter | None = None
    name: str = ""
    size: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """Return the finding as an entry of ``diagnostics`` in documents."""
        shown = ("code", "severity", "message", "path", "line", "column", "offset", "help")
        result = {key: getattr(self, key) for key in shown}
        return {**result, "undeclared": self.name} if self.matter is Matter.UNDECLARED else result


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding.

    Args:
        code: stage and number, such as ``RAP012``; explained by ``postproc explain``.
        severity: ``error`` stops the output, ``warning`` and ``info`` do not.
        message: one sentence, names in backticks.
        source: the file it stands in, if any.
        span: byte offsets ``(start, end)`` in that file.
        help: one action the user can take.
        matter: what it is about, where something is decided by it; name: of the data that it is about, there.
        size: the figure that it tells, such as a length [mm], by which the worst of its kind is found; 0 without one.
    """

    code: str
    severity: Severity
    message: str
    source: Source | None = None
    span: Span | None = None
    help: str = ""
    matter: Matter | None = None
    name: str = ""
    size: float = 0.0

    @property
    def place(self) -> str:
        """``file:line:col``, as far as it is known; else empty."""
        if self.source is None:
            return ""
        if self.span is None:
            return self.source.path
        line, column = self.source.position(self.span[0])
        return f"{self.source.path}:{line}:{column}"

    def render(self, width: int | None = None) -> str:
        """Return the text for a terminal: message, place, source line with carets, help.

        Args:
            width: columns that a line may take, None for as many as it needs.
        """
        lines = [wrapped(f"{self.severity}[{self.code}]: {one_line(self.message)}", width)]
        if self.place:
            lines.append(f" --> {one_line(self.place)}")
        if self.source is not None and self.span is not None:
            number, column = self.source.position(self.span[0])
            text = self.source.line(number)
            length = len(self.source.data[slice(*self.span)].decode(self.source.encoding, "replace"))
            before, marked = text[: column - 1], text[column - 1 :]
            margin = " " * len(str(number))
            room = None if width is None else max(20, width - len(margin) - 3)
            shown, carets = underlined(visible(before), visible(marked[:length]), visible(marked[length:]), room)
            lines += [f"{margin} |", f"{number} | {shown}", f"{margin} | {carets}"]
        if self.help:
            # A proposal has lines of its own; what a file name puts there cannot be taken for another finding.
            first, *others = visible(self.help).split("\n")
            lines += [wrapped(f"  = help: {first}", width, " " * 8), *(f"      {line}" for line in others)]
        return "\n".join(lines)

    @property
    def finding(self) -> Finding:
        """The diagnostic with line and column in place of the bytes of its file."""
        source, at = self.source, None if self.span is None else self.span[0]
        line, column = (None, None) if source is None or at is None else source.position(at)
        path, help_ = None if source is None else source.path, self.help or None
        stated = (self.code, self.severity, self.message)
        return Finding(*stated, path, line, column, at, help_, self.matter, self.name, self.size)

    def as_json(self) -> dict[str, Any]:
        """Return the finding as an entry of ``diagnostics`` in documents."""
        return self.finding.as_json()


class PostprocError(Exception):
    """Work cannot go on; carries the findings that say why.

    Args:
        diagnostics: at least one finding of severity ``error``.
        exit_code: 1 not safe to compensate, 2 bad usage or bad input file.
    """

    def __init__(self, diagnostics: Diagnostic | Iterable[Diagnostic], exit_code: int = 2) -> None:
        findings = (diagnostics,) if isinstance(diagnostics, Diagnostic) else tuple(diagnostics)
        super().__init__(findings, exit_code)
        self.diagnostics = findings
        self.exit_code = exit_code

    @classmethod
    def of(
        cls,
        code: str,
        message: str,
        source: Source | None = None,
        span: Span | None = None,
        help: str = "",
        *,
        exit_code: int = 2,
    ) -> Self:
        """Build the exception from one finding of severity ``error``.

        Args:
            code, message, source, span, help: of the finding, as in ``Diagnostic``. exit_code: of the command.
        """
        return cls(Diagnostic(code, "error", message, source, span, help), exit_code)

    def __str__(self) -> str:
        """Return all findings as rendered text."""
        return "\n".join(d.render() for d in self.diagnostics)


def did_you_mean(name: str, known: Iterable[str], most: int = 1, cutoff: float = 0.6) -> str:
    """Return "did you mean" with the nearest known names, at most ``most``; empty where none is near. Case is ignored.

    Args:
        cutoff: likeness from 0 to 1 that a name needs.
    """
    spelt = {other.lower(): other for other in known}
    close = [spelt[c] for c in get_close_matches(name.lower(), spelt, most, cutoff)]
    return "did you mean " + " or ".join(f"`{c}`" for c in close) + "?" if close else ""


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Tell whether any finding has severity ``error``."""
    return any(d.severity == "error" for d in diagnostics)


def joined(words: Sequence[str], last: str = "and") -> str:
    """Join words as ``a``, ``a and b``, ``a, b and c``.

    Args:
        last: the word before the last one.
    """
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
