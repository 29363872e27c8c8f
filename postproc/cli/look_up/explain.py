"""``postproc explain CODE``: what a diagnostic means and what to do."""

from __future__ import annotations

from postproc.cli.printing import put
from postproc.diagnostics import PostprocError, did_you_mean
from postproc.files import explanations


def run(code: str, /) -> int:
    """Print what a diagnostic means and what to do about it.

    Args:
        code: as printed in brackets, such as RAP012.
    """
    known = explanations()
    wanted = code.strip("[]").upper()
    if wanted not in known:
        help_ = did_you_mean(wanted, known, 3, 0.5) or "codes look like `RAP012`"
        raise PostprocError.of("CLI009", f"there is no diagnostic `{code}`", help=help_)
    put(known[wanted].removeprefix("## "))
    return 0
