"""The RAPID module with the function that corrects targets on the controller: a fixed text, its tables filled in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensation.text.marks import MODULE_MARKER
from postproc.diagnostics import PostprocError
from postproc.model.arm import Model
from postproc.rapid.evaluation.state import NO_MASS
from postproc.render.templates import environment, fill, load_template
from postproc.runtime.conditions import SINGULAR_SINE, Conditions
from postproc.runtime.tables import CorrectedModel, curves_of

MOST_LOAD = 2.0  # times what the arm carries
UNKNOWN_LOAD_KG = 1000.0
MODULE_NAME = "ppModel"
PASSES = 3
"""Times that functions of the command are put in: each shrinks what is left by their slope, 0.01 at most."""
LARGEST_TURN_DEG = 1.0
"""Correction of one joint beyond which the pose is next to a singular one: the target is returned as it came."""
LINE_LENGTH = 100  # characters
ZERO_ROUNDING = 1e-15
"""Numbers below that are rounding of a zero (cosines of right angles), and below what a single may hold."""


def module_tables(corrected: CorrectedModel, conditions: Conditions) -> dict[str, object]:
    """Values for the template of the module: header lines and all tables, as RAPID text.

    Args:
        corrected: the part of the model that is corrected at run time.
        conditions: the conditions that the module is made for.
    """
    return {
        "header": [*header(corrected, conditions)],
        "bound": number(1e3 * conditions.bound_m),
        "force": aggregate(conditions.force) if conditions.forced else "",
        "moment": aggregate(conditions.moment),
        "force_on": conditions.force_on,
        "region": [(number(a), number(b)) for a, b in np.degrees([conditions.lower, conditions.upper]).T.tolist()],
        "no_mass": number(NO_MASS),
        "most_kg": number(MOST_LOAD * (corrected.model.robot.payload or UNKNOWN_LOAD_KG)),
        "straightest": number(float(np.cos(np.arcsin(SINGULAR_SINE)))),
        "passes": PASSES,
        "largest_turn": number(LARGEST_TURN_DEG),
        **_arm(corrected),
        **_loads(corrected),
        **_bodies(corrected),
        **_curves(corrected, conditions),
    }


def runtime_module(
    tables: Mapping[str, object], errors: Sequence[str] = (), name: str = MODULE_NAME, template_dir: Path | None = None
) -> bytes:
    """The text of the module that corrects targets on the controller.

    Args:
        tables: from `module_tables`.
        errors: further lines of the header, that say how large its error is.
        name: of the module.
        template_dir: folder whose `runtime_module.j2` takes the place of the shipped one.

    Raises:
        PostprocError: RUN001, no valid RAPID name; REN001 or REN002, the template folder or the template.
    """
    if not (name.isascii() and name.isidentifier() and not name.startswith("_") and len(name) <= 32):
        text = f"`{name}` is no name of a module"
        raise PostprocError.of("RUN001", text, help="a letter, then at most 31 letters, digits and underscores")
    values = {**tables, "module": name, "marker": MODULE_MARKER, "errors": [*errors]}
    text = fill(load_template(environment(template_dir), "runtime_module.j2"), values)
    return (text.rstrip("\n") + "\n").encode("ascii", "replace")


def _frames(model: Model) -> Array:
    """Rotations (7, 3, 3) by body: the third column is the axis of its joint, in body axes; identity for the base."""
    upright = [np.eye(3)]
    for axis in model.robot.axis:
        upright.append(Rotation.align_vectors(axis[None], np.array([[0.0, 0.0, 1.0]]))[0].as_matrix())
    return np.array(upright)


def _arm(corrected: CorrectedModel) -> dict[str, object]:
    """Tables of link frames, masses, gravity, joint compliances and joint offsets, by their names in the template."""
    robot, tables, turned = corrected.model.robot, corrected.tables, _frames(corrected.model)
    mass = robot.mass + tables.mass
    first = np.einsum("bji,bj->bi", turned, robot.mass[:, None] * robot.center + tables.first_moment)
    links = []
    for b in range(7):
        R = turned[b].T @ robot.link[b][:3, :3] @ (turned[b + 1] if b < 6 else np.eye(3))
        links.append([turned[b].T @ robot.link[b][:3, 3], quaternion(R)])
    return {
        "link": aggregate(links),
        "mass": aggregate(mass),
        "first": aggregate(first),
        "gravity": aggregate(corrected.model.gravity),
        "soft": aggregate(np.degrees(tables.compliance)),
        "offset": aggregate(np.degrees(tables.offset)),
    }


def _loads(corrected: CorrectedModel) -> dict[str, object]:
    """Tables of what effects add to the stated load, and of the pulls of hoses, by their names in the template."""
    tables, turned = corrected.tables, _frames(corrected.model)
    stated = {
        "share": number(tables.share),
        "mass": number(tables.load_mass),
        "shift": aggregate(tables.shift),
        "first": aggregate(tables.load_moment),
    }
    pulls = tables.pulls
    used = tables.share or tables.load_mass or np.any(tables.shift) or np.any(tables.load_moment)
    return {
        "load": stated if used else {},
        "pulls": len(pulls),
        "pull": aggregate([[*(b + 1 for b in pull.bodies), pull.stiffness, pull.slack] for pull in pulls]),
        "pulled": aggregate(
            [[turned[b].T @ point for b, point in zip(pull.bodies, pull.points, strict=True)] for pull in pulls]
        ),
    }


def _bodies(corrected: CorrectedModel) -> dict[str, object]:
    """Tables of displacements of the ends of bodies (constant, by force, by moment), by their names in the template."""
    tables, turned = corrected.tables, _frames(corrected.model)
    both = np.zeros((7, 6, 6))
    both[:, :3, :3] = both[:, 3:, 3:] = np.swapaxes(turned, 1, 2)
    unit = np.array([1.0] * 3 + [180.0 / np.pi] * 3)
    offset = unit * np.einsum("bij,bj->bi", both, tables.body_offset)
    soft = unit[:, None] * (both @ tables.body_compliance @ np.swapaxes(both, 1, 2))
    gives = [bool(np.any(a) or np.any(b)) for a, b in zip(offset, soft, strict=True)]
    return {
        "bodies": any(gives),
        "gives": aggregate(gives),
        "shift": aggregate(offset[:, :3]),
        "tilt": aggregate(offset[:, 3:]),
        "by_force": aggregate(soft[:, :, :3]),
        "by_moment": aggregate(soft[:, :, 3:]),
        "radian": number(np.pi / 180.0),
    }


def _curves(corrected: CorrectedModel, conditions: Conditions) -> dict[str, object]:
    """Tables of the functions of one variable, a row for each and the values of all, by their names in the template."""
    curves = curves_of(corrected, conditions)
    every, at = curves.every, 1
    rows: list[list[float]] = []
    for curve in every:
        rows.append([curve.joint + 1, curve.source + 1, at, len(curve.values) - 3, curve.low, curve.step])
        at += len(curve.values)
    return {
        "rows": len(rows),
        "torques": len(curves.torque),
        "windings": len(curves.by_torque),
        "row": aggregate(rows),
        "values": at - 1,
        "value": aggregate(np.concatenate([np.zeros(0), *(curve.values for curve in every)])),
    }


def header(corrected: CorrectedModel, conditions: Conditions) -> Iterator[str]:
    """Lines of the module's header, without comment sign: model, effects, gravity, force, region, tool and load.

    Args:
        corrected: the part of the model that is corrected at run time.
        conditions: the conditions that the module is made for.
    """
    estimated = corrected.model.stiffness_source == "estimated"
    shipped = f"shipped, with a stiffness that is {'estimated by a rule' if estimated else 'published for its type'}"
    yield f"model: {conditions.source or shipped}; arm: {corrected.model.robot.name}"
    yield f"corrected: {_words(corrected.keys)}"
    if corrected.untold:
        yield f"left out, a target does not tell what they follow: {_words(corrected.untold)}"
    if corrected.unfit:
        yield f"left out, the tables below do not hold their law: {_words(corrected.unfit)}"
    for name, value in conditions.channels.items():
        yield f"constant: {name} = {value:g}"
    yield f"gravity in axes of the base [m/s2]: {_numbers(corrected.model.gravity)}"
    if conditions.forced:
        when = "on every target" if conditions.force_on == "all" else "where Weld is given"
        yield f"process force {when} [N]: {_numbers(conditions.force)}, moment [N m]: {_numbers(conditions.moment)}"
    for j, (low, high) in enumerate(np.degrees([conditions.lower, conditions.upper]).T, 1):
        yield f"region of axis {j} [deg]: {low:.6g} to {high:.6g}"
    yield (
        f"errors are stated for TCP {_numbers(1e3 * conditions.T_flange_tcp[:3, 3])} mm, {conditions.mass:g} kg "
        f"at {_numbers(1e3 * conditions.center)} mm"
    )


def number(value: float) -> str:
    """A constant in single precision as RAPID reads it: the shortest text that gives the same number.

    >>> number(-3.0165913e-07), number(9.81), number(2.0)
    ('-3.0165913E-07', '9.81', '2')
    """
    return str(np.float32(value if abs(value) > ZERO_ROUNDING else 0.0)).upper().removesuffix(".0")


def aggregate(values: object) -> str:
    """Numbers and booleans, nested, as a RAPID aggregate, broken into lines of about 100 characters."""
    text = _nested(values.tolist() if isinstance(values, np.ndarray) else values)
    lines = [""]
    for part in text.split(","):
        if len(lines[-1]) + len(part) > LINE_LENGTH:
            lines.append("")
        lines[-1] += part + ","
    return "\n        ".join(lines).removesuffix(",")


def _nested(value: object) -> str:
    """A boolean, a number or a sequence of them, as RAPID text on one line."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ",".join(map(_nested, value)) + "]"
    return number(float(value))  # type: ignore[arg-type]


def quaternion(R: Array) -> Array:
    """Quaternions (.., 4) of rotations (.., 3, 3), scalar first and not negative."""
    return np.asarray(np.roll(Rotation.from_matrix(R).as_quat(canonical=True), 1, axis=-1))


def _words(keys: Sequence[str]) -> str:
    """The keys joined by commas, or "nothing"."""
    return ", ".join(keys) or "nothing"


def _numbers(values: Array) -> str:
    """Values as a bracketed list with six significant digits."""
    return "[" + ",".join(f"{x:.6g}" for x in values) + "]"
