"""The joint compliances of Absolute Accuracy in a controller's configuration, as a model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.cli.app import build
from postproc.cli.run import run
from postproc.diagnostics import PostprocError
from postproc.model.from_controller import controller_model
from postproc.robot.catalogue import load_robot
from postproc.robot.controller import Calibration, read_calibration, read_entries
from postproc.settings import Settings, read_arm
from postproc.settings_files import with_choices

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
    found = read_calibration(motion, motion["ROBOT"][0])
    assert found is not None
    return found


def test_numbers_are_read_with_where_they_stand_and_what_is_left_is_named() -> None:
    found = calibration()
    assert found.compliance == {1: 1.1e-5, 2: 2.6e-5, 5: 2.2e-4}
    assert found.entries == {1: "rob1_2", 2: "rob1_3", 5: "rob1_6"}
    assert found.unread == ("arm_compliance_y", "error_roll", "offset of TOOL_INTERFACE")
    model = controller_model("irb1200_5_09", found)
    shipped = load_robot("irb1200_5_09").joint_compliance
    assert shipped is not None and model.robot.joint_compliance is not None
    np.testing.assert_allclose(model.robot.joint_compliance[[1, 2, 5]], [1.1e-5, 2.6e-5, 2.2e-4])
    np.testing.assert_allclose(model.robot.joint_compliance[[0, 3, 4]], shipped[[0, 3, 4]])
    source = model.robot.sources["joints.stiffness_Nm_per_rad"]
    assert "joint 3 (`rob1_3`)" in source and source.endswith("joint 1 and 4 and 5: as the library has it")
    assert model.stiffness_source == "controller"


@pytest.mark.parametrize("last", ["220", "-0.00022", "2.2e-9", "x"])
def test_a_number_in_another_unit_is_refused_by_name(last: str) -> None:
    """Degrees, milliradians or the motor's side of a gear would be off by 57 to 10,000 times."""
    with pytest.raises(PostprocError, match="KIN018") as stop:
        controller_model("irb1200_5_09", calibration(last))
    assert "`rob1_6`" in stop.value.diagnostics[0].message


def test_without_such_data_there_is_no_such_model() -> None:
    motion = read_entries(MOC.split("JOINT_CALIB")[0])
    assert read_calibration(motion, motion["ROBOT"][0]) is None
    with pytest.raises(PostprocError, match="KIN018"):
        read_arm(Settings(robot="irb1200_5_09", from_controller=True), "a.mod")


def test_the_layers_of_settings_name_it_like_a_model() -> None:
    outer = with_choices(Settings(), {"robot": "irb1200_5_09"}, Path(), "postproc.toml")
    inner = with_choices(outer, {"model": "controller"}, Path())
    assert (inner.robot, inner.model, inner.from_controller) == ("irb1200_5_09", None, True)
    assert with_choices(inner, {"model": "m.toml"}, Path()).from_controller is False


def test_from_a_backup(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where the controller uses the data itself, `--already` has to say what it corrects with them."""
    for calib in ("r1_uncalib", "r1_calib"):
        files = {
            "SYSPAR/MOC.cfg": MOC.replace("LAST", "0.00022").replace('CALIB"', calib + '"', 1),
            "RAPID/TASK1/PROGMOD/a.mod": SEAM,
        }
        for name, text in files.items():
            (tmp_path / calib / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / calib / name).write_text(text)
    seam = "RAPID/TASK1/PROGMOD/a.mod"
    asked = ["-m", "controller", "-o", str(tmp_path / "out.mod")]
    assert run(build(), ["compensate", str(tmp_path / "r1_uncalib" / seam), *asked]) == 0
    told = capsys.readouterr().err
    assert "with the joint compliances of its controller" in told and "KIN018" in told and "`rob1_3`" in told
    assert run(build(), ["compensate", str(tmp_path / "r1_calib" / seam), *asked]) == 1
    assert "error[KIN017]" in capsys.readouterr().err
    assert run(build(), ["inspect", str(tmp_path / "r1_calib" / seam), "-m", "controller"]) == 0
    told = capsys.readouterr().err
    assert "info[KIN017]" in told and "warning[KIN018]" in told
    assert run(build(), ["compensate", str(tmp_path / "r1_calib" / seam), *asked, "--already", "geometry,gravity"]) == 0
    capsys.readouterr()
    assert run(build(), ["robots", "show", str(tmp_path / "r1_calib")]) == 0
    shown = capsys.readouterr().out
    assert "JOINT_CALIB in the controller's MOC.cfg" in shown and "not read" in shown and "arm_compliance_y" in shown
