"""Corrected programs do in every world what the originals do there, to within their corrections."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.worlds.checking import check, seed_of, tasks
from tests.worlds.interpreter import Interpreter, load
from tests.worlds.syntax import annotations
from tests.worlds.world import five

TASKS = tasks()


@pytest.mark.parametrize("paths", TASKS, ids=[t[0].stem for t in TASKS])
def test_a_corrected_program_does_the_same_in_every_world(paths: list[Path]) -> None:
    """Same motions in the same order, goals and added targets within their corrections, all other effects the same."""
    found = check(paths)
    assert found.faults == []


def test_the_programs_are_many_and_move_in_every_world() -> None:
    """A program that stops early or moves little would judge nothing."""
    assert len(TASKS) >= 60
    for paths in TASKS:
        texts = [p.read_text("latin-1") for p in paths]
        says = {k: v for t in texts for k, v in annotations(t).items()}
        moved = []
        for world in five(seed_of(paths[0].stem), says):
            task = Interpreter(load(texts), world)
            moved.append(sum(e.motion for e in task.run()))
            assert task.stopped in ("", "EXIT"), (paths[0].stem, world.name, task.stopped)
        assert min(moved) >= 2, paths[0].stem
