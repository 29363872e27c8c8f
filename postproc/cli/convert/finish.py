"""What ``compensate`` does with its result: write it, show the difference, or say whether anything would change."""

from __future__ import annotations

import difflib
import os
from pathlib import Path

from postproc.cli.output import write


def finish(
    before: bytes, after: bytes, names: tuple[str, str], target: Path | None, *, check: bool, diff: bool, silent: bool
) -> int:
    """What ``--check``, ``--diff`` and ``-o`` do with a result: write it, or say whether something would change.

    Args:
        before, after: the input and the output.
        names: of both, for the head of the difference.
        target: where the output goes, None for stdout.
        check: write nothing; exit code 1 if the output file (the input, without one) would change.
        diff: write nothing; print the difference, exit code 1 if there is one.
        silent: stdout is taken (``--json``): neither the output nor the difference goes there.
    """
    if diff and not silent:
        write(None, unified_diff(before, after, *names))
    if check and target is not None:
        return int(not target.is_file() or target.read_bytes() != after)
    if check or diff:
        return int(before != after)
    if target is not None or not silent:
        write(target, after)
    return 0


def unified_diff(before: bytes, after: bytes, name_before: str, name_after: str) -> bytes:
    """The textual difference as ``diff -u`` prints it, bytes as they stand in the files."""
    lines = difflib.diff_bytes(
        difflib.unified_diff,
        _lines(before),
        _lines(after),
        os.fsencode(name_before),
        os.fsencode(name_after),
    )
    return b"".join(line if line.endswith(b"\n") else line + b"\n\\ No newline at end of file\n" for line in lines)


def _lines(data: bytes) -> list[bytes]:
    parts = data.split(b"\n")
    return [part + b"\n" for part in parts[:-1]] + ([parts[-1]] if parts[-1] else [])
