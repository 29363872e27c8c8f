"""Measurements to begin with: what the arm will be known to, and the sheet on which the readings are noted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.diagnostics import joined
from postproc.effects.roles import Role
from postproc.identification.planning.setups import SetupPlan
from postproc.model.uncertainty import parameter_name
from postproc.report.blocks import Chart, DataTable, Document, Figure, Section, Values
from postproc.report.drawing.postures import posture_drawings

WHAT = {
    "gauge": "readings of a dial gauge without and with the load",
    "tip": "touches of a tip",
    "plane": "touches of the faces of a cube",
    "distance": "lengths of a ball bar",
    "position": "measured positions",
}
HOW = {
    "gauge": "At each posture: set the stand where the gauge feels the tool in the stated direction, set it to zero "
    "without the load, put the load on, wait until it is still, note the reading, take the load off.",
    "tip": "At each posture: jog the tip of the tool onto the fixed tip and start; the program notes the joint angles.",
    "plane": "The program searches the cube's faces and notes the joint angles of each touch.",
    "distance": "At each posture: note the distance from the anchor to the tool centre point.",
    "position": "At each posture: measure the tool centre point.",
}
BOXES = {
    "gauge": ("without load [mm]", "with load [mm]"),
    "distance": ("distance [mm]",),
    "position": ("x [mm]", "y [mm]", "z [mm]"),
}
"""What is noted by hand at a set-up, by kind."""
DRAWING_WIDTH = 120  # pixels
LINKS_MATTER = 0.5
"""Share of what remains that is said of the links' weights."""


def first_plan_document(name: str, plan: SetupPlan) -> Document:
    """Describe a plan of first measurements, for terminal and printed sheet.

    Args:
        name: of the model, for the title.
    """
    s, columns = plan, ("", *(f"J{j} [deg]" for j in range(1, 7)), "load", "read", "expected [mm]")
    rows = [
        (i, *np.degrees(q).round(1).tolist(), load or "none", words, round(1e3 * change, 3) or "")
        for i, q, load, words, change in zip(s.ids, s.state.q, s.loads, s.words, s.change.tolist(), strict=True)
    ]
    drawn = Chart(lambda: posture_drawings(plan.model, plan.state.q, plan.ids, plan.direction), DRAWING_WIDTH)
    return Document(
        title=f"postproc plan {name}",
        values=first_plan_values(plan),
        sentence=first_plan_sentence(plan),
        figures=[Figure("set-ups", len(plan.ids))],
        basis=HOW[plan.kind],
        sections=[
            Section("Readings", [DataTable("set-ups", columns, rows, brief=range(3))]),
            Section("Postures from the side", [drawn]),
        ],
    )


def first_plan_values(plan: SetupPlan) -> Values:
    """Return the ``postproc/plan/1`` document of a plan without a table."""
    return {
        "schema": "postproc/plan/1",
        "kind": plan.kind,
        "poses": len(plan.state),
        "expected_remaining_fraction_before": _rounded(plan.before),
        "expected_remaining_fraction_after": _rounded(plan.after),
        "expected_remaining_fraction_of_link_weights": _rounded(plan.links),
        "stays_unknown": _names(plan, plan.unknown),
        "never_loaded": _names(plan, plan.unloaded),
        "set_ups": [
            {"pose_id": i, "name": name, "load": load, "expected_change_mm": round(1e3 * change, 4)}
            for i, name, load, change in zip(plan.ids, plan.names, plan.loads, plan.change.tolist(), strict=True)
        ],
    }


def first_plan_sentence(plan: SetupPlan) -> str:
    """Say what share of the deflection is expected to remain before and after, and which springs stay unknown."""
    shares = (plan.before, plan.after, plan.links)
    before, after, links = (f"{100 * low:.0f} to {100 * high:.0f} %" for low, high in shares)
    lines = [
        f"Of the deflection of `{plan.model.robot.name}` in this region {before} is expected to remain after a "
        f"correction as the arm is known now, {after} with {len(plan.state)} {WHAT[plan.kind]}."
    ]
    if plan.links[1] > LINKS_MATTER * plan.after[1]:
        lines.append(
            f"The weights of its links are estimates: these leave {links}, and no load on the tool tells them."
        )
    if 0 in plan.unloaded:
        lines.append("A weight never loads joint 1: pull sideways with a spring balance, too (`--pull N`).")
    if little := [f"joint {j + 1}" for j in plan.unknown if j not in plan.unloaded]:
        lines.append(f"The springs of {joined(little)} hardly move the tool under these loads, and stay as the type's.")
    return " ".join(lines)


def _rounded(interval: tuple[float, float]) -> list[float]:
    """Return an interval with three decimals."""
    return [round(x, 3) for x in interval]


def _names(plan: SetupPlan, joints: Sequence[int]) -> list[str]:
    """Return the names of the compliances of joints, counted from 0."""
    springs = plan.model.in_role(Role.JOINT_SPRINGS)
    assert springs is not None
    return [parameter_name(plan.model, springs.key, j) for j in joints]
