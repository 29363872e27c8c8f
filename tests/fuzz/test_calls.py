"""A part of the bad calls; ``python -m tests.fuzz.calls`` makes all of them."""

from __future__ import annotations

import pytest

from postproc.batch import executors
from tests.batch.build import IN_PROCESS
from tests.fuzz.calls import STEP, calls, make


def test_bad_calls_end_with_findings_and_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A batch works in this process: workers take seconds to start, and ``tests/batch`` starts them."""
    monkeypatch.setattr(executors, "local_pool", lambda workers: IN_PROCESS)
    every = list(calls())
    assert len(every) > 500
    assert [text for call in every[::STEP] if (text := make(call)) is not None] == []
