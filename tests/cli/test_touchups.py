"""``postproc touchups``: versions of a program as files, folders, backups and revisions, and what may be done with them."""

from __future__ import annotations

import csv
import hashlib
import json
import subprocess
import tomllib
from pathlib import Path

import pytest

from tests.batch.build import backup

from .conftest import ARM, Call

SEAM = "RAPID/TASK1/PROGMOD/Seam.mod"


@pytest.fixture
def pair(samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """The samples, drawn and touched up, in a fresh folder that is the current one."""
    monkeypatch.chdir(tmp_path)
    for name in ("drawn", "touched"):
        Path(f"{name}.mod").write_bytes((samples / "touched_up" / f"{name}.mod").read_bytes())
    return Path("drawn.mod"), Path("touched.mod")


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def test_a_table_is_fitted_as_it_is_and_the_touched_program_is_not_compensated(
    call: Call, pair: tuple[Path, Path]
) -> None:
    drawn, touched = pair
    made = call("touchups", *pair, *ARM, "-o", "t.csv")
    assert made.code == 0 and "`postproc fit t.csv --robot" in made.err
    assert made.err.splitlines()[-1].startswith("compensate the nominal program")
    table = Path("t.csv").read_text("utf-8")
    digest = hashlib.sha256(touched.read_bytes()).hexdigest()
    assert table.startswith(f"# touched-up program: touched.mod sha256 {digest}\n") and len(rows(table)) == 32
    fitted = call("fit", "t.csv", *ARM, "-o", "m.toml")
    assert fitted.code == 0 and "tool_frame" not in tomllib.loads(Path("m.toml").read_text("utf-8"))["effects"]
    assert tomllib.loads(Path("m.toml").read_text("utf-8"))["fit"]["touched_sha256"] == [digest]
    assert call("diagnose", "m.toml", "t.csv").out.startswith("Nothing is missing")
    assert call("compensate", drawn, "-m", "m.toml", "-o", "out.mod").code == 0
    refused = call("compensate", touched, "-m", "m.toml", "-o", "twice.mod")
    assert (refused.code, Path("twice.mod").exists()) == (1, False) and "error[CMP028]" in refused.err


def test_predictions_are_in_the_work_object_of_the_row(call: Call, pair: tuple[Path, Path]) -> None:
    call("touchups", *pair, *ARM, "-o", "t.csv")
    call("fit", "t.csv", *ARM, "-o", "m.toml")
    call("predict", "m.toml", "t.csv", "-o", "p.csv")
    for stated, predicted in zip(rows(Path("t.csv").read_text()), rows(Path("p.csv").read_text()), strict=True):
        assert all(abs(float(stated[k]) - float(predicted[k])) < 1.0 for k in ("x_mm", "y_mm", "z_mm"))


def test_the_document(call: Call, pair: tuple[Path, Path]) -> None:
    made = json.loads(call("touchups", *pair, *ARM, "--json").out)
    assert (made["compared"], made["touched"], made["omitted"]) == (32, 32, [])
    assert 0.2 < made["deflection_known_to"] < 0.5
    fixed = json.loads(call("touchups", *pair, *ARM, "--wobj-fixed", "--json").out)
    assert fixed["deflection_known_to"] < 0.3 * made["deflection_known_to"]


@pytest.mark.parametrize(
    ("words", "code", "finding"),
    [
        (("drawn.mod", "drawn.mod"), 1, "DAT052"),
        (("drawn.mod",), 1, "DAT052"),
        (("drawn.mod", "."), 2, "CLI003"),
        (("drawn.mod", "HEAD:drawn.mod"), 2, "CLI002"),
        (("drawn.mod", "touched.mod", "-o", "touched.mod"), 2, "CLI007"),
        (("drawn.mod", "touched.mod", "--wobj-free", "--wobj-fixed"), 2, "CLI011"),
        (("drawn.mod", "broken.mod"), 2, "RAP"),
    ],
)
def test_what_is_no_pair_of_versions(
    call: Call, pair: tuple[Path, Path], words: tuple[str, ...], code: int, finding: str
) -> None:
    Path("broken.mod").write_text("MODULE Touch\n  PROC main(\nENDMODULE\n")
    output = () if "-o" in words else ("-o", "t.csv")
    made = call("touchups", *words, *ARM, *output)
    assert made.code == code and f"error[{finding}" in made.err and not Path("t.csv").exists()


def test_targets_that_were_moved_together_are_no_table(call: Call, pair: tuple[Path, Path]) -> None:
    text = pair[0].read_text("utf-8")
    moved = [line.replace("robtarget", "robtarget ", 1) for line in text.splitlines(keepends=True)]
    for i, line in enumerate(moved):
        if ":=[[" in line and "robtarget" in line:
            head, _, numbers = line.partition(":=[[")
            x, _, others = numbers.partition(",")
            moved[i] = f"{head}:=[[{float(x) + 1.5:.3f},{others}"
    Path("shifted.mod").write_text("".join(moved))
    made = call("touchups", pair[0], "shifted.mod", *ARM, "-o", "t.csv")
    assert made.code == 1 and "error[DAT050]" in made.err and not Path("t.csv").exists()


def test_two_revisions_of_a_repository(call: Call, pair: tuple[Path, Path]) -> None:
    def git(*words: str) -> None:
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], check=True, capture_output=True)

    drawn, touched = (file.read_bytes() for file in pair)
    for file in pair:
        file.unlink()
    Path("cell").mkdir()
    git("init", "-q")
    for version in (drawn, touched):
        Path("cell/touch.mod").write_bytes(version)
        git("add", "cell")
        git("commit", "-qm", "a version")
    for one, two in (("HEAD~1:cell/touch.mod", "HEAD:cell/touch.mod"), ("HEAD~1:cell", "cell")):
        made = call("touchups", one, two, *ARM, "--json")
        assert made.code == 0 and json.loads(made.out)["touched"] == 32


