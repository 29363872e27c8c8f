"""Targets that the arm cannot reach: taught so, the program cannot run; displaced so, that run alone is not possible."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.compensation.correction.inverse import command
from postproc.compensation.options import Options
from postproc.compensation.reading import OUT_OF_REACH
from postproc.convert import compensate_program
from postproc.diagnostics import Source
from postproc.model.file import default_model
from postproc.rapid.motions.units import matrix_pose
from postproc.robot.configuration import confdata
from postproc.robot.kinematics import forward
from postproc.robot.pose import transform
from tests.compensation.build import AXES, arm, convert, independent, module, outcome, target, written

A, B, C = target(1350, -500), target(1330, -470), target(1350, -420)
ACROSS = target(1350, 100, conf=(2, 0, -1, 0))  # joint 1 stands two quadrants from its confdata


def test_one_displaced_target_out_of_reach_is_left_and_named() -> None:
    steps = [f"MoveJ {A},v200,fine,tT;", f"MoveL {B},v50,fine,tT;", f"MoveL Offs({A},0,9000,0),v50,fine,tT;"]
    steps += [f"MoveL {C},v50,fine,tT;", f"MoveL {B},v50,fine,tT;"]
    text = module("", "\n".join(steps))
    found = convert(text)
    assert found.exit_code == 0
    assert [o.status for o in found.outcomes] == ["compensated"] * 2 + ["skipped"] + ["compensated"] * 2
    assert outcome(found, 2).reason == OUT_OF_REACH
    (named,) = (d for d in found.diagnostics if d.code == "KIN001")
    assert named.severity == "warning" and named.source is not None and named.span is not None
    assert named.source.data[slice(*named.span)].decode() == f"Offs({A},0,9000,0)"
    assert steps[2] in written(found)
    assert found.report["max_error_after_mm"] < 0.01 < found.report["max_error_before_mm"]


@pytest.mark.parametrize(
    "body",
    [
        f"MoveJ {A},v200,fine,tT;\nMoveL {ACROSS},v50,fine,tT;\nMoveL {B},v50,fine,tT;",  # taught so
        f"MoveL Offs({A},0,9000,0),v50,fine,tT;",  # nothing is left
        f"MoveJ {A},v200,fine,tT;\n" + "".join(f"MoveL Offs({A},0,{y},0),v50,fine,tT;\n" for y in (9000, 9020, 9040)),
    ],
)
def test_a_program_that_the_arm_cannot_run_is_refused(body: str) -> None:
    found = convert(module("", body))
    assert (found.exit_code, found.output) == (1, None)
    assert "error" in {d.severity for d in found.diagnostics if d.code in ("KIN001", "KIN002")}


def _taught(*degrees: float) -> str:
    """The target at which the arm stands with these joint angles."""
    q, T_flange_tcp = np.radians([degrees]), transform(np.array([0.0, 0.0, 0.35]))
    pose, conf = matrix_pose(forward(arm().robot, q)[0] @ T_flange_tcp), confdata(arm().robot, q)[0]
    parts = [",".join(f"{v:.7f}" for v in part) for part in (pose.trans, pose.rot)]
    return f"[[{parts[0]}],[{parts[1]}],[{','.join(map(str, conf))}],{AXES}]"


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (f"MoveJ {A},v200,fine,tT;\nMoveC {target(1350, -460)},{C},v50,fine,tT;", "MOT001"),  # on one line
        (f"MoveJ {_taught(-85, -20, 60, 0, 50, 0)},v200,fine,tT;\n"
         f"MoveL {_taught(85, -20, 60, 0, 50, 0)},v50,fine,tT;", "MOT002"),  # joint 3 bends too far in between
    ],
)  # fmt: skip
def test_a_way_that_the_arm_cannot_go_is_refused(body: str, code: str) -> None:
    found = convert(module("", body))
    assert (found.exit_code, found.output) == (1, None)
    assert [d.code for d in found.diagnostics if d.severity == "error"] == [code]


def test_one_of_many_ways_that_the_arm_cannot_go_is_left() -> None:
    """A line through a singularity, in a program of a hundred that runs every day: the others are corrected."""
    ways = f"MoveL {_taught(85, -20, 60, 0, 50, 0)},v50,fine,tT;"
    body = f"MoveJ {A},v200,fine,tT;\n" + f"MoveL {B},v50,fine,tT;\nMoveL {C},v50,fine,tT;\n" * 12
    found = convert(
        module("", f"{body}MoveJ {_taught(-85, -20, 60, 0, 50, 0)},v200,fine,tT;\n{ways}\nMoveJ {A},v200,fine,tT;")
    )
    assert found.exit_code == 0 and ways in written(found)
    assert [o.status for o in found.outcomes] == ["compensated"] * 26 + ["skipped", "compensated"]
    assert outcome(found, 26).reason == OUT_OF_REACH
    assert [d.severity for d in found.diagnostics if d.code == "MOT002"] == ["warning"]
    assert found.report["max_error_after_mm"] < 0.01 < found.report["max_error_before_mm"]


def test_runs_that_the_arm_cannot_make_do_not_keep_the_others_from_their_correction() -> None:
    """The fourth turn of the loop is out of reach: what is written is what three turns ask for."""
    body = "MoveJ a,v200,fine,tT;\nFOR i FROM 0 TO {last} DO\nMoveL Offs(a,40*i,0,0),v50,fine,tT;\nENDFOR"
    text, possible = (module(f"CONST robtarget a:={target(2050, -500)};", body.format(last=last)) for last in (3, 2))
    found, without = convert(text), convert(possible)
    assert [o.status for o in found.outcomes] == ["compensated"] * 2
    assert [f.report["unproved_statements"] for f in (found, without)] == [1, 0]
    assert written(found).replace("0 TO 3", "0 TO 2").splitlines()[-9:] == written(without).splitlines()[-9:]
    again = independent(possible, without)
    assert again.violations == []
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)
    assert again.after < again.before / 4


def test_part_of_a_program_is_corrected_where_that_is_allowed() -> None:
    """One taught target stands two quadrants from its confdata; the ways to and from it stay as they are."""
    text = module(
        "", f"MoveJ {A},v200,fine,tT;\nMoveL {ACROSS},v50,fine,tT;\nMoveJ {B},v50,fine,tT;\nMoveL {C},v50,fine,tT;"
    )
    found = convert(text, allow_partial=True)
    assert found.exit_code == 0
    assert [o.status for o in found.outcomes] == ["compensated", "skipped", "compensated", "compensated"]
    assert outcome(found, 1).reason == OUT_OF_REACH
    assert [(d.severity, d.code) for d in found.diagnostics if d.code == "KIN002"] == [("warning", "KIN002")]
    assert f"MoveL {ACROSS}," in written(found)
    assert found.report["max_error_after_mm"] < 0.01 < found.report["max_error_before_mm"]


def test_a_joint_that_turns_back_on_the_way_does_not_end_the_timing() -> None:
    """Where joint 3 turns back toppra's linear program ended in NaN, after what it remembered of the points behind."""
    text = f"""MODULE Far
  PERS tooldata tG:=[TRUE,[[91.6931,0.827393,389.803],[0.922078,-0.000834299,0.387004,-0.000212223]],[5.3,[31.7,-4.1,38.8],[1,0,0,0],0,0,0]];
  PROC main()
    MoveJ [[55,945,1176],[0.3266,0.6355,-0.6374,0.2885],[0,0,-1,0],{AXES}],vmax,fine,tG;
    MoveL [[-220,1645,-8],[0.1943,-0.2762,-0.9101,-0.2401],[1,-1,1,0],{AXES}],vmax,z50,tG;
    MoveL [[-290,1653,-39],[0.2434,-0.6704,-0.655,-0.2496],[1,0,2,0],{AXES}],v40,fine,tG;
  ENDPROC
ENDMODULE
"""
    found = compensate_program(
        Source("far.mod", text.encode()), default_model("irb2600id_8_200"), Options(inertia=False)
    )
    assert found.exit_code == 0
    assert [o.status for o in found.outcomes] == ["compensated"] * 3


def test_near_a_straight_wrist_the_arm_keeps_its_elbow() -> None:
    """Axes 4 and 6 turn far for a millimetre there: another elbow may then be nearer by the largest joint change."""
    model = default_model("irb4600_60_205")
    g = np.random.default_rng(0)
    q = np.radians(g.uniform([-120, -20, -40, -150, -0.01, -170], [120, 50, 30, 150, 0.01, 170], (4000, 6)))
    desired = forward(model.robot, q)
    desired[:, :3, :3] = Rotation.from_rotvec(1e-3 * g.normal(size=(4000, 3))).as_matrix() @ desired[:, :3, :3]
    found = command(model.with_effects(), model.state(q, T_flange_tcp=np.eye(4)), desired).q
    assert np.abs(forward(model.robot, found) - desired).max() < 1e-6
    assert np.abs(found - q)[:, :3].max() < 0.05
