"""Expressions read into trees.

Grammar: ABB "Technical reference manual - RAPID Kernel", formal syntax, rule 3:

    <expr>         ::= [ NOT ] <logical term> { ( OR | XOR ) <logical term> }
    <logical term> ::= <relation> { AND <relation> }
    <relation>     ::= <simple expr> [ <relop> <simple expr> ]
    <simple expr>  ::= [ <addop> ] <term> { <addop> <term> }
    <term>         ::= <primary> { <mulop> <primary> }

So ``NOT a AND b`` is ``NOT (a AND b)`` and ``NOT a OR b`` is ``(NOT a) OR b``. Programs also write NOT and signs where
this grammar has no place for them (``a AND NOT b``, ``a * -b``): they are read where that can mean one thing only.
"""

from __future__ import annotations

from collections.abc import Iterator

from postproc.diagnostics import Span
from postproc.rapid.syntax.tokens import NAMES, tokenize
from postproc.rapid.syntax.trees import (
    Aggregate,
    Binary,
    Call,
    Component,
    Expression,
    Index,
    Name,
    Number,
    Star,
    StringNode,
    Truth,
    Unary,
)
from postproc.rapid.unknown import Kind, Unknown

MAX_EXPRESSION_NESTING = 40
MAX_OPERATORS = 150


class ExpressionError(ValueError):
    """The text is not an expression this reader knows."""


PRECEDENCE = {
    "or": 1, "xor": 1, "and": 2, "=": 4, "<>": 4, "<": 4, ">": 4, "<=": 4, ">=": 4,
    "+": 5, "-": 5, "*": 6, "/": 6, "div": 6, "mod": 6,
}  # fmt: skip

RESERVED = frozenset({*PRECEDENCE, "not", "true", "false", "then", "do", "to", "step"})


def number(text: str) -> float:
    """Value of a numeric literal without a sign, hexadecimal (0x), octal (0o) and binary (0b) ones included.

    Raises:
        ExpressionError: it is too large.
    """
    try:
        return float(int(text, 0)) if text[:2].lower() in ("0x", "0o", "0b") else float(text)
    except OverflowError as error:
        raise ExpressionError(f"`{text}` is too large") from error


def read_expression(data: bytes, start: int, end: int) -> Expression:
    """Read the longest expression at the begin of ``data[start:end]``; its ``span`` says where it ends.

    Raises:
        ExpressionError: there is none, or it is nested deeper than ``MAX_EXPRESSION_NESTING``.
    """
    return _Reader(data, start, end).binary(0)


def read_full_expression(data: bytes, start: int, end: int, what: str = "the expression") -> Expression:
    """Read the expression that fills ``data[start:end]``.

    Args:
        what: what the reason of an Unknown calls it.

    Raises:
        Unknown: the text is no expression, or goes on after one.
    """
    name = NAMES.fullmatch(data, start, end)
    if name is not None and (word := (text := name[0].decode("latin-1")).lower()) not in RESERVED:
        return Name((start, end), word, text)
    try:
        reader = _Reader(data, start, end)
        result = reader.binary(0)
        if reader.kind != "end":
            raise ExpressionError(f"`{reader.word}` is not expected here")
    except ExpressionError as error:
        raise Unknown(Kind.UNREADABLE, what, str(error)) from error
    return result


