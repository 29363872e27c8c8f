"""Every command of the README runs as it stands there."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from postproc.cli.app import build
from postproc.cli.run import run

ROOT = Path(__file__).resolve().parent.parent
DIFFERENT = ("--check", "--diff", "diff")  # these find something, and say so with their exit code


def commands() -> list[list[str]]:
    """The lines of the shell blocks, comments and the variable DATA resolved."""
    text = "\n".join(re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL))
    data = re.search(r"^DATA=(\S+)$", text, re.MULTILINE)
    assert data
    lines = [line for line in text.replace("$DATA", data[1]).splitlines() if line.startswith("postproc ")]
    return [shlex.split(line, comments=True)[1:] for line in lines]


def test_commands_run_as_they_stand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    found = commands()
    assert len(found) > 10
    for arguments in found:
        code = run(build(), arguments)
        said = capsys.readouterr()
        assert code == int(any(word in arguments for word in DIFFERENT)), (arguments, said.err)
    wanted = {word for arguments in found for word in arguments if word.startswith("out/")}
    assert all((tmp_path / name).exists() for name in wanted)
