"""Exit codes, streams and whole-or-nothing files."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from cyclopts import App

from postproc import __version__
from postproc.cli.app import build
from postproc.cli.convert.finish import finish, unified_diff
from postproc.cli.inputs import read_source
from postproc.cli.output import check_outputs, write
from postproc.cli.printing import print_document, say_next, show
from postproc.cli.run import run
from postproc.diagnostics import Diagnostic, Matter, PostprocError, Source
from postproc.excerpt import columns
from postproc.results.conversion import unknown_accuracy

from .conftest import ARM, Call


def test_internal_error_leaves_a_trace_in_a_file(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    app = App(print_error=False, exit_on_error=False, result_action="return_value")

    @app.default
    def broken() -> None:
        raise KeyError("joint 7")

    assert run(app, []) == 70
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "KeyError: 'joint 7'" in captured.err
    assert "Traceback" not in captured.err
    (trace,) = tmp_path.iterdir()
    assert str(trace) in captured.err
    assert "raise KeyError" in trace.read_text()


def test_a_closed_pipe_is_not_an_error() -> None:
    code = "from postproc.cli.app import main; import sys; sys.argv[1:] = ['explain', 'CLI001']; main()"
    reader, writer = os.pipe()
    os.close(reader)
    process = subprocess.run([sys.executable, "-c", code], stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert process.stderr == b""
    assert process.returncode == 1


def test_a_terminal_that_lacks_a_letter_gets_it_escaped(tmp_path: Path) -> None:
    own = tmp_path / "own.py"
    text = (
        "from postproc.effects.base import Effect, param\nclass Push(Effect):\n"
        '    """Pushes \u00b5m. Source: us."""\n    push_m: float = param(unit="m", typical=1e-4)\n'
        "    def displacement(self, state):\n        return self.push_m * state.q\n"
    )
    own.write_text(text, "utf-8")
    command = [sys.executable, "-m", "postproc", "effects", "list", "--effects", str(own)]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii:strict"}
    process = subprocess.run(command, capture_output=True, check=False, text=True, env=environment)
    assert (process.returncode, process.stderr) == (0, "")
    assert process.stdout.splitlines()[-1].split() == ["push", "Pushes", "\\xb5m."]


def test_a_full_disk_is_told() -> None:
    code = "from postproc.cli.app import main; import sys; sys.argv[1:] = ['explain', 'CLI001']; main()"
    with open("/dev/full", "w") as full:
        process = subprocess.run(
            [sys.executable, "-c", code], stdout=full, stderr=subprocess.PIPE, check=False, text=True
        )
    assert process.returncode == 2
    assert process.stderr.startswith("error[CLI008]: cannot write to stdout: the disk is full\n  = help: make space")
    assert process.stderr.count("\n") == 2


def test_an_unreadable_name(tmp_path: Path) -> None:
    with pytest.raises(PostprocError, match="CLI004"):
        read_source(str(tmp_path / "a\0b.mod"))


def test_a_stopped_command_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    app = build()

    @app.command
    def long() -> None:
        raise KeyboardInterrupt

    assert run(app, ["long"]) == 130
    assert capsys.readouterr().err == "stopped; nothing was written\n"


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_files_are_written_whoever_reads(samples: Path, tmp_path: Path, stream: str) -> None:
    data, model = samples / "measurements" / "simulated_backlash.csv", tmp_path / "m.toml"
    effects = "instrument_frame,tool_frame"
    form = ["--json"] if stream == "stdout" else []
    commands = (
        ["fit", str(data), "--robot", "irb4600_60_205", "--effects", effects, "-o", str(model)],
        ["compensate", str(samples / "paper_case.mod"), *form, "-o", str(tmp_path / "x.mod")],
    )
    for command in commands:
        reader, writer = os.pipe()
        os.close(reader)
        code = "from postproc.cli.app import main; main()"
        out, err = (writer if stream == name else subprocess.PIPE for name in ("stdout", "stderr"))
        words = [sys.executable, "-c", code, *command]
        process = subprocess.run(words, stdout=out, stderr=err, check=False, cwd=samples.parent)
        os.close(writer)
        assert b"Error" not in (process.stderr or b"")
        assert stream == "stdout" or process.returncode == 0
        assert Path(command[-1]).stat().st_size > 0


def test_streams_may_be_closed(samples: Path, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "postproc", "compensate", samples / "paper_case.mod", "-o", tmp_path / "x.mod"]
    command = ["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *words]
    assert subprocess.run(command, check=False, cwd=samples.parent).returncode == 0
    assert (tmp_path / "x.mod").exists()


def test_what_nobody_knows_of_the_accuracy_is_said() -> None:
    assert unknown_accuracy().startswith("the model was not fitted")
    left_out = Diagnostic("CMP016", "warning", "`rail_sag` reads `rail_m`", matter=Matter.NOT_WHOLE)
    assert unknown_accuracy([left_out]).startswith("not all of the model holds here")


def test_a_pipe_stays_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write(pipe, b"all of it")
    assert os.read(reader, 100) == b"all of it"
    os.close(reader)
    assert pipe.is_fifo()


def test_output_folders_are_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    for output in (tmp_path, tmp_path / "file" / "q.mod"):
        with pytest.raises(PostprocError, match="CLI008"):
            check_outputs(("p.mod",), output)
    target = tmp_path / "new" / "deep" / "q.mod"
    check_outputs(("p.mod",), target)
    assert not target.parent.exists()
    write(target, b"1")
    assert target.read_bytes() == b"1"


def test_writing_is_all_or_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "out.mod"
    target.write_bytes(b"old")
    target.chmod(0o640)
    write(target, b"new")
    assert target.read_bytes() == b"new"
    assert target.stat().st_mode & 0o777 == 0o640

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(PostprocError, match="No space left"):
        write(target, b"newer")
    assert target.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [target]


def test_diffs_keep_bytes_and_line_ends() -> None:
    before, after = b"MODULE m\r\n  ! \xe9\r\nENDMODULE", b"MODULE m\r\n  ! \xe8\r\nENDMODULE"
    assert unified_diff(before, after, "a.mod", "b.mod") == (
        b"--- a.mod\n+++ b.mod\n@@ -1,3 +1,3 @@\n MODULE m\r\n-  ! \xe9\r\n+  ! \xe8\r\n ENDMODULE\n"
        b"\\ No newline at end of file\n"
    )
    assert unified_diff(before, before, "a", "b") == b""


def test_documents_hold_no_nan(capsys: pytest.CaptureFixture[str]) -> None:
    import numpy as np

    odd = {"a": float("nan"), "b": np.array([1.0, np.inf]), "c": np.float64(2.5), "d": (np.int64(3), None, True)}
    print_document({"schema": "postproc/odd/1", **odd})
    head = {"schema": "postproc/odd/1", "tool": __version__}
    plain = {"a": None, "b": [1.0, None], "c": 2.5, "d": [3, None, True]}
    assert json.loads(capsys.readouterr().out) == head | plain


def test_findings_are_counted_when_there_are_many(capsys: pytest.CaptureFixture[str]) -> None:
    source = Source("p.mod", b"MoveL [1] [mm]\n" * 15)
    odd = [Diagnostic("RAP001", "warning", "odd", source, (15 * line, 15 * line + 5)) for line in range(15)]
    show([*odd, *odd])
    text = capsys.readouterr().err
    assert text.count("warning[RAP001]") == 3
    listed = ", ".join(map(str, range(4, 16)))
    assert text.endswith(f"RAP001: 12 more like this in lines {listed}; `--verbose` shows them\n")
    assert "MoveL [1] [mm]" in text
    show(replace(d, severity="error", message=f"`p{i}` is odd by {i} mm") for i, d in enumerate(odd))
    text = capsys.readouterr().err
    assert (text.count("error[RAP001]"), "RAP001: 5 more like this in lines 11, 12, 13, 14, 15;" in text) == (10, True)


def test_every_finding_is_printed_on_request(call: Call, tmp_path: Path) -> None:
    """Whatever is printed, the document holds them all."""
    path = tmp_path / "p.mod"
    lines = "".join(f"  ]]{i};\n" for i in range(8))
    path.write_text(f"MODULE p\nPROC main()\n{lines}ENDPROC\nENDMODULE\n")
    brief, whole = call("inspect", path, "--json"), call("inspect", path, "--json", "--verbose")
    assert (brief.err.count("warning[RAP003]"), whole.err.count("warning[RAP003]")) == (3, 8)
    assert "5 more like this in lines 6, 7, 8, 9, 10" in brief.err
    assert brief.out == whole.out
    assert len(json.loads(brief.out)["diagnostics"]) == 8


def test_findings_fit_the_terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Words stay whole, a long line is cut around its mark, and the code is coloured with the severity."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.delenv("NO_COLOR", raising=False)
    line = "MoveL [[1,2,3]," + "1," * 60 + "tTorch];"
    source = Source("p.mod", line.encode())
    at = line.index("tTorch")
    message = "the tool `tTorch` has no value in these files, and nobody knows where the torch is"
    show([Diagnostic("RAP020", "error", message, source, (at, at + 6), "give the file " * 6)])
    text = capsys.readouterr().err
    assert text.startswith("\x1b[1;31merror[RAP020]\x1b[0m: the tool `tTorch` has no value in these\n  files, and")
    plain = re.sub(r"\x1b\[[\d;]*m", "", text)
    assert all(columns(shown) <= 60 for shown in plain.splitlines())
    shown, carets = plain.splitlines()[4:6]
    assert shown[carets.index("^") :][:6] == "tTorch"
    assert "\x1b[1;31m^^^^^^\x1b[0m" in text
    assert " ".join(plain.split("= help:")[1].split()) == "give the file " * 5 + "give the file"


@pytest.mark.parametrize(
    ("line", "mark", "lead"),
    [
        ("\tMoveL p,v5;", "p", 10),  # a tab goes to the next stop of four columns
        ("a\tp;", "p", 4),
        ("! \u6cd5 p;", "p", 5),  # wide letters take two columns
        ("! e\u0301 p;", "p", 4),  # an accent that combines takes none
        ("! \u00fcber p;", "\u00fcber", 2),
    ],
)
def test_carets_stand_below_what_they_mean(line: str, mark: str, lead: int) -> None:
    data = line.encode()
    at = data.index(mark.encode())
    rows = Diagnostic("RAP003", "warning", "odd", Source("p.mod", data), (at, at + len(mark.encode()))).render()
    shown, carets = rows.splitlines()[3:5]
    assert carets == "  | " + " " * lead + "^" * len(mark)
    assert columns(shown[: shown.index(mark)]) - 4 == lead


def test_an_error_is_not_hidden_behind_a_warning_at_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    source = Source("t.csv", b"1,2\n")
    odd = Diagnostic("DAT009", "warning", "12 mm off", source, (0, 3))
    show([odd, replace(odd, message="13 mm off"), replace(odd, severity="error", message="turned by 61 deg")])
    assert [line for line in capsys.readouterr().err.splitlines() if "DAT009" in line] == [
        "warning[DAT009]: 12 mm off",
        "error[DAT009]: turned by 61 deg",
    ]


def test_check_and_diff_write_nothing(tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    target = tmp_path / "out.mod"
    names = ("a.mod", "out.mod")

    def finishing(before: bytes, after: bytes, to: Path | None, *flags: str) -> tuple[int, bytes]:
        code = finish(before, after, names, to, check="check" in flags, diff="diff" in flags, silent="json" in flags)
        return code, capfdbinary.readouterr().out

    assert finishing(b"a\n", b"b\n", target, "check") == (1, b"")
    assert finishing(b"a\n", b"b\n", None, "check") == (1, b"")
    assert finishing(b"a\n", b"a\n", None, "check") == (0, b"")
    code, text = finishing(b"a\n", b"b\n", target, "diff")
    assert (code, text) == (1, b"--- a.mod\n+++ out.mod\n@@ -1 +1 @@\n-a\n+b\n")
    assert not target.exists()
    assert finishing(b"a\n", b"b\n", None) == (0, b"b\n")
    assert finishing(b"a\n", b"b\n", None, "json") == (0, b"")
    assert finishing(b"a\n", b"b\n", target, "json") == (0, b"")
    assert target.read_bytes() == b"b\n"
    assert finishing(b"a\n", b"b\n", target, "check") == (0, b"")


@pytest.mark.parametrize(
    "words", (["inspect", "-", *ARM], ["compensate", "-", "--check", *ARM], ["diff", "{name}", "-"])
)
def test_a_hyphen_reads_stdin(words: list[str], call: Call, samples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = samples / "paper_case.mod"
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(program.read_bytes())))
    found = call(*(word.format(name=program) for word in words))
    assert found.code == (1 if "--check" in words else 0), found.err
    assert "CLI" not in found.err


def test_a_command_that_follows_names_stdin_as_it_was_named(capsys: pytest.CaptureFixture[str]) -> None:
    say_next("does it", "diagnose", Path("m.toml"), "<stdin>")
    assert "`postproc diagnose m.toml -` does it" in capsys.readouterr().err
