"""Regular expressions for pieces larger than a token; none comes back to what it matched, so none can run away."""

from __future__ import annotations

import re

from postproc.rapid.syntax.tokens import BLANK, COMMENT, IDENTIFIER, PLACEHOLDER, STRING, many, skip

TOKEN_GAP = many(BLANK + rb"|" + COMMENT)
DEPTH = 12  # brackets nested deeper than this are not read (a robtarget array in an aggregate needs 5)


def _nested(depth: int) -> bytes:
    """A pattern of text in brackets, nested at most ``depth`` deep; brackets in strings and comments do not count."""
    inner = b"|" + _nested(depth - 1) if depth > 1 else b""
    return rb"[\[({]" + many(rb"[^\[\](){}\"!]++|" + STRING + rb"|" + COMMENT + inner) + rb"[\])}]"


BRACKETED = _nested(DEPTH)
# An expression up to a comma, backslash, semicolon or closing bracket outside its own brackets.
EXPRESSION = many(rb"[^\[\](){}\"!,;\\]++|" + STRING + rb"|" + COMMENT + rb"|" + BRACKETED)


def up_to(word: bytes) -> re.Pattern[bytes]:
    """A pattern of the text up to the next ``word`` (any case) or semicolon that is in no string or comment."""
    first = word[:1]
    both = first.lower() + first.upper()
    other = rb"[^\"!;" + both + rb"]++"
    begins_otherwise = rb"(?!(?<![\w\x80-\xff])(?i:" + word + rb")(?![\w\x80-\xff]))[" + both + rb"]"
    return re.compile(many(other + rb"|" + STRING + rb"|" + COMMENT + rb"|" + begins_otherwise + rb"|\""))


def _spaced(*parts: bytes) -> re.Pattern[bytes]:
    """A compiled pattern of the parts in order, with any blanks and comments between them."""
    return re.compile(TOKEN_GAP.join(parts))


def _maybe(part: bytes) -> bytes:
    """A pattern of an optional part, followed by blanks and comments if it is there."""
    return rb"(?:" + part + TOKEN_GAP + rb")?"


WORDED = rb"(" + IDENTIFIER + rb")"
# The first word of a statement and what follows it.
LEAD = re.compile(TOKEN_GAP + rb"(?:" + WORDED + TOKEN_GAP + rb"(:=|:|\{|\.(?!\d))?)?")
WORD = re.compile(TOKEN_GAP + WORDED)
TO_SEMICOLON = re.compile(many(rb"[^;!\"]++|" + STRING + rb"|" + COMMENT + rb"|\""))
TO_LINE_END = re.compile(rb"[^\n]*+")
PLACE_PATTERN = re.compile(PLACEHOLDER)
REFERENCE = _spaced(
    IDENTIFIER + many(TOKEN_GAP + rb"(?:" + BRACKETED + rb"|\." + TOKEN_GAP + IDENTIFIER + rb")"), rb"(:=)"
)
# A line that starts with one of these ends the statement before it, whether or not that has its semicolon.
HARD_STOP = re.compile(
    rb"\n[ \t]*+(?i:(?:END(?:PROC|FUNC|TRAP|MODULE|RECORD|IF|FOR|WHILE|TEST)|ELSE|ELSEIF|CASE|DEFAULT|PROC|FUNC|TRAP"
    rb"|MODULE|LOCAL|CONST|PERS|VAR|ERROR|UNDO|BACKWARD)(?![\w\x80-\xff])"
    rb"|(?:Move(?:[JLC]|AbsJ)|Arc[LC](?:Start|End)?\d?)[ \t]+[\w\[*\\])"
)
DECLARATION = _spaced(rb"(?i:(CONST|PERS|VAR))", WORDED, WORDED, _maybe(rb"(" + BRACKETED + rb")") + rb"(:=)?")
MODULE_HEAD = re.compile(rb"(?i:MODULE)" + TOKEN_GAP + WORDED + rb"(?:" + TOKEN_GAP + rb"(\([^()]*+\)))?")
ROUTINE_HEAD = re.compile(
    rb"(?i:(?:(FUNC)" + TOKEN_GAP + WORDED + rb"|(PROC|TRAP)))" + TOKEN_GAP + WORDED + rb"(?:" + TOKEN_GAP + rb"(\("
    + many(rb"[^()\"!]++|" + STRING + rb"|" + COMMENT) + rb"\)))?"
)  # fmt: skip
# A search does not start again at every letter of a long word, nor at every blank before it.
_NOT_INSIDE = rb"(?:(?=[,|(\\])|(?<![\w\x80-\xff\s!]))"
PARAMETER = _spaced(
    _NOT_INSIDE, rb"([,|(]?)", rb"(\\?)", _maybe(rb"(?i:(VAR|PERS|INOUT|CONST))(?![\w\x80-\xff])") + WORDED, WORDED,
    rb"(\{[^{}]*+\})?",
)  # fmt: skip
FIELD = _spaced(rb"", WORDED, WORDED, rb";")
# One argument of an instruction: separator, \\name (or the name of a required argument), := or ?, expression.
PIECE = re.compile(
    TOKEN_GAP + rb"(,?)" + TOKEN_GAP + rb"(?>(?:\\" + TOKEN_GAP + WORDED + TOKEN_GAP + _maybe(rb"(:=|\?)") + rb"|"
    + IDENTIFIER + TOKEN_GAP + rb":=" + TOKEN_GAP + rb")?)(" + EXPRESSION + rb")"
)  # fmt: skip
# One of the first arguments of a motion instruction, if it is no option; group 1: its expression.
TARGET = re.compile(
    TOKEN_GAP
    + rb",?"
    + TOKEN_GAP
    + rb"(?>(?:"
    + IDENTIFIER
    + TOKEN_GAP
    + rb":="
    + TOKEN_GAP
    + rb")?)(?![,;\\])("
    + EXPRESSION
    + rb")"
)
# Arguments that are names, nothing else between them than commas.
PLAIN_ARGUMENTS = re.compile(rb",[A-Za-z_]\w*+" + many(rb",[A-Za-z_]\w*+"))
# One step through an expression (group 1: blank or comment), and an expression up to a comma.
TOKEN = re.compile(rb"(" + BLANK + many(BLANK) + rb"|" + COMMENT + rb")|" + STRING + rb"|[^\s!\"]++|[\x00-\xff]")
PART = re.compile(many(rb"[^\[\](){}\"!,]++|" + STRING + rb"|" + COMMENT + rb"|" + BRACKETED))


def listed(data: bytes, start: int, end: int) -> tuple[tuple[int, int], ...]:
    """Spans of the items in ``data[start:end]`` between commas outside brackets, without blanks around them.

    The span of an empty item is empty.
    """
    spans = []
    at = start
    while at < end:
        match = PART.match(data, at, end)
        stop = match.end() if match else end
        first = skip(data, at, stop)
        spans.append((first, trimmed(data, first, stop)))
        at = stop + 1
    return tuple(spans)


def trimmed(data: bytes, start: int, end: int) -> int:
    """The offset ``end`` moved back over blanks and comments, not before ``start``."""
    piece = data[start:end]
    if b"!" in piece:
        at = start
        last = start
        while at < end:
            match = TOKEN.match(data, at, end)
            if match is None:
                break
            at = match.end()
            if not match[1]:
                last = at
        return last
    return start + len(piece.rstrip())
