"""``kill -9`` at any moment: nothing is lost, nothing is half written, no worker stays behind."""

from __future__ import annotations

import signal
from pathlib import Path

from .folders import cached, convert, programs, tree, write
from .killing import gone, kill_when, outputs, start


def test_a_killed_run_goes_on(tmp_path: Path) -> None:
    source, out = write(programs(tmp_path / "in", 12), {"note.txt": "text"}), tmp_path / "out"
    convert(source, tmp_path / "whole")
    whole = tree(tmp_path / "whole")
    for count, by in ((1, signal.SIGKILL), (4, signal.SIGINT)):
        run = start(source, out, "--workers", "2")
        left = kill_when(run, lambda count=count: outputs(out) >= count, by=by)  # type: ignore[misc]
        assert outputs(out) < 12, "killed too late to show anything"
        assert gone(left)
        assert run.returncode == (1 if by == signal.SIGINT else -signal.SIGKILL)
        stands = tree(out, without=[".postproc"])
        assert stands.items() <= whole.items()
    again, _ = convert(source, out)
    assert not again.failed and cached(again)
    assert tree(out) == whole
