"""The page of a model beside measurements."""

from __future__ import annotations

from postproc.identify.compare import Comparison
from postproc.report.document import plain
from postproc.report.page import Section, render_page, table
from postproc.report.residuals import channel_section, workspace_section
from postproc.report.svg import bars


def comparison_page(name: str, found: Comparison) -> str:
    """HTML of a comparison with the table of that name."""
    document = plain(found.as_json())
    levels = {"this model": document["rms_mm"], "any function of the channels (bound)": document["bound_mm"]}
    figures = [
        ("rms per axis", document["rms_mm"]),
        ("mean distance", document["mean_mm"]),
        ("95 % of the poses are within", document["percentiles_mm"]["95"]),
        ("maximum", document["maximum_mm"]),
        *((f"rms in {axis}", values["rms"]) for axis, values in document["per_axis_mm"].items()),
        ("ISO 9283 accuracy, largest", document["iso9283"]["accuracy_max_mm"]),
        ("ISO 9283 repeatability, median", document["iso9283"]["repeatability_median_mm"]),
    ]
    worst = [(row["pose_id"], row["row"], row["error_mm"]) for row in document["worst"]]
    follows = [(t["channel"], t["where"], 100 * t["share"]) for t in document["channels"][:20]]
    sections = [
        Section(
            "How far, and how far it could be", bars(list(levels), list(levels.values()), "mm", document["noise_mm"])
        ),
        workspace_section(found.fit, found.error),
        channel_section(found.fit, found.error, [t.channel for t in found.trends], found.noise.position),
        Section("Figures", table(("figure", "mm"), figures)),
        Section("Worst poses", table(("pose", "row", "mm"), worst)),
        Section("Share of the residual above chance", table(("channel", "at", "%"), follows)),
    ]
    return render_page(f"postproc compare {name}", found.text().splitlines()[0], sections, document)
