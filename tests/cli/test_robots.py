"""``robots list`` and ``robots show``."""

from __future__ import annotations

import json
from pathlib import Path

from postproc.robot.type_names import ARMS

from .conftest import Call


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
