"""``postproc robots list|show``: the arms in the library."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.options import Flag
from postproc.cli.report import print_json, put
from postproc.cli.report import show as show_findings

if TYPE_CHECKING:
    from postproc.arrays import Array
    from postproc.robot.arm import Robot

STIFFNESS = {"measured": "stiffness measured", "estimated": "stiffness estimated", None: "stiffness unknown"}


def list_(*, json: Flag = False) -> int:
    """List the arms in the library.

    Args:
        json: print the postproc/robots/1 document.
    """
    from postproc.robot.catalogue import describe_robot, list_robots

    robots = [describe_robot(name) for name in list_robots()]
    if json:
        print_json({"schema": "postproc/robots/1", "robots": [_summary(robot) for robot in robots]})
        return 0
    for robot in robots:
        put(f"{robot.name:22} {STIFFNESS[robot.stiffness_source]:20} {_use(robot)}")
    return 0


def show(name: str, /, *, json: Flag = False) -> int:
    """Show what is known of an arm, what is estimated and what is unknown, each number with its source.

    Args:
        name: library name, a robot TOML or URDF file, or a controller's backup, whose arm is shown as it is calibrated.
        json: print the postproc/robot/1 document.
    """
    from postproc.robot.catalogue import describe_robot, doubts

    robot = _of_backup(Path(name)) if Path(name).is_dir() else describe_robot(name)
    show_findings(doubts(robot))
    if json:
        rows = [{"quantity": q, "status": s, "source": t} for q, _, s, t in _rows(robot)]
        print_json({"schema": "postproc/robot/1", **_summary(robot), "known": rows, "sources": dict(robot.sources)})
        return 0
    put(f"{robot.name}: {'; mounting: '.join(filter(None, (_use(robot), ', '.join(robot.mounting))))}")
    for quantity, values, status, source in _rows(robot):
        put(f"  {quantity:26} {status:10} {values}")
        if source:
            put(f"  {'':26} {'':10} {source}")
    if unread := robot.sources.get("absolute_accuracy.unread"):
        put(f"  not read, for their axes and frames are not published: {unread}")
    return 0


def _of_backup(folder: Path) -> Robot:
    """The only arm of a backup, with the joint compliances that its controller has, if it has any."""
    from postproc.model.from_controller import controller_model
    from postproc.robot.catalogue import describe_robot
    from postproc.robot.type_names import library_name
    from postproc.settings import read_station

    station = read_station(folder)
    arm = station.cell.arms[station.arm.lower()]
    robot = describe_robot(library_name(arm.type) or arm.type)
    if arm.calibration is None or robot.parallelogram:
        return robot
    return controller_model(robot.name, arm.calibration).robot


def _use(robot: Robot) -> str:
    if robot.parallelogram:
        return "parallelogram: described, not computed"
    return "spherical wrist" if robot.opw is not None else "forward models and fitting only"


def _rows(robot: Robot) -> list[tuple[str, str, str, str]]:
    """Quantity, values, ``known``, ``estimated`` or ``unknown``, and the source of each."""
    import numpy as np

    lengths = np.linalg.norm(robot.link[:, :3, 3], axis=1) * 1e3
    stiffness = None if robot.joint_compliance is None else 1.0 / robot.joint_compliance
    scalar = [None if x is None else np.array([x]) for x in (robot.payload, robot.reach)]
    mass = robot.mass if robot.mass.any() else None
    table: list[tuple[str, Array | None, tuple[str, ...]]] = [
        ("payload [kg]", scalar[0], ("payload_kg",)),
        ("reach to the wrist [mm]", None if scalar[1] is None else scalar[1] * 1e3, ("reach_mm",)),
        ("offsets of the axes [mm]", lengths, ("chain.origin_mm", "dh.a_mm", "robot")),
        ("lower limit [deg]", np.degrees(robot.lower), ("joints.limits_deg", "joints", "robot")),
        ("upper limit [deg]", np.degrees(robot.upper), ("joints.limits_deg", "joints", "robot")),
        ("speed [deg/s]", np.degrees(robot.speed), ("joints.speed_deg_per_s", "joints", "robot")),
        ("acceleration [rad/s^2]", robot.acceleration, ("joints.acceleration_rad_per_s2", "joints", "accelerations")),
        ("jerk [rad/s^3]", robot.jerk, ("joints.jerk_rad_per_s3", "joints", "accelerations")),
        ("torque [N m]", robot.torque, ("joints.torque_Nm", "robot")),
        ("stiffness [N m/rad]", stiffness, ("joints.stiffness_Nm_per_rad",)),
        ("within a factor of (95 %)", robot.stiffness_factor, ("joints.stiffness_factor",)),
        ("mass of bodies [kg]", mass, ("bodies.body", "robot")),
        ("within a factor of (68 %)", robot.mass_factor, ("bodies.mass_factor",)),
    ]
    return [_row(robot, quantity, values, keys) for quantity, values, keys in table]


def _row(robot: Robot, quantity: str, values: Array | None, keys: tuple[str, ...]) -> tuple[str, str, str, str]:
    if values is None:
        return quantity, "", "unknown", ""
    source = next((robot.sources[key] for key in keys if key in robot.sources), "")
    guessed = "estimate" in source or "DISPUTED" in source
    return quantity, "".join(f"{v:10.5g}" for v in values), "estimated" if guessed else "known", source


def _summary(robot: Robot) -> dict[str, object]:
    import numpy as np

    return {
        "name": robot.name,
        "payload_kg": robot.payload,
        "reach_mm": None if robot.reach is None else 1e3 * robot.reach,
        "mounting": list(robot.mounting),
        "parallelogram": robot.parallelogram,
        "closed_form_inverse": robot.opw is not None and not robot.parallelogram,
        "limits_deg": np.degrees(np.column_stack([robot.lower, robot.upper])),
        "speed_deg_per_s": np.degrees(robot.speed),
        "joint_compliance_rad_per_Nm": robot.joint_compliance,
        "stiffness_source": robot.stiffness_source,
        "stiffness_factor": robot.stiffness_factor,
        "mass_kg": robot.mass,
        "mass_factor": robot.mass_factor,
    }
