"""Statements read from the bytes of one file: a cursor with the findings made on the way, and the grammar."""

from __future__ import annotations

import re

from postproc.diagnostics import Diagnostic, Severity, Source, Span
from postproc.rapid.syntax import patterns
from postproc.rapid.syntax.expressions import ExpressionError, read_expression
from postproc.rapid.syntax.nodes import Branch, Declaration, Statement
from postproc.rapid.syntax.tokens import COMMENT, STRING, many, skip


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


MAX_NESTING = 100
DATA_WORDS = {b"const", b"pers", b"var"}
ROUTINE_WORDS = {b"proc", b"func", b"trap"}
HANDLER_WORDS = {b"error", b"undo", b"backward"}
BLOCK_ENDS = {b"endif", b"endfor", b"endwhile", b"endtest", b"else", b"elseif", b"case", b"default"}
ROUTINE_ENDS = {b"endproc", b"endfunc", b"endtrap"}
MODULE_ENDS = ROUTINE_WORDS | {b"endmodule", b"module", b"local", b"record", b"endrecord"}
TERMINATORS = BLOCK_ENDS | ROUTINE_ENDS | HANDLER_WORDS | MODULE_ENDS
LEAVE_WORDS = {b"raise", b"retry", b"trynext", b"exit", b"exitcycle"}

TO_THEN = patterns.up_to(b"THEN")
TO_DO = patterns.up_to(b"DO")
TO_FROM = patterns.up_to(b"FROM")
TO_TO = patterns.up_to(b"TO")
TO_STEP = patterns.up_to(b"STEP")
TO_TEST_BODY = re.compile(
    many(
        rb"(?!(?<![\w\x80-\xff])(?i:CASE|DEFAULT|ENDTEST)(?![\w\x80-\xff]))(?:" + STRING + rb"|" + COMMENT + rb"|[^;])"
    )
)
TO_COLON = re.compile(many(rb"[^;:!\"\n]++|" + STRING + rb"|" + COMMENT + rb"|\n"))
SIMPLE = {b"return": "return", b"goto": "goto", b"connect": "connect", **{w: "leave" for w in LEAVE_WORDS}}
BLOCKS = {b"if", b"for", b"while", b"test"}


