"""The catalogue of arms: robots by name, from a TOML file of the same form, or from a URDF."""

from __future__ import annotations

import re
from dataclasses import replace
from os.path import isfile  # unlike Path.is_file it takes any text for a name
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError, Severity, Source, did_you_mean
from postproc.files import read_source
from postproc.rapid.data.records import Vec3
from postproc.robot.arm import ACCELERATION, JERK, AccelerationSource, Drives, Robot
from postproc.robot.configuration import derive
from postproc.robot.kinematics import body_poses
from postproc.robot.pose import rpy, transform
from postproc.robot.type_names import ARMS, library_name
from postproc.tomlfile import FileTable, Place, Positive, check, locate, parse_toml, span_of

SHORTEST, LONGEST = 0.1, 20.0
"""Sum of the links' lengths [m] of arms that exist, with a margin."""
Six = Annotated[list[float], Field(min_length=6, max_length=6)]
Factor = Annotated[float, Field(ge=1)]
Three = Annotated[list[Annotated[float, Field(ge=0)]], Field(min_length=3, max_length=3)]
PositiveSix = Annotated[list[Positive], Field(min_length=6, max_length=6)]


GUESSED = {"joints": "not stated: two turns and 180 deg/s are taken, accelerations and jerks are estimates"}


class _Chain(FileTable):
    """The chain at zero, in base axes.

    Args:
        origin_mm: of each joint from the one before.
        axis: of each joint.
        origin_rpy_deg: turn of each joint's frame.
        flange_mm, flange_rpy_deg: tool0 from joint 6.
        parallelogram: axis 3 is the pitch of the forearm.
    """

    origin_mm: Annotated[list[Place], Field(min_length=6, max_length=6)]
    axis: Annotated[list[Vec3], Field(min_length=6, max_length=6)]
    origin_rpy_deg: Annotated[list[Vec3], Field(min_length=6, max_length=6)] | None = None
    flange_mm: Place = (0.0, 0.0, 0.0)
    flange_rpy_deg: Vec3 = (0.0, 0.0, 0.0)
    parallelogram: bool = False


class _Dh(FileTable):
    """Standard Denavit-Hartenberg table.

    Args:
        a_mm: link lengths.
        d_mm: link offsets.
        alpha_deg: link twists.
        theta_offset_deg: joint angles at zero.
    """

    a_mm: Six
    d_mm: Six
    alpha_deg: Six
    theta_offset_deg: Six = [0.0] * 6


class _Joints(FileTable):
    """Limits, and springs where they are known.

    Args:
        limits_deg: lowest and highest angle of each joint.
        speed_deg_per_s, acceleration_rad_per_s2, jerk_rad_per_s3, torque_Nm: largest of each joint.
        acceleration_source: logged on an arm of the type, stated by somebody who knows it, or estimated.
        rotor_inertia_ratio: of axes 1 to 3, inertia of motor and gear over that of the links at the zero pose; with it
            their acceleration is that at the zero pose without payload, and follows the inertia elsewhere.
        stiffness_Nm_per_rad: of each joint's spring.
        stiffness_source: measured on an arm of the type, or estimated.
        stiffness_factor: within which 95 % of the arms lie about it.
    """

    limits_deg: Annotated[list[tuple[float, float]], Field(min_length=6, max_length=6)] = [(-360.0, 360.0)] * 6
    speed_deg_per_s: PositiveSix = [180.0] * 6
    acceleration_rad_per_s2: PositiveSix = ACCELERATION
    acceleration_source: AccelerationSource = "stated"
    jerk_rad_per_s3: PositiveSix | None = None
    rotor_inertia_ratio: Three | None = None
    torque_Nm: PositiveSix | None = None
    stiffness_Nm_per_rad: PositiveSix | None = None
    stiffness_source: Literal["measured", "estimated"] = "measured"
    stiffness_factor: Annotated[list[Factor], Field(min_length=6, max_length=6)] | None = None


class _Body(FileTable):
    """A body, from the pedestal to the flange.

    Args:
        mass_kg: its mass.
        center_mm: of mass.
        gyration_mm: radius of gyration.
        inertia_kg_m2: xx, yy, zz, xy, xz, yz about the centre.
    """

    mass_kg: Annotated[float, Field(ge=0)]
    center_mm: Place = (0.0, 0.0, 0.0)
    gyration_mm: Annotated[float, Field(ge=0)] = 0.0
    inertia_kg_m2: Annotated[list[float], Field(min_length=6, max_length=6)] | None = None


