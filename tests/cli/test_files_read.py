"""Files that are too large, of another kind, or hold values that nothing can be: a finding each, and nothing is written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.batch.folders import program, write
from tests.cli.conftest import ARM, Call

TABLE = "simulated_backlash.csv"


@pytest.mark.parametrize("option", ["--with", "--cell", "-m", "--template"])
@pytest.mark.parametrize("kind", ["pipe", "device", "link to a pipe"])
def test_what_is_no_file_is_not_waited_for(call_as_written: Call, tmp_path: Path, option: str, kind: str) -> None:
    write(tmp_path, {"a.mod": program("A")})
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    given = {"pipe": tmp_path / "pipe", "device": Path("/dev/zero"), "link to a pipe": tmp_path / "link"}[kind]
    arm = () if option == "-m" else ARM
    found = call_as_written("compensate", tmp_path / "a.mod", *arm, option, given, "-o", tmp_path / "b.mod")
    assert found.code == 2 and str(given) in found.err


def test_a_table_of_a_million_rows_is_refused_before_it_is_held(call: Call, samples: Path, tmp_path: Path) -> None:
    lines = (samples / "measurements" / TABLE).read_bytes().splitlines(keepends=True)
    table = tmp_path / "t.csv"
    table.write_bytes(lines[0] + lines[1] * 400_000)
    found = call("predict", samples / "models" / "irb4600_60_205.toml", table, "-o", tmp_path / "out.csv")
    assert found.code == 2 and "DAT001" in found.err and not (tmp_path / "out.csv").exists()
