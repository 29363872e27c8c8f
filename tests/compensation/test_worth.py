"""A correction that takes away hardly anything is not written."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.correction import curve
from postproc.compensation.correction.curve import Exact, fruitless_moves
from postproc.compensation.options import Options
from postproc.convert import compensate_program
from postproc.diagnostics import Source
from postproc.model.file import default_model
from tests.compensation.build import convert, module, target

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


@pytest.mark.parametrize(
    ("goals", "way", "vain"),
    [
        ([(3.0, 3.0)], (3.5, 3.5), [True]),
        ([(3.0, 2.8)], (3.5, 3.3), [True]),
        ([(3.0, 0.0)], (3.5, 3.5), [False]),
        ([(3.0, 3.0)], (3.5, 2.0), [False]),
        ([(3.0, 3.2)], (3.5, 3.5), [False]),
        ([(0.0, 0.0)], (3.5, 3.5), [False]),
        ([(3.0, 3.0), (3.0, 3.0)], (3.5, 1.0), [False, False]),
        ([(3.0, 3.0), (3.0, 0.1)], (3.5, 3.5), [True, False]),
    ],
)
def test_goal_way_there_and_way_on_decide(
    goals: list[tuple[float, float]], way: tuple[float, float], vain: list[bool]
) -> None:
    """Errors before and after [mm]: of goals, and in the middle of the last line."""
    lines = "".join(f"MoveL {target(1300, -500 + 60 * k)},v50,fine,tT;\n" for k in range(1, len(goals) + 1))
    plan = convert(module("", f"MoveJ {target(1300, -500)},v200,fine,tT;\n{lines}")).plan
    assert plan is not None
    samples = plan.motion.samples
    before, after = (np.zeros(len(samples.u)) for _ in range(2))
    before[samples.goal[1:]], after[samples.goal[1:]] = np.array(goals).T
    before[-2], after[-2] = way
    shifted = [samples.T_work_tcp.copy() for _ in range(2)]
    shifted[0][:, 0, 3] += 1e-3 * before
    shifted[1][:, 0, 3] += 1e-3 * (before - after)
    flange = samples.curves.mounts.flange(shifted[1][samples.goal])
    written = Exact(shifted[0], samples.q, flange, samples.q[samples.goal])
    assert fruitless_moves(samples, written, shifted[1]).tolist()[1:] == vain


def test_a_program_of_which_nothing_is_worth_it_comes_out_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    model, options = default_model("irb4600_60_205"), Options(force=(0.0, 300.0, 0.0), inertia=False)
    source = Source("pick.mod", PROGRAM.encode())
    assert compensate_program(source, model, options).output != source.data
    monkeypatch.setattr(curve, "WORTH", 0.0)
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
