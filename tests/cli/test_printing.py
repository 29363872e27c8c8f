"""What is printed for people: findings, progress, lines of a batch; documents hold plain values."""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc import __version__
from postproc.batch.document import batch_document
from postproc.batch.values import Batch, TaskOutcome
from postproc.cli.convert.batch_lines import reporting
from postproc.cli.output import write
from postproc.cli.printing import print_document, show
from postproc.cli.progress import watching
from postproc.compensation.options import Options
from postproc.diagnostics import Diagnostic, Finding, Matter, Source
from postproc.excerpt import columns
from postproc.model.file import default_model
from postproc.report.blocks import Document
from postproc.report.page import render_page
from postproc.report.terminal import render_text
from postproc.results.convert.conversion import unknown_accuracy
from postproc.runtime.passes import correct_program
from postproc.tasks.task import Task


def show_on_terminal(monkeypatch: pytest.MonkeyPatch, columns: int = 60) -> None:
    """Let the streams of a test be a terminal of a width."""
    for stream in (sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.delenv("NO_COLOR", raising=False)


def shown(capsys: pytest.CaptureFixture[str], findings: Iterable[Diagnostic]) -> str:
    show(findings)
    return capsys.readouterr().err


def test_documents_hold_no_nan(capsys: pytest.CaptureFixture[str]) -> None:
    odd = {"a": float("nan"), "b": np.array([1.0, np.inf]), "c": np.float64(2.5), "d": (np.int64(3), None, True)}
    print_document({"schema": "postproc/odd/1", **odd})
    head = {"schema": "postproc/odd/1", "tool": __version__}
    assert json.loads(capsys.readouterr().out) == {**head, "a": None, "b": [1.0, None], "c": 2.5, "d": [3, None, True]}


def test_no_file_name_ends_the_document_of_a_page() -> None:
    evil = "<!--<script>a</script>--></SCRIPT>.mod"
    page = render_page(Document(title="t", sentence="s", values={"name": evil}))
    (inside,) = re.findall(r'<script[^>]*id="document"[^>]*>(.*?)</script', page, re.DOTALL | re.IGNORECASE)
    assert "<" not in inside and json.loads(inside) == {"name": evil}


def test_what_nobody_knows_of_the_accuracy_is_said() -> None:
    left_out = Diagnostic("CMP016", "warning", "`rail_sag` reads `rail_m`", matter=Matter.OMITTED)
    assert unknown_accuracy().startswith("the model was not fitted")
    assert unknown_accuracy([left_out]).startswith("not all of the model holds here")


def test_findings_are_counted_when_there_are_many(capsys: pytest.CaptureFixture[str]) -> None:
    source = Source("p.mod", b"MoveL [1] [mm]\n" * 15)
    odd = [Diagnostic("RAP001", "warning", "odd", source, (15 * line, 15 * line + 5)) for line in range(15)]
    text = shown(capsys, [*odd, *odd])
    assert text.count("warning[RAP001]") == 3 and "MoveL [1] [mm]" in text
    listed = ", ".join(map(str, range(4, 16)))
    assert text.endswith(f"RAP001: 12 more like this in lines {listed}; `--verbose` shows them\n")
    text = shown(capsys, (replace(d, severity="error", message=f"`p{i}` is odd by {i} mm") for i, d in enumerate(odd)))
    assert text.count("error[RAP001]") == 10 and "RAP001: 5 more like this in lines 11, 12, 13, 14, 15;" in text


def test_an_error_is_not_hidden_behind_a_warning_at_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    odd = Diagnostic("DAT009", "warning", "12 mm off", Source("t.csv", b"1,2\n"), (0, 3))
    turned = replace(odd, severity="error", message="turned by 61 deg")
    text = shown(capsys, [odd, replace(odd, message="13 mm off"), turned])
    assert re.findall(".*DAT009.*", text) == ["warning[DAT009]: 12 mm off", "error[DAT009]: turned by 61 deg"]


def test_findings_fit_the_terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Words stay complete, a long line is cut around its mark, and the code is coloured with the severity."""
    show_on_terminal(monkeypatch)
    line = "MoveL [[1,2,3]," + "1," * 60 + "tTorch];"
    at = line.index("tTorch")
    message = "the tool `tTorch` has no value in these files, and nobody knows where the torch is"
    source = Source("p.mod", line.encode())
    text = shown(capsys, [Diagnostic("RAP020", "error", message, source, (at, at + 6), "give the file " * 6)])
    assert text.startswith("\x1b[1;31merror[RAP020]\x1b[0m: the tool `tTorch` has no value in these\n  files, and")
    plain = re.sub(r"\x1b\[[\d;]*m", "", text)
    assert all(columns(row) <= 60 for row in plain.splitlines())
    excerpt, carets = plain.splitlines()[4:6]
    assert excerpt[carets.index("^") :][:6] == "tTorch" and "\x1b[1;31m^^^^^^\x1b[0m" in text
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
    at, size = line.encode().index(mark.encode()), len(mark.encode())
    rows = Diagnostic("RAP003", "warning", "odd", Source("p.mod", line.encode()), (at, at + size)).render()
    excerpt, carets = rows.splitlines()[3:5]
    assert carets == "  | " + " " * lead + "^" * len(mark)
    assert columns(excerpt[: excerpt.index(mark)]) - 4 == lead


def test_a_terminal_is_shown_no_control_characters(
    capfdbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    data = b"MODULE m\r\n ! \x1b]52;c;x\x07 \xc2\x9b\r\n"
    for is_terminal, printed in ((False, data), (True, b"MODULE m\r\n ! \\x1b]52;c;x\\x07 \\x9b\r\n")):
        monkeypatch.setattr(sys.stdout, "isatty", lambda answer=is_terminal: answer, raising=False)
        write(None, data)
        assert capfdbinary.readouterr().out == printed


def test_work_that_takes_long_says_so(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    show_on_terminal(monkeypatch)
    with watching("reading `a\x1b.mod`", 300) as watch:
        watch("path", 0.25)
        time.sleep(1.3)
    assert capsys.readouterr().err == "\rreading `a\\x1b.mod`: path, 25 %, 1 s\x1b[K\r\x1b[K"
    with watching("x"):
        pass
    assert capsys.readouterr().err == ""


def test_a_log_gets_no_lines_of_progress(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing but results and findings: the output of a job is the same however fast its machine is."""
    started: list[object] = []
    monkeypatch.setattr("postproc.cli.progress.threading.Thread", lambda **kwargs: started.append(kwargs))
    with watching("reading `a.mod`", 300) as watch:
        watch("path", 0.25)
    assert capsys.readouterr().err == "" and started == []


def test_the_line_of_a_long_work_tells_rate_and_remaining_time(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = [0.0]
    show_on_terminal(monkeypatch, 200)
    monkeypatch.setattr("postproc.cli.progress.time.monotonic", lambda: clock[0])
    monkeypatch.setattr("postproc.cli.progress.EVERY_S", 0.02)
    with watching("correcting `a.mod`", 20_000) as watch:

        def line(now: float) -> str:
            """The line that is shown at a time."""
            clock[0], text = now, ""
            for _ in range(3000):
                time.sleep(0.001)
                text = capsys.readouterr().err or text
                if f" {now:.0f} s" in text:
                    break
            return text.rpartition("\r")[2].removesuffix("\x1b[K")

        assert line(0.4) == "correcting `a.mod`, 0 s"
        clock[0] = 4.0
        watch("path and timing", 0.25)
        shared = "correcting `a.mod`: path and timing, 25 %, "
        assert line(5.0) == f"{shared}5 s, 1,250 lines/s, about 11 s remain"
        for late in (17.0, 30.0):  # the step takes longer than its share foretold
            assert line(late) == f"{shared}{late:.0f} s, 1,250 lines/s"
        watch("going back", 0.2)  # a search may find that it has more to do than it said
        assert "going back, 20 %," in line(31.0)


def test_a_conversion_tells_how_far_it_is(samples: Path) -> None:
    told: list[tuple[str, float]] = []
    source = Source("a.mod", (samples / "panel_300.mod").read_bytes())
    correct_program(source, default_model(), Options(), lambda what, share: told.append((what, share)))
    steps = list(dict.fromkeys(what for what, _ in told))
    assert steps == ["following the program", "path and timing", "correction", "reading back and proving"]
    shares = [share for _, share in told]
    assert shares == sorted(shares) and 0.9 < shares[-1] < 1


def outcome_of(name: str, status: str, *findings: Finding, cached: bool = False, **figures: object) -> TaskOutcome:
    return TaskOutcome(Task(name, ()), status, cached, figures, findings)  # type: ignore[arg-type]


EDITED = Finding("BAT016", "warning", "put aside", "c.mod", 3, 7, matter=Matter.EDITED)
OFF = replace(EDITED, code="CMP006", matter=Matter.OFF)


def test_a_terminal_shows_how_far_a_batch_is_and_what_failed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    show_on_terminal(monkeypatch)
    wrong = Finding("RAP001", "error", "the file [bold] is empty", "a[0].mod", 3, 7)
    with reporting(2) as reporter:
        reporter.outcome(outcome_of("a[0].mod", "failed", wrong))
        reporter.outcome(outcome_of("b.mod", "unchanged"))
        reporter.outcome(outcome_of("c.mod", "compensated", EDITED, OFF))
        time.sleep(1.2)
    text = " ".join(capsys.readouterr().err.split())
    for words in ("programs: 3 of 2, 100 %", "a[0].mod:3:7: error[RAP001]: the file [bold] is empty"):
        assert words in text
    assert "c.mod:3:7: warning[BAT016]: put aside" in text and "b.mod" not in text and "CMP006" not in text


def test_the_table_of_many_tasks_shows_those_that_matter() -> None:
    figures = {"added_targets": 1, "statements": {"skipped": 2}, "tolerance_mm": 0.01}
    place = {"place": "path", "before_mm": 1.0, "tolerance_mm": 0.01, "expected_on_arm_mm": None}
    of: list[dict[str, object]] = [{**figures, "figures": [{**place, "after_mm": i / 1e3}]} for i in range(100)]
    of[99]["unproved_statements"] = 71
    good = [outcome_of(f"{i:03}.mod", "compensated", cached=i % 2 == 0, **each) for i, each in enumerate(of)]
    bad = outcome_of("zzz.mod", "failed", Finding("CMP009", "warning", "m"), Finding("KIN001", "error", "m"))
    head, _, text = render_text(batch_document("in", Batch((*good, bad), 3, ()))).partition("\nEvery program:\n")
    assert all(words in head for words in ("done before 50", "failed 1", "files copied 3"))
    lines = text.partition("\n\n")[0].splitlines()
    assert len(lines) == 42 and lines[-1] == "  61 more; `--verbose` shows them" and "unproved" in lines[0]
    assert [" ".join(line.split()) for line in lines[1:4]] == [
        "zzz.mod failed 1",
        "099.mod compensated not known 1.000 0.099 0.010 1 2 71",
        "098.mod compensated, as before not known 1.000 0.098 0.010 1 2",
    ]
    assert lines[-2].split()[0] == "061.mod"
    off = Batch((outcome_of("a", "compensated", OFF, OFF),), 0, ())
    assert "beyond the tolerance somewhere 1" in render_text(batch_document("in", off))
