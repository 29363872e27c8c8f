"""What a controller's backup says about its tasks: their names, which of them move an arm, and which arm.

BACKINFO/backinfo.txt: ``>>TASK1: (T_ROB1,,)``. SYSPAR/SYS.cfg: CAB_TASKS name the motion tasks and their group of
mechanical units, MECHANICAL_UNIT_GROUP its robot. SYSPAR/MOC.cfg: ROBOT gives the type, ``ROB1_4600_2.55_40``, and the
base frame in the world. TASKn is not robot n.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from postproc.rapid.program.records import Pose
from postproc.rapid.program.values import to_quat
from postproc.rapid.unknown import Unknown

Entry = Mapping[str, str]

_ENTRY = re.compile(r'-(\w+)(?:[ \t]+(?:"([^"]*)"|([^-\s"][^\s"]*|-[\d.][^\s"]*)))?')
_TASK = re.compile(r"^>>(TASK\w*):\s*\(([^,)]*)", re.MULTILINE | re.IGNORECASE)
_TYPE = re.compile(r"(?:ROB\d+|IRB)_(\d+\w*?)_((?:[A-Za-z]\w*_)*)(\d+(?:\.\d+)?)_(\d+(?:\.\d+)?)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Drive:
    """What a task moves.

    Args:
        task: its name on the controller.
        moves: whether it is a motion task.
        type: the arm's type as the controller writes it, None where nothing is said.
        base: the arm's base frame in the world [mm]; None where it moves or cannot be read.
    """

    task: str
    moves: bool = True
    type: str | None = None
    base: Pose | None = Pose()


def read_drives(backup: Path) -> dict[str, Drive]:
    """What the tasks of a backup move, by folder name in upper case (``TASK1``); nothing where nothing is said."""
    names = {folder.upper(): name.strip() for folder, name in _TASK.findall(_text(backup, "BACKINFO", "backinfo.txt"))}
    system, motion = (_domains(_text(backup, "SYSPAR", f"{name}.cfg")) for name in ("SYS", "MOC"))
    tasks = {entry["name"].lower(): entry for entry in system.get("CAB_TASKS", []) if "name" in entry}
    groups = {e["name"].lower(): e for e in system.get("MECHANICAL_UNIT_GROUP", []) if "name" in e}
    robots = {e["name"].lower(): e for e in motion.get("ROBOT", []) if "name" in e}
    found = {}
    for folder, name in names.items():
        task = tasks.get(name.lower())
        if task is None:
            continue
        group = groups.get(task.get("usemechanicalunitgroup", "").lower())
        robot = robots.get(group.get("robot", "").lower()) if group is not None else None
        if robot is None and len(robots) == 1:
            robot = next(iter(robots.values()))
        found[folder] = Drive(
            name,
            "motiontask" in task,
            robot.get("use_robot_type") if robot is not None else None,
            _base(robot) if robot is not None else Pose(),
        )
    return found


def library_name(type_: str) -> str | None:
    """The library's name of an arm that a controller calls ``ROB1_4600_2.55_40``: ``irb4600_40_255``.

    >>> library_name("ROB2_4600_2.05_60"), library_name("ROB1_6700_LeanID_2.65_220")
    ('irb4600_60_205', 'irb6700_leanid_220_265')
    """
    found = _TYPE.fullmatch(type_)
    if found is None:
        return None
    family, variant, reach, payload = found.groups()
    return f"irb{family}_{variant}{payload}_{round(100 * float(reach))}".lower()


def _base(robot: Entry) -> Pose | None:
    """Base frame [mm]; the configuration states metres. A frame that another unit moves (a track) is none."""
    try:
        x, y, z = (1e3 * float(robot.get(f"base_frame_pos_{axis}", 0.0)) for axis in "xyz")
        rot = to_quat(tuple(float(robot.get(f"base_frame_orient_u{i}", not i)) for i in range(4)))
    except (ValueError, Unknown):
        return None
    if robot.get("base_frame_coordinated") or not all(map(math.isfinite, (x, y, z, *rot))):
        return None
    return Pose((x, y, z), rot)


def _domains(text: str) -> dict[str, list[Entry]]:
    """Entries of a configuration file by type: a backslash at the end of a line continues it, ``#`` ends a type."""
    found: dict[str, list[Entry]] = {}
    current: list[Entry] = []
    for line in re.sub(r"\\[ \t]*\r?\n[ \t]*", " ", text).splitlines():
        if head := re.fullmatch(r"([A-Z]\w*):\s*", line):
            current = found.setdefault(head[1], [])
        elif line.lstrip().startswith("-"):
            current.append({key.lower(): quoted or bare for key, quoted, bare in _ENTRY.findall(line)})
    return found


def _text(backup: Path, folder: str, name: str) -> str:
    """A file of the backup, its name in any case; empty where there is none."""
    for path in sorted(backup.glob("*")):
        if path.name.lower() == folder.lower() and path.is_dir():
            for file in sorted(path.glob("*")):
                if file.name.lower() == name.lower() and file.is_file():
                    return read_quietly(file).decode("latin-1")
    return ""


def read_quietly(path: Path) -> bytes:
    """The bytes of a file that only helps to understand others; it is copied too, and reported then if it cannot be."""
    try:
        return path.read_bytes()
    except OSError:
        return b""
