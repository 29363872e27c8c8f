"""Targets taught anew with another posture, tilt and external axis: the corrected program goes along, and nearer."""

from __future__ import annotations

import re

import pytest

from tests.worlds.interpreter import load
from tests.worlds.product import convert
from tests.worlds.taught.anew import world
from tests.worlds.taught.checking import check
from tests.worlds.taught.follow import judge
from tests.worlds.taught.programs import CELLS, FAMILIES, one

SOME = [(name, CELLS[k % len(CELLS)]) for k, name in enumerate(FAMILIES)]
FLIPS = re.compile(r"(?<=LOCAL FUNC robtarget )(ppArc\w+)(.*?)k:=g\.robconf;", re.S)
STANDS = re.compile(r"s\.extax\.eax_a\+share\*\(g\.extax\.eax_a-s\.extax\.eax_a\)")
TURNED = re.compile(r"(?<=\],)o\*q,|(?<=p:=\[b,)o\*q,")


@pytest.mark.parametrize(("name", "cell"), SOME, ids=[f"{name}-{cell.name}" for name, cell in SOME])
def test_a_corrected_program_follows_what_is_taught_anew(name: str, cell: object) -> None:
    """Same posture, external axes and orientation along every way, and nowhere farther off than without correction."""
    task, _ = one(name, next(c for c in CELLS if c is cell), 1000 * list(FAMILIES).index(name))
    found = check(task)
    assert found.faults == []
    assert found.corrected >= 2
    judged = found.judged.values()
    assert len(judged) >= 4 and sum(j.motions for j in judged) >= 12
    assert max(j.before_mm for j in judged) > 3 * max(j.after_mm for j in judged)


@pytest.mark.parametrize(
    ("change", "wrong", "by", "fault"),
    [
        ("posture", FLIPS, r"\1\2k:=[0,0,0,0];", "posture"),
        ("axes", STANDS, "600", "axes"),
        ("tilt", TURNED, "g.rot,", "turned"),
    ],
)
def test_numbers_in_place_of_what_is_taught_do_not_pass(
    change: str, wrong: re.Pattern[str], by: str, fault: str
) -> None:
    """Confdata, external axes and orientation of the parts of an arc as they were when the program was corrected."""
    task, _ = one("welded_arcs", CELLS[1], 0)
    text = convert({"t.mod": task.text}, axes=task.cell.axes).texts["t.mod"]
    spoiled = wrong.sub(by, text)
    assert spoiled != text
    taught = world(task, change, 7)
    assert taught is not None
    original = load([task.text])
    assert judge(task.cell, original, load([text]), taught).faults == []
    assert any(found.startswith(fault) for found in judge(task.cell, original, load([spoiled]), taught).faults)
