"""What a controller's backup says about its tasks: their names, which of them move an arm, and which arm.

BACKINFO/backinfo.txt: ``>>TASK1: (T_ROB1,,)``. SYSPAR/SYS.cfg: CAB_TASKS name the motion tasks and their group of
mechanical units, MECHANICAL_UNIT_GROUP its robot. SYSPAR/MOC.cfg: ROBOT gives the type, ``ROB1_4600_2.55_40``, and the
base frame in the world. TASKn is not robot n. Gantries and positioners are entries of ROBOT too.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from postproc.diagnostics import Diagnostic
from postproc.files import read_file
from postproc.robot.type_names import library_name, nearest_names

Entry = Mapping[str, str]
Entries = Mapping[str, list[Entry]]
"""Entries of a configuration file by type."""

_ENTRY = re.compile(r'-(\w+)(?:[ \t]+(?:"([^"]*)"|([^-\s"][^\s"]*|-[\d.][^\s"]*)))?')
_TASK_HEADING = re.compile(r"^>>(TASK\w*):\s*\(([^,)]*)", re.MULTILINE | re.IGNORECASE)
_ARM = re.compile(r"(?:ROB\d*|IRB)_", re.IGNORECASE)
_MOC_NUMBER = re.compile(r"[-+]?(?:\d++(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?")
SETTLE = "name the arm, `--robot NAME`, or give its model, `-m MODEL`"


@dataclass(frozen=True, slots=True)
class Backup:
    """Contents of a controller's backup: task names by folder (``TASK1``, upper case), entries of SYS.cfg and
    MOC.cfg.
    """

    tasks: Mapping[str, str] = field(default_factory=dict)
    system: Entries = field(default_factory=dict)
    motion: Entries = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Drive:
    """What a task moves.

    Args:
        task: its name on the controller, else that of its folder.
        moves: whether it is a motion task; True where nothing is said.
        arm: library name of its arm, None where that is not known.
        unknown: why it is not known (KIN011): an error for a task that moves, unless the user names the arm.
    """

    task: str
    moves: bool = True
    arm: str | None = None
    unknown: Diagnostic | None = None


@dataclass(frozen=True, slots=True)
class Calibration:
    """What Absolute Accuracy knows of one arm, as its controller's configuration holds it.

    Args:
        compliance: ``Compl`` of JOINT_CALIB by joint from 0 [rad/(N m)] (docs/robot.md says why that is its unit).
        entries: names of these entries by joint.
        unread: parameters that stand beside them, whose frames and axes are not published.
    """

    compliance: Mapping[int, float]
    entries: Mapping[int, str]
    unread: tuple[str, ...] = ()


def read_calibration(motion: Entries, robot: Entry) -> Calibration | None:
    """Return the Absolute Accuracy calibration of a ROBOT entry; None where MOC.cfg states no joint compliance."""
    joints = {i: robot[f"use_joint_{i}"].lower() for i in range(6) if f"use_joint_{i}" in robot}
    springs = by_name(motion, "JOINT_CALIB")
    stated = {i: springs[name]["compl"] for i, name in joints.items() if "compl" in springs.get(name, {})}
    if not stated:
        return None
    compliance = {i: float(text) if _MOC_NUMBER.fullmatch(text) else math.nan for i, text in stated.items()}
    arms = by_name(motion, "ARM")
    calibrated = {arms.get(name, {}).get("use_arm_calib", name).lower() for name in joints.values()}
    calibrations = [e for name, e in by_name(motion, "ARM_CALIB").items() if name in calibrated]
    calibrations += [e for name, e in by_name(motion, "PARALLEL_ARM_CALIB").items() if name in joints.values()]
    unread = {key for entry in calibrations for key in entry if key.startswith(("error_", "arm_compliance_"))}
    if any(key.startswith("offset_") for entry in motion.get("TOOL_INTERFACE", []) for key in entry):
        unread.add("offset of TOOL_INTERFACE")
    return Calibration(compliance, {i: joints[i] for i in stated}, tuple(sorted(unread)))


def read_backup(folder: Path) -> Backup:
    """Read the configuration in a controller's backup; empty where a file is missing."""
    names = {
        task.upper(): name.strip()
        for task, name in _TASK_HEADING.findall(text_in_backup(folder, "BACKINFO", "backinfo.txt"))
    }
    return Backup(names, *(read_entries(text_in_backup(folder, "SYSPAR", f"{name}.cfg")) for name in ("SYS", "MOC")))


