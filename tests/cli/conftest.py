"""Commands as a user calls them, in this process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from postproc.batch import executors
from postproc.cli.app import build
from postproc.cli.run import run
from tests.batch.build import IN_PROCESS


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


Call = Callable[..., Outcome]
ARM = ("--robot", "irb4600_60_205")
CONVERT = ("compensate", "inspect", "batch", "seam", "runtime")


@pytest.fixture
def call(call_as_written: Call) -> Call:
    """Commands that read programs are for the arm of the samples where they name none."""

    def calling(*arguments: str | Path) -> Outcome:
        named = arguments[0] not in CONVERT or {"--robot", "-m", "--help"} & set(arguments)
        return call_as_written(*arguments, *(() if named else ARM))

    return calling


@pytest.fixture
def call_as_written(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Call:
    """A batch works in this process: workers take seconds to start, and ``tests/batch`` starts them."""
    monkeypatch.setattr(executors, "local_pool", lambda workers: IN_PROCESS)

    def calling(*arguments: str | Path) -> Outcome:
        code = run(build(), [str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return calling
