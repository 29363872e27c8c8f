"""The page of a model beside measurements."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from postproc.estimation.words.wording import FREE
from postproc.identification.compare import Comparison
from postproc.measure.observations import Observation
from postproc.report.document import plain
from postproc.report.drawing.charts import bars
from postproc.report.drawing.laws import law_charts, laws_of
from postproc.report.drawing.residuals import channel_sections
from postproc.report.drawing.steps import Rung, distance_chart, steps_data
from postproc.report.page import Page, Section, figure, grid, render, render_page, table

IN_SPACE = (
    "Beside it the channels that stand out. Points: each pose, less the mean; red: means with their standard errors; "
    "rings: the worst poses; grey: twice the noise."
)
SCRIPTS = ("space", "arm", "steps")


def comparison_page(name: str, found: Comparison) -> str:
    """HTML of a comparison.

    Args:
        name: of the model and the table.
    """
    document = plain(found.as_json())
    fit, kind = found.fit, found.fit.observed
    noise = document[kind.key("noise")]
    levels = {"this model": document[kind.key("rms")], FREE: document[kind.key("bound")]}
    figures = [
        *figure("mean distance", document[kind.key("mean")], unit=kind.unit),
        *figure(f"rms per {kind.each}", document[kind.key("rms")], "before", kind.unit),
        *figure(f"noise per {kind.each}", noise, unit=kind.unit),
    ]
    error = render(
        "error.html.j2",
        bars=Markup(bars(levels, noise, FREE, kind.unit)),
        distances="",
        laws=False,
        beside=Markup(distance_chart(fit, noise, held_out=False)),
    )
    laws = law_charts(laws_of(fit, [e.key for e in fit.model.effects]))
    follows = [(t["channel"], t["where"], f"{100 * t['share']:.0f} %") for t in document["channels"][:20]]
    sections = [
        Section("How far, and how far it could be", error, f"Rms per {kind.each}. {_grey()}"),
        *workspace_section(fit.observed.name, "Where it is off"),
        Section("Worst poses", '<div data-steps="worst"></div>'),
        *channel_sections(fit, "What it follows: every channel", folded=fit.observed.name == "position"),
        Section("Figures", table("figures", ("figure", kind.unit), _figures(document, kind))),
        *([Section("Laws that the model holds", grid(laws, 320), "At these poses.", True)] if laws else []),
        Section(
            "Share of the residual above chance", table("shares", ("channel", "at", "explains"), follows), "", True
        ),
    ]
    steps = steps_data([Rung("this model", fit, fit.rms)], (), noise)
    page = Page(
        title=f"postproc compare {name}",
        sentence=found.text().splitlines()[0],
        sections=sections,
        document=document,
        figures=figures,
        data={"steps": plain(steps)},
        scripts=SCRIPTS,
    )
    return render_page(page)


def workspace_section(observed: str, title: str, program: bool = False) -> list[Section]:
    """The residuals in space and over the channels that stand out; none where no position was measured.

    Args:
        program: with some poses as targets of a program, as each step would have them corrected.
    """
    return [Section(title, render("steps.html.j2", program=program), IN_SPACE)] if observed == "position" else []


def _grey() -> str:
    return (
        "Grey: what a smooth function of all channels, without physics, reaches on rows that it has not seen. "
        "An effect that jumps can do better."
    )


def _figures(document: dict[str, Any], kind: Observation) -> list[tuple[str, float]]:
    within, along = document[kind.key("percentiles")], document[kind.key(f"per_{kind.each}")].items()
    figures = [
        ("half of the poses are within", within["50"]),
        ("95 % of the poses are within", within["95"]),
        ("99 % of the poses are within", within["99"]),
        ("worst pose", document[kind.key("maximum")]),
        *((f"{axis}: rms", values["rms"]) for axis, values in along),
        *((f"{axis}: mean", values["mean"]) for axis, values in along),
    ]
    return figures + iso_figures(document)


def iso_figures(document: dict[str, Any]) -> list[tuple[str, Any]]:
    """Pose figures of ISO 9283 [mm]; none where no position was measured."""
    iso = document.get("iso9283")
    if not iso:
        return []
    return [
        ("ISO 9283 pose accuracy AP, mean", iso["accuracy_mean_mm"]),
        ("ISO 9283 pose accuracy AP, largest", iso["accuracy_max_mm"]),
        ("ISO 9283 pose repeatability RP, median", iso["repeatability_median_mm"]),
        ("ISO 9283 pose repeatability RP, largest", iso["repeatability_max_mm"]),
    ]
