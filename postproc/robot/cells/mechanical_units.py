"""The cell that a controller's configuration describes: MOC.cfg and SYS.cfg read into a `Cell`.

Which rule holds where was found from the numbers of public backups (docs/robot.md):

- SINGLE of mechanics TRACK: slides along +x of its frame. The frame of the arm that it carries is written in the world,
  for the track at zero.
- ROBOT of type GEN_KIN (gantry, positioner): each joint is Rot(x, attitude) Trans(x, length) Rot(z, theta_home_position
  + q) Trans(z, offset_z + d), the modified Denavit-Hartenberg convention (Craig), behind the rotation base_pose_rot of
  its ROBOT_TYPE. The frame of an arm that it carries is relative to the end of that chain.
- Turning units are turned about +z of their frame. ``logical_axis`` 7 to 12 are eax_a to eax_f.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import GRAVITY, Array, gravity_in, invert
from postproc.diagnostics import Diagnostic
from postproc.robot.cells.cell import LETTERS, Cell, CellArm, CellTask, Joint, Kind, Unit
from postproc.robot.cells.station import Station
from postproc.robot.controller import Backup, Entries, Entry, arm_entries, by_name, read_calibration
from postproc.robot.pose import rpy, transform

SAME_PLACE = 1e-3  # [m]: two arms do not stand nearer to each other
SAME_WAY = np.radians(2.0)
CARRYING_NAMES = ("TRACK", "EXT_LIN")


def read_cell(backup: Backup) -> Cell:
    """Build the units, arms and tasks of a controller's configuration.

    What is not understood becomes a finding of the cell (KIN014, KIN015), and is never guessed.
    """
    motion = backup.motion
    units = {unit.name.lower(): unit for unit in _units(motion)}
    names = {alias.lower(): name for alias, name in _aliases(motion)}
    units = {key: replace(unit, parent=_named(unit.parent, names)) for key, unit in units.items()}
    for entry in [*motion.get("SINGLE", []), *motion.get("ROBOT", [])]:
        carrier = _named(_parent(entry), names)
        if carrier is not None and carrier.lower() not in units:
            units[carrier.lower()] = Unit(carrier, (), unknown="the configuration does not describe it")
    cell = Cell(units)
    arms = {e["name"].lower(): _arm(cell, e, names, motion) for e in arm_entries(motion) if "name" in e}
    cell = replace(cell, arms=arms, tasks=dict(_tasks(backup, units, arms)))
    return replace(cell, findings=tuple(_findings(cell, motion)))


def _aliases(motion: Entries) -> Iterator[tuple[str, str]]:
    """Yield pairs (alias, name) for each mechanical unit.

    Other entries refer to a unit by its own name or by that of the SINGLE or ROBOT entry that it uses.
    """
    for entry in motion.get("MECHANICAL_UNIT", []):
        for key in ("use_single_0", "use_robot", "name"):
            if key in entry:
                yield entry[key], entry["name"]


def _named(alias: str | None, names: dict[str, str]) -> str | None:
    """Return the unit that an alias means, by ``names`` with aliases in lower case; an unknown alias as it is."""
    return None if alias is None else names.get(alias.lower(), alias)


def _units(motion: Entries) -> Iterator[Unit]:
    """Yield the mechanical units of MOC.cfg.

    A file without MECHANICAL_UNIT entries has one for each SINGLE and each ROBOT of type GEN_KIN.
    """
    singles, robots = (by_name(motion, kind) for kind in ("SINGLE", "ROBOT"))
    arms = {e["name"].lower() for e in arm_entries(motion) if "name" in e}
    listed = motion.get("MECHANICAL_UNIT", [])
    if not listed:
        listed = [{"name": e["name"], "use_single_0": e["name"]} for e in singles.values()]
        listed += [{"name": e["name"], "use_robot": e["name"]} for k, e in robots.items() if k not in arms]
    for entry in listed:
        single, chain = (
            singles.get(entry.get("use_single_0", "").lower()),
            robots.get(entry.get("use_robot", "").lower()),
        )
        active = "activate_at_start_up" in entry
        if single is not None:
            yield _single(motion, entry["name"], single, active)
        elif chain is not None:
            rows = (chain.get(f"use_joint_{i}") for i in range(6))
            joints = tuple(_row(motion, name) for name in rows if name)
            yield Unit(
                entry["name"], joints, _parent(chain), _frame(chain) @ _turn(motion, chain), active, _doubt(joints)
            )
        else:
            yield Unit(entry["name"], (), active=active, unknown="the configuration describes no joint of it")


def _single(motion: Entries, name: str, entry: Entry, active: bool) -> Unit:
    """Return the unit `name` of a SINGLE entry: one joint, linear along x or rotary about z of its frame.

    Args:
        active: whether the unit is activated at start-up.
    """
    type_ = entry.get("use_single_type", "")
    kind, doubt = _mechanics(motion, type_)
    joint = _joint(motion, entry.get("use_joint", name), kind)
    if joint.axis is None and type_.upper().startswith("IRBT"):
        joint = replace(joint, axis=LETTERS[0])  # ABB's own tracks are thinned in a backup
    direction = np.array([1.0, 0.0, 0.0]) if kind == "linear" else np.array([0.0, 0.0, 1.0])
    doubt = doubt or _doubt((joint,))
    return Unit(name, (replace(joint, direction=direction),), _parent(entry), _frame(entry), active, doubt)


def _mechanics(motion: Entries, type_: str) -> tuple[Kind, str]:
    """Return how a SINGLE of this type moves, and a text on why that is not known; the text is empty where it is."""
    stated = by_name(motion, "SINGLE_TYPE").get(type_.lower(), {}).get("mechanics", "").upper()
    if stated in CARRYING_NAMES or (not stated and type_.upper().startswith("IRBT")):
        return "linear", ""
    if stated in ("FREE_ROT", "EXT_ROT"):
        return "rotary", ""
    return "rotary", f"how its type `{type_}` moves is not in the backup"


def _row(motion: Entries, name: str) -> Joint:
    """Return the joint of a GEN_KIN chain with the name of its JOINT; ``T_before`` is its Denavit-Hartenberg row."""
    joint = _joint(motion, name, None)
    row = by_name(motion, "ARM_TYPE").get(_arm_of(motion, name).get("use_arm_type", "").lower(), {})
    attitude, length, home, offset = (
        _number(row, key) for key in ("attitude", "length", "theta_home_position", "offset_z")
    )
    first = transform(np.zeros(3), rpy(np.array([_exact(attitude), 0.0, 0.0])))
    second = transform(np.array([length, 0.0, 0.0]), rpy(np.array([0.0, 0.0, _exact(home)])))
    return replace(joint, T_before=first @ second @ transform(np.array([0.0, 0.0, offset])))


def _joint(motion: Entries, name: str, kind: Kind | None) -> Joint:
    """Return the joint of the JOINT entry ``name``, with its axis, limits and speed.

    Args:
        kind: how it moves; None takes it from its TRANSMISSION.
    """
    joints = by_name(motion, "JOINT")
    entry = joints.get(name.lower(), {})
    logical = _number(entry, "logical_axis")
    letter = LETTERS[int(logical) - 7] if 7 <= logical <= 12 else None
    drive = by_name(motion, "TRANSMISSION").get(entry.get("use_transmission", "").lower(), {})
    turns: Kind = "rotary" if "rotating_move" in drive else "linear"
    if "lock_joint_in_ipol" in entry:
        return Joint(name, None, "fixed")
    arm = _arm_of(motion, name)
    limits = [
        float(arm[key]) if _is_number(arm.get(key)) else None for key in ("lower_joint_bound", "upper_joint_bound")
    ]
    leader = joints.get(entry.get("follower_to_joint", "").lower(), {})
    led = _number(leader, "logical_axis")
    return Joint(
        name, letter, kind or turns, lower=limits[0], upper=limits[1], speed=_speed(motion, entry, drive),
        leader=LETTERS[int(led) - 7] if 7 <= led <= 12 else None,
    )  # fmt: skip


def _arm_of(motion: Entries, joint: str) -> Entry:
    """Return the ARM entry of a joint: the one it names, else one whose type has the joint's name, else empty."""
    used = by_name(motion, "JOINT").get(joint.lower(), {}).get("use_arm", joint).lower()
    arms = by_name(motion, "ARM")
    return arms.get(used) or next((a for a in arms.values() if a.get("use_arm_type", "").lower() == joint.lower()), {})


