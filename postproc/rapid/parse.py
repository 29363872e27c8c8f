"""Bytes to modules, routines and statements; what cannot be read becomes an opaque span and a diagnostic."""

from __future__ import annotations

import re

from postproc.diagnostics import Diagnostic, Severity, Source, Span
from postproc.rapid import patterns
from postproc.rapid.expressions import ExpressionError, read_expression
from postproc.rapid.syntax import Branch, Declaration, Module, Parameter, Record, Routine, Statement
from postproc.rapid.tokens import skip

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
    rb"(?:(?!(?<![\w\x80-\xff])(?i:CASE|DEFAULT|ENDTEST)(?![\w\x80-\xff]))(?:\"(?:[^\"\r\n]|\"\")*+\"|![^\n]*+|[^;]))*+"
)
TO_COLON = re.compile(rb"(?:[^;:!\"\n]++|\"(?:[^\"\r\n]|\"\")*+\"|![^\n]*+|\n)*+")


def text(data: bytes) -> str:
    return data.decode("latin-1")


class Parser:
    """A cursor over one file; the methods read one construct each and move the cursor behind it."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.data = source.data
        self.end = len(source.data)
        self.at = 0
        self.diagnostics: list[Diagnostic] = []
        self.module = ""
        self.routine = ""
        self.local_data: list[Declaration] = []
        self.depth = 0

    # -- helpers ------------------------------------------------------------------------------------------------

    def report(self, code: str, severity: Severity, message: str, span: Span, help: str = "") -> None:
        self.diagnostics.append(Diagnostic(code, severity, message, self.source, span, help))

    def peek(self) -> tuple[bytes, int, int]:
        """Next word in lower case with its span; an empty word when something else comes."""
        found = patterns.WORD.match(self.data, self.at)
        if found is None:
            at = skip(self.data, self.at, self.end)
            return b"", at, at
        return found[1].lower(), found.start(1), found.end(1)

    def semicolon(self) -> None:
        """Step over an optional ``;`` (some files have one after ENDIF)."""
        at = skip(self.data, self.at, self.end)
        if self.data[at : at + 1] == b";":
            self.at = at + 1

    def to_semicolon(self, start: int) -> tuple[int, bool]:
        """End of the statement that starts at ``start`` (before the semicolon), and whether it has one."""
        found = patterns.TO_SEMICOLON.match(self.data, start)
        end = found.end() if found else start
        if self.data.find(b"\n", start, end) >= 0:
            stop = patterns.HARD_STOP.search(self.data, start, end + 1)
            if stop is not None:
                return max(start + 1, stop.start()), False
        return end, end < self.end

    # -- files and modules --------------------------------------------------------------------------------------

    def file(self) -> list[Module]:
        modules: list[Module] = []
        header = re.compile(rb"(?:\xef\xbb\xbf)?\s*%%%.*?%%%", re.DOTALL).match(self.data)
        if header is not None:
            self.at = header.end()
        while True:
            word, start, end = self.peek()
            if word == b"module" and (head := patterns.MODULE_HEAD.match(self.data, start)) is not None:
                modules.append(self.module_at(head))
            elif word in DATA_WORDS | ROUTINE_WORDS | {b"local", b"task", b"record", b"alias"}:
                self.report(
                    "RAP004",
                    "warning",
                    "data or routines stand outside a MODULE",
                    (start, end),
                    "put them between MODULE and ENDMODULE; the controller does not load them otherwise",
                )
                modules.append(self.items("", (start, start), ()))
            elif start >= self.end:
                return modules
            else:
                line = patterns.TO_LINE_END.match(self.data, start)
                self.at = max(line.end() if line else start, start + 1)

    def module_at(self, head: re.Match[bytes]) -> Module:
        self.at = head.end()
        attributes = tuple(re.findall(r"\w+", text(head[2]).upper())) if head[2] else ()
        module = self.items(text(head[1]), head.span(), attributes)
        return module

    def items(self, name: str, head: Span, attributes: tuple[str, ...]) -> Module:
        """Everything up to ENDMODULE (which is consumed) or the end of the file."""
        self.module, self.routine = name, ""
        records: list[Record] = []
        declarations: list[Declaration] = []
        routines: list[Routine] = []
        while True:
            word, start, end = self.peek()
            scope = ""
            item = start
            if word in (b"local", b"task"):
                scope = text(word.upper())
                self.at = end
                word, start, end = self.peek()
            if word in DATA_WORDS:
                declaration = self.declaration(item, scope)
                if declaration is not None:
                    declarations.append(declaration)
            elif word in ROUTINE_WORDS:
                routine = self.routine_at(item, start, scope)
                if routine is not None:
                    routines.append(routine)
            elif word == b"record":
                records.append(self.record(end))
            elif word == b"alias":
                self.at = end
                stop, _ = self.to_semicolon(end)
                words = text(self.data[end:stop]).split()
                if len(words) == 2:
                    records.append(Record(words[1].lower(), (("", words[0].lower()),)))
                self.at = min(stop + 1, self.end)
            elif word == b"endmodule":
                self.at = end
                break
            elif word == b"module" or (not word and start >= self.end):
                self.at = start
                if name:
                    self.report(
                        "RAP005",
                        "error",
                        f"module `{name}` has no ENDMODULE",
                        head,
                        "the file is cut off or an END word is missing; load it in RobotStudio and check the program",
                    )
                break
            else:
                self.opaque(start)
        return Module(
            self.source,
            (head[0], self.at),
            head,
            name,
            attributes,
            tuple(records),
            tuple(declarations),
            tuple(routines),
        )

    def record(self, at: int) -> Record:
        self.at = at
        name, _, self.at = self.peek()
        fields = []
        while True:
            word, start, end = self.peek()
            if word == b"endrecord":
                self.at = end
                break
            found = patterns.FIELD.match(self.data, self.at)
            if found is None:
                self.opaque(start)
                if start >= self.end:
                    break
                continue
            fields.append((text(found[2]).lower(), text(found[1]).lower()))
            self.at = found.end()
        return Record(text(name), tuple(fields))

    def declaration(self, start: int, scope: str) -> Declaration | None:
        at = skip(self.data, self.at, self.end)
        found = patterns.DECLARATION.match(self.data, at)
        if found is None:
            self.opaque(start)
            return None
        end, closed = self.to_semicolon(found.end())
        if not closed:
            self.not_closed(start, end)
        self.at = end + 1 if closed else end
        init = None
        if found[5]:
            first = skip(self.data, found.end(), end)
            init = (first, max(first, patterns.trimmed(self.data, first, end)))
        dims: tuple[Span, ...] = ()
        if found[4]:
            inner = self.data[found.start(4) + 1 : found.end(4) - 1]
            offset = found.start(4) + 1
            spans = []
            for part in inner.split(b","):
                spans.append((offset, offset + len(part)))
                offset += len(part) + 1
            dims = tuple(spans)
        return Declaration(
            self.source, (start, self.at), self.module, self.routine, scope, text(found[1]).upper(),
            text(found[2]).lower(), text(found[3]), dims, init,
        )  # fmt: skip

    # -- routines -----------------------------------------------------------------------------------------------

    def routine_at(self, item: int, start: int, scope: str) -> Routine | None:
        head = patterns.ROUTINE_HEAD.match(self.data, start)
        if head is None:
            self.opaque(start)
            return None
        kind, name = text(head[1]).upper(), text(head[3])
        self.at = head.end()
        self.routine, self.local_data = name, []
        body, handlers = self.block(), []
        while True:
            word, begin, end = self.peek()
            if word in HANDLER_WORDS:
                self.at = end
                at = skip(self.data, end, self.end)
                if self.data[at : at + 1] == b"(":
                    close = self.data.find(b")", at)
                    self.at = close + 1 if close >= 0 else end
                handlers.append(self.block())
            elif word in ROUTINE_ENDS:
                self.at = end
                self.semicolon()
                break
            elif word in BLOCK_ENDS:
                self.report(
                    "RAP006",
                    "error",
                    f"`{text(word.upper())}` closes nothing in `{name}`",
                    (begin, end),
                    "check the IF, FOR, WHILE and TEST blocks of this routine",
                )
                self.at = end
                body += self.block()
            else:
                self.report(
                    "RAP007",
                    "error",
                    f"{kind} `{name}` has no END{kind}",
                    head.span(3),
                    "check the blocks and semicolons of this routine",
                )
                break
        routine = Routine(
            self.source, (item, self.at), self.module, kind, name, scope == "LOCAL",
            text(head[2]).lower() if kind == "FUNC" and head[2] else "", parameters(head[4] or b""),
            tuple(self.local_data), tuple(body), tuple(tuple(h) for h in handlers),
        )  # fmt: skip
        self.routine, self.local_data = "", []
        return routine

    def block(self) -> list[Statement]:
        """Statements up to the next word that ends a block, which is left for the caller."""
        statements: list[Statement] = []
        self.depth += 1
        while (statement := self.statement()) is not None:
            if statement.kind != "data":
                statements.append(statement)
        self.depth -= 1
        return statements

    def statement(self) -> Statement | None:
        """The next statement, or None at a word that ends the block or at the end of the file."""
        data = self.data
        lead = patterns.LEAD.match(data, self.at)
        name = lead[1] if lead else None
        if lead is None or name is None:
            return self.odd_statement(lead.end() if lead else self.at)
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
            end, closed = self.to_semicolon(lead.end(1))
            if not closed:
                self.not_closed(start, end)
            self.at = end + 1 if closed else end
            span = (start, self.at)
            if word in SIMPLE:
                first = skip(data, lead.end(1), end)
                part = (first, max(first, patterns.trimmed(data, first, end)))
                return Statement(SIMPLE[word], span, text(data[part[0] : part[1]]).lower(), (part,))
            return Statement("call", span, text(word))
        if mark == b":":
            self.at = lead.end()
            return Statement("label", (start, self.at), text(word))
        reference = lead if mark == b":=" else patterns.REFERENCE.match(data, start)
        if reference is None:
            return self.opaque(start)
        end, closed = self.to_semicolon(reference.end())
        if not closed:
            self.not_closed(start, end)
        self.at = end + 1 if closed else end
        target = (start, patterns.trimmed(data, start, reference.end() - 2))
        first = skip(data, reference.end(), end)
        value = (first, max(first, patterns.trimmed(data, first, end)))
        return Statement("assign", (start, self.at), text(word), (target, value))

    def odd_statement(self, at: int) -> Statement | None:
        """A statement that does not start with a word: late binding, placeholder, lone semicolon."""
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
        place = patterns.PLACE.match(data, at)
        if place is not None:
            self.at = place.end()
            self.semicolon()
            return Statement("placeholder", (at, self.at))
        return self.opaque(at)

    def opaque(self, start: int) -> Statement:
        """Keep what cannot be read as it stands, up to the semicolon or the next certain beginning."""
        end, closed = self.to_semicolon(start)
        self.at = max(end + 1 if closed else end, min(start + 1, self.end))
        span = (start, max(start, self.at))
        if span[0] < span[1]:
            shown = text(self.data[start : min(start + 40, self.at)]).split("\n")[0].strip()
            self.report("RAP003", "warning", f"`{shown}` is not understood and is kept as it stands", span)
        return Statement("opaque", span)

    def not_closed(self, start: int, end: int) -> None:
        self.report("RAP008", "error", "the statement has no `;`", (start, end), "add the missing semicolon")

    # -- blocks -------------------------------------------------------------------------------------------------

    def nested(self, word: bytes, start: int, end: int) -> Statement:
        if self.depth > MAX_NESTING:
            self.report("RAP009", "error", f"blocks are nested deeper than {MAX_NESTING}", (start, end))
            return self.opaque(start)
        if word == b"if":
            return self.if_at(start, end)
        if word == b"test":
            return self.test_at(start, end)
        return self.loop_at(word, start, end)

    def close(self, word: bytes, start: int) -> None:
        """Consume the END word of the block that began at ``start``."""
        found, _, end = self.peek()
        if found == word:
            self.at = end
            self.semicolon()
        else:
            opener = text(word[3:].upper())
            self.report(
                "RAP010",
                "error",
                f"{opener} has no {text(word.upper())}",
                (start, start + len(opener)),
                "check the blocks of this routine",
            )

    def head(self, pattern: re.Pattern[bytes], at: int, word: int) -> tuple[Span, bool]:
        """Expression before a word of ``word`` letters; the cursor goes behind the word if it is there."""
        found = pattern.match(self.data, at)
        end = found.end() if found else at
        hit = end < self.end and self.data[end : end + 1] != b";"
        first = skip(self.data, at, end)
        if hit:
            self.at = end + word
        return (first, max(first, patterns.trimmed(self.data, first, end))), hit

    def if_at(self, start: int, end: int) -> Statement:
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
        """``IF condition statement``: the condition ends where no operator follows."""
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
        self.at = end
        if word == b"while":
            condition, ok = self.head(TO_DO, end, 2)
            name, parts = "", (condition,)
        else:
            variable, ok = self.head(TO_FROM, end, 4)
            name = text(self.data[variable[0] : variable[1]]).lower()
            first, ok = self.head(TO_TO, self.at, 2) if ok else (variable, False)
            last, ok = self.head(TO_DO, self.at, 2) if ok else (first, False)
            parts = (first, last)
            step = TO_STEP.match(self.data, last[0], last[1])
            if ok and step is not None and step.end() < last[1]:
                at = skip(self.data, step.end() + 4, last[1])
                parts = (first, (last[0], patterns.trimmed(self.data, last[0], step.end())), (at, last[1]))
        if not ok:
            return self.opaque(start)
        body = tuple(self.block())
        self.close(b"end" + word, start)
        return Statement(text(word), (start, self.at), name, parts, (Branch((), body),))

    def test_at(self, start: int, end: int) -> Statement:
        found = TO_TEST_BODY.match(self.data, end)
        stop = found.end() if found else end
        subject = (skip(self.data, end, stop), 0)
        subject = (subject[0], max(subject[0], patterns.trimmed(self.data, subject[0], stop)))
        self.at = stop
        branches = []
        while True:
            word, begin, after = self.peek()
            if word == b"case":
                colon = TO_COLON.match(self.data, after)
                close = colon.end() if colon else after
                self.at = min(close + 1, self.end)
                branches.append(Branch(split(self.data, after, close), tuple(self.block())))
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


SIMPLE = {b"return": "return", b"goto": "goto", b"connect": "connect", **{w: "leave" for w in LEAVE_WORDS}}
BLOCKS = {b"if", b"for", b"while", b"test"}


def split(data: bytes, start: int, end: int) -> tuple[Span, ...]:
    """Spans of the expressions between commas."""
    spans = []
    at = start
    while at < end:
        found = patterns.PART.match(data, at, end)
        stop = found.end() if found else end
        first = skip(data, at, stop)
        if first < stop:
            spans.append((first, patterns.trimmed(data, first, stop)))
        at = max(stop, at) + 1
    return tuple(spans)


def parameters(head: bytes) -> tuple[Parameter, ...]:
    """Parameters of a routine; alternatives of ``|`` share the optional mark of the first."""
    found: list[Parameter] = []
    optional = False
    for item in patterns.PARAMETER.finditer(head):
        optional = bool(item[2]) or (item[1] == b"|" and optional)
        kind = text(item[4]).lower()
        rank = item[6].count(b",") + 1 if item[6] else 0
        mode = "SWITCH" if kind == "switch" else text(item[3] or b"").upper()
        found.append(Parameter(text(item[5]).lower(), kind, mode, optional, rank))
    return tuple(found)


def parse(source: Source) -> tuple[list[Module], list[Diagnostic]]:
    """Modules of one file and what was found wrong with it."""
    parser = Parser(source)
    return parser.file(), parser.diagnostics
