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
    """Position in a file; the methods step over small pieces."""

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
        """The next word in lower case with begin and end, without moving; an empty one if something else comes."""
        found = patterns.WORD.match(self.data, self.at)
        if found is None:
            at = skip(self.data, self.at, self.end)
            return b"", at, at
        return found[1].lower(), found.start(1), found.end(1)

    def semicolon(self) -> None:
        """Move behind a ``;`` if one comes next (some files have one after ENDIF)."""
        at = skip(self.data, self.at, self.end)
        if self.data[at : at + 1] == b";":
            self.at = at + 1

    def to_semicolon(self, start: int) -> tuple[int, bool]:
        """Offset at which the statement that starts at ``start`` ends (without semicolon), and whether it has one."""
        found = patterns.TO_SEMICOLON.match(self.data, start)
        end = found.end() if found else start
        if self.data.find(b"\n", start, end) >= 0:
            stop = patterns.HARD_STOP.search(self.data, start, end + 1)
            if stop is not None:
                return max(start + 1, stop.start()), False
        return end, end < self.end

    def close_statement(self, start: int, behind: int) -> int:
        """Move behind a statement and its semicolon, reporting RAP008 without one; returns where its text ends.

        Args:
            start: begin of the statement; behind: an offset inside it from which to search.
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
        """Move behind text that cannot be read, up to its semicolon or the next line that certainly begins something.

        Returns:
            A statement of kind ``opaque``; the text is reported as RAP003 and kept as it stands.
        """
        end, closed = self.to_semicolon(start)
        self.at = max(end + 1 if closed else end, min(start + 1, self.end))
        span = (start, max(start, self.at))
        if span[0] < span[1]:
            shown = text(self.data[start : min(start + 40, self.at)]).split("\n")[0].strip()
            self.report("RAP003", "warning", f"`{shown}` is not understood and is kept as it stands", span)
        return Statement("opaque", span)

    def head(self, pattern: re.Pattern[bytes], at: int, word: int) -> tuple[Span, bool]:
        """Span of the expression from ``at`` to a keyword of ``word`` letters, and whether the keyword is there.

        If it is, the cursor moves behind it.

        Args:
            pattern: matches the text before the keyword.
        """
        found = pattern.match(self.data, at)
        end = found.end() if found else at
        hit = end < self.end and self.data[end : end + 1] != b";"
        if hit:
            self.at = end + word
        return self.part(at, end), hit