def _speed(motion: Entries, joint: Entry, drive: Entry) -> float | None:
    """Return the largest speed [m/s] or [rad/s] of a JOINT, by its TRANSMISSION ``drive``; None if it is not stated."""
    system = by_name(motion, "DRIVE_SYSTEM").get(joint.get("use_drive_system", "").lower(), {})
    duty = by_name(motion, "STRESS_DUTY_CYCLE").get(system.get("use_stress_duty_cycle", "").lower(), {})
    motor, ratio = _number(duty, "speed_absolute_max"), _number(drive, "transm_joint")
    return abs(motor / ratio) if motor and ratio else None


def _arm(cell: Cell, entry: Entry, names: dict[str, str], motion: Entries) -> CellArm:
    """Build the arm of a ROBOT entry; the base frame of one on a track is converted from the world to its unit.

    Args:
        names: name of each unit by alias in lower case.
    """
    unit = _named(_parent(entry), names)
    T = _frame(entry)
    if unit is not None and unit.lower() in cell.units and _stands_in_world(cell.unit(unit)):
        zero = Station(cell, units=tuple(cell.units)).world(unit, np.zeros((1, 6)))[0]
        T = invert(zero[None])[0] @ T
    calibrated = re.fullmatch(r"r\d+_calib", entry.get("use_robot_calib", ""), re.IGNORECASE) is not None
    calibration = read_calibration(motion, entry)
    return CellArm(entry["name"], entry.get("use_robot_type", ""), unit, T, _gravity(entry), calibrated, calibration)


