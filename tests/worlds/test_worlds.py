"""Corrected programs do in every world what the originals do there, to within their corrections."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.worlds.checking import check, tasks
from tests.worlds.product import RunTime, convert

TASKS = tasks()


@pytest.mark.parametrize("paths", TASKS, ids=[t[0].stem for t in TASKS])
def test_a_corrected_program_does_the_same_in_every_world(paths: list[Path]) -> None:
    """Same motions in the same order, goals and added targets within their corrections, all other effects the same."""
    found = check(paths)
    assert found.faults == []
    # A program that stops early or moves little would judge nothing.
    assert [o.stopped for o in found.outcomes if o.stopped not in ("", "EXIT") or o.motions < 2] == []
    assert not any(code in found.refused for code in ("CMP004", "CMP013")), found.refused


RUN_TIME = [("where-needed", name) for name in ("data_by_name", "socket_fed", "displacement_here")]
RUN_TIME += [("where-needed", "function_with_effects"), ("all", "branch_between_seams")]


@pytest.mark.parametrize(("mode", "name"), RUN_TIME)
def test_a_program_corrected_on_the_controller_comes_to_its_goals(mode: RunTime, name: str) -> None:
    """With the function in the program the interpreter runs the module, and the real arm comes to the original's goals."""
    paths = next(paths for paths in TASKS if paths[0].stem == name)
    found = check(paths, run_time=mode)
    assert found.refused == ""
    assert found.faults == []
    assert found.came_back == 0
    if name == "displacement_here":  # what follows where the arm stands stays as it is
        assert found.reached_mm == []
    else:
        assert len(found.reached_mm) >= 10
        assert max(found.reached_mm) < 0.001


def test_what_is_refused_without_the_function_is_refused_still() -> None:
    """Each of them says how many statements the function would reach."""
    names = {"data_by_name": 4, "written_by_name": 5}
    for paths in TASKS:
        if (count := names.get(paths[0].stem)) is not None:
            said = convert({p.name: p.read_text("latin-1") for p in paths})
            assert said.texts == {}
            assert f"RUN007 {count} motion statements could be corrected on the controller" in said.told


def test_the_programs_are_many() -> None:
    assert len(TASKS) >= 60
