"""``postproc robots list|show``: the arms in the library."""

from __future__ import annotations

from typing import TYPE_CHECKING

from postproc.cli.options import Flag
from postproc.cli.report import print_json, put
from postproc.cli.report import show as show_findings

if TYPE_CHECKING:
    from postproc.arrays import Array
    from postproc.robot.arm import Robot


def list_(*, json: Flag = False) -> int:
    """List the arms in the library.

    Args:
        json: print the postproc/robots/1 document.
    """
    from postproc.robot.catalogue import list_robots, load_robot

    robots = [load_robot(name) for name in list_robots()]
    if json:
        print_json({"schema": "postproc/robots/1", "robots": [_summary(robot) for robot in robots]})
        return 0
    for robot in robots:
        known = "elasticity known" if robot.joint_compliance is not None else "elasticity to be fitted"
        wrist = "spherical wrist" if robot.opw is not None else "forward models and fitting only"
        put(f"{robot.name:22} {known:24} {wrist}")
    return 0


def show(name: str, /, *, json: Flag = False) -> int:
    """Show the numbers of an arm, each with its source.

    Args:
        name: library name, or a robot TOML or URDF file.
        json: print the postproc/robot/1 document.
    """
    import numpy as np

    from postproc.robot.catalogue import doubts, load_robot

    robot = load_robot(name)
    show_findings(doubts(robot))
    if json:
        print_json({"schema": "postproc/robot/1", **_summary(robot), "sources": dict(robot.sources)})
        return 0
    put(robot.name)
    rows: list[tuple[str, Array | None]] = [
        ("lower limit [deg]", np.degrees(robot.lower)),
        ("upper limit [deg]", np.degrees(robot.upper)),
        ("speed [deg/s]", np.degrees(robot.speed)),
        ("acceleration [rad/s^2]", robot.acceleration),
        ("jerk [rad/s^3]", robot.jerk),
        ("torque [N m]", robot.torque),
        ("compliance [rad/(N m)]", robot.joint_compliance),
        ("mass of bodies [kg]", robot.mass),
    ]
    for label, values in rows:
        put(f"  {label:24}" + ("not known" if values is None else "".join(f"{v:12.5g}" for v in values)))
    put("sources")
    for key, source in robot.sources.items():
        put(f"  {key}: {source}")
    return 0


def _summary(robot: Robot) -> dict[str, object]:
    import numpy as np

    return {
        "name": robot.name,
        "payload_kg": robot.payload,
        "closed_form_inverse": robot.opw is not None,
        "limits_deg": np.degrees(np.column_stack([robot.lower, robot.upper])),
        "speed_deg_per_s": np.degrees(robot.speed),
        "joint_compliance_rad_per_Nm": robot.joint_compliance,
        "mass_kg": robot.mass,
    }