class _Bodies(FileTable):
    """Masses.

    Args:
        center_frame: in which centres are given.
        mass_factor: one standard deviation of each mass.
        body: seven, the pedestal first.
    """

    center_frame: Literal["body", "base_at_zero", "dh"] = "body"
    mass_factor: Annotated[list[Factor], Field(min_length=7, max_length=7)] | None = None
    body: Annotated[list[_Body], Field(min_length=7, max_length=7)] = [_Body(mass_kg=0.0)] * 7


class _Controller(FileTable):
    """What controllers call it.

    Args:
        types: names in ``MOC.cfg``.
    """

    types: list[str] = []


class RobotFile(FileTable):
    """One arm as its maker describes it.

    Args:
        name, description: for people.
        payload_kg, repeatability_mm, reach_mm: of the data sheet.
        mounting: ways in which it may stand.
        chain: the geometry.
        dh: the same as a Denavit-Hartenberg table.
        joints: limits, speeds and springs.
        bodies: masses.
        controller: what controllers call it.
    """

    name: Annotated[str, Field(min_length=1)] | None = None
    description: str = ""
    payload_kg: Positive | None = None
    repeatability_mm: Positive | None = None
    reach_mm: Positive | None = None
    mounting: list[str] = []
    chain: _Chain | None = None
    dh: _Dh | None = None
    joints: _Joints = _Joints()
    bodies: _Bodies = _Bodies()
    controller: _Controller = _Controller()


def list_robots() -> list[str]:
    """Return the names of the robots in the library, sorted."""
    return sorted(path.stem for path in ARMS.glob("*.toml"))


def load_robot(name_or_path: str | Path) -> Robot:
    """Load a robot by library name, or from a robot TOML or URDF file.

    Raises:
        PostprocError: KIN006 unknown name, KIN007 a file that does not describe a six-axis arm, KIN012 an arm with a
            parallelogram, whose kinematics is not computed.
    """
    robot = describe_robot(name_or_path)
    if robot.parallelogram:
        text = f"axes 2 and 3 of `{robot.name}` are coupled by a parallelogram, which is not computed"
        help_ = "leave its programs out, in a batch by `only` of a jobs file; `postproc robots show` has its numbers"
        raise PostprocError.of("KIN012", text, help=help_)
    return robot


def describe_robot(name_or_path: str | Path) -> Robot:
    """Load a robot like `load_robot`, but also an arm with a parallelogram, whose kinematics is not computed.

    Raises:
        PostprocError: KIN006 unknown name, KIN007 a file that does not describe a six-axis arm.
    """
    path = ARMS / f"{name_or_path}.toml"
    if not isfile(path) or Path(name_or_path).name != str(name_or_path):
        path = Path(name_or_path)
    if path.suffix.lower() in (".urdf", ".xml", ".xacro") and isfile(path):
        from postproc.robot.urdf import read_urdf

        return read_urdf(path)
    if path.suffix.lower() != ".toml" or not isfile(path):
        what = "robot file" if path.suffix.lower() in (".toml", ".urdf", ".xml", ".xacro") else "robot"
        called = library_name(str(name_or_path))
        near = (
            f"the library calls it `{called}`"
            if called is not None
            else did_you_mean(str(name_or_path), list_robots(), 3)
        )
        help_ = "; ".join(filter(None, (near, "`postproc robots list` has all names; or give a robot TOML or URDF")))
        raise PostprocError.of("KIN006", f"there is no {what} `{name_or_path}`", help=help_)
    source = read_source(path, "KIN007")
    return read_robot(source)


def doubts(robot: Robot) -> list[Diagnostic]:
    """Return diagnostics on a doubtful arm: no masses or odd lengths (KIN010), rounded angles of its URDF (KIN013)."""
    findings = [no_masses(robot)] if not robot.mass.any() else []
    if "angles" in robot.sources:
        text = f"`{robot.name}`: angles of its URDF are rounded, {robot.sources['angles']}"
        findings.append(
            Diagnostic("KIN013", "info", text, help="nothing to do, where the arm is built at right angles")
        )
    reach = float(np.linalg.norm(robot.link[:, :3, 3], axis=1).sum())
    if not SHORTEST < reach < LONGEST:
        text = f"the links of `{robot.name}` are {reach:.4g} m long, one after another"
        findings.append(Diagnostic("KIN010", "warning", text, help="lengths are in m in a URDF, in mm in a TOML"))
    return findings


