"""RAPID text as a tree: tokens, expressions, statements, routines, modules.

Grammar: Technical reference manual RAPID kernel (3HAC16585-1), summary of rules; section numbers stand at the functions.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

Expr = tuple[Any, ...]
"""``(kind, ...)``: num text, str, bool, agg items, ref name accessors, call name args, un op a, bin op a b, star."""

_TOKEN = re.compile(
    r"""(?P<blank>\s+|![^\r\n]*|%%%.*?%%%)
    |(?P<str>"(?:[^"\r\n]|"")*")
    |(?P<num>0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
    |(?P<id>[^\W\d]\w*)
    |(?P<op>:=|<>|<=|>=|.)""",
    re.S | re.X,
)
_ENDS = frozenset("endproc endfunc endtrap endif endfor endwhile endtest else elseif case default error undo backward".split())
_STORAGE = frozenset("const pers var local task".split())


class SyntaxFault(Exception):
    """The text does not follow the grammar."""


@dataclass(frozen=True)
class Token:
    kind: str
    text: str
    line: int

    @property
    def low(self) -> str:
        return self.text.lower()


@dataclass(frozen=True)
class Arg:
    """An argument: ``pos`` expr, ``opt`` name [expr], ``cond`` name parameter, ``named`` name expr."""

    kind: str
    name: str
    value: Expr | None


@dataclass(eq=False)
class Statement:
    """One statement: kind, its parts, its line, its words, its place in the routine (set by the reader)."""

    kind: str
    line: int
    parts: dict[str, Any]
    words: str = ""
    index: int = -1


@dataclass(frozen=True)
class Data:
    """A declaration; scope is ``local``, ``task`` or ``global``, storage ``const``, ``pers`` or ``var``."""

    name: str
    type: str
    storage: str
    scope: str
    dims: tuple[Expr, ...]
    value: Expr | None


@dataclass(frozen=True)
class Parameter:
    """mode is ``in``, ``inout``, ``var``, ``pers`` or ``switch``; dims the number of array dimensions."""

    name: str
    type: str
    mode: str
    optional: bool
    dims: int


@dataclass(eq=False)
class Routine:
    name: str
    kind: str
    type: str | None
    local: bool
    module: str
    parameters: list[Parameter]
    data: list[Data] = field(default_factory=list)
    body: list[Statement] = field(default_factory=list)
    error: list[Statement] | None = None
    error_numbers: list[Expr] = field(default_factory=list)
    flat: list[Statement] = field(default_factory=list)


@dataclass(eq=False)
class Module:
    name: str
    data: list[Data] = field(default_factory=list)
    routines: list[Routine] = field(default_factory=list)
    records: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)


def tokens(text: str) -> list[Token]:
    out, line = [], 1
    for m in _TOKEN.finditer(text.removeprefix("\ufeff")):
        if m.lastgroup != "blank":
            out.append(Token(m.lastgroup or "", m[0], line))
        line += m[0].count("\n")
    return out


def string_value(literal: str) -> str:
    r"""2.7: ``""`` is a quote, ``\\`` a backslash, ``\07`` the character with that code."""
    body = literal[1:-1].replace('""', '"')
    return re.sub(r"\\(\\|[0-9a-fA-F]{2})", lambda m: "\\" if m[1] == "\\" else chr(int(m[1], 16)), body)


class _Reader:
    def __init__(self, text: str) -> None:
        self.items, self.at = tokens(text), 0

    def peek(self, ahead: int = 0) -> str:
        i = self.at + ahead
        return self.items[i].low if i < len(self.items) else ""

    def kind(self, ahead: int = 0) -> str:
        i = self.at + ahead
        return self.items[i].kind if i < len(self.items) else ""

    def take(self, *wanted: str) -> Token:
        if self.at >= len(self.items):
            raise SyntaxFault(f"the text ends where {wanted} is expected")
        token = self.items[self.at]
        if wanted and token.low not in wanted:
            raise SyntaxFault(f"line {token.line}: `{token.text}` where {wanted} is expected")
        self.at += 1
        return token

    def accept(self, *wanted: str) -> bool:
        if self.peek() in wanted and self.kind() != "str":
            self.at += 1
            return True
        return False

    # 3: <expr> ::= [ NOT ] <logical term> { ( OR | XOR ) <logical term> }
    # NOT stands before a whole logical term: NOT a AND b is NOT (a AND b). `a AND NOT b` is not in the grammar but in
    # programs; there it can only mean the relation behind it.
    def expression(self) -> Expr:
        left = self._signed_term()
        while self.peek() in ("or", "xor"):
            op = self.take().low
            left = ("bin", op, left, self._signed_term())
        return left

    def _signed_term(self) -> Expr:
        if self.accept("not"):
            return ("un", "not", self._logical_term())
        return self._logical_term()

    def _logical_term(self) -> Expr:
        left = self._relation()
        while self.accept("and"):
            left = ("bin", "and", left, ("un", "not", self._relation()) if self.accept("not") else self._relation())
        return left

    def _relation(self) -> Expr:
        left = self._simple()
        if self.peek() in ("<", "<=", "=", ">", ">=", "<>"):
            op = self.take().text
            left = ("bin", op, left, self._simple())
        return left

    def _simple(self) -> Expr:
        sign = self.take().text if self.peek() in ("+", "-") else ""
        left = self._term()
        if sign == "-":
            left = ("un", "-", left)
        while self.peek() in ("+", "-") and self.kind() == "op":
            op = self.take().text
            left = ("bin", op, left, self._term())
        return left

    def _term(self) -> Expr:
        left = self._primary()
        while self.peek() in ("*", "/", "div", "mod"):
            op = self.take().low
            left = ("bin", op, left, self._primary())
        return left

    def _primary(self) -> Expr:
        token = self.take()
        if token.kind == "num":
            return ("num", token.text)
        if token.kind == "str":
            return ("str", string_value(token.text))
        if token.kind == "id":
            if token.low in ("true", "false"):
                return ("bool", token.low == "true")
            if token.low == "not":
                return ("un", "not", self._relation())
            if self.peek() == "(":
                self.take()
                arguments = self._arguments(")")
                self.take(")")
                return ("call", token.low, arguments, self._accessors())
            return ("ref", token.low, self._accessors())
        if token.text == "(":
            inner = self.expression()
            self.take(")")
            return inner
        if token.text == "[":
            items = [self.expression()]
            while self.accept(","):
                items.append(self.expression())
            self.take("]")
            return ("agg", tuple(items))
        if token.text == "-":
            return ("un", "-", self._primary())
        if token.text == "+":
            return self._primary()
        if token.text == "*":
            return ("star",)
        raise SyntaxFault(f"line {token.line}: `{token.text}` where an expression is expected")

    def _accessors(self) -> tuple[tuple[str, Any], ...]:
        out: list[tuple[str, Any]] = []
        while True:
            if self.peek() == "{":
                self.take()
                indices = [self.expression()]
                while self.accept(","):
                    indices.append(self.expression())
                self.take("}")
                out.append(("index", tuple(indices)))
            elif self.peek() == "." and self.kind(1) == "id":
                self.take()
                out.append(("part", self.take().low))
            else:
                return tuple(out)

    # 3.10, 4.5
    def _arguments(self, end: str) -> tuple[Arg, ...]:
        out: list[Arg] = []
        while self.peek() != end:
            self.accept(",")
            if self.accept("\\"):
                name = self.take().low
                if self.accept(":="):
                    out.append(Arg("opt", name, self.expression()))
                elif self.accept("?"):
                    out.append(Arg("cond", name, self._primary()))
                else:
                    out.append(Arg("opt", name, None))
            elif self.kind() == "id" and self.peek(1) == ":=":
                name = self.take().low
                self.take()
                out.append(Arg("named", name, self.expression()))
            else:
                out.append(Arg("pos", "", self.expression()))
        return tuple(out)

    # 4: statements
    def block(self, *ends: str) -> list[Statement]:
        out = []
        while self.peek() not in ends:
            if self.peek() == "" or (self.peek() in _ENDS and self.peek() not in ends):
                raise SyntaxFault(f"`{self.peek()}` where a statement or {ends} is expected, at token {self.at}")
            out.append(self.statement())
        return out

    def statement(self) -> Statement:
        start, line = self.at, self.items[self.at].line
        made = self._compound() if self.peek() in ("if", "for", "while", "test") else self._simple_statement()
        made.line = line
        end = made.parts.pop("header", self.at)
        made.words = " ".join(t.low if t.kind != "str" else t.text for t in self.items[start:end])
        return made

    def _simple_statement(self) -> Statement:
        word = self.peek()
        line = self.items[self.at].line
        if self.kind() == "id" and self.peek(1) == ":" and word not in _ENDS:
            self.take()
            self.take()
            return Statement("label", line, {"name": word})
        if word == "<" and self.peek(2) == ">":
            self.at += 3
            return Statement("nothing", line, {})
        if word == ";":
            self.take()
            return Statement("nothing", line, {})
        made = self._keyword(word, line) or self._call_or_assignment(line)
        self.take(";")
        return made

    def _keyword(self, word: str, line: int) -> Statement | None:
        if word == "goto":
            self.take()
            return Statement("goto", line, {"name": self.take().low})
        if word in ("return", "raise"):
            self.take()
            return Statement(word, line, {"value": None if self.peek() == ";" else self.expression()})
        if word in ("exit", "retry", "trynext"):
            self.take()
            return Statement(word, line, {})
        if word == "connect":
            self.take()
            target = self._primary()
            self.take("with")
            return Statement("connect", line, {"target": target, "trap": self.take().low})
        return None

    def _call_or_assignment(self, line: int) -> Statement:
        if self.accept("%"):
            name: Any = self.expression()
            self.take("%")
            return Statement("late", line, {"name": name, "args": self._arguments(";")})
        start = self.at
        target = ("ref", self.take().low, self._accessors())
        if self.accept(":="):
            return Statement("assign", line, {"target": target, "value": self.expression()})
        self.at = start
        name = self.take()
        if name.kind != "id":
            raise SyntaxFault(f"line {name.line}: `{name.text}` where a statement is expected")
        return Statement("call", line, {"name": name.low, "args": self._arguments(";")})

    def _compound(self) -> Statement:
        word = self.take().low
        line = self.items[self.at - 1].line
        if word == "if":
            return self._if(line)
        if word == "while":
            condition = self.expression()
            self.take("do")
            header = self.at
            body = self.block("endwhile")
            self.take()
            parts = {"condition": condition, "body": body}
        elif word == "for":
            name = self.take().low
            self.take("from")
            first = self.expression()
            self.take("to")
            last = self.expression()
            step = self.expression() if self.accept("step") else None
            self.take("do")
            header = self.at
            body = self.block("endfor")
            self.take()
            parts = {"name": name, "first": first, "last": last, "step": step, "body": body}
        else:
            subject = self.expression()
            header = self.at
            cases, default = [], None
            while not self.accept("endtest"):
                if self.accept("default"):
                    self.take(":")
                    default = self.block("endtest", "case")
                else:
                    self.take("case")
                    values = [self.expression()]
                    while self.accept(","):
                        values.append(self.expression())
                    self.take(":")
                    cases.append((values, self.block("case", "default", "endtest")))
            parts = {"subject": subject, "cases": cases, "default": default}
        self.accept(";")
        return Statement(word, line, {**parts, "header": header})

    def _if(self, line: int) -> Statement:
        arms, otherwise = [], None
        condition = self.expression()
        header = self.at
        if not self.accept("then"):
            return Statement("if", line, {"arms": [(condition, [self.statement()])], "otherwise": None, "header": header})
        header = self.at
        arms.append((condition, self.block("elseif", "else", "endif")))
        while self.accept("elseif"):
            condition = self.expression()
            self.take("then")
            arms.append((condition, self.block("elseif", "else", "endif")))
        if self.accept("else"):
            otherwise = self.block("endif")
        self.take("endif")
        self.accept(";")
        return Statement("if", line, {"arms": arms, "otherwise": otherwise, "header": header})

    # 2.18, 5
    def declaration(self) -> Data:
        scope = "global"
        while self.peek() in ("local", "task"):
            scope = self.take().low
        storage = self.take("const", "pers", "var").low
        type_, name = self.take().low, self.take().low
        dims: list[Expr] = []
        if self.accept("{"):
            dims.append(self.expression())
            while self.accept(","):
                dims.append(self.expression())
            self.take("}")
        value = self.expression() if self.accept(":=") else None
        self.take(";")
        return Data(name, type_, storage, scope, tuple(dims), value)

    def _parameters(self) -> list[Parameter]:
        out: list[Parameter] = []
        self.take("(")
        optional = False
        while not self.accept(")"):
            if self.accept(","):
                optional = False
            if self.accept("\\"):
                optional = True
            self.accept("|")
            if self.accept("switch"):
                out.append(Parameter(self.take().low, "switch", "switch", True, 0))
                continue
            mode = self.take().low if self.peek() in ("inout", "var", "pers") else "in"
            type_, name, dims = self.take().low, self.take().low, 0
            if self.accept("{"):
                dims = 1
                while not self.accept("}"):
                    dims += self.take().text == ","
            out.append(Parameter(name, type_, mode, optional, dims))
        return out

    def routine(self, module: str) -> Routine:
        local = self.accept("local")
        kind = self.take("proc", "func", "trap").low
        type_ = self.take().low if kind == "func" else None
        name = self.take().low
        made = Routine(name, kind, type_, local, module, self._parameters() if kind != "trap" else [])
        while self.peek() in _STORAGE:
            made.data.append(self.declaration())
        end = f"end{kind}"
        stops = (end, "error", "undo", "backward")
        made.body = self.block(*stops)
        while not self.accept(end):
            if self.accept("error"):
                if self.accept("("):
                    made.error_numbers = [a.value for a in self._arguments(")") if a.value]
                    self.take(")")
                made.error = self.block(*stops)
            else:
                self.take("undo", "backward")
                self.block(*stops)
        number(made)
        return made


def children(s: Statement) -> list[list[Statement]]:
    """The statement lists inside a compound statement."""
    if s.kind == "if":
        return [b for _, b in s.parts["arms"]] + ([s.parts["otherwise"]] if s.parts["otherwise"] else [])
    if s.kind in ("for", "while"):
        return [s.parts["body"]]
    if s.kind == "test":
        return [b for _, b in s.parts["cases"]] + ([s.parts["default"]] if s.parts["default"] else [])
    return []


def number(routine: Routine) -> None:
    """Lists all statements of a routine in the order of its text and numbers them."""

    def collect(statements: list[Statement]) -> None:
        for s in statements:
            s.index = len(routine.flat)
            routine.flat.append(s)
            for inner in children(s):
                collect(inner)

    collect(routine.body)
    collect(routine.error or [])


def parse(text: str) -> list[Module]:
    """All modules of a file.

    Raises:
        SyntaxFault: it does not follow the grammar.
    """
    r, out = _Reader(text), []
    while r.peek():
        r.take("module")
        module = Module(r.take().low)
        if r.accept("("):
            while not r.accept(")"):
                r.take()
        while not r.accept("endmodule"):
            k = 1 if r.peek() in ("local", "task") else 0
            if r.peek(k) == "record":
                _record(r, module)
            elif r.peek(k) == "alias":
                r.at += k + 1
                type_, name = r.take().low, r.take().low
                module.aliases[name] = type_
                r.take(";")
            elif r.peek(k) in ("const", "pers", "var"):
                module.data.append(r.declaration())
            else:
                module.routines.append(r.routine(module.name))
        out.append(module)
    return out


def _record(r: _Reader, module: Module) -> None:
    r.accept("local")
    r.take("record")
    name = r.take().low
    parts = []
    while not r.accept("endrecord"):
        type_, part = r.take().low, r.take().low
        r.take(";")
        parts.append((part, type_))
    module.records[name] = parts


def annotations(text: str) -> dict[str, list[str]]:
    """What a program's comments ``! world: name = ...`` say of the values that a world may draw."""
    out: dict[str, list[str]] = {}
    for m in re.finditer(r"!\s*world:\s*(.+?)\s*=\s*(.+)", text):
        out[" ".join(m[1].lower().split())] = m[2].split()
    return out
