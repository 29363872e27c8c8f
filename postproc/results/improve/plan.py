"""The next poses to measure: what they will do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from postproc.diagnostics import joined
from postproc.identification.planning.plan import Alternative, MeasuringPlan
from postproc.identification.planning.promise import Promise
from postproc.identification.planning.standing import from_limits
from postproc.identification.planning.weld_targets import WeldTargets
from postproc.model.uncertainty.prediction import parameter_name
from postproc.numbers import on_arm_text
from postproc.report.blocks import Block, Chart, DataTable, Document, Figure, Section, Values
from postproc.report.drawing.postures import posture_drawings
from postproc.results.wording import parameters_text

DRAWN = "Each posture from the side, the tool on the right, and from above, the base's x on the right."
Programs = Sequence[tuple[WeldTargets, list[float]]]
"""Programs, each with the interval [mm] that is expected where it welds once the plan is measured."""
HARDLY_LOWER = 0.9
"""Share of what is expected now above which planned measurements hardly lower it."""
OPEN = "most of it is what no effect of the model explains (`postproc diagnose`), or what such measurements do not tell"
DECIMALS = 2
"""Of a deviation that is expected [mm], as `compensate` prints it."""
DRAWING_WIDTH = 170
"""Pixels of a posture on the page."""
STOPPED = "A simulation ends as soon as it is clear that nine of ten tables are not reached."


def plan_document(name: str, plan: MeasuringPlan) -> Document:
    """Describe a plan of poses to measure.

    Args:
        name: of the model and the tables, for the title.
    """
    figures, sections = [], []
    if plan.promise is not None:
        figures = [Figure("simulated tables that tell them apart", _share(plan.promise))]
        rows = [(_poses(plan, other), _share(other.promise)) for other in plan.alternatives]
        columns = ("measured", "simulated tables that tell them apart")
        sections = [Section("What else was simulated", [DataTable("alternatives", columns, rows)], STOPPED)]
    sentence = " ".join(filter(None, (plan_sentence(plan), _loads(plan))))
    title, poses = f"postproc plan {name}", Section("Poses", _poses_blocks(plan), DRAWN)
    near = int(np.floor(np.degrees(from_limits(plan.fit.model.robot, plan.state.q)) + 1e-6))
    basis = (
        f"Every joint stays {near} deg or more from its limits." if near >= 0 else "Some poses are beyond the limits."
    )
    return Document(
        title=title,
        values=plan_values(plan),
        sentence=sentence,
        figures=figures,
        basis=basis,
        sections=[poses, *sections],
    )


def _poses_blocks(plan: MeasuringPlan) -> list[Block]:
    """Return the drawings of the poses, and their table."""
    state, model = plan.state, plan.fit.model
    drawn = Chart(lambda: posture_drawings(model, state.q, plan.ids, above=True), DRAWING_WIDTH)
    angles = np.degrees(state.q).round(1).T.tolist()
    loads = [None] * len(state) if state.payload_mass is None else state.payload_mass.round(3).tolist()
    places = ["{:.0f}, {:.0f}, {:.0f}".format(*p) for p in 1e3 * plan.T_base_tcp[:, :3, 3]]
    digits = [None, *[1] * 6, None, None]
    columns = ("", *(f"J{j} [deg]" for j in range(1, 7)), "payload [kg]", "TCP [mm]")
    return [
        drawn,
        DataTable(
            "poses", columns, list(zip(plan.ids, *angles, loads, places, strict=True)), brief=(), decimals=digits
        ),
    ]


def plan_values(plan: MeasuringPlan) -> dict[str, Any]:
    """Return the ``postproc/plan/1`` document."""
    return {
        "schema": "postproc/plan/1",
        "poses": len(plan.state),
        "from_limits_deg": round(float(np.degrees(from_limits(plan.fit.model.robot, plan.state.q))), 1),
        "between": None if plan.between is None else list(plan.between),
        "told_apart": plan.resolved,
        "promise": None if plan.promise is None else asdict(plan.promise),
        "alternatives": [
            {"poses": a.poses, "payloads_kg": list(a.payloads), "force_N": round(a.force, 1)} | asdict(a.promise)
            for a in plan.alternatives
        ],
        "before": round(plan.before, 3),
        "after": round(plan.after, 3),
        "worst_determined": [parameter_name(plan.fit.model, *entry) for entry in plan.worst],
        "no_pose_determines": [parameter_name(plan.fit.model, *entry) for entry in plan.never],
        "for": program_values(plan.programs),
    }


def program_values(programs: Programs) -> list[Values]:
    """Return the entries of ``for``: programs, and the largest deviation expected where they weld, now and then."""
    return [
        {
            "program": one.program,
            "weld_targets": len(one.state),
            "expected_on_arm_mm": one.expected_mm,
            "expected_on_arm_mm_after": after,
        }
        for one, after in programs
    ]


def program_sentences(programs: Programs, measured: str) -> str:
    """Say what is expected on the arm where programs weld, now and with planned measurements.

    Args:
        measured: what is planned, such as ``these 6 set-ups``.
    """
    lines = []
    for one, after in programs:
        now = "how near the arm comes is not known now"
        if one.expected_mm is not None:
            now = f"{on_arm_text(one.expected_mm, DECIMALS)} are expected on the arm now"
        lines.append(f"Where `{one.program}` welds, {now}, {on_arm_text(after, DECIMALS)} with {measured}.")
        if one.expected_mm is not None and after[1] > HARDLY_LOWER * one.expected_mm[1]:
            lines.append(f"That is hardly less: {OPEN}.")
    return " ".join(lines)


def plan_sentence(plan: MeasuringPlan) -> str:
    """Say how well the poses tell two effects apart, or determine the parameters that are least known."""
    n = len(plan.state)
    if plan.programs:
        return program_sentences(plan.programs, f"these {n} poses")
    if plan.between is not None and plan.promise is not None:
        return _promised(plan, plan.promise, plan.between)
    never = f" No pose determines {parameters_text(plan.fit, plan.never)}: others do the same, or no load moves them."
    never *= bool(plan.never)
    if not plan.worst:
        return f"The data so far determines what poses can determine.{never}"
    hardly = " More than 1 is as good as unknown: little moves there on any pose." if plan.after > 1.0 else ""
    return (
        f"Least is known of {parameters_text(plan.fit, plan.worst)}: to ± {plan.before:.2g} times the ordinary size of "
        f"such a parameter now, to ± {plan.after:.2g} times with these {n} poses.{hardly}{never}"
    )


def _promised(plan: MeasuringPlan, promise: Promise, pair: tuple[str, str]) -> str:
    """Say how many simulated tables tell two effects apart, and what else would where these are too few.

    Args:
        promise: of the plan; pair: keys of the two effects.
    """
    both, approach = "`{}` and `{}`".format(*pair), "Approach every joint from the stated side and wait a second."
    promised = f"With these {len(plan.state)} poses {_share(promise)} simulated tables would tell {both} apart, as "
    promised += "`diagnose` does"
    if plan.resolved:
        return f"The data so far tells {both} apart already. {promised}. {approach}"
    if promise.enough:
        return f"{promised}: enough. {approach}"
    works = next((other for other in plan.alternatives if other.promise.enough), None)
    if works is not None:
        return f"{promised}: not enough. With {_poses(plan, works)} {_share(works.promise)} would."
    failed = joined([_poses(plan, other) for other in plan.alternatives], "or")
    return f"{promised}: not enough. Nor would {failed}: nothing that was simulated tells them apart."


def _share(promise: Promise) -> str:
    """Return a promise in words: ``18 of 20``."""
    return f"{promise.told_apart} of {promise.tables}"


def _poses(plan: MeasuringPlan, other: Alternative) -> str:
    """Return in words which other poses were simulated, with the options that ask for them."""
    masses = joined([f"{mass:g}" for mass in other.payloads])
    loads = [f"payloads of {masses} kg (`--payloads`), {_centre(plan)},"] * bool(other.payloads)
    loads += [f"a pull of {other.force:.0f} N at the TCP in changing directions (`--force`)"] * bool(other.force)
    words = joined(loads).removesuffix(",").replace(", and", " and")
    return f"{other.poses} poses with {words}" if loads else f"{other.poses} such poses (`-n`)"


def _loads(plan: MeasuringPlan) -> str:
    """Say which loads the planned poses have and where these hang; empty without any."""
    mass, wrench = plan.state.payload_mass, plan.state.wrench
    pull = 0.0 if wrench is None else float(np.linalg.norm(wrench[:, :3], axis=1).max())
    words = []
    if mass is not None and mass.any():
        words.append(f"payloads of {joined([f'{kg:g}' for kg in np.unique(mass.round(3))])} kg, {_centre(plan)}")
    if pull:
        words.append(f"a pull of {pull:.0f} N at the TCP")
    return f"The poses have {'; and '.join(words)}." if words else ""


def _centre(plan: MeasuringPlan) -> str:
    """Say where the centre of the payloads is: that of the table, or the origin of the flange."""
    centre = plan.state.payload_center
    x, y, z = (0.0, 0.0, 0.0) if centre is None else (1e3 * centre[0]).tolist()
    return f"their centre at {x:g}, {y:g}, {z:g} mm in tool0"
