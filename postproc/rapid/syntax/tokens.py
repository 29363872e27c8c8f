"""Tokens of RAPID text, on bytes: joined they give the input back, whatever the input is.

Lexical rules: ABB RAPID reference, "Basic elements" (strings and identifiers are ISO 8859-1, free case, one line).
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from postproc.diagnostics import Source, Span


def many(choices: bytes) -> bytes:
    """A pattern that repeats the alternatives ``choices`` (split by ``|``) as often as possible, without backtracking.

    An atomic group: Python before 3.11.5 loses its place in a possessive one where a piece fails half-way (cpython
    gh-106052); single characters (``[a-z]*+``) are safe.
    """
    return rb"(?>(?:" + choices + rb")*)"


# UTF-8 byte order mark, no-break space and ideographic space occur in files that went through word processors.
ODD_BLANK = rb"\xef\xbb\xbf|\xc2\xa0|\xe3\x80\x80"
BLANK = rb"(?:[ \t\r\n\f\v]++|" + ODD_BLANK + rb")"
COMMENT = rb"![^\n]*+"
STRING = b'"' + many(rb'[^"\r\n]++|""') + b'"'
IDENTIFIER = rb"[A-Za-z_\x80-\xff]" + many(rb"\w++|(?!" + ODD_BLANK + rb")[\x80-\xff]")
NUMBER = rb"0[xX][0-9A-Fa-f]+|0[oO][0-7]+|0[bB][01]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
PLACEHOLDER = rb"<[A-Z]{2,6}>"

MASTER = re.compile(
    rb"(?P<blank>" + BLANK + many(BLANK) + rb")"
    rb"|(?P<comment>" + COMMENT + rb")"
    rb"|(?P<name>" + IDENTIFIER + rb")"
    rb"|(?P<number>" + NUMBER + rb")"
    rb"|(?P<string>" + STRING + rb")"
    rb"|(?P<placeholder>" + PLACEHOLDER + rb")"
    rb"|(?P<operator>:=|<>|<=|>=|[-+*/=<>,;:.(){}\[\]\\?%|#@])"
    rb"|(?P<other>[\x00-\xff])"
)
NAMES = re.compile(IDENTIFIER)
# What Dim is asked about is counted, not read.
_COUNTED = rb"(?<![\w\x80-\xff])(?i:Dim)\s*\(\s*" + IDENTIFIER
_DIGITS = rb"(?<![\w\x80-\xff])(?:" + NUMBER + rb")"
_WORDS = re.compile(b"|".join([STRING, COMMENT, _COUNTED, _DIGITS, rb"([.\\]\s*)?(" + IDENTIFIER + rb")"]))
# Blanks and comments, as many as there are.
SKIP = re.compile(many(BLANK + rb"|" + COMMENT))


def tokenize(data: bytes, start: int = 0, end: int | None = None) -> Iterator[tuple[str, Span]]:
    """Kind and span of every token in ``data[start:end]``; the spans are adjacent and cover everything."""
    for match in MASTER.finditer(data, start, len(data) if end is None else end):
        yield match.lastgroup or "other", match.span()


def skip(data: bytes, at: int, end: int) -> int:
    """Offset of the first byte at or after ``at`` that is neither blank nor comment (at most ``end``)."""
    match = SKIP.match(data, at, end)
    return match.end() if match else at


def number_text(data: bytes, span: Span) -> str:
    """The number at a span as it is written, with a minus sign or none, and without blanks between sign and digits."""
    text = data[span[0] : span[1]].decode("latin-1")
    try:
        float(text)
    except ValueError:  # signs that stand apart from their digits, or no decimal
        text = SKIP.sub(b"", data[span[0] : span[1]]).decode("latin-1")
    else:
        return text[1:] if text[0] == "+" else text
    digits = text.lstrip("+-")
    return digits if text.count("-", 0, len(text) - len(digits)) % 2 == 0 else f"-{digits}"


def identifiers(data: bytes) -> set[str]:
    """Every word of the text in lower case, those in comments and strings too (a superset is safe for new names)."""
    return {word.decode("latin-1").lower() for word in set(NAMES.findall(data))}


def names_at(source: Source, span: Span) -> Iterator[tuple[str, Span]]:
    """Lower-case name and span of each data or routine named in a piece of text.

    Components, option names, words in strings and comments, and the argument of Dim are left out.
    """
    for match in _WORDS.finditer(source.data, *span):
        if match[2] and not match[1]:
            yield match[2].decode("latin-1").lower(), match.span(2)


def word_set(text: str) -> frozenset[str]:
    """The set of the words in a text, which blanks separate."""
    return frozenset(text.split())
