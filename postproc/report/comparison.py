"""The page of a model beside measurements."""

from __future__ import annotations

from postproc.fit.words.wording import FREE
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
    kind = found.fit.observed
    noise, within = document[kind.key("noise")], document[kind.key("percentiles")]
    levels = {"this model": document[kind.key("rms")], FREE: document[kind.key("bound")]}
    key = {
        "mean distance": document[kind.key("mean")],
        "worst pose": document[kind.key("maximum")],
        f"rms per {kind.each}": document[kind.key("rms")],
        f"noise per {kind.each}": noise,
    }
    along = document[kind.key(f"per_{kind.each}")].items()
    figures = [
        ("half of the poses are within", within["50"]),
        ("95 % of the poses are within", within["95"]),
        ("99 % of the poses are within", within["99"]),
        *((f"{axis}: rms", values["rms"]) for axis, values in along),
        *((f"{axis}: mean", values["mean"]) for axis, values in along),
    ]
    if iso := document.get("iso9283"):
        figures += [
            ("ISO 9283 accuracy, mean", iso["accuracy_mean_mm"]),
            ("ISO 9283 accuracy, largest", iso["accuracy_max_mm"]),
            ("ISO 9283 repeatability, median", iso["repeatability_median_mm"]),
            ("ISO 9283 repeatability, largest", iso["repeatability_max_mm"]),
        ]
    files = [] if not found.fit.data.file else ["file"]
    worst = [[row[name] for name in ("pose_id", *files, "row", kind.key("error"))] for row in document["worst"]]
    follows = [(t["channel"], t["where"], f"{100 * t['share']:.0f} %") for t in document["channels"][:20]]
    sections = [
        Section(
            "How far, and how far it could be",
            bars(levels, noise, FREE, kind.unit),
            f"Rms per {kind.each}, {kind.unit}. Grey: what a smooth function of all channels, without physics, reaches "
            "on rows that it has not seen. An effect that jumps can do better.",
        ),
        workspace_section(found.fit),
        channel_section(found.fit, found.fit.parts.level),
        Section("Figures", table(("figure", kind.unit), figures)),
        Section("Worst poses", table(("pose", *files, "row", kind.unit), worst)),
        Section("Share of the residual above chance", table(("channel", "at", "explains"), follows)),
    ]
    return render_page(f"postproc compare {name}", found.text().splitlines()[0], sections, document, key)