def _stands_in_world(unit: Unit) -> bool:
    """Tell whether a unit is a track, one joint along x: the frame of an arm on a track is written in the world."""
    return len(unit.joints) == 1 and bool(unit.joints[0].direction[0])


def _gravity(entry: Entry) -> Array | None:
    """Return gravity (3,) in base axes [m/s^2] by gravity_beta or gravity_alpha, else by the base frame.

    None where both angles are not zero, as their order is not known.
    """
    alpha, beta = (_exact(_number(entry, f"gravity_{angle}")) for angle in ("alpha", "beta"))
    if alpha and beta:
        return None
    if alpha or beta:
        return gravity_in(rpy(np.array([alpha, beta, 0.0])))
    return gravity_in(_frame(entry)[:3, :3])


def _tasks(backup: Backup, units: dict[str, Unit], arms: dict[str, CellArm]) -> Iterator[tuple[str, CellTask]]:
    """Yield pairs (name in lower case, task) of the tasks in SYS.cfg.

    A task has the units and the arm of its mechanical unit group. Without a group, the only motion task has all units,
    and the arm if there is one only.
    """
    groups = by_name(backup.system, "MECHANICAL_UNIT_GROUP")
    entries = by_name(backup.system, "CAB_TASKS")
    for key, entry in entries.items():
        moves = "motiontask" in entry
        group = groups.get(entry.get("usemechanicalunitgroup", "").lower())
        if group is not None:
            members = [group[k] for k in sorted(group) if k.startswith("mechanicalunit_")]
            arm = group.get("robot")
        else:  # a system of one task: all units are its own
            alone = moves and sum("motiontask" in e for e in entries.values()) == 1
            members = [u.name for u in units.values()] if alone else []
            arm = next(iter(arms.values())).name if alone and len(arms) == 1 else None
        known = tuple(m for m in members if m.lower() in units)
        yield key, CellTask(entry["name"], moves, arm, known)


def _findings(cell: Cell, motion: Entries) -> Iterator[tuple[str, Diagnostic]]:
    """Yield pairs (name of a unit or arm, warning or info on it), KIN014 or KIN015.

    KIN014: a unit's motion is not known, or two arms would stand at one place; KIN015: how an arm leans is in doubt.
    """
    for unit in cell.units.values():
        if unit.unknown:
            help_ = (
                "say how it moves in `[[external_axes]]` of the model file, or `--free-axes` where it carries nothing"
            )
            yield unit.name, Diagnostic("KIN014", "warning", f"the unit `{unit.name}`: {unit.unknown}", help=help_)
    bases = {a.name: _frame(e)[:3, 3] for a, e in _stated_in_world(cell, motion)}
    for one, other in [(a, b) for a in bases for b in bases if a < b]:
        if np.linalg.norm(bases[one] - bases[other]) < SAME_PLACE:
            text = f"`{one}` and `{other}` would stand at one place, with their base frames taken in the world"
            help_ = "state where each stands in `[[external_axes]]`"
            yield from ((name, Diagnostic("KIN014", "warning", text, help=help_)) for name in (one, other))
    for entry in arm_entries(motion):
        yield from ((entry["name"], finding) for finding in _leaning(cell, entry))


