"""The boundary to the shell: exit codes and streams, whoever reads them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from cyclopts import App

from postproc.cli.run import run

MAIN = "from postproc.cli.app import main; main()"


@pytest.mark.parametrize(("error", "code"), [(KeyError("joint 7"), 70), (KeyboardInterrupt(), 130)])
def test_what_a_command_raises_is_one_line_and_an_exit_code(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    error: BaseException,
    code: int,
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    app = App(print_error=False, exit_on_error=False, suppress_keyboard_interrupt=False, result_action="return_value")

    @app.default
    def broken() -> None:
        raise error

    assert run(app, []) == code
    out, err = capsys.readouterr()
    if code == 130:
        assert (out, err, list(tmp_path.iterdir())) == ("", "stopped; nothing was written\n", [])
    else:
        (trace,) = tmp_path.iterdir()
        assert (out, err.count("\n"), "Traceback" in err) == ("", 1, False)
        assert "KeyError: 'joint 7'" in err and str(trace) in err
        assert "raise error" in trace.read_text()


def process(*words: object, **streams: Any) -> subprocess.CompletedProcess[bytes]:
    """A command in a process of its own; what is not stated of its streams is kept."""
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
    return subprocess.run([sys.executable, "-c", MAIN, *map(str, words)], check=False, **streams)


def closed_pipe() -> int:
    """The end for writing of a pipe that nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    return writer


def test_a_closed_pipe_is_not_an_error() -> None:
    done = process("explain", "CLI001", stdout=closed_pipe())
    assert (done.returncode, done.stderr) == (1, b"")


def test_a_full_disk_is_told() -> None:
    with open("/dev/full", "w") as full:
        done = process("explain", "CLI001", stdout=full)
    assert done.returncode == 2 and done.stderr.count(b"\n") == 2
    assert done.stderr.startswith(b"error[CLI008]: cannot write to stdout: the disk is full\n  = help: make space")


FIT = ("fit", "samples/measurements/simulated_backlash.csv", "--robot", "irb4600_60_205")


@pytest.mark.parametrize(
    ("stream", "words"),
    [("stderr", FIT), ("stdout", ("compensate", "samples/paper_case.mod", "--json"))],
)
def test_files_are_written_whoever_reads(samples: Path, tmp_path: Path, stream: str, words: tuple[str, ...]) -> None:
    out = tmp_path / words[0]
    done = process(*words, "-o", out, cwd=samples.parent, **{stream: closed_pipe()})
    assert b"Error" not in (done.stderr or b"")
    assert stream == "stdout" or done.returncode == 0
    assert out.stat().st_size > 0


def test_streams_may_be_closed(samples: Path, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "postproc", "compensate", samples / "paper_case.mod", "-o", tmp_path / "x.mod"]
    command = ["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *words]
    assert subprocess.run(command, check=False, cwd=samples.parent).returncode == 0
    assert (tmp_path / "x.mod").exists()


def test_a_terminal_that_lacks_a_letter_gets_it_escaped(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "from postproc.effects.base import Effect, param\nclass Push(Effect):\n"
        '    """Pushes \u00b5m. Source: us."""\n    push_m: float = param(unit="m", typical=1e-4)\n'
        "    def displacement(self, state):\n        return self.push_m * state.q\n",
        "utf-8",
    )
    environment = {**os.environ, "PYTHONIOENCODING": "ascii:strict"}
    done = process("effects", "list", "--effects", tmp_path / "own.py", env=environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.splitlines()[-1].split() == [b"push", b"Pushes", b"\\xb5m."]