def no_masses(robot: Robot, severity: Severity = "warning") -> Diagnostic:
    """Return the diagnostic KIN010 for an arm on which nothing has a mass."""
    text = f"`{robot.name}` has no masses: no weight bends it, and springs cannot be told from measurements"
    return Diagnostic("KIN010", severity, text, help="give `<inertial>` in a URDF, `mass_kg` in a TOML")


def read_robot(source: Source) -> Robot:
    """Build a robot from the text of a robot TOML file.

    Raises:
        PostprocError: KIN007, at the key that does not fit.
    """
    file = check(RobotFile, parse_toml(source, "KIN007"), source, "KIN007")
    link, axis = _geometry(file, source)
    joints, bodies = file.joints, file.bodies.body
    lower, upper = np.radians(np.array(joints.limits_deg, dtype=float)).T
    if not (lower < upper).all():
        raise _wrong(
            "`joints.limits_deg`: a lower limit is not below its upper limit", source, ("joints", "limits_deg")
        )
    center = _centers(file, link, axis)
    inertia = np.array([_inertia(b) for b in bodies])
    acceleration = np.array(joints.acceleration_rad_per_s2)
    is_stated = "acceleration_rad_per_s2" in joints.model_fields_set
    robot = Robot(
        name=file.name or Path(source.path).stem,
        link=link,
        axis=axis,
        lower=lower,
        upper=upper,
        speed=np.radians(joints.speed_deg_per_s),
        acceleration=acceleration,
        acceleration_source=joints.acceleration_source if is_stated else "estimated",
        jerk=JERK * acceleration if joints.jerk_rad_per_s3 is None else np.array(joints.jerk_rad_per_s3),
        mass=np.array([b.mass_kg for b in bodies]),
        center=center,
        inertia=inertia,
        torque=_array(joints.torque_Nm),
        joint_compliance=None if joints.stiffness_Nm_per_rad is None else 1.0 / np.array(joints.stiffness_Nm_per_rad),
        opw=derive(link, axis),
        payload=file.payload_kg,
        repeatability=None if file.repeatability_mm is None else 1e-3 * file.repeatability_mm,
        stiffness_source=None if joints.stiffness_Nm_per_rad is None else joints.stiffness_source,
        stiffness_factor=_array(joints.stiffness_factor),
        mass_factor=_array(file.bodies.mass_factor),
        parallelogram=file.chain is not None and file.chain.parallelogram,
        reach=None if file.reach_mm is None else 1e-3 * file.reach_mm,
        mounting=tuple(file.mounting),
        sources={**_guessed(file), **_sources(source)},
    )
    if joints.rotor_inertia_ratio is None:
        return robot
    links = _link_inertia(robot)[:3]
    if not links.all():
        raise _wrong("`joints.rotor_inertia_ratio` needs the masses of the bodies", source, ("joints",))
    rotor = np.array(joints.rotor_inertia_ratio) * links
    return replace(robot, drives=Drives(acceleration[:3] * (links + rotor), rotor))


def _link_inertia(robot: Robot) -> Array:
    """Return the inertia (6,) [kg m^2] that the bodies beyond each joint have about its axis, at the zero pose."""
    T = body_poses(robot, np.zeros((1, 6)))[0]
    R, p = T[1:, :3, :3], T[1:, :3, 3]
    axes = np.einsum("jab,jb->ja", R, robot.axis)
    centers = np.einsum("bij,bj->bi", R, robot.center[1:]) + p
    result = np.zeros(6)
    for j, axis in enumerate(axes):
        local = np.einsum("bki,k->bi", R, axis)
        turning = np.einsum("bi,bij,bj->b", local, robot.inertia[1:], local)
        arm = np.cross(axis, centers - p[j])
        result[j] = (turning + robot.mass[1:] * np.sum(arm * arm, axis=1))[j:].sum()
    return result


def _array(values: list[float] | None) -> Array | None:
    """Return the values as an array, or None for None."""
    return None if values is None else np.array(values)


