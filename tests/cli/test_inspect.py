"""``inspect``: every motion statement is accounted for, with its posture and what comes nearest to a limit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from postproc.robot.catalogue import load_robot

from .conftest import Call


def test_rows_say_where_and_with_what(call: Call, samples: Path) -> None:
    text = call("inspect", samples / "panel_300.mod").out.splitlines()
    assert [line.split(", 48 times; ")[1] for line in text if "rTacks" in line] == [
        "it moves with the target that it is derived from",
        "its array element is edited",
        "an offset is written into its argument",
    ]
    # The work object is turned by a third of a degree only, so base and work object positions nearly add up.
    first = next(line for line in text if "ArcLStart" in line).split()
    assert first[3] == "p1A01" and [float(x) for x in first[4:7]] == pytest.approx(
        [1010 + 12.5 + 116, -8 - 475, 430], abs=6.0
    )
    assert " ".join(first[7:]) == "tTorch 5.6 kg, wPanel; its declaration is edited"


def test_the_posture_and_what_is_nearest(call: Call, samples: Path) -> None:
    """Compared with the joint values of every target, which a line between them comes a little nearer than."""
    document = json.loads(call("inspect", samples / "hull_seam.mod", "--json").out)
    rows = [row for row in document["statements"] if row["joints_deg"]]
    q = np.array([row["joints_deg"] for row in rows])
    robot = load_robot("irb4600_60_205")
    lower, upper = np.degrees([robot.lower, robot.upper])
    at_targets = np.minimum(q - lower, upper - q).min()
    limit, wrist, arm = document["nearest"]
    assert at_targets - 0.05 < limit["distance_deg"] <= at_targets + 1e-9  # a line may come nearer than its ends
    angle, joint = limit["angle_deg"], limit["joint"] - 1
    assert limit["distance_deg"] == pytest.approx(min(angle - lower[joint], upper[joint] - angle))
    assert 0 < np.abs(q[:, 4]).min() - wrist["distance_deg"] < 0.3
    assert (wrist["joint"], wrist["angle_deg"]) == (5, pytest.approx(wrist["distance_deg"]))
    assert 0.2 < arm["singular_value_ratio"] < 1 and arm["distance_deg"] is None
    quarters = np.floor(q[:, [0, 3, 5]] / 90 + 1e-9)
    assert [row["confdata"][:3] for row in rows] == quarters.astype(int).tolist()
    text = call("inspect", samples / "hull_seam.mod").out.splitlines()[-4:]
    assert text[0] == "start: joints 0.0, -25.0, 25.0, 0.0, 65.0, 0.0 deg, confdata [0,0,0,0]; line 35, MoveAbsJ"
    assert [line.split(":")[0] for line in text[1:]] == [f"nearest to a {near['to']}" for near in document["nearest"]]
