"""Arms of the library for the independent arm: their files are read as data, by none of the package's code."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.independent import arm as A

FILES = Path(__file__).parents[3] / "postproc" / "robot" / "arms"
MEASURED = 1.5
"""Factor that holds 95 % of arms where a measured stiffness states none: the independent cells draw 0.7 to 1.4."""
ESTIMATED = (4.0, 3.0, 2.5, 2.5, 3.5, 2.5)
"""The same of the rule for arms that nobody measured (docs/robot.md)."""

HEAVIER = 1.3
"""One geometric standard deviation of the masses where the file states none: its estimates say plus or minus 30 %."""


@dataclass(frozen=True)
class Type:
    """One arm as its file has it.

    Args:
        arm: geometry, masses and limits.
        compliance: (6,) [rad/(N m)] of the file.
        spread: (6,) standard deviation of the logarithm of an arm's own compliance over that.
        weight: (7,) the same of the logarithm of the bodies' masses.
        payload: rated [kg]. reach: [m].
        torque, lever: weight of the moving bodies times reach, and the reach, in those of the IRB 4600-60/2.05, for
            which the independent effects have their ordinary sizes.
    """

    name: str
    arm: A.Arm
    compliance: np.ndarray
    spread: np.ndarray
    weight: np.ndarray
    payload: float
    reach: float
    torque: float
    lever: float


def arm_type(name: str) -> Type:
    """The arm of a file whose frames are parallel to the base at the zero pose."""
    file = tomllib.loads((FILES / f"{name}.toml").read_text("utf-8"))
    chain, joints, bodies = file["chain"], file["joints"], file["bodies"]
    assert "origin_rpy_deg" not in chain and bodies["center_frame"] == "base_at_zero"
    origin = 1e-3 * np.array(chain["origin_mm"], float)
    # Joint 1 turns about z, so that its height may stand behind it: the pedestal then tilts about its foot.
    assert chain["axis"][0] == [0, 0, 1] and not origin[0, :2].any()
    origin[1] += origin[0]
    origin[0] = 0
    roll, pitch, yaw = np.radians(chain["flange_rpy_deg"])
    assert roll == 0 and yaw == 0
    flange = A.transform(A.rotation(np.array([0.0, 1.0, 0.0]), pitch), 1e-3 * np.array(chain["flange_mm"], float))
    mass = np.array([b["mass_kg"] for b in bodies["body"]], float)
    place = np.concatenate([np.zeros((1, 3)), np.cumsum(origin, axis=0)])
    center = 1e-3 * np.array([b["center_mm"] for b in bodies["body"]], float) - place
    lower, upper = np.radians(np.array(joints["limits_deg"], float)).T
    arm = A.Arm(
        name, np.stack([*(A.shift(*p) for p in origin), flange]), np.array(chain["axis"], float), mass, center, lower, upper,
        {"a1": origin[1, 0], "a2": origin[2, 2], "a3": origin[3, 2], "d1": origin[1, 2], "d4": origin[4, 0], "d6": origin[5, 0]},
    )  # fmt: skip
    stated = joints["stiffness_source"] == "measured"
    factor = np.array(joints.get("stiffness_factor", [MEASURED] * 6 if stated else ESTIMATED), float)
    main = A.irb4600()
    reach = 1e-3 * float(file["reach_mm"])
    torque = float(mass[1:].sum() * reach / (main.mass[1:].sum() * 2.05))
    compliance = 1 / np.array(joints["stiffness_Nm_per_rad"], float)
    weight = np.log(np.array(bodies.get("mass_factor", [HEAVIER] * 7), float))
    return Type(
        name, arm, compliance, np.log(factor) / 1.96, weight, float(file["payload_kg"]), reach, torque, reach / 2.05
    )
