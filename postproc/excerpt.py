"""Text fitted to a terminal: columns of characters, lines wrapped between words, a line of source with its carets."""

from __future__ import annotations

import textwrap
import unicodedata

TAB = 4  # columns between the stops of tabs
CUT = ".."


def columns(text: str) -> int:
    """Return the columns that text without tabs takes on a terminal: wide letters take two, combining accents none."""
    return len(text) if text.isascii() else sum(map(_columns, text))


def _columns(letter: str) -> int:
    """Return the columns of one character."""
    if unicodedata.category(letter) in ("Mn", "Me", "Cf"):
        return 0
    return 2 if unicodedata.east_asian_width(letter) in "WF" else 1


def spread(text: str) -> str:
    """Return a line with its tabs replaced by blanks, up to the next multiple of four columns."""
    done = ""
    for part in text.split("\t")[:-1]:
        done += part
        done += " " * (TAB - columns(done) % TAB)
    return done + text.rpartition("\t")[2]


def wrapped(text: str, width: int | None, indent: str = "  ") -> str:
    """Wrap a line between words, with further lines indented; a word longer than the width stays whole.

    Args:
        width: columns of the terminal; None for no limit. indent: of further lines, beside that of the first.
    """
    if width is None or columns(text) <= width:
        return text
    lead = text[: len(text) - len(text.lstrip(" "))]
    return "\n".join(
        textwrap.wrap(
            text,
            width,
            subsequent_indent=lead + indent,
            break_long_words=False,
            break_on_hyphens=False,
            replace_whitespace=False,
        )
    )


def underlined(before: str, marked: str, after: str, width: int | None) -> tuple[str, str]:
    """Return a line of source, and a line with carets below its marked part; a line that is too long is cut around it.

    Args:
        before, marked, after: the parts of the line. width: columns that there are, None for as many as it takes.
    """
    if width is not None:  # of a program on one line no more is looked at than may be shown
        before, marked, after = before[-4 * width :], marked[: 4 * width], after[: 4 * width]
    line = spread(before + marked + after)
    begin = columns(spread(before))
    end = max(begin + 1, columns(spread(before + marked)))
    if width is None or columns(line) <= width:
        return line, " " * begin + "^" * (end - begin)
    # The window begins where the whole mark is in it, with some of what stands before.
    first = max(0, min(begin - width // 4, columns(line) - width))
    low = first + len(CUT) * (first > 0)
    high = first + width
    continues = high < columns(line)
    shown, at = CUT * (first > 0), 0
    for letter in line:
        after_it = at + _columns(letter)
        if low <= at and after_it <= high - len(CUT) * continues:
            shown += letter
        elif at < low < after_it:  # half of a wide letter
            shown += " "
        at = after_it
    return shown + CUT * continues, " " * (begin - first) + "^" * (min(end, high) - begin)
