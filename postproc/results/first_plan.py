"""Measurements to begin with: what the arm will be known to, and the sheet on which the readings are noted."""

from __future__ import annotations

import numpy as np

from postproc.diagnostics import joined
from postproc.identification.planning.setups import SetupPlan
from postproc.numbers import mm
from postproc.report.blocks import Chart, DataTable, Document, Section, Values
from postproc.report.drawing.postures import posture_drawings

DRAWING_WIDTH = 105  # pixels
LINKS_MATTER = 0.5
"""Share of what remains below which that by the loads alone says how much the weights of the links matter."""


def first_plan_document(name: str, plan: SetupPlan) -> Document:
    """Describe a plan of first measurements, for terminal and printed sheet.

    Args:
        name: of the model, for the title.
    """
    gauge, angles = plan.kind == "gauge", [f"J{j} [deg]" for j in range(1, 7)]
    columns = ("", *angles, "load", "grows towards" if gauge else "touched", "expected [mm]")
    change, q = (1e3 * plan.change).round(3).tolist(), np.degrees(plan.state.q).round(1).tolist()
    listed = zip(plan.ids, q, plan.loads, plan.words, change, strict=True)
    rows = [(name, *posture, load or "none", words, off or "") for name, posture, load, words, off in listed]
    drawn = Chart(lambda: posture_drawings(plan.model, plan.state.q, plan.ids, gauge * plan.direction), DRAWING_WIDTH)
    return Document(
        title=f"postproc plan {name}",
        values=first_plan_values(plan),
        sentence=first_plan_sentence(plan),
        sections=[
            Section("Readings", [DataTable("set-ups", columns, rows, brief=range(3))]),
            Section("Postures from the side", [drawn]),
        ],
    )


def first_plan_values(plan: SetupPlan) -> Values:
    """Return the ``postproc/plan/1`` document of a plan without a table."""
    remains = {"before": plan.before, "after": plan.after}
    remains |= {"of_loads_before": plan.load_before, "of_loads_after": plan.load_after}
    listed = zip(plan.ids, plan.names, plan.loads, plan.change.tolist(), strict=True)
    return {
        "schema": "postproc/plan/1",
        "kind": plan.kind,
        "poses": len(plan.state),
        **{f"expected_remaining_fraction_{key}": [round(x, 3) for x in share] for key, share in remains.items()},
        "joints_unknown": [j + 1 for j in plan.unknown],
        "joints_never_loaded": [j + 1 for j in plan.unloaded],
        "set_ups": [
            {"pose_id": i, "name": name, "load": load, "expected_change_mm": mm(change, 4)}
            for i, name, load, change in listed
        ],
    }


def first_plan_sentence(plan: SetupPlan) -> str:
    """Say what share of the deflection is expected to remain before and after, and which springs stay unknown."""
    shares = (plan.before, plan.after, plan.load_before, plan.load_after)
    before, after, load_before, load_after = (f"{100 * low:.0f} to {100 * high:.0f} %" for low, high in shares)
    lines = [
        f"Of the deflection of `{plan.model.robot.name}` in this region {before} is expected to remain after a "
        f"correction as the arm is known now, {after} with these {len(plan.state)} set-ups."
    ]
    if plan.load_before[1] > 0:
        lines.append(f"Of the deflection by the load alone it is {load_before} now, {load_after} with them.")
    if plan.kind == "gauge" and plan.load_after[1] < LINKS_MATTER * plan.after[1]:
        lines.append(
            "The weights of its links make the difference: they are estimates, and no load on the tool tells them."
        )
    if plan.kind == "gauge" and 0 in plan.unloaded:
        lines.append("A weight never loads joint 1: pull sideways with a spring balance, too (`--pull N`).")
    if little := [f"joint {j + 1}" for j in plan.unknown if j not in plan.unloaded]:
        lines.append(f"They tell little more of the springs of {joined(little)}.")
    return " ".join(lines)