def _stated_in_world(cell: Cell, motion: Entries) -> Iterator[tuple[CellArm, Entry]]:
    """Yield arms whose frame is written in the world although a unit carries them, with their ROBOT entry."""
    for entry in arm_entries(motion):
        arm = cell.arms.get(entry.get("name", "").lower())
        unit = cell.units.get((arm.unit or "").lower()) if arm is not None else None
        if arm is not None and unit is not None and _stands_in_world(unit):
            yield arm, entry


def _leaning(cell: Cell, entry: Entry) -> Iterator[Diagnostic]:
    """Yield KIN015 where it is in doubt how the arm of a ROBOT entry leans.

    Its mounting angle and base frame disagree, no angle confirms a leaning frame, or two angles are stated.
    """
    arm = cell.arms.get(entry.get("name", "").lower())
    if arm is None:
        return
    help_ = "check `gravity_beta` on the controller, or state `[mounting]` in the model"
    if arm.gravity is None:
        text = f"`{arm.name}` leans by gravity_alpha and gravity_beta at once, and their order is not known"
        yield Diagnostic("KIN015", "warning", text, help=help_)
        return
    by_frame = _frame(entry)[:3, :3].T @ np.array([0.0, 0.0, -1.0])
    angle = float(np.arccos(np.clip(by_frame @ arm.gravity / GRAVITY, -1.0, 1.0)))
    leans = float(np.degrees(np.arccos(np.clip(-by_frame[2], -1.0, 1.0))))
    if not {"gravity_alpha", "gravity_beta"} & entry.keys() and leans > np.degrees(SAME_WAY) and arm.unit is None:
        text = f"`{arm.name}` leans by {leans:.0f} deg as its base frame says, and no mounting angle confirms it"
        yield Diagnostic("KIN015", "info", f"{text}: the frame is taken", help=help_)
    if angle > SAME_WAY and arm.unit is None:
        text = (
            f"`{arm.name}` hangs otherwise by its mounting angle than by its base frame ({np.degrees(angle):.0f} deg)"
        )
        yield Diagnostic("KIN015", "info", f"{text}: the angle is taken", help=help_)


def _doubt(joints: tuple[Joint, ...]) -> str:
    """Say which joint has no external axis in the backup; empty where each has one or is fixed."""
    lost = next((j.name for j in joints if j.axis is None and j.kind != "fixed"), None)
    return "" if lost is None else f"which external axis moves its joint `{lost}` is not in the backup"


def _parent(entry: Entry) -> str | None:
    """Return the name of the unit that an entry stands on; None for the world."""
    return entry.get("base_frame_coordinated") or None


def _frame(entry: Entry) -> Array:
    """Return the base frame (4, 4) [m] of an entry; all NaN where its rotation cannot be read."""
    place = np.array([_number(entry, f"base_frame_pos_{axis}") for axis in "xyz"])
    return _turned(entry, "base_frame_orient", place)


def _turn(motion: Entries, chain: Entry) -> Array:
    """Return the rotation (4, 4) of a chain's first row in its base frame, ``base_pose_rot`` of its ROBOT_TYPE."""
    kind = by_name(motion, "ROBOT_TYPE").get(chain.get("use_robot_type", "").lower(), {})
    return _turned(kind, "base_pose_rot", np.zeros(3))


def _turned(entry: Entry, key: str, place: Array) -> Array:
    """Return the frame (4, 4) at a place (3,) [m], turned by the quaternion ``key_u0`` to ``key_u3``; NaN if unread."""
    turn = np.array([_number(entry, f"{key}_u{i}", float(not i)) for i in range(4)])
    if not np.isfinite(turn).all() or not turn.any():
        return np.full((4, 4), np.nan)
    return transform(place, Rotation.from_quat(turn, scalar_first=True).as_matrix())


def _exact(angle: float) -> float:
    """Round an angle [rad] to a multiple of a quarter turn where it is within 1e-5 of one."""
    near = np.pi / 2 * round(angle / (np.pi / 2)) if np.isfinite(angle) else angle
    return near if abs(angle - near) < 1e-5 else angle


def _number(entry: Entry, key: str, default: float = 0.0) -> float:
    """Return a number of an entry; the default where the key is missing, NaN where it is no number."""
    return default if key not in entry else float(entry[key]) if _is_number(entry[key]) else np.nan


def _is_number(text: str | None) -> bool:
    """Tell whether a text is a finite number."""
    try:
        return text is not None and np.isfinite(float(text))
    except ValueError:
        return False
