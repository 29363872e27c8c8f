"""Confdata of corrected and added targets on a few of the programs that ``python -m tests.bench.confdata`` draws."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from postproc.compensation.text import added_targets
from postproc.robot.arm import Robot
from postproc.robot.configuration import confdata
from tests.bench import confdata as C

DRAWS = [
    ("axis 4", "operator's names", 23), ("axis 6", "names", 156), ("arc", "numbers", 3),
    ("track", "names", 92), ("gantry", "operator's names", 5), ("positioner", "names", 72),
    ("near a straight wrist", "operator's names", 29), ("through a straight wrist", "names", 74),
    ("joint moves to a straight wrist", "numbers", 9),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "form", "seed"), DRAWS, ids=[kind for kind, *_ in DRAWS])
def test_confdata_is_that_of_the_posture_and_stays_where_it_selects_it(kind: str, form: str, seed: int) -> None:
    case = C.draw(kind, form, seed)
    output = C.convert(case)
    assert output is not None
    targets = C.judge(case, output)
    assert not [t for t in targets if t.changed or not t.valid or (t.added and not t.exact)]


def test_the_judge_sees_another_confdata() -> None:
    case = C.draw("axis 6", "names", 156)
    output = C.convert(case)
    assert output is not None
    worse = re.sub(r"(\\turns:=)\[[^\]]*\]", r"\1[0,0,0,1]", output)
    assert worse != output
    assert [t for t in C.judge(case, worse) if t.added and not t.exact]


def test_targets_taught_anew_with_the_other_wrist_keep_the_added_ones_on_their_line() -> None:
    """The quarter turns that an added target is from its end are the same for both wrists."""
    case = C.draw("axis 1", "names", 22)
    output = C.convert(case)
    assert output is not None and "\\turns:=[" in output

    def flipped(found: re.Match[str]) -> str:
        cf1, cf4, cf6, cfx = (int(n) for n in found[2].split(","))
        return f"{found[1]}[{cf1},{cf4 - 2},{cf6 + 2},{cfx ^ 1}]{found[3]}"

    target = r"(robtarget p\d+:=\[\[[^\]]*\],\[[^\]]*\],)\[([^\]]*)\](,)"
    anew, written = re.sub(target, flipped, case.text), re.sub(target, flipped, output)
    assert anew != case.text
    targets = C.judge(replace(case, text=anew), written)
    assert [t for t in targets if t.added] and all(t.exact for t in targets if t.added)


def test_the_proof_refuses_an_added_target_in_another_posture(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers whose confdata means the other wrist, and a function that gives the confdata of an end in another one."""
    other = np.array([0, 2, -2, 1])

    def of_the_other_wrist(robot: Robot, q: np.ndarray) -> np.ndarray:
        conf = confdata(robot, q)
        return conf + other * np.where(conf[:, 3:] % 2, -1, 1)

    monkeypatch.setattr(added_targets, "confdata", of_the_other_wrist)
    numbers = C.draw("axis 1", "numbers", 11)
    assert [code for code, _ in C.converted(numbers)[1]][-2:] == ["CMP022", "CMP004"]
    monkeypatch.undo()

    monkeypatch.setattr(added_targets, "quarter_turns", lambda *_: (0, 2, -2, 1))
    named = C.draw("axis 1", "names", 0)
    assert [code for code, _ in C.converted(named)[1]][-2:] == ["CMP022", "CMP004"]


def test_lines_whose_tool_the_wrist_axes_turn_unevenly_get_no_targets() -> None:
    case = C.draw("reorientation", "names", 87)
    aside = case.text.replace("  PROC main()\n", "  PROC main()\n    SingArea\\Wrist;\n")
    output = C.convert(replace(case, text=aside))
    plain = C.convert(case)
    assert output is not None and plain is not None
    assert "ppLine" in plain and "ppLine" not in output
