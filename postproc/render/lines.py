"""Lines of RAPID text: how those around a place are indented and ended, and long statements on several of them.

RAPID takes a line break wherever it takes a blank.
"""

from __future__ import annotations

from collections.abc import Sequence

from postproc.rapid.syntax.tokens import tokenize

LONGEST_LINE = 200  # characters of what stays on one line: a target takes more than a hundred
LINE_WIDTH = 110  # of the lines of what is longer
_FIXED = ('"', "!", "\n")  # a text, a comment or lines of its own: left as it is


def broken(text: str, lead: str, newline: str) -> str:
    """A statement or an argument with line breaks if it has more than 200 characters, otherwise as it is.

    Breaks stand after commas, and before the signs of a sum that is still too long. Text with a string, a comment or
    breaks of its own stays as it is.

    Args:
        lead: blanks before the statement; continued lines are indented by one step more.
        newline: the line end to use.
    """
    if len(text) <= LONGEST_LINE or any(mark in text for mark in _FIXED):
        return text
    lines, step = [""], "\t" if "\t" in lead else "  "
    for part in _parts(text, commas=True):
        for piece in [part] if len(part) <= LINE_WIDTH else _parts(part, commas=False):
            if lines[-1] and len(lines[-1]) + len(piece) > LINE_WIDTH:
                lines.append("")
            lines[-1] += piece
    return f"{newline}{lead}{step}".join(lines)


def _parts(text: str, commas: bool) -> Sequence[str]:
    """The text cut into parts that may stand on lines of their own.

    With ``commas`` it is cut behind commas outside brackets or inside one pair; otherwise before the + and - signs of a
    sum outside brackets.
    """
    data, depth, cuts, last = text.encode("latin-1", "replace"), 0, [0], ""
    for kind, (start, end) in tokenize(data):
        token = data[start:end].decode("latin-1")
        depth += token in ("(", "[", "{")
        depth -= token in (")", "]", "}")
        if depth <= 1 and commas and token == ",":
            cuts.append(end)
        elif depth <= 0 and not commas and token in ("+", "-") and last not in ("", ",", "("):
            cuts.append(start)
        last = last if kind == "blank" else token
    return [text[a:b] for a, b in zip(cuts, [*cuts[1:], len(text)], strict=True) if b > a]


def line_style(data: bytes, offset: int) -> tuple[bytes, bytes]:
    """Indentation of the line at a byte offset (blanks before it only), and its line end, CR LF or LF."""
    start = data.rfind(b"\n", 0, offset) + 1
    before = data[start:offset]
    indent = before[: len(before) - len(before.lstrip())]
    end = data.find(b"\n", offset)
    if end < 0:
        end = start - 1
    newline = b"\r\n" if end > 0 and data[end - 1 : end] == b"\r" else b"\n"
    return indent, newline


def indent_after(data: bytes, offset: int) -> str:
    """Indentation of the first line with text after the line at a byte offset; two blanks if there is none near."""
    for line in data[offset : offset + 4096].split(b"\n")[1:]:
        if line.strip():
            return line[: len(line) - len(line.lstrip())].decode("latin-1")
    return "  "
