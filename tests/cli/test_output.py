"""Files are written whole or not at all, and never over what is read or what somebody saved."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import postproc.runtime.passes
from postproc.cli.convert.finish import unified_diff
from postproc.cli.inputs import read_source
from postproc.cli.output import write
from postproc.files import place, write_atomically
from tests.build import refused

from .conftest import Call


def test_writing_is_all_or_nothing_and_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, done = tmp_path / ("n" * 251 + ".mod"), list[str]()
    target.write_bytes(b"old")
    target.chmod(0o640)
    for name in ("fsync", "replace"):
        monkeypatch.setattr(os, name, lambda *a, true=getattr(os, name), name=name: (done.append(name), true(*a))[1])
    write(target, b"new")
    assert done == ["fsync", "replace"]
    assert (target.read_bytes(), target.stat().st_mode & 0o777) == (b"new", 0o640)

    def fail(error: BaseException) -> None:
        def replace(*_: object) -> None:
            raise error

        monkeypatch.setattr(os, "replace", replace)

    fail(OSError(28, "No space left on device"))
    assert "No space left" in refused(lambda: write(target, b"newer"))[0].message
    fail(KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        write_atomically(target, b"newer")
    assert target.read_bytes() == b"new" and list(tmp_path.iterdir()) == [target]


def test_a_pipe_stays_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write(pipe, b"all of it")
    assert os.read(reader, 100) == b"all of it" and pipe.is_fifo()
    os.close(reader)


def test_folders_without_case_hold_one_file_for_two_spellings(tmp_path: Path) -> None:
    (tmp_path / "Cell").mkdir()
    assert place(tmp_path / "Cell" / "A.mod") != place(tmp_path / "Cell" / "a.mod")
    (tmp_path / "cELL").symlink_to(tmp_path / "Cell")  # as a file system without case answers
    assert place(tmp_path / "Cell" / "A.mod") == place(tmp_path / "Cell" / "a.mod")


def test_what_somebody_saves_meanwhile_is_not_written_over(
    call: Call, samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "p.mod"
    program.write_bytes((samples / "corner_arc.mod").read_bytes())
    convert, saved = postproc.runtime.passes.correct_program, program.read_bytes() + b"! saved meanwhile\n"

    def slowly(*arguments: object) -> object:
        done = convert(*arguments)  # type: ignore[arg-type]
        program.write_bytes(saved)
        return done

    monkeypatch.setattr(postproc.runtime.passes, "correct_program", slowly)
    outcome = call("compensate", program, "--in-place")
    assert outcome.code == 1 and "error[CLI015]" in outcome.err
    assert program.read_bytes() == saved


def test_diffs_keep_bytes_and_line_ends() -> None:
    before, after = b"MODULE m\r\n  ! \xe9\r\nENDMODULE", b"MODULE m\r\n  ! \xe8\r\nENDMODULE"
    assert unified_diff(before, after, "a.mod", "b.mod") == (
        b"--- a.mod\n+++ b.mod\n@@ -1,3 +1,3 @@\n MODULE m\r\n-  ! \xe9\r\n+  ! \xe8\r\n ENDMODULE\n"
        b"\\ No newline at end of file\n"
    )
    assert unified_diff(before, before, "a", "b") == b""


def test_an_unreadable_name(tmp_path: Path) -> None:
    assert [d.code for d in refused(lambda: read_source(str(tmp_path / "a\0b.mod")))] == ["CLI004"]


def table(samples: Path) -> list[str]:
    return (samples / "measurements" / "simulated_backlash.csv").read_text("utf-8").splitlines(keepends=True)


def test_a_table_of_a_million_rows_is_refused_before_it_is_held(call: Call, samples: Path, tmp_path: Path) -> None:
    lines = table(samples)
    (tmp_path / "t.csv").write_text(lines[0] + lines[1] * 400_000)
    outcome = call("predict", samples / "models/irb4600_60_205.toml", tmp_path / "t.csv", "-o", tmp_path / "out.csv")
    assert outcome.code == 2 and "DAT001" in outcome.err and not (tmp_path / "out.csv").exists()


def test_predict_has_a_row_for_every_row(call: Call, samples: Path, tmp_path: Path) -> None:
    lines, out = table(samples), tmp_path / "out.csv"
    lines[9] = lines[9].rstrip("\n") + ",7\n"
    (tmp_path / "t.csv").write_text("".join([*lines[:5], "torn,1,2\n", *lines[5:]]))
    outcome = call("predict", samples / "models/irb4600_60_205.toml", tmp_path / "t.csv", "-o", out)
    assert outcome.code == 0 and "DAT004" in outcome.err
    rows = out.read_text().splitlines()
    assert len(rows) == len(lines) + 1
    assert [i for i, row in enumerate(rows) if not row.partition(",")[2].strip(",")] == [5, 10]


def test_numbers_of_tables_are_as_people_write_them(call: Call, samples: Path, tmp_path: Path) -> None:
    lines = table(samples)
    cells = lines[3].split(",")
    cells[7] = f"{cells[7][:-2]}_{cells[7][-2:]}"
    (tmp_path / "t.csv").write_text("".join([*lines[:3], ",".join(cells), *lines[4:]]))
    outcome = call("compare", samples / "models/irb4600_60_205.toml", tmp_path / "t.csv")
    assert "DAT003" in outcome.err and cells[7] in outcome.err
