"""Targets that the arm cannot reach: taught so, the program cannot run; displaced so, that run alone is not possible."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.compensation.correction.inverse import command
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.file import default_model
from postproc.robot.kinematics import forward
from postproc.runtime.passes import correct_program
from tests.build import AXES, target

A, B, C = target(1350, -500), target(1330, -470), target(1350, -420)


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
    found = correct_program(Source("far.mod", text.encode()), default_model("irb2600id_8_200"), Options(inertia=False))
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
