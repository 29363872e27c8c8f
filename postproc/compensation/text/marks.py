"""Marks that the package leaves in what it writes, by which a program is known to be compensated before."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterable, Iterator

from postproc.diagnostics import Diagnostic, Source, Span
from postproc.rapid.syntax.tokens import names_at

MODULE_MARKER = "postproc runtime 1"
"""First words of the comment after MODULE in a module whose functions correct targets."""
CORRECTED, CORRECTED_CIRCLE = "ppCorrected", "ppCorrectedCirc"
"""Functions of such a module, that give the target to command for a target and for a circle point."""
CORRECTING = frozenset({CORRECTED.lower(), CORRECTED_CIRCLE.lower()})
_HEADER = re.compile(rb"^[ \t]*!\s*postproc \d++\.\d++[^\r\n]*compensated", re.MULTILINE)
# The functions that added targets call, of this and earlier versions, stay where somebody takes the header out.
_ADDED = re.compile(
    rb"^[ \t]*+(?i:(?:LOCAL[ \t]++)?FUNC[ \t]++\w++[ \t]++"
    rb"pp(?:(?:Line|Arc)Point|(?:Line|Arc|Bend)(?:Keep|Conf)|LineBend)\d*+[ \t]*+\()",
    re.MULTILINE,
)


def say_touched_up(sources: Iterable[Source], touched: Collection[str]) -> Iterator[Diagnostic]:
    """CMP028 (error) for each program whose touch-ups the model was fitted to: they hold the correction already.

    Args:
        touched: hashes (SHA-256) of such programs.
    """
    for source in sources if touched else ():
        if hashlib.sha256(source.data).hexdigest() in touched:
            text = "the model was fitted to the touch-ups of this very program: it would be corrected twice"
            help_ = "compensate the nominal program, which was named first in `postproc touchups`"
            yield Diagnostic("CMP028", "error", text, source, help=help_)


def say_corrected_before(sources: Iterable[Source]) -> Iterator[Diagnostic]:
    """CMP001, an error, at files that were compensated before: by their header, or functions they hold or call.

    A file without its header in which only numbers were changed is not recognised.
    """
    program = "the program was compensated before", "start from the original, or take the postproc lines out"
    read_only = (
        "the file that is read along was compensated before: its targets hold the correction",
        "lend the original",
    )
    for source in sources:
        span = _mark(source)
        if span is not None:
            text, help_ = read_only if source.read_only else program
            yield Diagnostic("CMP001", "error", text, source, span, help_)


def _mark(source: Source) -> Span | None:
    """The place in a file that shows that it was compensated before: header, added function or call; else None."""
    for pattern in (_HEADER, _ADDED, re.compile(re.escape(MODULE_MARKER).encode())):
        if (match := pattern.search(source.data)) is not None:
            return match.span()
    if b"ppcorrected" not in source.data.lower():
        return None
    return next((span for name, span in names_at(source, (0, len(source.data))) if name in CORRECTING), None)
