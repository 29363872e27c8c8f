"""``kill -9`` at any moment: nothing is lost, nothing is half written, no worker stays behind."""

from __future__ import annotations

import signal
from pathlib import Path

from .folders import convert, program, programs, tree, write
from .killing import finish, gone, kill_when, outputs, start


def test_a_killed_run_goes_on(tmp_path: Path) -> None:
    source, out = write(programs(tmp_path / "in", 24), {"note.txt": "text"}), tmp_path / "out"
    convert(source, tmp_path / "whole")
    whole = tree(tmp_path / "whole")
    for count, by in ((1, signal.SIGKILL), (4, signal.SIGINT)):
        run = start(source, out, "--workers", "2")
        left = kill_when(run, lambda count=count: outputs(out) >= count, by=by)  # type: ignore[misc]
        assert outputs(out) < 24, "killed too late to show anything"
        assert gone(left)
        assert run.returncode == (1 if by == signal.SIGINT else -signal.SIGKILL)
        stands = tree(out, without=[".postproc"])
        assert stands.items() <= whole.items()
    said = finish(start(source, out, "--workers", "1"))
    assert ", done before " in said
    assert tree(out) == whole


def test_a_bar_on_a_terminal_and_lines_elsewhere(tmp_path: Path) -> None:
    source = write(tmp_path / "in", {"a[b].mod": program("A")})
    said = finish(start(source, tmp_path / "out", "--workers", "1"))
    first, second = said.splitlines()[:2]
    assert first == "arm `irb4600_60_205` (from --robot); tolerance 0.1 mm, 0.2 mm in the air; scope all"
    assert second.startswith("[1/1] a[b].mod: ")
    assert [line for line in said.splitlines() if line.startswith("1 task in ")]
