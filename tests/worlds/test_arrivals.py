"""Added targets lie on the programmed lines by whichever way the arm comes: programs in which it may come by several."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.worlds.checking import PROGRAMS, check, tasks

TASKS = tasks(PROGRAMS / "arrivals")


@pytest.mark.parametrize("paths", TASKS, ids=[t[0].stem for t in TASKS])
def test_added_targets_lie_on_the_line_by_every_way(paths: list[Path]) -> None:
    """With other data of operators, code elsewhere that moves the arm and calls procedures, and entered anywhere."""
    found = check(paths, every_way=True)
    assert found.faults == []
    assert found.refused == ""


def test_the_programs_are_many() -> None:
    assert len(TASKS) >= 60
