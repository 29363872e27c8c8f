"""A cursor over the bytes of one file, and the findings made on the way."""

from __future__ import annotations

import re

from postproc.diagnostics import Diagnostic, Severity, Source, Span
from postproc.rapid.syntax import patterns
from postproc.rapid.syntax.nodes import Declaration, Statement
from postproc.rapid.syntax.tokens import skip


def text(data: bytes) -> str:
    """Bytes decoded as ISO 8859-1, in which every byte is a character."""
    return data.decode("latin-1")


class Cursor:
    """Position in a file; the methods step over small pieces.

    ``at`` is the present byte offset, ``module`` and ``routine`` are the names of those around it; ``local_data`` are
    the declarations of that routine so far, ``depth`` counts the blocks around ``at``.
    """

    def __init__(self, source: Source) -> None:
        """Start at the first byte of the file, outside any module."""
        self.source = source
        self.data = source.data
        self.end = len(source.data)
        self.at = 0
        self.diagnostics: list[Diagnostic] = []
        self.module = ""
        self.routine = ""
        self.local_data: list[Declaration] = []
        self.depth = 0

    def report(self, code: str, severity: Severity, message: str, span: Span, help: str = "") -> None:
        """Add a finding about a byte span of the file to ``diagnostics``."""
        self.diagnostics.append(Diagnostic(code, severity, message, self.source, span, help))

    def peek(self) -> tuple[bytes, int, int]:
        """The next word in lower case, its begin and its end, without moving; an empty word if something else comes."""
        match = patterns.WORD.match(self.data, self.at)
        if match is None:
            at = skip(self.data, self.at, self.end)
            return b"", at, at
        return match[1].lower(), match.start(1), match.end(1)

    def semicolon(self) -> None:
        """Move behind a ``;`` if one comes next (some files have one after ENDIF)."""
        at = skip(self.data, self.at, self.end)
        if self.data[at : at + 1] == b";":
            self.at = at + 1

    def to_semicolon(self, start: int) -> tuple[int, bool]:
        """Offset of the semicolon behind ``start``, and True; or where the statement ends without one, and False.

        It ends without one at the next line that begins a routine, block, declaration or motion (``HARD_STOP``).
        """
        match = patterns.TO_SEMICOLON.match(self.data, start)
        end = match.end() if match else start
        if self.data.find(b"\n", start, end) >= 0:
            stop = patterns.HARD_STOP.search(self.data, start, end + 1)
            if stop is not None:
                return max(start + 1, stop.start()), False
        return end, end < self.end

    def close_statement(self, start: int, behind: int) -> int:
        """Move behind a statement and its semicolon, or report RAP008; returns its end without the semicolon.

        Args:
            start: first byte of the statement; behind: offset inside it from which the semicolon is searched.
        """
        end, closed = self.to_semicolon(behind)
        if not closed:
            self.report("RAP008", "error", "the statement has no `;`", (start, end), "add the missing semicolon")
        self.at = end + 1 if closed else end
        return end

    def part(self, start: int, end: int) -> Span:
        """The span from ``start`` to ``end`` without the blanks and comments at both ends."""
        first = skip(self.data, start, end)
        return first, max(first, patterns.trimmed(self.data, first, end))

    def opaque(self, start: int) -> Statement:
        """Move behind text at ``start`` that cannot be read, up to the end that `to_semicolon` finds; report RAP003.

        Returns:
            A statement of kind ``opaque`` that spans the text; it is kept as it stands.
        """
        end, closed = self.to_semicolon(start)
        self.at = max(end + 1 if closed else end, min(start + 1, self.end))
        span = (start, max(start, self.at))
        if span[0] < span[1]:
            shown = text(self.data[start : min(start + 40, self.at)]).split("\n")[0].strip()
            self.report("RAP003", "warning", f"`{shown}` is not understood and is kept as it stands", span)
        return Statement("opaque", span)

    def head(self, pattern: re.Pattern[bytes], at: int, length: int) -> tuple[Span, bool]:
        """Span of the expression from ``at`` to a keyword, and whether the keyword is there; if so, move behind it.

        Args:
            pattern: matches the text before the keyword (`patterns.up_to`); length: letters of the keyword.
        """
        match = pattern.match(self.data, at)
        end = match.end() if match else at
        hit = end < self.end and self.data[end : end + 1] != b";"
        if hit:
            self.at = end + length
        return self.part(at, end), hit
