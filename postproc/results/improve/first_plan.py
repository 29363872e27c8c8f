"""Measurements to begin with: what the arm will be known to, and the sheet on which the readings are noted."""

from __future__ import annotations

import numpy as np

from postproc.diagnostics import joined
from postproc.identification.planning.setups import SetupPlan
from postproc.identification.planning.standing import from_limits
from postproc.numbers import mm, percent_range
from postproc.report.blocks import Chart, DataTable, Document, Section, Values
from postproc.report.drawing.postures import AtTool, posture_drawings
from postproc.results.improve.plan import program_sentences, program_values

SETUP_WIDTH = 210  # pixels
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
    loads = [load or "none" for load in plan.loads]
    rows = list(zip(plan.ids, *zip(*q, strict=True), loads, plan.words, [x or "" for x in change], strict=True))
    at_tool = AtTool(plan.direction, plan.load_direction, [f"{w}; {x}" for w, x in zip(plan.words, loads, strict=True)])
    drawn = Chart(
        lambda: posture_drawings(plan.model, plan.state.q, plan.ids, gauge, at_tool if gauge else None), SETUP_WIDTH
    )
    table = DataTable("set-ups", columns, rows, brief=range(len(rows))[:3], decimals=[None, *[1] * 6, None, None, 3])
    sections = [
        Section("Readings", [table]),
        Section("Postures from the side and from above" if gauge else "Postures from the side", [drawn]),
    ]
    keys = ("pose_id", "name", "load", "expected_change_mm")
    listed = zip(plan.ids, plan.names, plan.loads, [mm(x, 4) for x in plan.change], strict=True)
    values: Values = {
        "schema": "postproc/plan/1",
        "kind": plan.kind,
        "poses": len(plan.state),
        "from_limits_deg": round(float(np.degrees(from_limits(plan.model.robot, plan.state.q))), 1),
        **{f"expected_remaining_fraction_{key}": [round(x, 3) for x in share] for key, share in plan.remaining.items()},
        "joints_unknown": [j + 1 for j in plan.unknown],
        "joints_never_loaded": [j + 1 for j in plan.unloaded],
        "for": program_values(plan.programs),
        "set_ups": [dict(zip(keys, row, strict=True)) for row in listed],
    }
    title, sentence = f"postproc plan {name}", first_plan_sentence(plan)
    return Document(title=title, values=values, sentence=sentence, sections=sections)


def first_plan_sentence(plan: SetupPlan) -> str:
    """Say what share of the deflection is expected to remain before and after, and which springs stay unknown."""
    shares = plan.remaining
    before, after, load_before, load_after = map(percent_range, shares.values())
    text = f"Of the deflection of `{plan.model.robot.name}` in this region {before} is expected to remain after a "
    count = len(plan.state)
    planned = f"these {count} set-ups" if count > 1 else "this set-up"
    lines = [program_sentences(plan.programs, planned)] * bool(plan.programs)
    lines.append(
        f"{text}correction as the arm is known now, {after} with {planned}; `compensate` says it of one program."
    )
    if shares["of_loads_before"][1] > 0:
        lines.append(f"Of the deflection by the load alone it is {load_before} now, {load_after} with them.")
    if plan.kind == "gauge" and shares["of_loads_after"][1] < LINKS_MATTER * shares["after"][1]:
        what = "The weights of its links make the difference"
        lines.append(f"{what}: they are estimates, and no load on the tool tells them.")
    lines += _loads(plan)
    if plan.kind == "gauge" and 0 in plan.unloaded:
        lines.append("A weight never loads joint 1: pull sideways with a spring balance, too (`--pull N`);")
        lines.append("where no weight can be hung, alone.")
    if little := [f"joint {j + 1}" for j in plan.unknown if j not in plan.unloaded]:
        lines.append(f"They tell little more of the springs of {joined(little)}.")
    return " ".join(lines)


def _loads(plan: SetupPlan) -> list[str]:
    """Return a sentence on the mass and the pull of the set-ups and where they act; none without a load."""
    mass, wrench = float(np.max(np.asarray(plan.state.payload_mass), initial=0.0)), plan.state.wrench
    pull = 0.0 if wrench is None else float(np.abs(wrench[:, :3]).max())
    tool = "the TCP, {:g}, {:g}, {:g} mm in tool0".format(*(1e3 * plan.model.T_flange_tcp[:3, 3]).tolist())
    if not (mass or pull):
        return []
    if plan.kind != "gauge":
        return [f"The {mass:g} kg are bolted to the flange."]
    acts = f"The {mass:g} kg hang at {tool}" if mass else f"The {pull:g} N pull at {tool}"
    text = f"{acts}; there the {pull:g} N pull, too." if mass and pull else f"{acts}."
    return [
        text,
        "Measure that place to 1 cm: what acts elsewhere passes for another stiffness, and no reading shows it.",
    ]
