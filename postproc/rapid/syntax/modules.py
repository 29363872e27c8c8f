"""Bytes to modules and routines; what cannot be read becomes an opaque span and a diagnostic."""

from __future__ import annotations

import re

from postproc.diagnostics import Diagnostic, Source, Span
from postproc.rapid.syntax import patterns
from postproc.rapid.syntax.nodes import Declaration, Module, Record, Routine, RoutineParameter
from postproc.rapid.syntax.statements import (
    BLOCK_ENDS,
    DATA_WORDS,
    HANDLER_WORDS,
    ROUTINE_ENDS,
    ROUTINE_WORDS,
    StatementReader,
    text,
)
from postproc.rapid.syntax.tokens import skip

ITEM_WORDS = DATA_WORDS | ROUTINE_WORDS | {b"local", b"task", b"record", b"alias"}
FILE_HEADER = re.compile(rb"(?:\xef\xbb\xbf)?\s*%%%.*?%%%", re.DOTALL)


class FileReader(StatementReader):
    """Modules and routines of one file."""

    def file(self) -> list[Module]:
        """Read every module of the file; data and routines outside of modules become modules without a name."""
        modules: list[Module] = []
        header = FILE_HEADER.match(self.data)
        if header is not None:
            self.at = header.end()
        stray: int | None = None  # where text outside modules begins
        while True:
            word, start, end = self.peek()
            module = patterns.MODULE_HEAD.match(self.data, start) if word == b"module" else None
            inside = module is not None or word in ITEM_WORDS
            if stray is not None and (inside or (modules and start >= self.end)):
                message = "text outside a module is not loaded by the controller and is kept as it stands"
                self.report(
                    "RAP015", "warning", message, (stray, self.at), "delete it if it was left behind by mistake"
                )
                stray = None
            if module is not None:
                self.at = module.end()
                attributes = tuple(re.findall(r"\w+", text(module[2]).upper())) if module[2] else ()
                modules.append(self.items(text(module[1]), module.span(), attributes))
            elif inside:
                message = "data or routines stand outside a MODULE"
                help_ = "put them between MODULE and ENDMODULE; the controller does not load them otherwise"
                self.report("RAP004", "warning", message, (start, end), help_)
                modules.append(self.items("", (start, start), ()))
            elif start >= self.end:
                return modules
            else:
                stray = start if stray is None else stray
                line = patterns.TO_LINE_END.match(self.data, start)
                self.at = max(line.end() if line else start, start + 1)

    def items(self, name: str, head: Span, attributes: tuple[str, ...]) -> Module:
        """Read data, routines and records up to and including ENDMODULE, or to the end of the file, as a module.

        Args:
            head: span of ``MODULE name(attributes)``; attributes: in upper case.
        """
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
                    help_ = (
                        "the file is cut off or an END word is missing; load it in RobotStudio and check the program"
                    )
                    self.report("RAP005", "error", f"module `{name}` has no ENDMODULE", head, help_)
                break
            else:
                self.opaque(start)
        parts = tuple(records), tuple(declarations), tuple(routines)
        return Module(self.source, (head[0], self.at), head, name, attributes, *parts)

    def record(self, at: int) -> Record:
        """Read a RECORD with its fields up to ENDRECORD; ``at`` is the offset behind the word RECORD."""
        self.at = at
        name, _, self.at = self.peek()
        fields = []
        while True:
            word, start, end = self.peek()
            if word == b"endrecord":
                self.at = end
                break
            match = patterns.FIELD.match(self.data, self.at)
            if match is None:
                self.opaque(start)
                if start >= self.end:
                    break
                continue
            fields.append((text(match[2]).lower(), text(match[1]).lower()))
            self.at = match.end()
        return Record(text(name), tuple(fields))

    def routine_at(self, item: int, start: int, scope: str) -> Routine | None:
        """Read the routine whose PROC, FUNC or TRAP begins at ``start``; None if its head cannot be read.

        Args:
            item: where its declaration begins, scope word included; scope: LOCAL, TASK or empty.
        """
        head = patterns.ROUTINE_HEAD.match(self.data, start)
        if head is None:
            self.opaque(start)
            return None
        kind, name = text(head[1] or head[3]).upper(), text(head[4])
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
                message, help_ = "closes nothing in", "check the IF, FOR, WHILE and TEST blocks of this routine"
                self.report("RAP006", "error", f"`{text(word.upper())}` {message} `{name}`", (begin, end), help_)
                self.at = end
                body += self.block()
            else:
                help_ = "check the blocks and semicolons of this routine"
                self.report("RAP007", "error", f"{kind} `{name}` has no END{kind}", head.span(4), help_)
                break
        routine = Routine(
            self.source, (item, self.at), self.module, kind, name, scope == "LOCAL",
            text(head[2] or b"").lower(), parameters(head[5] or b""),
            tuple(self.local_data), tuple(body), tuple(tuple(h) for h in handlers),
        )  # fmt: skip
        self.routine, self.local_data = "", []
        return routine


def parameters(head: bytes) -> tuple[RoutineParameter, ...]:
    """Parse the parameter list of a routine.

    Args:
        head: the list with its brackets, as ``b"(num a \\switch On|switch Off)"``; may be empty.

    Returns:
        Parameters in text order; those after ``|`` are optional if the first one has the backslash.
    """
    parameters_read: list[RoutineParameter] = []
    optional = False
    for item in patterns.PARAMETER.finditer(head):
        optional = bool(item[2]) or (item[1] == b"|" and optional)
        kind = text(item[4]).lower()
        rank = item[6].count(b",") + 1 if item[6] else 0
        mode = "SWITCH" if kind == "switch" else text(item[3] or b"").upper()
        parameters_read.append(RoutineParameter(text(item[5]).lower(), kind, mode, optional, rank))
    return tuple(parameters_read)


def parse(source: Source) -> tuple[list[Module], list[Diagnostic]]:
    """Read the modules of one file; returns them and the findings about its syntax."""
    reader = FileReader(source)
    return reader.file(), reader.diagnostics
