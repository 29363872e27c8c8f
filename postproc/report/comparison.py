"""The page of a model beside measurements."""

from __future__ import annotations

from postproc.fit.wording import FREE
from postproc.identify.compare import Comparison
from postproc.report.charts import bars
from postproc.report.document import plain
from postproc.report.page import Section, render_page, table
from postproc.report.residuals import channel_section, workspace_section


def comparison_page(name: str, found: Comparison) -> str:
    """HTML of a comparison.

    Args:
        name: of the model and the table.
    """
    document = plain(found.as_json())
    levels = {"this model": document["rms_mm"], FREE: document["bound_mm"]}
    key = {
        "mean distance": document["mean_mm"],
        "worst pose": document["maximum_mm"],
        "rms per axis": document["rms_mm"],
        "noise per axis": document["noise_mm"],
    }
    iso = document["iso9283"]
    figures = [
        ("half of the poses are within", document["percentiles_mm"]["50"]),
        ("95 % of the poses are within", document["percentiles_mm"]["95"]),
        ("99 % of the poses are within", document["percentiles_mm"]["99"]),
        *((f"{axis}: rms", values["rms"]) for axis, values in document["per_axis_mm"].items()),
        *((f"{axis}: mean", values["mean"]) for axis, values in document["per_axis_mm"].items()),
        ("ISO 9283 accuracy, mean", iso["accuracy_mean_mm"]),
        ("ISO 9283 accuracy, largest", iso["accuracy_max_mm"]),
        ("ISO 9283 repeatability, median", iso["repeatability_median_mm"]),
        ("ISO 9283 repeatability, largest", iso["repeatability_max_mm"]),
    ]
    files = [] if not found.fit.data.file else ["file"]
    worst = [[row[name] for name in ("pose_id", *files, "row", "error_mm")] for row in document["worst"]]
    follows = [(t["channel"], t["where"], f"{100 * t['share']:.0f} %") for t in document["channels"][:20]]
    sections = [
        Section(
            "How far, and how far it could be",
            bars(levels, document["noise_mm"], aside=FREE),
            "Rms per axis. Grey: what a smooth function of all channels, without physics, reaches on rows that it has "
            "not seen. An effect that jumps can do better.",
        ),
        workspace_section(found.fit),
        channel_section(found.fit, found.noise.position),
        Section("Figures", table(("figure", "mm"), figures)),
        Section("Worst poses", table(("pose", *files, "row", "mm"), worst)),
        Section("Share of the residual above chance", table(("channel", "at", "explains"), follows)),
    ]
    return render_page(f"postproc compare {name}", found.text().splitlines()[0], sections, document, key)