class _Reader:
    """Reads an expression by recursive descent; ``kind``, ``word`` and ``span`` are those of the present token.

    Every method that reads raises ExpressionError for text that does not belong there.
    """

    def __init__(self, data: bytes, start: int, end: int) -> None:
        """Start at the first token of ``data[start:end]``."""
        self.tokens: Iterator[tuple[str, Span]] = tokenize(data, start, end)
        self.data = data
        self.end = end
        self.last = start
        self.depth = 0
        self.operators = 0
        self.kind, self.word, self.span = "end", "", (start, start)
        self.step()

    def step(self) -> None:
        """Move to the next token that is neither blank nor comment; its kind is ``end`` behind the last one."""
        self.last = self.span[1]
        for kind, span in self.tokens:
            if kind not in ("blank", "comment"):
                self.kind, self.span = kind, span
                self.word = self.data[span[0] : span[1]].decode("latin-1")
                return
        self.kind, self.word, self.span = "end", "", (self.end, self.end)

    def take(self, word: str) -> bool:
        """Move on and return True if the present token is this operator; else return False."""
        if self.word == word and self.kind == "operator":
            self.step()
            return True
        return False

    def expect(self, word: str) -> None:
        """Move behind this operator; raise ExpressionError if another token is present."""
        if not self.take(word):
            raise ExpressionError(f"`{word}` is missing before `{self.word}`")

    def deeper(self) -> None:
        """Count one more level of nesting; raise ExpressionError beyond ``MAX_EXPRESSION_NESTING``."""
        self.depth += 1
        if self.depth > MAX_EXPRESSION_NESTING:
            raise ExpressionError("the expression is nested too deeply")

    def binary(self, level: int) -> Expression:
        """Read operands and the operators between them that bind more tightly than ``level``; 0 reads an expression.

        Args:
            level: one of ``PRECEDENCE``, or 0.
        """
        self.deeper()
        lhs = self.negated(level) if self.kind == "name" and self.word.lower() == "not" else self.signed()
        while True:
            operator = self.word.lower()
            rank = PRECEDENCE.get(operator, 0) if self.kind in ("operator", "name") else 0
            if rank <= level:
                self.depth -= 1
                return lhs
            self.step()
            self.operators += 1
            if self.operators > MAX_OPERATORS:
                raise ExpressionError("the expression is too long")
            rhs = self.binary(rank)
            lhs = Binary((lhs.span[0], rhs.span[1]), operator, lhs, rhs)

    def negated(self, level: int) -> Expression:
        """Read NOT and its operand.

        Args:
            level: precedence of the operator before NOT; 0 if there is none: the operand then reaches to the next OR or
                XOR, else it is a relation only.

        Raises:
            ExpressionError: AND follows such a relation, so that the meaning is not clear.
        """
        start, first = self.span[0], level == 0
        self.step()
        operand = self.binary(PRECEDENCE["or"] if first else PRECEDENCE["and"])
        if not first and self.kind == "name" and self.word.lower() == "and":
            raise ExpressionError("`NOT` before `AND` is not clear without parentheses")
        return Unary((start, operand.span[1]), "not", operand)

    def signed(self) -> Expression:
        """Read an operand with any number of signs in front; the sign of a number becomes part of its value."""
        if self.kind == "operator" and self.word in "+-":
            sign, start = self.word, self.span[0]
            self.step()
            self.deeper()
            operand = self.signed()
            self.depth -= 1
            span = (start, operand.span[1])
            if isinstance(operand, Number):
                return Number(span, -operand.value if sign == "-" else operand.value)
            return Unary(span, sign, operand)
        return self.postfix(self.primary())

    def postfix(self, base: Expression) -> Expression:
        """Read the indices ``{..}`` and components ``.name`` behind an expression that has been read."""
        parts = 0
        while self.kind == "operator" and self.word in ("{", "."):
            parts += 1
            if parts > MAX_EXPRESSION_NESTING:
                raise ExpressionError("the expression is nested too deeply")
            if self.take("{"):
                indices = self.listed("}")
                base = Index((base.span[0], self.last), base, indices)
            else:
                self.step()
                if self.kind != "name":
                    raise ExpressionError("a component name is missing after `.`")
                base = Component((base.span[0], self.span[1]), base, self.word.lower())
                self.step()
        return base

    def listed(self, close: str) -> tuple[Expression, ...]:
        """Read expressions separated by commas and the bracket ``close`` behind them."""
        items: list[Expression] = []
        if self.take(close):
            return ()
        while True:
            items.append(self.binary(0))
            if self.take(close):
                return tuple(items)
            self.expect(",")

    def primary(self) -> Expression:
        """Read a number, text, truth value, name, call, aggregate, ``*`` or an expression in parentheses."""
        kind, word, span = self.kind, self.word, self.span
        if kind == "number":
            self.step()
            return Number(span, number(word))
        if kind == "string":
            self.step()
            # Quotes and backslashes are doubled in text; character codes ``\hh`` stay as written.
            return StringNode(span, word[1:-1].replace('""', '"').replace("\\\\", "\\"))
        if kind == "name":
            self.step()
            low = word.lower()
            if low in ("true", "false"):
                return Truth(span, low == "true")
            if low in RESERVED:
                raise ExpressionError(f"`{word}` is not expected here")
            if self.kind == "operator" and self.word == "(":
                return self.call(span, word)
            return Name(span, low, word)
        if kind == "operator":
            if self.take("["):
                items = self.listed("]")
                return Aggregate((span[0], self.last), items)
            if self.take("("):
                inner = self.binary(0)
                self.expect(")")
                return Unary((span[0], self.last), "()", inner)
            if self.take("*"):
                return Star(span)
        raise ExpressionError(f"`{word}` is not expected here" if word else "an expression is missing")

    def call(self, span: Span, name: str) -> Expression:
        """Read the arguments of a function call, whose name (at ``span``) has been read, and its parentheses."""
        self.expect("(")
        arguments: list[Expression] = []
        options: list[tuple[str, Expression | None]] = []
        while not self.take(")"):
            if self.kind == "end":
                raise ExpressionError("`)` is missing")
            if self.take("\\"):
                option = self.word.lower()
                self.step()
                value = self.binary(0) if self.take(":=") or self.take("?") else None
                options.append((option, value))
            else:
                arguments.append(self.binary(0))
            if not (self.take(",") or self.word in (")", "\\")):
                raise ExpressionError(f"`,` is missing before `{self.word}`")
        return Call((span[0], self.last), name.lower(), tuple(arguments), tuple(options), name)
