"""``diff``: by meaning, with a tolerance."""

from __future__ import annotations

import json
from pathlib import Path

from .conftest import Call


def folders(samples: Path, tmp_path: Path) -> tuple[Path, Path]:
    """Two folders: one file of each kind of difference, two that mean the same."""
    a, b = tmp_path / "a", tmp_path / "b"
    text = (samples / "hull_seam.mod").read_bytes()
    for folder in (a, b):
        (folder / "RAPID" / "TASK1").mkdir(parents=True)
        (folder / "RAPID" / "TASK1" / "same.mod").write_bytes(text)
        (folder / ".postproc").mkdir()
        (folder / ".postproc" / "1.jsonl").write_text(folder.name)
    moved = text.replace(b"[698.15,5.53,0.48]", b"[698.15,5.53,0.88]")
    for name, one, two in (
        ("RAPID/TASK1/moved.mod", text, moved),
        ("respelled.mod", text, text.replace(b"MoveL ", b"movel   ")),
        ("MOC.cfg", b"MOC:CFG_1.0", b"MOC:CFG_1.1"),
        ("gone.mod", text, None),
        ("new.mod", None, text),
        ("broken.mod", text, b"MODULE broken\nPROC main(\n"),
    ):
        for folder, data in ((a, one), (b, two)):
            if data is not None:
                (folder / name).write_bytes(data)
    return a, b


def test_folders_are_compared_file_by_file(call: Call, samples: Path, tmp_path: Path) -> None:
    a, b = folders(samples, tmp_path)
    outcome = call("diff", a, b, "--json", "--report", tmp_path / "page.html")
    assert outcome.code == 1
    document = json.loads(outcome.out)
    assert document["counts"] == {"equal": 2, "changed": 2, "added": 1, "removed": 1, "unreadable": 1}
    assert {f["path"]: f["status"] for f in document["files"]} == {
        "MOC.cfg": "changed",
        "RAPID/TASK1/moved.mod": "changed",
        "RAPID/TASK1/same.mod": "equal",
        "broken.mod": "unreadable",
        "gone.mod": "removed",
        "new.mod": "added",
        "respelled.mod": "equal",
    }
    moved = document["files"][1]
    assert (moved["changed"], len(moved["differences"])) == (1, 1)
    assert abs(moved["differences"][0]["shift_mm"][2] - 0.4) < 1e-9
    page = (tmp_path / "page.html").read_text("utf-8")
    assert "Of 7 files: 2 changed, 1 added, 1 removed, 1 unreadable." in page and "RAPID/TASK1/moved.mod" in page
    text = call("diff", a, b).out.splitlines()
    assert text[0] == "Of 7 files: 2 changed, 1 added, 1 removed, 1 unreadable."
    assert text[1:3] == [
        "largest distance 0.400 mm, files that differ 5, statements that differ 1",
        "Tolerance 0.001 mm and 0.01 deg.",
    ]
    of_files, what = text[4:].index("What differs:") + 4, text.index("Every file:")
    rows = [line.split() for line in text[what + 2 : of_files - 1]]
    assert rows[0] == ["MOC.cfg", "changed", "0", "0", "0", "0", "other", "bytes"]
    assert rows[1][:2] == ["RAPID/TASK1/moved.mod", "changed"] and "0.4000" in rows[1]
    assert "RAPID/TASK1/moved.mod" in text[-1] and "0.4000" in text[-1]
    assert not any("respelled" in line for line in text)
    assert any("respelled" in line for line in call("diff", a, b, "--verbose").out.splitlines())


def test_folders_that_mean_the_same_are_equal(call: Call, samples: Path, tmp_path: Path) -> None:
    a, b = folders(samples, tmp_path)
    for name in ("MOC.cfg", "gone.mod", "new.mod", "broken.mod", "RAPID/TASK1/moved.mod"):
        (a / name).unlink(missing_ok=True)
        (b / name).unlink(missing_ok=True)
    assert call("diff", a, b).code == 0


def test_folders_that_cannot_be_compared(call: Call, samples: Path, tmp_path: Path) -> None:
    a, b = folders(samples, tmp_path)
    outcome = call("diff", a, samples / "hull_seam.mod")
    assert (outcome.code, "error[CLI003]" in outcome.err) == (2, True)
    for name in ("x", "y"):
        (tmp_path / name).mkdir()
    outcome = call("diff", tmp_path / "x", tmp_path / "y")
    assert (outcome.code, "error[BAT001]" in outcome.err) == (2, True)
    outcome = call("diff", a, b, "--report", a / "page.html")
    assert (outcome.code, "error[CLI007]" in outcome.err) == (2, True)


def test_what_compensate_adds_is_told_as_added(call: Call, samples: Path, tmp_path: Path) -> None:
    """A close tolerance needs more targets: as many statements are added as the conversion says, all others changed."""
    out = tmp_path / "out.mod"
    done = call(
        "compensate", samples / "hull_seam.mod", "--force", "200,-200,-200", "--tolerance", "0.002", "-o", out, "--json"
    )
    document = json.loads(done.out)
    found = json.loads(call("diff", samples / "hull_seam.mod", out, "--json").out)
    motions = [d["kind"] for d in found["differences"] if d["what"] == "motion"]
    assert motions.count("added") == document["added_targets"] > 3
    assert "removed" not in motions
    shifts = [row["shift_mm"] for row in document["statements"] if row["shift_mm"] is not None]
    assert abs(found["max_distance_mm"] - max(shifts)) < 0.01  # what is written is rounded