def read_drive(backup: Backup, folder: str) -> Drive:
    """Return what a task of a backup moves, by the name of its folder (``TASK1``) or its own name."""
    name = backup.tasks.get(folder.upper(), folder)
    tasks = by_name(backup.system, "CAB_TASKS")
    task = tasks.get(name.lower())
    moves = task is None or "motiontask" in task
    robots = arm_entries(backup.motion)
    group = by_name(backup.system, "MECHANICAL_UNIT_GROUP").get((task or {}).get("usemechanicalunitgroup", "").lower())
    if group is not None:
        robots = [r for r in robots if r.get("name", "").lower() == group.get("robot", "").lower()]
        if not robots and "robot" not in group:
            return Drive(name, False)  # a positioner's task
    if len(robots) != 1:
        listed = task is not None or not tasks
        return Drive(name, moves, None, _not_known(_no_single_arm(name, robots, backup, listed)))
    type_ = robots[0].get("use_robot_type", "")
    arm = library_name(type_)
    if arm is not None:
        return Drive(name, moves, arm)
    text = f"`{name}` moves an arm of type `{type_}`, which is not in the library"
    return Drive(name, moves, None, _not_known(text, not_in_library(type_)))


def arm_entries(motion: Entries) -> list[Entry]:
    """Return the ROBOT entries that are arms: of an ABB type or with a serial number, and no GEN_KIN chain."""
    names = {e.get("name", "").lower() for e in motion.get("ROBOT_TYPE", []) if e.get("type", "").upper() == "GEN_KIN"}
    return [
        robot
        for robot in motion.get("ROBOT", [])
        if robot.get("use_robot_type", "").lower() not in names
        and (robot.get("use_robot_serial_number") or _ARM.match(robot.get("use_robot_type", "")))
    ]


def read_entries(text: str) -> Entries:
    """Parse a configuration file (MOC.cfg, SYS.cfg) into its entries, key and value each, listed by type.

    A backslash at the end of a line continues it. Keys are in lower case; a key without a value has an empty text.
    """
    entries: dict[str, list[Entry]] = {}
    current: list[Entry] = []
    for line in re.sub(r"\\[ \t]*\r?\n[ \t]*", " ", text).splitlines():
        if head := re.fullmatch(r"([A-Z]\w*):\s*", line):
            current = entries.setdefault(head[1], [])
        elif line.lstrip().startswith("-"):
            current.append({key.lower(): quoted or bare for key, quoted, bare in _ENTRY.findall(line)})
    return entries


def read_quietly(path: Path) -> bytes:
    """Return the bytes of a file that only helps to understand others; empty where it cannot be read."""
    try:
        return read_file(path)
    except OSError:
        return b""


def _not_known(text: str, help_: str = SETTLE) -> Diagnostic:
    """Return KIN011, an error: the arm of a task is not known, as ``text`` says."""
    return Diagnostic("KIN011", "error", text, help=help_)


def _no_single_arm(task: str, robots: list[Entry], backup: Backup, listed: bool) -> str:
    """Return a sentence on why the arm of a task is not known: no ROBOT entry may be its arm, or several may.

    Args:
        robots: the entries that may be.
        listed: SYS.cfg lists the task, or lists no task at all.
    """
    if robots:
        each = " and ".join(f"`{r.get('name', '?')}` (`{r.get('use_robot_type', '?')}`)" for r in robots)
        if not listed:
            return f"the backup holds {each}, and its SYS.cfg does not list the task `{task}`, which moves one of them"
        return f"the backup holds {each}, and no mechanical unit group says which of them `{task}` moves"
    if not backup.motion:
        return f"which arm `{task}` moves is not known: the backup has no SYSPAR/MOC.cfg, or it cannot be read"
    return f"which arm `{task}` moves is not known: no ROBOT in the backup's MOC.cfg is its arm"


def not_in_library(type_: str) -> str:
    """Return a help text for an arm that the library lacks: names of the same model, and how to name another arm."""
    near = ", ".join(f"`{name}`" for name in nearest_names(type_))
    known = f"its arms of that model are {near}; name one, or" if near else "it has no arm of that model; name"
    return f"{known} a file that describes it, `--robot NAME`, or give its model, `-m MODEL`"


def by_name(entries: Entries, kind: str) -> dict[str, Entry]:
    """Return the entries of a type, such as ``SINGLE``, by name in lower case; those without a name are left out."""
    return {entry["name"].lower(): entry for entry in entries.get(kind, []) if "name" in entry}


def text_in_backup(backup: Path, folder: str, name: str) -> str:
    """Return the text of a file in a folder of the backup, both names in any case; empty where there is none."""
    for path in sorted(backup.glob("*")):
        if path.name.lower() == folder.lower() and path.is_dir():
            for file in sorted(path.glob("*")):
                if file.name.lower() == name.lower() and file.is_file():
                    return read_quietly(file).decode("latin-1")
    return ""
