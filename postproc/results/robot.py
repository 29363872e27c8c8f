"""The arms of the library, and what is known of one, with the source of each number."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.report.blocks import DataTable, Document, Section
from postproc.robot.arm import Robot


def robots_document(robots: Sequence[Robot]) -> Document:
    """Describe the arms of the library."""
    rows = [(robot.name, f"stiffness {robot.stiffness_source or 'unknown'}", _use(robot)) for robot in robots]
    return Document(
        title="postproc robots list",
        values={"schema": "postproc/robots/1", "robots": [_values(robot) for robot in robots]},
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
        values={"schema": "postproc/robot/1", **_values(robot), "known": known, "sources": dict(robot.sources)},
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
    table: list[tuple[str, Array | float | None, tuple[str, ...]]] = [
        ("payload [kg]", robot.payload, ("payload_kg",)),
        ("reach to the wrist [mm]", None if robot.reach is None else 1e3 * robot.reach, ("reach_mm",)),
        (
            "offsets of the axes [mm]",
            np.linalg.norm(robot.link[:, :3, 3], axis=1) * 1e3,
            ("chain.origin_mm", "dh.a_mm", "robot"),
        ),
        ("lower limit [deg]", np.degrees(robot.lower), limits),
        ("upper limit [deg]", np.degrees(robot.upper), limits),
        ("speed [deg/s]", np.degrees(robot.speed), ("joints.speed_deg_per_s", "joints", "robot")),
        ("acceleration [rad/s^2]", robot.acceleration, ("joints.acceleration_rad_per_s2", *estimates)),
        ("jerk [rad/s^3]", robot.jerk, ("joints.jerk_rad_per_s3", *estimates)),
        ("torque [N m]", robot.torque, ("joints.torque_Nm", "robot")),
        (
            "stiffness [N m/rad]",
            None if robot.joint_compliance is None else 1.0 / robot.joint_compliance,
            ("joints.stiffness_Nm_per_rad",),
        ),
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


def _values(robot: Robot) -> dict[str, Any]:
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
        "stiffness_source": robot.stiffness_source,
        "stiffness_factor": robot.stiffness_factor,
        "mass_kg": robot.mass,
        "mass_factor": robot.mass_factor,
    }
