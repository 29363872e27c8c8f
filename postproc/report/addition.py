"""The page of a model with more physics, on which the reader watches the error fall from step to step."""

from __future__ import annotations

from markupsafe import Markup

from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate
from postproc.identification.add import Addition
from postproc.report.comparison import SCRIPTS, workspace_section
from postproc.report.document import plain
from postproc.report.drawing.charts import bars
from postproc.report.drawing.residuals import channel_sections
from postproc.report.drawing.steps import Rung, distance_chart, steps_data
from postproc.report.page import Page, Section, figure, render, render_page
from postproc.report.parameters import parameter_table

EACH = "Rms on rows that the fit has not seen, everything fitted again without the effect: long bars matter."
BASE = "the model as it came"
BAR = '<div class="controls" data-steps="controls"></div>'
FALL = (
    "Step through the model with the slider, the arrow keys or a click on a bar: the laws, the residuals in space, the "
    "charts and the sample targets are those of the step."
)


def addition_page(name: str, found: Addition) -> str:
    """HTML of an addition.

    Args:
        name: of the model, the effects and the tables.
    """
    document = plain(found.as_json())
    kind, noise = found.fit.observed, found.fit.parts.level
    floor = document[kind.key("floor")]
    dashed = floor if noise else None
    rungs = rungs_of(found)
    ladder: dict[str, float | None] = {rung.name: 1e3 * rung.error for rung in rungs}
    without = {f"without {key}": 1e3 * fit.held_out_rms for key, fit in found.without.items()}
    added = list(dict.fromkeys(step.name.removeprefix("+ ") for step in found.ladder[1:]))
    steps = steps_data(rungs, added, dashed)
    figures = [
        *figure("error before", document["before"][kind.key("held_out_rms")], "before", kind.unit),
        *figure("error after", document[kind.key("held_out_rms")], "after", kind.unit),
        *figure("noise" if noise is not None else "any smooth function", floor, unit=kind.unit),
    ]
    error = render(
        "error.html.j2",
        bars=Markup(bars(ladder, dashed, unit=kind.unit, steps=list(ladder))),
        distances=Markup(distance_chart(found.fit, dashed, held_out=True)),
        laws=any(step["laws"] for step in steps["steps"]),
        beside="",
    )
    keys = [e.key for e in found.fit.model.effects]
    sections = [
        Section("Watch the error fall", error, FALL),
        *workspace_section(kind.name, "Where it is off, at this step", program=True),
        Section("What each effect is worth", bars(without, dashed, unit=kind.unit), EACH),
        *channel_sections(found.fit, "What the rest follows", folded=True),
        Section("Parameters", parameter_table(found.fit, keys), folded=True),
    ]
    page = Page(
        title=f"postproc add {name}",
        sentence=found.text().splitlines()[0],
        sections=sections,
        document=document,
        figures=figures,
        bar=BAR,
        data={"steps": plain(steps)},
        scripts=SCRIPTS,
    )
    return render_page(page)


def rungs_of(found: Addition) -> list[Rung]:
    """The steps of the ladder, each with its model beside the measurements."""
    rungs = []
    for k, step in enumerate(found.ladder):
        fit = step.fit if isinstance(step.fit, Fit) else evaluate(step.model, found.fit.data)
        rungs.append(Rung(step.name if k else BASE, fit, step.fit.held_out_rms))
    return rungs
