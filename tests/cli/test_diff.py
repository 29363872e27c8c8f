"""``diff``: by meaning, with a tolerance."""

from __future__ import annotations

import json
from pathlib import Path

from .conftest import Call


def test_a_program_is_equal_to_itself_however_it_is_written(call: Call, samples: Path, tmp_path: Path) -> None:
    program = samples / "hull_seam.mod"
    respelled = tmp_path / "other.mod"
    text = (
        program.read_text("utf-8")
        .replace("MoveL ", "movel   ")
        .replace("9E+09", "9e9")
        .replace("[698.15,", "[698.150,")
    )
    respelled.write_text(text, "utf-8", newline="\n")
    outcome = call("diff", program, respelled)
    assert outcome.code == 0, outcome.out
    assert "0 differences" in outcome.out


def test_moved_targets_are_found_and_measured(call: Call, samples: Path, tmp_path: Path) -> None:
    program = samples / "hull_seam.mod"
    moved = tmp_path / "moved.mod"
    moved.write_bytes(program.read_bytes().replace(b"[698.15,5.53,0.48]", b"[698.15,5.53,0.88]"))
    outcome = call("diff", program, moved, "--json")
    assert outcome.code == 1
    document = json.loads(outcome.out)
    assert document["schema"] == "postproc/diff/1"
    assert len(document["differences"]) == 1
    difference = document["differences"][0]
    assert (difference["name"], difference["line_a"]) == ("ArcL", 50)
    assert abs(difference["distance_mm"] - 0.4) < 1e-9
    assert call("diff", program, moved, "--tolerance", "0.5").code == 0


def test_orientations_have_a_tolerance_of_their_own(call: Call, samples: Path, tmp_path: Path) -> None:
    program = samples / "hull_seam.mod"
    turned = tmp_path / "turned.mod"
    # A quaternion that moves by 2e-4 turns by twice as much: 0.023 deg.
    turned.write_bytes(program.read_bytes().replace(b"[0.048649,-0.707207,", b"[0.048849,-0.707207,"))
    outcome = call("diff", program, turned, "--tolerance", "10")
    assert (outcome.code, "beyond 10 mm and 0.01 deg" in outcome.out) == (1, True)
    assert call("diff", program, turned, "--angle-tolerance", "0.03").code == 0


def test_what_cannot_be_compared(call: Call, samples: Path, tmp_path: Path) -> None:
    empty = tmp_path / "empty.mod"
    empty.write_bytes(b"")
    outcome = call("diff", samples / "hull_seam.mod", empty)
    assert (outcome.code, outcome.out) == (2, "")
    assert "error[CLI005]" in outcome.err
    for wrong in ("-1", "nan", "much"):
        outcome = call("diff", samples / "hull_seam.mod", samples / "hull_seam.mod", "--tolerance", wrong)
        assert outcome.code == 2
        assert "error[CLI001]" in outcome.err
