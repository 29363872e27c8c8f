"""A robot from a URDF file, read by pinocchio."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.files import read_source
from postproc.robot.arm import ACCELERATION, JERK, Robot
from postproc.robot.configuration import derive

ROUNDED_ANGLE_RAD = 5e-4
"""Angles [rad] so near to a multiple of an eighth of a turn stand for it: 1.5708, 3.142."""
_ANGLES = re.compile(r"(rpy\s*=\s*)([\"'])([^\"']*)\2")

_ERRORS = re.compile(r"^Error:[ \t]+([^ \t\n].*)$", re.M)


def read_urdf(path: Path) -> Robot:
    """Read the six-axis arm of a URDF file; its flange is the frame ``tool0``, else ``flange``, else the last one.

    Raises:
        PostprocError: KIN007, not a URDF or not a serial arm with six turning joints, or pinocchio is not installed.
    """
    try:
        import pinocchio
    except ImportError as error:
        help_ = "install it (conda-forge has it for every platform), or take an arm of `postproc robots list`"
        raise PostprocError.of(
            "KIN007", f"`{path}`: pinocchio reads URDF files, and it is not installed", help=help_
        ) from error
    pin: Any = pinocchio
    model, snapped = _parsed(path, pin)
    serial = all(model.parents[i] == i - 1 for i in range(1, model.njoints))
    if model.nv != 6 or model.njoints != 7 or not serial:
        raise _wrong(
            path,
            f"{model.njoints - 1} moving joints in a {'chain' if serial else 'tree'}; six in a chain are needed",
        )
    data = model.createData()
    q = pin.neutral(model)
    pin.computeJointJacobians(model, data, q)
    motion = np.array([pin.getJointJacobian(model, data, i, pin.ReferenceFrame.LOCAL)[:, i - 1] for i in range(1, 7)])
    if np.abs(motion[:, :3]).max() > 1e-12:
        raise _wrong(path, "the arm has sliding joints; six turning joints are needed")
    named = {f.name: f for f in model.frames if f.parentJoint == 6}
    flange = named.get("tool0") or named.get("flange") or list(named.values())[-1]
    link = np.array([model.jointPlacements[i].homogeneous for i in range(1, 7)] + [flange.placement.homogeneous])
    endless = np.array([model.joints[i].nq == 2 for i in range(1, 7)])
    first = np.array([model.joints[i].idx_q for i in range(1, 7)])
    turns = 2 * np.pi  # of a joint without limits, to either side: poses are drawn inside limits
    lower = np.where(endless, -turns, np.array(model.lowerPositionLimit)[first])
    upper = np.where(endless, turns, np.array(model.upperPositionLimit)[first])
    if not (lower < upper).all():
        raise _wrong(path, "a lower limit is not below its upper limit")
    speed = np.array(model.velocityLimit)
    effort = np.array(model.effortLimit)
    return Robot(
        name=str(model.name),
        link=link,
        axis=motion[:, 3:],
        lower=lower,
        upper=upper,
        speed=np.where((speed > 0) & np.isfinite(speed), speed, np.pi),
        acceleration=np.array(ACCELERATION),
        jerk=JERK * np.array(ACCELERATION),
        mass=np.array([0.0] + [i.mass for i in list(model.inertias)[1:]]),
        center=np.array([np.zeros(3)] + [i.lever for i in list(model.inertias)[1:]]),
        inertia=np.array([np.zeros((3, 3))] + [i.inertia for i in list(model.inertias)[1:]]),
        torque=effort if np.isfinite(effort).all() and (effort > 0).all() else None,
        opw=derive(link, motion[:, 3:]),
        sources={
            "robot": f"URDF {path.name}",
            "accelerations": "estimate: a URDF states none",
            **({"angles": f"{', '.join(snapped)} rad taken as multiples of an eighth of a turn"} if snapped else {}),
        },
    )


def _parsed(path: Path, pin: Any) -> tuple[Any, list[str]]:
    """Return the pinocchio model of a URDF file, and the angles that `exact_angles` rounds; KIN007 if it is none."""
    if path.suffix.lower() == ".xacro" or "<xacro:" in _text(path):
        made = f"{path.name.split('.')[0]}_made.urdf"
        text = f"`{path}` is a xacro file, a recipe for a URDF"
        raise PostprocError.of("KIN007", text, help=f"make the URDF with ROS: `xacro {path} > {made}`, and give that")
    text, snapped = exact_angles(_text(path))
    messages: list[str] = []
    try:
        with _parser_words(messages):
            return pin.buildModelFromXML(text), snapped
    except (ValueError, RuntimeError) as error:
        raise _wrong(path, f"not a URDF of a robot: {'; '.join(messages) or error}") from error


def exact_angles(text: str) -> tuple[str, list[str]]:
    """Return a URDF text with rounded multiples of pi / 4 written in full, and the angles that were rounded, sorted.

    Four digits of pi / 2 put a wrist 4 micrometres from its axis at 1 m, and no closed form finds it.
    """
    step, rounded = np.pi / 4, set()

    def written(match: re.Match[str]) -> str:
        """Return a match of an ``rpy`` attribute with its angles written in full."""
        words = match[3].split()
        for i, word in enumerate(words):
            try:
                angle = float(word)
            except ValueError:
                return match[0]
            exact = step * round(angle / step)
            if 0 < abs(angle - exact) < ROUNDED_ANGLE_RAD:
                if abs(angle - exact) > 1e-9:
                    rounded.add(word)
                words[i] = repr(float(exact))
        return f"{match[1]}{match[2]}{' '.join(words)}{match[2]}"

    return _ANGLES.sub(written, text), sorted(rounded)


@contextmanager
def _parser_words(into: list[str]) -> Iterator[None]:
    """Append to ``into`` the first error that the URDF parser (C++) writes to stderr: only there it names a joint."""
    sys.stderr.flush()
    kept = os.dup(2)
    with tempfile.TemporaryFile() as words:
        os.dup2(words.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            words.seek(0)
            into += [word.strip() for word in _ERRORS.findall(words.read().decode("utf-8", "replace"))[:1]]


def _text(path: Path) -> str:
    """Return the text of a file; KIN007 where it cannot be read."""
    return read_source(path, "KIN007").data.decode("utf-8", "replace")


def _wrong(path: Path, message: str) -> PostprocError:
    """Return the error KIN007 about a URDF file."""
    return PostprocError.of("KIN007", f"`{path}`: {message}", help="give the URDF of one six-axis arm")
