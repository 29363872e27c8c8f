"""``robots list`` and ``robots show``."""

from __future__ import annotations

import json
from pathlib import Path

from postproc.robot.type_names import ARMS

from .conftest import Call


def test_list_says_what_each_arm_can_do(call: Call) -> None:
    outcome = call("robots", "list")
    assert (outcome.code, outcome.err) == (0, "")
    lines = {line.split()[0]: line for line in outcome.out.splitlines()}
    assert "stiffness measured" in lines["irb4600_60_205"] and "spherical wrist" in lines["irb4600_60_205"]
    assert "stiffness estimated" in lines["irb4600_40_255"]
    assert "stiffness unknown" in lines["ur10"] and "forward models and fitting only" in lines["ur10"]
    assert "described, not computed" in lines["irb6660_205_19"]


def test_show_gives_every_number_with_its_source(call: Call) -> None:
    outcome = call("robots", "show", "irb4600_60_205")
    assert outcome.code == 0
    rows = json.loads(call("robots", "show", "irb6700_245_300", "--json").out)["known"]
    assert {row["quantity"]: row["status"] for row in rows} == {
        "payload [kg]": "known", "reach to the wrist [mm]": "known", "offsets of the axes [mm]": "estimated",
        "lower limit [deg]": "known", "upper limit [deg]": "known", "speed [deg/s]": "estimated",
        "acceleration [rad/s^2]": "estimated", "jerk [rad/s^3]": "estimated", "torque [N m]": "unknown",
        "stiffness [N m/rad]": "estimated", "within a factor of (95 %)": "known",
        "mass of bodies [kg]": "estimated", "within a factor of (68 %)": "known",
    }  # fmt: skip
    assert "torque [N m]               unknown" in outcome.out
    assert "stiffness [N m/rad]        known" in outcome.out and "seed paper, Table 2" in outcome.out
    assert all(row["source"] for row in rows if row["status"] != "unknown")
    document = json.loads(call("robots", "show", "irb4600_60_205", "--json").out)
    assert document["schema"] == "postproc/robot/1"
    assert document["limits_deg"][1] == [-90.0, 150.0]
    assert document["closed_form_inverse"] is True
    assert json.loads(call("robots", "show", "ur10", "--json").out)["closed_form_inverse"] is False
    assert "Table 2" in document["sources"]["joints.stiffness_Nm_per_rad"]


def test_what_a_file_does_not_state_is_no_knowledge(call: Call, tmp_path: Path) -> None:
    text = (ARMS / "irb4600_20_250.toml").read_text(encoding="utf-8")
    mine = tmp_path / "mine.toml"
    mine.write_text("\n".join(x for x in text.splitlines() if not x.startswith(("acceleration", "jerk"))), "utf-8")
    rows = {row["quantity"]: row["status"] for row in json.loads(call("robots", "show", mine, "--json").out)["known"]}
    stated = [rows[key] for key in ("acceleration [rad/s^2]", "jerk [rad/s^3]", "stiffness [N m/rad]")]
    assert stated == ["estimated"] * 3 and rows["speed [deg/s]"] == "known"


def test_a_flange_that_is_turned_is_named(call: Call, samples: Path, tmp_path: Path) -> None:
    text = (ARMS / "irb4600_20_250.toml").read_text(encoding="utf-8")
    mine = tmp_path / "mine.toml"
    mine.write_text("\n".join(x for x in text.splitlines() if not x.startswith("flange_rpy")), "utf-8")
    done = call("inspect", samples / "hull_seam.mod", "--robot", mine)
    assert done.code and "its flange is turned" in done.err and "flange_rpy_deg = [0, 90, 0]" in done.err
