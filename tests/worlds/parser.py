"""RAPID text to a tree of modules, routines, statements and expressions, by recursive descent.

Grammar: Technical reference manual RAPID kernel (3HAC16585-1), summary of rules; section numbers stand at the functions.
"""

from __future__ import annotations

from typing import Any

from tests.worlds.syntax import (
    Arg,
    Data,
    Expr,
    Module,
    Parameter,
    Routine,
    Statement,
    SyntaxFault,
    Token,
    number,
    string_value,
    tokens,
)

_ENDS = frozenset(
    [
        "endproc",
        "endfunc",
        "endtrap",
        "endif",
        "endfor",
        "endwhile",
        "endtest",
        "else",
        "elseif",
        "case",
        "default",
        "error",
        "undo",
        "backward",
    ]
)
_STORAGE = frozenset(["const", "pers", "var", "local", "task"])


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
        if word in ("exit", "exitcycle", "retry", "trynext"):
            self.take()  # the next cycle begins at main, as each world does
            return Statement(word.removesuffix("cycle"), line, {})
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
            return Statement(
                "if", line, {"arms": [(condition, [self.statement()])], "otherwise": None, "header": header}
            )
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
