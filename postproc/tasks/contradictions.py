"""What settings say against a controller's configuration, and against the data sheet of the arm.

What the command line or a jobs file says is meant for this program, and a warning is enough. A settings file may have
been found above the folder by accident: what it says against the controller is an error.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.diagnostics import Diagnostic, Severity
from postproc.files import real
from postproc.settings import Settings
from postproc.tasks.task import Task

if TYPE_CHECKING:
    from postproc.robot.arm import Robot

PROCESS = ("force", "moment", "already")
"""What no settings file outside a backup says of its cell."""


def contradictions(settings: Settings, task: Task, robot: Robot) -> list[Diagnostic]:
    """Return contradictions of settings to the controller's configuration (BAT012, BAT019) and the data sheet (BAT020).

    They are errors if a settings file, and not the command line, states what contradicts.

    Args:
        robot: the arm of the settings' model.
    """
    inherited = dict(settings.inherited)
    findings = _against_arm(task, robot.name, inherited.keys())
    if task.backup is not None:
        findings += _of_another_folder(settings, real(task.backup), inherited)
    station = settings.station
    if "already" in inherited and station is not None and not station.cell_arm.calibrated:
        text = f"`{settings.stated_in[0]}` says that the controller corrects by itself; its configuration does not"
        findings.append(Diagnostic("BAT019", "error", text, help="take `already` out, or say it with `--already`"))
    return findings + _beyond_payload(settings, robot, "error" if "force" in inherited else "warning")


def _against_arm(task: Task, robot: str, inherited: Collection[str]) -> list[Diagnostic]:
    """Return BAT012 where the model's arm is not that of the controller; an info if the latter is not known.

    Args:
        robot: name of the model's arm.
        inherited: keys that a settings file states; an arm or model from there makes it an error.
    """
    if task.unknown is not None:
        return [replace(task.unknown, severity="info", help="the arm or model that was named is used")]
    if task.robot in (None, robot):
        return []
    text = f"the controller drives `{task.robot}` with this task, the model is of `{robot}`"
    if {"robot", "model"} & {*inherited}:
        help_ = "take the arm out of the settings file, or name it with `--robot` or `-m` if it is meant"
        return [Diagnostic("BAT012", "error", text, help=help_)]
    return [Diagnostic("BAT012", "warning", text, help="give each arm's model to its tasks in a jobs file")]


def _of_another_folder(settings: Settings, backup: Path, inherited: Mapping[str, str]) -> list[Diagnostic]:
    """Return BAT019 where a settings file outside the backup states what holds for the cell of the backup alone.

    That is the process force and moment, and what of the arm's error the controller corrects itself (``already``).

    Args:
        backup: folder of the backup. inherited: keys that a settings file states, with their values as text.
    """
    keys = [key for key in PROCESS if key in inherited]
    if not keys or real(settings.stated_in[0]).is_relative_to(backup):
        return []
    named = ", ".join(f"`{key} = {inherited[key]}`" for key in keys)
    text = f"`{settings.stated_in[0]}` stands outside the backup and says {named} of its cell"
    help_ = f"put that into `{backup / settings.stated_in[0].name}`, or say it with `--{keys[0]}`"
    return [Diagnostic("BAT019", "error", text, help=help_)]


def _beyond_payload(settings: Settings, robot: Robot, severity: Severity) -> list[Diagnostic]:
    """Return BAT020 where the process force exceeds the weight of the arm's rated payload."""
    from postproc.arrays import GRAVITY

    force, rated = math.hypot(*settings.options.force), robot.payload
    if rated is None or force <= GRAVITY * rated:
        return []
    text = f"a force of {force:.0f} N is more than the weight of the payload of `{robot.name}`: {rated:g} kg"
    text += f", {GRAVITY * rated:.0f} N"
    return [Diagnostic("BAT020", severity, text, help="check its size and unit [N], and which arm it is")]
