"""Approved outputs kept in version control, as docs/batch.md shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.diagnostics import PostprocError
from postproc.testing import assert_same_program, programs

from .folders import program, write


def test_what_moved_is_named_and_measured(tmp_path: Path) -> None:
    text = program("Seam")
    folder = write(
        tmp_path, {"approved/a.mod": text, "out/a.mod": text.replace("1210,180,", "1210,180.25,"), "x": "text"}
    )
    assert text != (folder / "out/a.mod").read_text()
    assert programs(folder) == ["approved/a.mod", "out/a.mod"]
    assert_same_program(folder / "approved/a.mod", folder / "out/a.mod", tolerance_mm=0.3)
    with pytest.raises(AssertionError) as caught:
        assert_same_program(folder / "approved/a.mod", folder / "out/a.mod", tolerance_mm=0.2)
    assert re.search(r"(?i)seam\.rseam:7/7 MoveL +0\.250 mm", str(caught.value))


def test_what_is_no_program_or_not_there(tmp_path: Path) -> None:
    write(tmp_path, {"a.mod": program("Seam"), "b.mod": "text"})
    with pytest.raises(PostprocError):
        assert_same_program(tmp_path / "a.mod", tmp_path / "b.mod")
    with pytest.raises(AssertionError, match="is not there"):
        assert_same_program(tmp_path / "a.mod", tmp_path / "c.mod")
