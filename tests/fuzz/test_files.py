"""A few of the bad files; ``python -m tests.fuzz.files`` makes many more."""

from __future__ import annotations

from tests.fuzz.files import KINDS, Case, cases, make


def test_bad_files_end_with_findings_and_change_nothing() -> None:
    few = [*cases(2 * len(KINDS), 7), *(Case(kind, kind.calls[0], 0, "fifo") for kind in KINDS[:5])]
    assert [text for case in few if (text := make(case)) is not None] == []
