"""Reading what the user names on the command line: files and vectors."""

from __future__ import annotations

import math
import sys
from pathlib import Path

from postproc.diagnostics import Diagnostic, PostprocError, Source

Vector = tuple[float, float, float]


def read_source(name: str) -> Source:
    """The bytes of a file; ``-`` is stdin.

    Raises:
        PostprocError: no such file (CLI002), a folder (CLI003), not readable (CLI004), empty (CLI005).
    """
    if name == "-":
        return Source("<stdin>", sys.stdin.buffer.read())
    try:
        data = Path(name).read_bytes()
    except FileNotFoundError:
        raise _error("CLI002", f"there is no file `{name}`", "check the spelling and the folder") from None
    except IsADirectoryError:
        raise _error("CLI003", f"`{name}` is a folder", "name one file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _error("CLI004", f"cannot read `{name}`: {reason}", "check the rights of the file") from None
    if not data.strip():
        raise PostprocError(
            Diagnostic("CLI005", "error", f"`{name}` is empty", Source(name, data), help="name the file that was meant")
        )
    return Source(name, data)


def parse_vector(option: str, text: str) -> Vector:
    """Three numbers with commas between them, ``200,-200,-200``.

    Raises:
        PostprocError: anything else (CLI006).
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        raise _error("CLI006", f"`{option} {text}` is not three numbers", f"write `{option} 200,-200,-200`")
    return x, y, z


def _error(code: str, message: str, help_: str) -> PostprocError:
    return PostprocError(Diagnostic(code, "error", message, help=help_))
