"""The comment at the head of a corrected module: what was done to it, and how near it comes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from postproc.compensation.options import Options
from postproc.compensation.results.document import estimated_stiffness
from postproc.model.arm import Model


def header_values(model: Model, options: Options, document: Mapping[str, Any]) -> dict[str, Any]:
    """The values for the template ``header.j2``.

    Errors in transients and transitions are empty if they are within the tolerance.

    Args:
        document: the result of the compensation in the form ``postproc/compensate/1``.
    """
    beyond = {
        name: f"{value:.3f}" if (value := document[f"max_{name}"]) > document["tolerance_mm"] else ""
        for name in ("transient_mm", "transition_mm")
    }
    return {
        "version": document["tool"],
        "robot": document["robot"],
        "effects": ", ".join(e.key for e in model.effects) or "rigid",
        "wrench": _wrench_text(options),
        "already": ", ".join(options.already),
        "before_mm": f"{document['max_error_before_mm']:.3f}",
        "after_mm": f"{document['max_error_after_mm']:.3f}",
        "arc_before_mm": _mm(document["max_arc_error_before_mm"]),
        "arc_mm": _mm(document["max_arc_error_after_mm"]),
        **beyond,
        "stiffness": estimated_stiffness(document),
        "added": document["added_targets"],
        "left": sum(d["code"] == "CMP005" for d in document["diagnostics"]),
        "run_time": document["run_time"],
        "measured": document["measured_statements"],
        "unmeasured": document["unmeasured_statements"],
        "unproved": document["unproved_statements"],
    }


def _mm(value: float | None) -> str:
    """Millimetres with three decimals; empty for None."""
    return "" if value is None else f"{value:.3f}"


def _wrench_text(options: Options) -> str:
    """Process force and moment of the options as text, with where they act; empty if both are zero."""
    parts = [
        f"{name} {', '.join(f'{x:g}' for x in vector)} {unit}"
        for name, vector, unit in (("force", options.force, "N"), ("moment", options.moment, "N m"))
        if any(vector)
    ]
    where = {"all": "along the whole program", "arc": "while the arc burns"}[options.force_on]
    return f"{'; '.join(parts)}, {where}" if parts else ""
