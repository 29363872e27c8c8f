"""A correction that takes away hardly anything is not written."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from postproc.compensation.options import Options
from postproc.compensation.results import figures
from postproc.convert import compensate_program
from postproc.diagnostics import Source
from postproc.model.file import default_model

PROGRAM = """MODULE Pick
  PERS tooldata tT:=[TRUE,[[0,0,300],[1,0,0,0]],[5,[0,0,150],[1,0,0,0],0,0,0]];
  CONST robtarget pA:=[[1500,100,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jHome:=[[0,10,10,0,60,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ jHome,v1000,fine,tT;
    MoveL pA,v100,fine,tT;
    MoveAbsJ jHome,v1000,fine,tT;
  ENDPROC
ENDMODULE
"""


def told(goals: list[tuple[float, float]], ways: list[tuple[float, float]]) -> set[Any]:
    """Statements 0, 1, .. of one move each that are not worth it, from errors before and after [mm]."""
    moves = [
        SimpleNamespace(event=SimpleNamespace(statement=SimpleNamespace(key=k)), first=False) for k in range(len(goals))
    ]
    plan: Any = SimpleNamespace(
        motion=SimpleNamespace(moves=moves), places=dict.fromkeys(range(len(goals)), "argument")
    )
    before, after = (
        figures.Deviation(
            np.array([[way[k], 0.0, 0.0] for way in ways]), np.arange(len(ways)), np.zeros(len(ways)),
            np.ones(len(ways), dtype=bool), np.ones(len(ways), dtype=bool),
            np.array([goal[k] for goal in goals]), np.ones(len(goals), dtype=bool),
        )
        for k in (0, 1)
    )  # fmt: skip
    return figures.fruitless(plan, before, after)


@pytest.mark.parametrize(
    ("goals", "ways", "vain"),
    [
        ([(3.544, 3.544)], [(3.544, 3.544)], {0}),
        ([(3.0, 2.8)], [(3.5, 3.3)], {0}),
        ([(3.0, 0.0)], [(3.5, 3.5)], set()),
        ([(3.0, 3.0)], [(3.5, 2.0)], set()),
        ([(3.0, 3.0), (3.0, 3.0)], [(3.5, 3.5), (3.5, 1.0)], set()),
        ([(3.0, 3.0), (3.0, 0.1)], [(3.5, 3.5), (3.5, 3.5)], {0}),
    ],
)
def test_goal_way_there_and_way_on_decide(
    goals: list[tuple[float, float]], ways: list[tuple[float, float]], vain: set[int]
) -> None:
    assert told(goals, ways) == vain


def test_a_program_of_which_nothing_is_worth_it_comes_out_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    model, options = default_model("irb4600_60_205"), Options(force=(0.0, 300.0, 0.0), inertia=False)
    source = Source("pick.mod", PROGRAM.encode())
    assert compensate_program(source, model, options).output != source.data
    monkeypatch.setattr(figures, "WORTH", 0.0)
    found = compensate_program(source, model, options)
    assert found.exit_code == 0 and found.output == source.data
    (left,) = [o for o in found.outcomes if o.status == "skipped"]
    assert "less than a tenth" in (left.reason or "")
    assert [o.status for o in found.outcomes if o is not left] == ["unchanged"] * 2


def test_a_joint_target_is_not_among_what_is_left_without_a_finding() -> None:
    found = compensate_program(
        Source("pick.mod", PROGRAM.encode()), default_model("irb4600_60_205"), Options(force=(0.0, 300.0, 0.0))
    )
    skipped = [o for o in found.outcomes if o.status == "skipped"]
    assert len(skipped) == sum(d.code == "CMP005" for d in found.diagnostics) == 0
