"""``postproc robots list|show``: the arms in the library."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.options import CheckFlag
from postproc.cli.output import present
from postproc.cli.printing import show as show_findings

if TYPE_CHECKING:
    from postproc.robot.arm import Robot


def list_(*, json: CheckFlag = False) -> None:
    """List the arms in the library.

    Args:
        json: print the postproc/robots/1 document.
    """
    from postproc.results.library import robots_document
    from postproc.robot.catalogue import describe_robot, list_robots

    present(robots_document([describe_robot(name) for name in list_robots()]), json=json)


def show(name: str, /, *, json: CheckFlag = False) -> None:
    """Show what is known of an arm, what is estimated and what is unknown, each number with its source.

    Args:
        name: library name, a robot TOML or URDF file, or a controller's backup, whose arm is shown as it is calibrated.
        json: print the postproc/robot/1 document.
    """
    from postproc.results.library import robot_document
    from postproc.robot.catalogue import describe_robot, doubts

    robot = _of_backup(Path(name)) if Path(name).is_dir() else describe_robot(name)
    show_findings(doubts(robot))
    present(robot_document(robot), json=json)


def _of_backup(folder: Path) -> Robot:
    """Return the only arm of a backup, with the joint compliances of its controller where it states some."""
    from postproc.model.controller import controller_model
    from postproc.robot.catalogue import describe_robot
    from postproc.robot.type_names import library_name
    from postproc.settings import read_station

    station = read_station(folder)
    arm = station.cell_arm
    robot = describe_robot(library_name(arm.type) or arm.type)
    if arm.calibration is None or robot.parallelogram:
        return robot
    return controller_model(robot.name, arm.calibration).robot
