"""A part of the bad calls; ``python -m tests.fuzz.calls`` makes all of them."""

from __future__ import annotations

from tests.fuzz.calls import STEP, calls, make


def test_bad_calls_end_with_findings_and_change_nothing() -> None:
    every = list(calls())
    assert len(every) > 500
    assert [text for call in every[::STEP] if (text := make(call)) is not None] == []
