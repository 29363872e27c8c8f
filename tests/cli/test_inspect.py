"""``inspect``: every motion statement is accounted for, and bad input never ends in a traceback."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from postproc.robot.catalogue import load_robot
from postproc.robot.type_names import ARMS

from .conftest import Call


def test_rows_say_where_and_with_what(call: Call, samples: Path) -> None:
    text = call("inspect", samples / "panel_300.mod").out.splitlines()
    tacks = [line for line in text if "rTacks" in line]
    assert len(tacks) == 3
    assert [line.split(", 48 times; ")[1] for line in tacks] == [
        "an offset is written into its argument",
        "its array element is edited",
        "it moves with the target that it is derived from",
    ]
    # The work object is turned by a third of a degree only, so base and work object positions nearly add up.
    first = next(line for line in text if "ArcLStart" in line).split()
    assert [float(x) for x in first[3:6]] == pytest.approx([1010 + 12.5 + 116, -8 - 475, 430], abs=6.0)
    assert first[6:] == ["tTorch", "5.6", "kg,", "wPanel;", "its", "declaration", "is", "edited"]


def test_an_arm_of_unknown_stiffness_is_looked_at_as_it_is(call: Call, samples: Path, tmp_path: Path) -> None:
    lines = (ARMS / "irb4600_20_250.toml").read_text(encoding="utf-8").splitlines()
    mine = tmp_path / "mine.toml"
    mine.write_text("\n".join(line for line in lines if not line.startswith("stiffness")), encoding="utf-8")
    outcome = call("inspect", samples / "hull_seam.mod", "--robot", mine, "--json")
    assert outcome.code == 0
    document = json.loads(outcome.out)
    assert {row["edited"] for row in document["statements"]} == {None}


def test_the_posture_and_what_is_nearest(call: Call, samples: Path) -> None:
    """Compared with the joint values of every target, which a line between them comes a little nearer than."""
    outcome = call("inspect", samples / "hull_seam.mod", "--json")
    document = json.loads(outcome.out)
    rows = [row for row in document["statements"] if row["joints_deg"]]
    q = np.array([row["joints_deg"] for row in rows])
    robot = load_robot("irb4600_60_205")
    lower, upper = np.degrees([robot.lower, robot.upper])
    at_targets = np.minimum(q - lower, upper - q).min()
    limit, wrist, arm = document["nearest"]
    assert limit["distance_deg"] == pytest.approx(at_targets, abs=0.05)
    assert limit["distance_deg"] <= at_targets + 1e-9  # a line may come nearer than its ends
    assert limit["distance_deg"] == pytest.approx(
        min(limit["angle_deg"] - lower[limit["joint"] - 1], upper[limit["joint"] - 1] - limit["angle_deg"])
    )
    assert 0 < np.abs(q[:, 4]).min() - wrist["distance_deg"] < 0.3
    assert (wrist["joint"], wrist["angle_deg"]) == (5, pytest.approx(wrist["distance_deg"]))
    assert 0.2 < arm["singular_value_ratio"] < 1 and arm["distance_deg"] is None
    quarters = np.floor(q[:, [0, 3, 5]] / 90 + 1e-9)
    assert [row["confdata"][:3] for row in rows] == quarters.astype(int).tolist()
    text = call("inspect", samples / "hull_seam.mod").out.splitlines()[-4:]
    assert text[0] == "start: joints 0.0, -25.0, 25.0, 0.0, 65.0, 0.0 deg, confdata [0,0,0,0]; line 35, MoveAbsJ"
    assert [line.split(":")[0] for line in text[1:]] == [f"nearest to a {near['to']}" for near in document["nearest"]]
