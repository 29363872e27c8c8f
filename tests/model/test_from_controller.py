"""The joint compliances of Absolute Accuracy in a controller's configuration, as a model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.cli.app import build
from postproc.cli.run import run
from postproc.model.controller import controller_model
from postproc.robot.catalogue import load_robot
from postproc.robot.controller import Calibration, read_calibration, read_entries
from postproc.settings import Settings, read_arm
from postproc.settings_files import with_choices
from tests.build import refused

MOC = """MOC:CFG_1.0:6:0::
#
ROBOT:

      -name "ROB_1" -use_robot_serial_number "rob_1"\\
      -use_robot_type "ROB1_1200_0.9_5_TypeB" -use_robot_calib "CALIB"\\
      -use_joint_0 "rob1_1" -use_joint_1 "rob1_2" -use_joint_2 "rob1_3"\\
      -use_joint_3 "rob1_4" -use_joint_4 "rob1_5" -use_joint_5 "rob1_6"
#
TOOL_INTERFACE:

      -name "r1_tool" -offset_x -7.4E-06
#
ARM_CALIB:

      -name "rob1_1" -absacc_version 2 -error_roll 0.0002 -arm_compliance_y 3.1E-06

      -name "track" -error_yaw 0.1
#
JOINT_CALIB:

      -name "rob1_1"

      -name "rob1_2" -Compl 1.1E-05

      -name "rob1_3" -Compl 2.6E-005

      -name "rob1_6" -Compl LAST

      -name "other" -Compl 5
"""
SEAM = """MODULE A
  PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PROC main()
    MoveJ [[500,0,500],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;
    MoveL [[500,100,500],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;
  ENDPROC
ENDMODULE
"""


def calibration(last: str = "0.00022") -> Calibration:
    motion = read_entries(MOC.replace("LAST", last))
    result = read_calibration(motion, motion["ROBOT"][0])
    assert result is not None
    return result


def test_numbers_are_read_with_where_they_stand_and_what_is_left_is_named():
    known = calibration()
    assert known.entries == {1: "rob1_2", 2: "rob1_3", 5: "rob1_6"}
    assert known.unread == ("arm_compliance_y", "error_roll", "offset of TOOL_INTERFACE")
    model, expected = controller_model("irb1200_5_09", known), load_robot("irb1200_5_09").joint_compliance.copy()
    expected[[1, 2, 5]] = [1.1e-5, 2.6e-5, 2.2e-4]
    np.testing.assert_allclose(model.robot.joint_compliance, expected)
    assert model.robot.sources["joints.stiffness_Nm_per_rad"] == (
        "JOINT_CALIB in the controller's MOC.cfg: joint 2 (`rob1_2`), joint 3 (`rob1_3`), joint 6 (`rob1_6`); "
        "joint 1 and 4 and 5: as the library has it"
    )
    assert model.stiffness_source == "controller"


@pytest.mark.parametrize("last", ["220", "-0.00022", "2.2e-9", "x"])
def test_a_number_in_another_unit_is_refused_by_name(last):
    """Degrees, milliradians or the motor's side of a gear would be off by 57 to 10,000 times."""
    (finding,) = refused(lambda: controller_model("irb1200_5_09", calibration(last)))
    assert finding.code == "KIN018" and "`rob1_6`" in finding.message


def test_without_such_data_there_is_no_such_model():
    motion = read_entries(MOC.split("JOINT_CALIB")[0])
    assert read_calibration(motion, motion["ROBOT"][0]) is None
    (finding,) = refused(lambda: read_arm(Settings(robot="irb1200_5_09", from_controller=True), "a.mod"))
    assert finding.code == "KIN018"


def test_the_layers_of_settings_name_it_like_a_model():
    outer = with_choices(Settings(), {"robot": "irb1200_5_09"}, Path(), "postproc.toml")
    inner = with_choices(outer, {"model": "controller"}, Path())
    assert (inner.robot, inner.model, inner.from_controller) == ("irb1200_5_09", None, True)
    assert with_choices(inner, {"model": "m.toml"}, Path()).from_controller is False


# The command, whether the controller uses the data itself, its exit code, and what it says.
COMMANDS = [
    ("compensate {} -m controller -o {}", "r1_uncalib", 0, ["the joint compliances of its controller", "`rob1_3`"]),
    ("compensate {} -m controller -o {}", "r1_calib", 1, ["error[KIN017]"]),
    ("compensate {} -m controller -o {} --already geometry,gravity", "r1_calib", 0, []),
    ("inspect {} -m controller", "r1_calib", 0, ["info[KIN017]", "warning[KIN018]"]),
    ("robots show {2}", "r1_calib", 0, ["JOINT_CALIB in the controller's MOC.cfg", "not read", "arm_compliance_y"]),
]


@pytest.mark.parametrize(("command", "calib", "code", "says"), COMMANDS)
def test_a_backup_gives_the_model_where_the_controller_does_not_use_it(command, calib, code, says, tmp_path, capsys):
    moc, seam = tmp_path / "SYSPAR/MOC.cfg", tmp_path / "RAPID/TASK1/PROGMOD/a.mod"
    for path, text in ((moc, MOC.replace("LAST", "0.00022").replace('CALIB"', calib + '"', 1)), (seam, SEAM)):
        path.parent.mkdir(parents=True)
        path.write_text(text)
    assert run(build(), command.format(seam, tmp_path / "out.mod", tmp_path).split()) == code
    shown = "".join(capsys.readouterr())
    assert all(text in shown for text in says)
