"""What a command must never do: write over what it reads, lose what somebody saved, say nothing, believe odd text."""

from __future__ import annotations

import json
import os
import re
import sys
import time
from pathlib import Path

import pytest

from postproc.cli.output import write
from postproc.cli.progress import _Work, watching
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.files import place, write_whole
from postproc.model.file import default_model
from postproc.report.blocks import Document
from postproc.report.page import render_page
from postproc.runtime.passes import correct_program

from .conftest import Call


@pytest.fixture
def program(samples: Path, tmp_path: Path) -> Path:
    path = tmp_path / "p.mod"
    path.write_bytes((samples / "corner_arc.mod").read_bytes())
    return path


def test_templates_settings_and_the_arm_of_a_model_are_inputs(
    call_as_written: Call, program: Path, tmp_path: Path
) -> None:
    from postproc.files import resource
    from postproc.robot.catalogue import ARMS

    (tmp_path / "t").mkdir()
    for name in ("header.j2", "target.j2"):
        (tmp_path / "t" / name).write_bytes(
            resource("templates", name).read_bytes() if resource("templates", name).is_file() else b""
        )
    (tmp_path / "own.toml").write_bytes((ARMS / "irb4600_60_205.toml").read_bytes())
    (tmp_path / "m.toml").write_text('robot = "own.toml"\n')
    (tmp_path / "user.sys").write_text("MODULE user(SYSMODULE)\nENDMODULE\n")
    (tmp_path / "postproc.toml").write_text('model = "m.toml"\ntemplate = "t"\nwith = ["user.sys"]\n')
    (tmp_path / "link.j2").symlink_to(tmp_path / "t" / "header.j2")
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    for option in ("-o", "--report"):
        for name in ("t/header.j2", "link.j2", "own.toml", "m.toml", "user.sys", "postproc.toml", "p.mod"):
            found = call_as_written("compensate", program, option, tmp_path / name)
            assert found.code == 2 and "error[CLI007]" in found.err, name
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before


def test_folders_without_case_hold_one_file_for_two_spellings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "Cell"
    folder.mkdir()
    assert place(folder / "A.mod") != place(folder / "a.mod")
    (tmp_path / "cELL").symlink_to(folder)  # as a file system without case answers
    assert place(folder / "A.mod") == place(folder / "a.mod")


def test_what_somebody_saves_meanwhile_is_not_written_over(
    call: Call, program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import postproc.runtime.passes

    convert = postproc.runtime.passes.correct_program

    def slowly(*arguments: object) -> object:
        done = convert(*arguments)  # type: ignore[arg-type]
        program.write_bytes(program.read_bytes() + b"! saved meanwhile\n")
        return done

    monkeypatch.setattr(postproc.runtime.passes, "correct_program", slowly)
    found = call("compensate", program, "--in-place")
    assert found.code == 1 and "error[CLI015]" in found.err
    assert program.read_bytes().endswith(b"! saved meanwhile\n") and b"compensated for" not in program.read_bytes()


def test_what_is_written_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    for name in ("fsync", "replace"):
        monkeypatch.setattr(os, name, lambda *a, true=getattr(os, name), name=name: (done.append(name), true(*a))[1])
    write(tmp_path / ("n" * 251 + ".mod"), b"1")
    assert done == ["fsync", "replace"]


def test_a_write_that_is_stopped_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", stop)
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path / "a.mod", b"1")
    assert not list(tmp_path.iterdir())


def test_numbers_of_tables_are_as_people_write_them(call: Call, samples: Path, tmp_path: Path) -> None:
    lines = (samples / "measurements" / "simulated_backlash.csv").read_text("utf-8").splitlines(keepends=True)
    cells = lines[3].split(",")
    whole = cells[7]
    cells[7] = f"{whole[:-2]}_{whole[-2:]}"
    table = tmp_path / "t.csv"
    table.write_text("".join([*lines[:3], ",".join(cells), *lines[4:]]), "utf-8")
    found = call("compare", samples / "models" / "irb4600_60_205.toml", table)
    assert "DAT003" in found.err and cells[7] in found.err


def test_predict_has_a_row_for_every_row(call: Call, samples: Path, tmp_path: Path) -> None:
    lines = (samples / "measurements" / "simulated_backlash.csv").read_text("utf-8").splitlines(keepends=True)
    table, out = tmp_path / "t.csv", tmp_path / "out.csv"
    table.write_text(
        "".join([*lines[:5], "torn,1,2\n", *lines[5:9], lines[9].rstrip("\n") + ",7\n", *lines[10:]]), "utf-8"
    )
    found = call("predict", samples / "models" / "irb4600_60_205.toml", table, "-o", out)
    assert found.code == 0 and "DAT004" in found.err
    rows = out.read_text().splitlines()
    assert len(rows) == len(table.read_text().splitlines())
    empty = [i for i, row in enumerate(rows) if not row.partition(",")[2].strip(",")]
    assert empty == [5, 10]


def test_no_file_name_ends_the_document_of_a_page() -> None:
    evil = "<!--<script>a</script>--></SCRIPT>.mod"
    page = render_page(Document(title="t", sentence="s", values={"name": evil}))
    (inside,) = re.findall(r'<script[^>]*id="document"[^>]*>(.*?)</script', page, re.DOTALL | re.IGNORECASE)
    assert "<" not in inside and json.loads(inside) == {"name": evil}


def test_a_terminal_is_shown_no_control_characters(
    capfdbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    data = b"MODULE m\r\n ! \x1b]52;c;x\x07 \xc2\x9b\r\n"
    write(None, data)
    assert capfdbinary.readouterr().out == data  # a file or a pipe has the bytes
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    write(None, data)
    assert capfdbinary.readouterr().out == b"MODULE m\r\n ! \\x1b]52;c;x\\x07 \\x9b\r\n"


def test_work_that_takes_long_says_so(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with watching("reading `a\x1b.mod`", 300) as watch:
        watch("path", 0.25)
        time.sleep(1.3)
    said = capsys.readouterr().err
    assert said == "\rreading `a\\x1b.mod`: path, 25 %, 1 s\x1b[K\r\x1b[K"
    with watching("x"):
        pass
    assert capsys.readouterr().err == ""


def test_the_line_of_a_long_work_tells_rate_and_remaining_time() -> None:
    work = _Work("correcting `a.mod`", 20_000)
    assert work.line(work.begun + 0.4) == "correcting `a.mod`, 0 s"
    work.watch("path and timing", 0.5)
    work.told = work.begun + 4.0
    expected = "correcting `a.mod`: path and timing, 50 %, 5 s, 2,500 lines/s, about 3 s remain"
    assert work.line(work.begun + 5.0) == expected
    for late in (8.5, 30.0, 70.0):  # the step takes longer than its share foretold
        assert "remain" not in work.line(work.begun + late)
    work.watch("going back", 0.2)  # a search may find that it has more to do than it said
    assert work.share == 0.5


def test_a_conversion_tells_how_far_it_is(samples: Path) -> None:
    told: list[tuple[str, float]] = []
    source = Source("a.mod", (samples / "panel_300.mod").read_bytes())
    correct_program(source, default_model(), Options(), lambda what, share: told.append((what, share)))
    steps = list(dict.fromkeys(what for what, _ in told))
    assert steps == ["following the program", "path and timing", "correction", "reading back and proving"]
    shares = [share for _, share in told]
    assert shares == sorted(shares) and 0.9 < shares[-1] < 1
