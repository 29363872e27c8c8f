"""Reading the files that the user names."""

from __future__ import annotations

import sys
from pathlib import Path

from postproc.diagnostics import Diagnostic, PostprocError, Source


def read_source(name: str) -> Source:
    """The bytes of a file; ``-`` is stdin.

    Raises:
        PostprocError: no such file (CLI002), a folder (CLI003), not readable (CLI004), empty (CLI005).
    """
    if name == "-":
        source = Source("<stdin>", sys.stdin.buffer.read())
    else:
        source = Source(name, _read(name))
    if not source.data.strip():
        raise PostprocError(
            Diagnostic("CLI005", "error", f"`{source.path}` is empty", help="name the file that was meant")
        )
    return source


def _read(name: str) -> bytes:
    try:
        return Path(name).read_bytes()
    except FileNotFoundError:
        raise _error("CLI002", f"there is no file `{name}`", "check the spelling and the folder") from None
    except IsADirectoryError:
        raise _error("CLI003", f"`{name}` is a folder", "name one file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _error("CLI004", f"cannot read `{name}`: {reason}", "check the rights of the file") from None


def _error(code: str, message: str, help_: str) -> PostprocError:
    return PostprocError(Diagnostic(code, "error", message, help=help_))