def test_backups_name_the_arm_and_pair_their_tasks(call_as_written: Call, tmp_path: Path) -> None:
    a, b = backup(tmp_path / "monday"), backup(tmp_path / "friday")
    seam = (b / SEAM).read_text("utf-8")
    (b / SEAM).write_text(seam.replace("[[1200,100.0", "[[1200.7,100.3"), "utf-8")
    assert (b / SEAM).read_text("utf-8") != seam
    made = call_as_written("touchups", a, b, "--json")
    assert made.code == 0 and json.loads(made.out)["touched"] == 1


def test_originals_in_one_module(call: Call, pair: tuple[Path, Path]) -> None:
    kept = [line for line in pair[0].read_text("utf-8").splitlines(keepends=True) if "CONST robtarget" in line]
    kept = [line.replace("robtarget p", "robtarget o_p") for line in kept]
    lines = pair[1].read_text("utf-8").splitlines(keepends=True)
    Path("one.mod").write_text("".join([*lines[:2], *kept, *lines[2:]]))
    made = call("touchups", "one.mod", *ARM, "-o", "t.csv")
    call("touchups", *pair, *ARM, "-o", "two.csv")
    assert made.code == 0 and rows(Path("t.csv").read_text()) == rows(Path("two.csv").read_text())


def test_work_that_was_measured_in_the_base_leaves_no_place_free(call: Call, pair: tuple[Path, Path]) -> None:
    call("touchups", *pair, *ARM, "--wobj-fixed", "-o", "t.csv")
    fitted = call("fit", "t.csv", *ARM, "-o", "m.toml")
    assert "where the work is: fitted are joint_offset, joint_compliance\n" in fitted.err
    assert {*tomllib.loads(Path("m.toml").read_text("utf-8"))["effects"]} == {"joint_offset", "joint_compliance"}