def _geometry(file: RobotFile, source: Source) -> tuple[Array, Array]:
    """Return link transforms (7, 4, 4) and unit axes (6, 3) of the file's one [chain] or [dh] table; else KIN007."""
    if (file.chain is None) == (file.dh is None):
        raise _wrong("a robot needs either a [chain] or a [dh] table", source, ())
    if file.dh is not None:
        return dh_chain(
            *(np.array(v) for v in (file.dh.a_mm, file.dh.d_mm, file.dh.alpha_deg, file.dh.theta_offset_deg))
        )
    assert file.chain is not None
    chain = file.chain
    angles = np.radians(np.array([*(chain.origin_rpy_deg or [(0.0, 0.0, 0.0)] * 6), chain.flange_rpy_deg]))
    origins = np.array([*chain.origin_mm, chain.flange_mm]) * 1e-3
    axis = np.array(chain.axis, dtype=float)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    if (length < 1e-9).any():
        raise _wrong("`chain.axis`: an axis has no direction", source, ("chain", "axis"))
    return transform(origins, np.array([rpy(a) for a in angles])), axis / length


def dh_chain(a_mm: Array, d_mm: Array, alpha_deg: Array, offset_deg: Array) -> tuple[Array, Array]:
    """Return link transforms (7, 4, 4) [m] and axes (6, 3) of a standard Denavit-Hartenberg table.

    T_i = Rot_z(theta_i + offset_i) Trans_z(d_i) Trans_x(a_i) Rot_x(alpha_i) (seed paper, Eq. 2b corrected).

    Args:
        a_mm, d_mm, alpha_deg, offset_deg: (6,) link lengths, link offsets, link twists, and joint angles at zero.
    """
    link = np.tile(np.eye(4), (7, 1, 1))
    for i in range(6):
        offset = transform(np.zeros(3), rpy(np.array([0.0, 0.0, np.radians(offset_deg[i])])))
        turn = rpy(np.array([np.radians(alpha_deg[i]), 0.0, 0.0]))
        twist = transform(np.array([a_mm[i], 0.0, d_mm[i]]) * 1e-3, turn)
        # A turn about z commutes with the joint, so the zero offset may stand after it.
        link[i + 1] = offset @ twist
    return link, np.tile([0.0, 0.0, 1.0], (6, 1))


def _centers(file: RobotFile, link: Array, axis: Array) -> Array:
    """Return the centres of mass (7, 3) [m] in body axes; ``link`` and ``axis``, as in `Robot`, convert them."""
    center = np.array([b.center_mm for b in file.bodies.body]) * 1e-3
    if file.bodies.center_frame == "body":
        return center
    if file.bodies.center_frame == "dh":  # frame i stands at the far end of link i
        return np.einsum("bij,bj->bi", link[:, :3, :3], center) + link[:, :3, 3]
    six, seven = np.zeros(6), np.zeros(7)
    zero = Robot("zero", link, axis, six, six, six, six, six, seven, seven, seven)
    T = body_poses(zero, np.zeros((1, 6)))[0]
    return np.einsum("bji,bj->bi", T[:, :3, :3], center - T[:, :3, 3])


def _inertia(body: _Body) -> Array:
    """Return the inertia (3, 3) [kg m^2] of a body: as stated, else mass times radius of gyration squared."""
    if body.inertia_kg_m2 is not None:
        xx, yy, zz, xy, xz, yz = body.inertia_kg_m2
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.eye(3) * body.mass_kg * (body.gyration_mm * 1e-3) ** 2


def _guessed(file: RobotFile) -> dict[str, str]:
    """Return ``robot.sources`` entries for joint limits and rates that are not stated, and for estimated stiffness."""
    guesses = {} if "joints" in file.model_fields_set else dict(GUESSED)
    for key in ("acceleration_rad_per_s2", "jerk_rad_per_s3"):
        if "joints" in file.model_fields_set and key not in file.joints.model_fields_set:
            guesses[f"joints.{key}"] = "estimate: the file states none"
    if file.joints.stiffness_source == "estimated":
        guesses["joints.stiffness_Nm_per_rad"] = "estimate, by the file's stiffness_source"
    return guesses


def _sources(source: Source) -> dict[str, str]:
    """Return, by dotted key (``joints.limits_deg``), the comment behind each value, on the last line of the value."""
    text = source.data.decode("utf-8-sig")
    sources = {}
    for keys, (_, (start, end)) in locate(text).items():
        last = text[max(start, text.rfind("\n", 0, end)) :].lstrip("\n").partition("\n")[0]
        comment = re.sub(r'"[^"]*"', "", last).partition("#")[2].strip()
        if comment:
            sources[".".join(map(str, keys))] = comment
    return sources


def _wrong(message: str, source: Source, keys: tuple[str, ...]) -> PostprocError:
    """Return the error KIN007 at the key with this path in the file; at no place where the path is empty."""
    return PostprocError.of("KIN007", message, source, span_of(source, keys) if keys else None)