class StatementReader(Cursor):
    """Reads one construct per method and moves the cursor behind it."""

    def block(self) -> list[Statement]:
        """Read statements up to the next word that ends a block, before which the cursor stays.

        Data declarations among them go to ``local_data`` instead.
        """
        statements: list[Statement] = []
        self.depth += 1
        while (statement := self.statement()) is not None:
            if statement.kind != "data":
                statements.append(statement)
        self.depth -= 1
        return statements

    def statement(self) -> Statement | None:
        """Read the next statement; None at a word that ends the block or at the end of the file.

        A data declaration goes to ``local_data`` and is returned as a statement of kind ``data``.
        """
        data = self.data
        lead = patterns.LEAD.match(data, self.at)
        name = lead[1] if lead else None
        if lead is None or name is None:
            return self.statement_without_word(lead.end() if lead else self.at)
        start = lead.start(1)
        word = name.lower()
        if word in TERMINATORS:
            return None
        if word in BLOCKS:
            return self.nested(word, start, lead.end(1))
        mark = lead[2]
        if mark is None:
            if word in DATA_WORDS:
                self.at = start
                declaration = self.declaration(start, "")
                if declaration is not None:
                    self.local_data.append(declaration)
                return Statement("data", (start, self.at))
            end = self.close_statement(start, lead.end(1))
            span = (start, self.at)
            if word in SIMPLE:
                part = self.part(lead.end(1), end)
                return Statement(SIMPLE[word], span, text(data[part[0] : part[1]]).lower(), (part,))
            return Statement("call", span, word.decode("latin-1"))
        if mark == b":":
            self.at = lead.end()
            return Statement("label", (start, self.at), text(word))
        reference = lead if mark == b":=" else patterns.REFERENCE.match(data, start)
        if reference is None:
            return self.opaque(start)
        end = self.close_statement(start, reference.end())
        target = (start, patterns.trimmed(data, start, reference.end() - 2))
        value = self.part(reference.end(), end)
        return Statement("assign", (start, self.at), text(word), (target, value))

    def statement_without_word(self, at: int) -> Statement | None:
        """Read a statement that begins with no word: ``%name%`` call, placeholder or lone semicolon.

        Anything else is kept as an ``opaque`` statement (RAP003); None at the end of the file.

        Args:
            at: byte offset of its first character, behind blanks and comments.
        """
        data = self.data
        if at >= self.end:
            return None
        first = data[at : at + 1]
        if first == b";":
            self.at = at + 1
            return Statement("placeholder", (at, self.at))
        if first == b"%":
            end, closed = self.to_semicolon(at)
            self.at = end + 1 if closed else end
            return Statement("call", (at, self.at), "%")
        place = patterns.PLACE_PATTERN.match(data, at)
        if place is not None:
            self.at = place.end()
            self.semicolon()
            return Statement("placeholder", (at, self.at))
        return self.opaque(at)

    def nested(self, word: bytes, start: int, end: int) -> Statement:
        """Read an IF, TEST, FOR or WHILE statement; opaque if blocks are nested deeper than ``MAX_NESTING``.

        Args:
            word: the keyword in lower case; start, end: its span.
        """
        if self.depth > MAX_NESTING:
            self.report("RAP009", "error", f"blocks are nested deeper than {MAX_NESTING}", (start, end))
            return self.opaque(start)
        if word == b"if":
            return self.if_at(start, end)
        if word == b"test":
            return self.test_at(start, end)
        return self.loop_at(word, start, end)

    def close(self, word: bytes, start: int) -> None:
        """Move behind ``word`` (``endif`` or the like), which ends the block begun at ``start``, or report RAP010."""
        kind, _, end = self.peek()
        if kind == word:
            self.at = end
            self.semicolon()
        else:
            opener = text(word[3:].upper())
            message, span = f"{opener} has no {text(word.upper())}", (start, start + len(opener))
            self.report("RAP010", "error", message, span, "check the blocks of this routine")

    def if_at(self, start: int, end: int) -> Statement:
        """Read IF with its branches, or ``IF condition statement``; ``start`` to ``end`` is the span of the word IF."""
        condition, has_then = self.head(TO_THEN, end, 4)
        if not has_then:
            return self.compact_if(start, end)
        branches = [Branch((condition,), tuple(self.block()))]
        while True:
            word, _, after = self.peek()
            if word == b"elseif":
                condition, has_then = self.head(TO_THEN, after, 4)
                if not has_then:
                    self.at = condition[1]
                branches.append(Branch((condition,), tuple(self.block())))
            elif word == b"else":
                self.at = after
                branches.append(Branch((), tuple(self.block())))
            else:
                break
        self.close(b"endif", start)
        return Statement("if", (start, self.at), branches=tuple(branches))

    def compact_if(self, start: int, end: int) -> Statement:
        """Read ``IF condition statement``, in which the longest expression is the condition; opaque if there is none.

        Args:
            start, end: span of the word IF.
        """
        stop, _ = self.to_semicolon(end)
        try:
            condition = read_expression(self.data, end, stop)
        except ExpressionError:
            return self.opaque(start)
        self.at = condition.span[1]
        self.depth += 1
        inner = self.statement()
        self.depth -= 1
        if inner is None:
            return self.opaque(start)
        return Statement("if", (start, self.at), branches=(Branch((condition.span,), (inner,)),))

    def loop_at(self, word: bytes, start: int, end: int) -> Statement:
        """Read a FOR or WHILE loop with its body; opaque if its head cannot be read.

        Args:
            word: the keyword in lower case; start, end: its span.
        """
        self.at = end
        if word == b"while":
            condition, ok = self.head(TO_DO, end, 2)
            name, parts = "", [condition]
        else:
            variable, ok = self.head(TO_FROM, end, 4)
            name = text(self.data[variable[0] : variable[1]]).lower()
            first, ok = self.head(TO_TO, self.at, 2) if ok else (variable, False)
            last, ok = self.head(TO_DO, self.at, 2) if ok else (first, False)
            parts = [first, last]
            step = TO_STEP.match(self.data, last[0], last[1])
            if ok and step is not None and step.end() < last[1]:
                at = skip(self.data, step.end() + 4, last[1])
                parts = [first, (last[0], patterns.trimmed(self.data, last[0], step.end())), (at, last[1])]
        if not ok:
            return self.opaque(start)
        body = tuple(self.block())
        self.close(b"end" + word, start)
        return Statement(text(word), (start, self.at), name, tuple(parts), (Branch((), body),))

    def test_at(self, start: int, end: int) -> Statement:
        """Read TEST with its cases, opaque if other text precedes them; ``start`` to ``end``: span of the word TEST."""
        match = TO_TEST_BODY.match(self.data, end)
        self.at = match.end() if match else end
        subject = self.part(end, self.at)
        branches = []
        while True:
            word, begin, after = self.peek()
            if word == b"case":
                colon = TO_COLON.match(self.data, after)
                close = colon.end() if colon else after
                self.at = min(close + 1, self.end)
                conditions = tuple(span for span in patterns.listed(self.data, after, close) if span[0] < span[1])
                branches.append(Branch(conditions, tuple(self.block())))
            elif word == b"default":
                at = skip(self.data, after, self.end)
                self.at = at + 1 if self.data[at : at + 1] == b":" else after
                branches.append(Branch((), tuple(self.block())))
            elif word not in TERMINATORS and begin < self.end and not branches:
                return self.opaque(start)
            else:
                break
        self.close(b"endtest", start)
        return Statement("test", (start, self.at), parts=(subject,), branches=tuple(branches))

    def declaration(self, start: int, scope: str) -> Declaration | None:
        """Read the data declaration at the cursor; None, with an opaque finding, if it cannot be read.

        Args:
            start: where it begins, scope word included; scope: LOCAL, TASK or empty.
        """
        at = skip(self.data, self.at, self.end)
        match = patterns.DECLARATION.match(self.data, at)
        if match is None:
            self.opaque(start)
            return None
        end = self.close_statement(start, match.end())
        init = self.part(match.end(), end) if match[5] else None
        dims: tuple[Span, ...] = ()
        if match[4]:
            inner = self.data[match.start(4) + 1 : match.end(4) - 1]
            offset = match.start(4) + 1
            spans = []
            for part in inner.split(b","):
                spans.append((offset, offset + len(part)))
                offset += len(part) + 1
            dims = tuple(spans)
        return Declaration(
            self.source, (start, self.at), self.module, self.routine, scope, text(match[1]).upper(),
            text(match[2]).lower(), text(match[3]), dims, init,
        )  # fmt: skip
