"""The arms and the effects of the library, what is known of one, and what the conformance kit says of others."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, has_errors
from postproc.effects.base import Effect
from postproc.effects.findings import origin
from postproc.report.blocks import DataTable, Document, Section, attributes
from postproc.robot.arm import Robot


def robots_document(robots: Sequence[Robot]) -> Document:
    """Describe the arms of the library."""
    known = [f"stiffness of the type {robot.stiffness_source or 'unknown'}" for robot in robots]
    rows = [(robot.name, stiffness, _use(robot)) for robot, stiffness in zip(robots, known, strict=True)]
    return Document(
        title="postproc robots list",
        values={"schema": "postproc/robots/1", "robots": [_robot_values(robot) for robot in robots]},
        sentence="",
        sections=[Section("", [DataTable("arms", ("", "", ""), rows)])],
    )


def robot_document(robot: Robot) -> Document:
    """Describe one arm, with the source of each number."""
    rows = _known(robot)
    known = [{"quantity": quantity, "status": status, "source": source} for quantity, status, _, source in rows]
    unread = robot.sources.get("absolute_accuracy.unread")
    return Document(
        title=f"postproc robots show {robot.name}",
        values={"schema": "postproc/robot/1", **_robot_values(robot), "known": known, "sources": dict(robot.sources)},
        sentence=f"{robot.name}: {'; mounting: '.join(filter(None, (_use(robot), ', '.join(robot.mounting))))}",
        basis=f"not read, for their axes and frames are not published: {unread}" if unread else "",
        sections=[Section("", [DataTable("known", ("", "", "", ""), rows, beneath=3)])],
    )


def _use(robot: Robot) -> str:
    """Say what can be computed for an arm."""
    if robot.parallelogram:
        return "parallelogram: described, not computed"
    return "spherical wrist" if robot.opw is not None else "forward models and fitting only"


def _known(robot: Robot) -> list[tuple[str, str, str, str]]:
    """Return rows of quantity, status (``known``, ``estimated`` or ``unknown``), values and source."""
    limits, estimates = ("joints.limits_deg", "joints", "robot"), ("joints", "accelerations")
    offsets = np.linalg.norm(robot.link[:, :3, 3], axis=1) * 1e3
    stiffness = None if robot.joint_compliance is None else 1.0 / robot.joint_compliance
    torque, rotor = (None, None) if robot.drives is None else (robot.drives.torque, robot.drives.rotor)
    table: list[tuple[str, Array | float | None, tuple[str, ...]]] = [
        ("payload [kg]", robot.payload, ("payload_kg",)),
        ("reach to the wrist [mm]", None if robot.reach is None else 1e3 * robot.reach, ("reach_mm",)),
        ("offsets of the axes [mm]", offsets, ("chain.origin_mm", "dh.a_mm", "robot")),
        ("lower limit [deg]", np.degrees(robot.lower), limits),
        ("upper limit [deg]", np.degrees(robot.upper), limits),
        ("speed [deg/s]", np.degrees(robot.speed), ("joints.speed_deg_per_s", "joints", "robot")),
        ("acceleration [rad/s^2]", robot.acceleration, ("joints.acceleration_rad_per_s2", *estimates)),
        ("torque that accelerates axes 1 to 3 [N m]", torque, ("joints.acceleration_rad_per_s2",)),
        ("rotor inertia of axes 1 to 3 [kg m^2]", rotor, ("joints.rotor_inertia_ratio",)),
        ("jerk [rad/s^3]", robot.jerk, ("joints.jerk_rad_per_s3", *estimates)),
        ("torque [N m]", robot.torque, ("joints.torque_Nm", "robot")),
        ("stiffness [N m/rad]", stiffness, ("joints.stiffness_Nm_per_rad",)),
        ("within a factor of (95 %)", robot.stiffness_factor, ("joints.stiffness_factor",)),
        ("mass of bodies [kg]", robot.mass if robot.mass.any() else None, ("bodies.body", "robot")),
        ("within a factor of (68 %)", robot.mass_factor, ("bodies.mass_factor",)),
    ]
    rows = []
    for quantity, values, keys in table:
        source = next((robot.sources[key] for key in keys if key in robot.sources), "") if values is not None else ""
        status = "estimated" if "estimate" in source or "DISPUTED" in source else "known"
        text = "".join(f"{v:10.5g}" for v in np.atleast_1d(values)) if values is not None else ""
        rows.append((quantity, status if values is not None else "unknown", text, source))
    return rows


def _robot_values(robot: Robot) -> dict[str, Any]:
    """Return the entry of an arm in a document."""
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
        **attributes(robot, "stiffness_source", "stiffness_factor"),
        "mass_kg": robot.mass,
        "mass_factor": robot.mass_factor,
    }


PARAMETERS = ("parameter", "shape", "from", "to", "ordinary size", "vanishes at", "only forms it")


def effects_document(library: Iterable[type[Effect]]) -> Document:
    """Describe the library: key and title of each effect."""
    rows = [(cls.key, cls.title) for cls in library]
    return Document(
        title="postproc effects list",
        values={"schema": "postproc/effects/1", "effects": [_effect_values(cls) for cls in library]},
        sentence="",
        sections=[Section("", [DataTable("effects", ("", ""), rows)])],
    )


def effect_document(cls: type[Effect], stated: Effect | None = None) -> Document:
    """Describe an effect: equation, source, parameters, channels it reads, and effects that it is confused with.

    Args:
        stated: the effect of a model, of which the law in symbols or the values are shown; None where nobody asks.
    """
    law = [] if stated is None else list(stated.symbols())
    if stated is not None and not law:
        law = [f"{name} = {x:g}" for name, x in zip(stated.names(), stated.vector(), strict=True)]
    rows = []
    for name, meta in cls.parameters().items():
        # Each row has a unit of its own: no number of decimals suits all.
        limits = [f"{x:g}" if np.isfinite(x) else None for x in (meta.low, meta.high)]
        null = (f"{meta.null:g}", None) if meta.amplitude else (None, f"{meta.null:g} unless said")
        shape = " x ".join(map(str, meta.shape)) or "1"
        rows.append((f"{name} [{meta.unit}]", shape, *limits, f"{meta.typical:g}", *null))
    structures = [(name, "chosen by search", None, None, None, None, None) for name in cls.structures()]
    similar = DataTable("alike", ("effect", "to tell them apart"), list(cls.confused_with.items()))
    return Document(
        title=f"postproc effects show {cls.key}",
        values={"schema": "postproc/effect/1", **_effect_values(cls), "in_model": law},
        sentence=f"{cls.key}: {inspect.cleandoc(cls.__doc__ or '')}",
        sections=[
            Section("Parameters", [DataTable("parameters", PARAMETERS, [*rows, *structures])]),
            Section("Reads", [f"  {', '.join(cls.reads)}"]),
            Section("Is confused with", [similar]),
            Section("In the model", [f"  {line}" for line in law]),
        ],
    )


def check_document(classes: Sequence[type[Effect]], findings: Sequence[Diagnostic]) -> Document:
    """Describe what the conformance kit found in the effects of a file."""
    doubt = ", if what is told above is meant so" if findings else ""
    fit = [] if has_errors(findings) else [f"{cls.key}: fit for every command{doubt}" for cls in classes]
    return Document(
        title="postproc effects check",
        values={
            "schema": "postproc/effects-check/1",
            "effects": [cls.key for cls in classes],
            "diagnostics": [finding.as_json() for finding in findings],
        },
        sentence="\n".join(fit),
    )


def _effect_values(cls: type[Effect]) -> dict[str, Any]:
    """Return the entry of an effect in a document."""
    return {
        "key": cls.key,
        "title": cls.title,
        "reads": cls.reads,
        "parameters": {name: {"unit": meta.unit, "null": meta.null} for name, meta in cls.parameters().items()},
        "confused_with": cls.confused_with,
        "origin": origin(cls),
    }
