"""The page of a model with more physics: the error before and after, what each effect is worth, what is left."""

from __future__ import annotations

from postproc.identify.add import Addition
from postproc.report.charts import bars
from postproc.report.document import plain
from postproc.report.page import Section, render_page
from postproc.report.parameters import parameter_table
from postproc.report.residuals import channel_section, workspace_section

EACH = "Rms per axis on rows that the fit has not seen, everything fitted again without the effect: long bars matter."


def addition_page(name: str, found: Addition) -> str:
    """HTML of an addition.

    Args:
        name: of the model, the effects and the tables.
    """
    document = plain(found.as_json())
    ladder = {
        ("the model as it came" if i == 0 else s.name): 1e3 * s.fit.held_out_rms for i, s in enumerate(found.ladder)
    }
    kind, noise = found.fit.observed, found.fit.parts.level
    floor = document[kind.key("floor")]
    without = {f"without {key}": 1e3 * fit.held_out_rms for key, fit in found.without.items()}
    key = {
        "error before": document["before"][kind.key("held_out_rms")],
        "error after": document[kind.key("held_out_rms")],
        "noise" if noise is not None else "any smooth function": floor,
    }
    note = (
        "Rms per axis. The dashed line is the noise: no model can be expected below it." if noise else "Rms per axis."
    )
    dashed = floor if noise else None
    sections = [
        Section("The error on rows that the fit has not seen", bars(ladder, dashed, unit=kind.unit), note),
        Section("What each effect is worth", bars(without, dashed, unit=kind.unit), EACH),
        workspace_section(found.fit, "Where it is off now"),
        channel_section(found.fit, noise, "What the rest follows"),
        Section("Parameters", parameter_table(found.fit, [e.key for e in found.fit.model.effects])),
    ]
    return render_page(f"postproc add {name}", found.text().splitlines()[0], sections, document, key)
