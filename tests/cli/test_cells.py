"""``--cell``: what carries the arm and its work, for one program."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cells.test_paths import axis, track
from tests.cli.conftest import ARM, Call


@pytest.fixture
def program(tmp_path: Path) -> Path:
    (tmp_path / "cell.toml").write_text(axis("a", "linear", "robot", unit='"TRACK_1"', limits=[0, 3900]))
    path = tmp_path / "rail.mod"
    path.write_text(track(1500.0, 2700.0, 2300.0).text)
    return path


def test_a_cell_is_described_by_a_file(call_as_written: Call, program: Path) -> None:
    bare = call_as_written("compensate", program, *ARM, "--json")
    assert bare.code == 1 and "MOT008" in bare.err and "describe them with `--cell FILE`" in bare.err
    near = ("--tolerance", "0.01")
    given = call_as_written("compensate", program, *ARM, *near, "--cell", program.parent / "cell.toml", "--json")
    assert given.code == 0 and json.loads(given.out)["max_error_after_mm"] < 0.01
    seen = call_as_written("inspect", program, *ARM, "--cell", program.parent / "cell.toml", "--json")
    place = json.loads(seen.out)["statements"][0]["position_mm"]
    assert seen.code == 0 and place == pytest.approx([1100, -400, 700], abs=0.01)  # in the base, not in the world


def test_settings_keep_the_cell(call_as_written: Call, program: Path) -> None:
    (program.parent / "postproc.toml").write_text('robot = "irb4600_60_205"\ncell = "cell.toml"\n')
    assert call_as_written("compensate", program, "--json").code == 0
    short = (program.parent / "cell.toml").read_text().replace("3900", "2000")
    (program.parent / "cell.toml").write_text(short)
    found = call_as_written("compensate", program, "--json")
    assert "KIN003" in found.err and "eax_a at 2700.0 mm, allowed are 0.0 to 2000.0 mm" in found.err


def test_a_cell_that_cannot_be_read_is_told(call_as_written: Call, program: Path) -> None:
    lost = call_as_written("compensate", program, *ARM, "--cell", program.parent / "none.toml")
    assert lost.code == 2 and "KIN016" in lost.err
    folder = program.parent / "backup" / "SYSPAR"
    folder.mkdir(parents=True)
    two = "".join(f'      -name "ROB_{k}" -use_robot_type "ROB{k}_4600_2.05_60"\n\n' for k in (1, 2))
    (folder / "MOC.cfg").write_text(f"ROBOT:\n\n{two}#\n")
    several = call_as_written("compensate", program, *ARM, "--cell", program.parent / "backup")
    assert several.code == 2 and "`ROB_1` and `ROB_2`" in several.err
