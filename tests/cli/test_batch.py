"""``batch``: documents, exit codes, usage."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .conftest import Call

EMPTY = "MODULE Data\n  PERS num n:=1;\nENDMODULE\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "in").mkdir()
    (tmp_path / "in/data.mod").write_text(EMPTY)
    (tmp_path / "in/bad.mod").write_text("no module")
    return tmp_path / "in"


def test_the_document_and_the_exit_code(call: Call, folder: Path, tmp_path: Path) -> None:
    outcome = call("batch", folder, "-o", tmp_path / "out", "--workers", "1", "--json")
    document = json.loads(outcome.out)
    assert outcome.code == 1
    assert document["schema"] == "postproc/batch/1" and document["shard"] == "1/1"
    assert document["counts"] == {"compensated": 0, "unchanged": 1, "failed": 1, "cached": 0, "copied": 0}
    assert [(t["name"], t["status"], t["cached"]) for t in document["tasks"]] == [
        ("bad.mod", "failed", False),
        ("data.mod", "unchanged", False),
    ]
    assert "bad.mod: error[RAP011]" in outcome.err
    (folder / "bad.mod").unlink()
    assert call("batch", folder, "-o", tmp_path / "out", "--workers", "1").code == 0


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["{in}", "-o", "{out}", "--shard", "3/2"], "BAT014"),
        (["{in}", "-o", "{out}", "--shard", "half"], "BAT014"),
        (["{in}", "-o", "{in}"], "BAT015"),
        (["{in}/sub", "-o", "{in}"], "BAT015"),
        (["{in}/none", "-o", "{out}"], "BAT001"),
        (["{in}/data.mod", "-o", "{out}"], "BAT001"),
        (["{in}", "-o", "{out}", "--template", "{in}/none"], "REN001"),
        (["{in}/sub", "-o", "{out}"], "BAT001"),
        (["{in}", "-o", "{out}", "--workers", "0"], "CLI001"),
        (["{in}"], "CLI001"),
        (["{in}", "-o", "{out}", "-m", "{in}/none.toml"], "MOD001"),
        (["{in}", "-o", "{out}", "--with", "{in}/none.mod"], "BAT002"),
    ],
)
def test_usage(call: Call, folder: Path, tmp_path: Path, arguments: list[str], code: str) -> None:
    (folder / "sub").mkdir()
    filled = [a.replace("{in}", str(folder)).replace("{out}", str(tmp_path / "out")) for a in arguments]
    outcome = call("batch", *filled)
    assert outcome.code == 2 and code in outcome.err, outcome.err
    assert not (tmp_path / "out").exists()
