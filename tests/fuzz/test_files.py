"""A few of the bad files; ``python -m tests.fuzz.files`` makes many more."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

FEW = """
from tests.fuzz.files import KINDS, Case, cases, make
few = [*cases(len(KINDS), 7), *(Case(kind, kind.calls[0], 0, "fifo") for kind in KINDS[:5])]
print(*filter(None, map(make, few)), sep="\\n")
"""


def test_bad_files_end_with_findings_and_change_nothing() -> None:
    """In a process of its own: what a child of this one holds counts as the child's memory."""
    root = Path(__file__).resolve().parents[2]
    found = subprocess.run([sys.executable, "-c", FEW], cwd=root, capture_output=True, text=True, check=False)
    assert (found.returncode, found.stdout.strip()) == (0, ""), found.stderr[-2000:]
