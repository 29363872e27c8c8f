"""RAPID text as statements, by regular expressions."""

from __future__ import annotations

import re
from dataclasses import dataclass

MOVES = re.compile(r"(Move(?:Abs)?J|MoveL|MoveC|Arc[LC]\d?(?:Start|End)?)(?![A-Za-z0-9_])", re.I)
STORAGE = r"(?:(?:LOCAL|TASK)\s+)?(?:CONST|PERS|VAR)"
DECLARATION = re.compile(rf"{STORAGE}\s+(\w+)\s+(\w+)\s*(\{{[^}}]*\}})?\s*(?::=(.*))?;$", re.I | re.S)
BLOCK = re.compile(
    r"""MODULE\s+\w+(\s*\([^)]*\))?|ENDMODULE|(LOCAL\s+)?(PROC|TRAP)\s+\w+\s*(\([^)]*\))?|(LOCAL\s+)?FUNC\s+\w+\s+\w+\s*\([^)]*\)
    |END(?:PROC|TRAP|FUNC|FOR|IF|WHILE|TEST|RECORD)\b\s*;?|(?:LOCAL\s+)?RECORD\s+\w+
    |FOR\b.*?\bDO\b|WHILE\b.*?\bDO\b|IF\b[^;]*?\bTHEN\b|ELSEIF\b[^;]*?\bTHEN\b|ELSE\b|TEST\b[^\n]*|CASE\b[^:]*:|DEFAULT\s*:
    |(?:ERROR|UNDO|BACKWARD)\b(?!\s*[;:(,])|%%%.*?%%%|\w+\s*:(?!=)""",
    re.I | re.S | re.X,
)


@dataclass(frozen=True)
class Statement:
    """One statement or block word: source span, code without comments, line number (from 1)."""

    start: int
    end: int
    code: str
    line: int
    block: bool


def mask_comments(text: str) -> str:
    """The text with comments blanked, same length."""
    pattern = re.compile(r'"(?:[^"\r\n]|"")*"|![^\r\n]*')
    return pattern.sub(lambda m: " " * len(m[0]) if m[0][0] == "!" else m[0], text)


def comments(text: str) -> list[tuple[int, str]]:
    pattern = re.compile(r'"(?:[^"\r\n]|"")*"|![^\r\n]*')
    return [(m.start(), m[0]) for m in pattern.finditer(text) if m[0][0] == "!"]


_BITS = re.compile(r'"(?:[^"\r\n]|"")*"|[\[\](){};]')


def statements(text: str) -> list[Statement]:
    code = mask_comments(text)
    newlines = [m.start() for m in re.finditer("\n", text)]
    out: list[Statement] = []
    i, line = 0, 0
    while True:
        blank = re.compile(r"\s*").match(code, i)
        assert blank is not None
        i = blank.end()
        if i >= len(code):
            return out
        while line < len(newlines) and newlines[line] < i:
            line += 1
        m = BLOCK.match(code, i)
        if m and m.end() > i:
            out.append(Statement(i, m.end(), code[i : m.end()].strip(), line + 1, True))
            i = m.end()
            continue
        depth, end = 0, len(code)
        for bit in _BITS.finditer(code, i):
            c = bit[0]
            depth += (c in "[({") - (c in "])}")
            if c == ";" and depth <= 0:
                end = bit.end()
                break
        out.append(Statement(i, end, code[i:end].strip(), line + 1, False))
        i = end


def split_arguments(code: str) -> tuple[list[str], dict[str, str]]:
    """Positional argument texts, and optional ones by lower-case name."""
    depth, pieces, mark = 0, [], 0
    marks: list[str] = [","]
    for bit in re.finditer(r'"(?:[^"\r\n]|"")*"|[\[\](){},\\]', code):
        c = bit[0]
        depth += (c in "[({") - (c in "])}")
        if depth == 0 and c in ",\\":
            pieces.append(code[mark : bit.start()].strip())
            marks.append(c)
            mark = bit.end()
    pieces.append(code[mark:].strip())
    positional, optional = [], {}
    for kind, piece in zip(marks, pieces, strict=True):
        if kind == "\\":
            name, _, value = piece.partition(":=")
            optional[name.strip().lower()] = value.strip()
        elif piece:
            positional.append(piece)
    return positional, optional
