"""The next poses to measure: what they will do."""

from __future__ import annotations

from typing import Any

from postproc.identification.plan import TELLING_SIGMAS, MeasuringPlan
from postproc.model.uncertainty import parameter_name
from postproc.report.blocks import Document
from postproc.results.wording import parameters_text

LEAST_SIGMAS = 3.0
"""Standard deviations below which a difference does not stand out at all."""


def plan_document(name: str, plan: MeasuringPlan) -> Document:
    """Describe a plan of poses to measure.

    Args:
        name: of the model and the tables, for the title.
    """
    return Document(title=f"postproc plan {name}", values=plan_values(plan), sentence=plan_sentence(plan))


def plan_values(plan: MeasuringPlan) -> dict[str, Any]:
    """Return the ``postproc/plan/1`` document."""
    return {
        "schema": "postproc/plan/1",
        "poses": len(plan.state),
        "between": None if plan.between is None else list(plan.between),
        "told_apart": plan.resolved,
        "before": round(plan.before, 3),
        "after": round(plan.after, 3),
        "worst_determined": [parameter_name(plan.fit.model, *entry) for entry in plan.worst],
        "no_pose_determines": [parameter_name(plan.fit.model, *entry) for entry in plan.never],
    }


def plan_sentence(plan: MeasuringPlan) -> str:
    """Say how well the poses tell two effects apart, or determine the parameters that are least known."""
    n = len(plan.state)
    if plan.between is not None:
        a, b = plan.between
        if plan.after < LEAST_SIGMAS:
            return (
                f"Even with these {n} poses the difference between `{a}` and `{b}` stands out by only "
                f"{plan.after:.1f} standard deviations: standing still, on positions, they do nearly the same. "
                f"`postproc effects show {a}` says what tells them apart."
            )
        enough = (
            "the data so far tells them apart already"
            if plan.before >= TELLING_SIGMAS and plan.resolved
            else "enough to tell them apart"
            if plan.after >= TELLING_SIGMAS
            else f"{TELLING_SIGMAS:.0f} tell them apart: ask for more poses with `-n`"
        )
        return (
            f"With these {n} poses the difference between `{a}` and `{b}` stands out by {plan.after:.1f} standard "
            f"deviations (now {plan.before:.1f}); {enough}. Approach every joint from the stated side and wait a "
            "second."
        )
    never = (
        f" No pose determines {parameters_text(plan.fit, plan.never)}: others do the same, or no load moves them."
        if plan.never
        else ""
    )
    if not plan.worst:
        return f"The data so far determines what poses can determine.{never}"
    hardly = " More than 1 is as good as unknown: little moves there on any pose." if plan.after > 1.0 else ""
    return (
        f"Least is known of {parameters_text(plan.fit, plan.worst)}: to ± {plan.before:.2g} times the ordinary size of "
        f"such a parameter now, to ± {plan.after:.2g} times with these {n} poses.{hardly}{never}"
    )
