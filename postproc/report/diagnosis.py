"""The page of a diagnosis: the verdict, the error now and with what is missing, the laws found, the ranking."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from postproc.estimation.words.wording import FREE, p_text, place
from postproc.identification.diagnosis import Diagnosis
from postproc.identification.words.sentences import NAMED, doubts, headline
from postproc.identification.words.text import UNNAMED, diagnosis_json
from postproc.measure.observations import Observation
from postproc.report.addition import BAR, BASE
from postproc.report.comparison import SCRIPTS, workspace_section
from postproc.report.document import plain
from postproc.report.drawing.charts import bars
from postproc.report.drawing.residuals import channel_sections, suspect_chart
from postproc.report.drawing.steps import Rung, distance_chart, steps_data
from postproc.report.page import Figure, Page, Section, figure, render, render_page, table
from postproc.report.parameters import parameter_table

LOOKS = (
    " The chart shows the first without the share that the fitted parameters have taken on. `postproc diagnose --draft "
    "OWN.py` writes it as an effect, `postproc add` adds it."
)
NOISE = "The dashed line is the noise: no model can be expected below it. "
GREY = "Grey: what a smooth function of all channels, without physics, reaches."
BOTH = "with what is missing"


def diagnosis_page(name: str, found: Diagnosis) -> str:
    """HTML of a diagnosis.

    Args:
        name: of the model and the table.
    """
    document = plain(diagnosis_json(found))
    kind = found.base.observed
    floor = document[kind.key("floor")]
    rungs = [Rung(BASE, found.base, found.base.held_out_rms)]
    if found.missing:
        rungs.append(Rung(BOTH, found.told, found.final.held_out_rms))
    steps = steps_data(rungs, [m.key for m in found.missing], floor)
    sections = [_error(found, document, steps), *_what(found, document)]
    sections += workspace_section(kind.name, "Where it is off", program=bool(found.missing))
    suspected = [(s.channel, s.where) for s in found.suspects]
    sections += [
        *channel_sections(found.final, "What the rest follows", suspected, folded=kind.name == "position"),
        _ranking(document, kind),
    ]
    if document["blind_to"]:
        blind = [(b["effect"], b["why"]) for b in document["blind_to"]]
        columns = ("effect", "why")
        sections.append(Section("This data could not have shown", table("not shown", columns, blind), folded=True))
    page = Page(
        title=f"postproc diagnose {name}",
        sentence=headline(found),
        sections=sections,
        document=document,
        figures=_figures(document, kind),
        bar=BAR if found.missing else "",
        data={"steps": plain(steps)},
        scripts=SCRIPTS,
    )
    return render_page(page)


def _figures(document: dict[str, Any], kind: Observation) -> list[Figure]:
    error = kind.key("held_out_rms")
    unnamed = document[f"{error}_unnamed"]
    after = document[f"{error}_after"] if document["missing"] else None
    return [
        *figure("error now", document[error], "before", kind.unit),
        *figure("noise", document[kind.key("floor")], unit=kind.unit),
        *_verdict(document),
        *figure("error with it", after, "after", kind.unit),
        *figure("error with what has no name", unnamed, "after", kind.unit),
    ]


def _verdict(document: dict[str, Any]) -> list[Figure]:
    each = [(m["effect"], _alike(m)) for m in document["missing"]]
    several = ((name, alike if len(alike) <= NAMED else ["others"]) for name, alike in each)
    missing = ", ".join(" or ".join([name, *alike]) for name, alike in several)
    if document["verdict"] == "missing":
        return [Figure("missing", missing)]
    return [Figure("verdict", document["verdict"]), *figure("found", missing or None)]


def _alike(missing: dict[str, Any]) -> list[str]:
    """What explains the data as well as an effect that was found."""
    return [key for key in missing["not_separable_from"] if key not in missing["not_seen_beside"]]


def _error(found: Diagnosis, document: dict[str, Any], steps: dict[str, Any]) -> Section:
    """The ladder of errors, and beside it the laws that were found, or what has no name."""
    kind, floor = found.base.observed, document[found.base.observed.key("floor")]
    error = kind.key("held_out_rms")
    ladder = {BASE: document[error]}
    ladder |= {f"+ {m['effect']}": m[f"{error}_after"] for m in document["missing"]}
    if document[f"{error}_unnamed"] is not None:
        ladder[UNNAMED] = document[f"{error}_unnamed"]
    ladder[FREE] = document[kind.key("bound")]
    names = [BASE, *(f"+ {m['effect']}" for m in document["missing"][-1:])]
    beside = suspect_chart(found.searched, found.suspects[0], found.floor) if found.suspects else ""
    html = render(
        "error.html.j2",
        bars=Markup(bars(ladder, floor, FREE, kind.unit, names if len(names) > 1 else ())),
        distances=Markup(distance_chart(found.final, floor, held_out=True)),
        laws=any(step["laws"] for step in steps["steps"]),
        beside=Markup(beside),
    )
    note = f"Rms per {kind.each}, {kind.unit}. {NOISE if floor else ''}{GREY}"
    return Section("The error on rows that the fit has not seen", html, note)


def _what(found: Diagnosis, document: dict[str, Any]) -> list[Section]:
    """What is missing, and what remains without a name."""
    sections = [_found(found, document)] if found.missing else []
    if found.suspects:
        suspects = [(s["where"], s["channel"], s["pattern"], f"{100 * s['share']:.0f} %") for s in document["suspects"]]
        # With a law the place beside the ladder is taken.
        chart = suspect_chart(found.searched, found.suspects[0], found.floor)
        note = "Of what the final model leaves above the noise; strongest first." + (LOOKS if chart else "")
        columns = ("where", "channel", "pattern", "explains")
        shown = chart if found.missing else ""
        sections.append(Section("What remains follows", shown + table("suspects", columns, suspects), note))
    return sections


def _found(found: Diagnosis, document: dict[str, Any]) -> Section:
    rows, kind = [], found.base.observed
    for m in document["missing"]:
        effect = found.told.model.effect(m["effect"])
        title = effect.title if effect is not None else ""
        rows.append((m["effect"], title, place(m["form"]), _p(m["p_value"]), m[f"{kind.key('held_out_rms')}_after"]))
    columns = ("effect", "what it is", "form", "p", f"held out with it [{kind.unit}]")
    values = parameter_table(found.told, [m["effect"] for m in document["missing"]])
    note = " ".join([*doubts(found), "`postproc add` writes the model that has it."])
    return Section("What is missing", table("missing effects", columns, rows) + values, note)


def _ranking(document: dict[str, Any], kind: Observation) -> Section:
    rows = []
    for c in document["candidates"]:
        form, why = place(c["form"]), c["why_not"] or ""
        rows.append((c["effect"], form, c[f"{kind.key('rms')}_after"], _p(c["p_value"]), c["evidence"], why))
    columns = ("effect", "form", f"rms after [{kind.unit}]", "p", "evidence", "not testable because")
    note = (
        "Each effect alone on the model as it came; rms on the fitted rows. Evidence is twice the logarithm "
        "of the odds, after paying for parameters and for the number of forms that were tried: above 0 it speaks for "
        "the effect."
    )
    return Section("Ranking of effects", table("ranking", columns, rows), note, folded=True)


def _p(value: float) -> str:
    return p_text(value).replace("-", "\N{NON-BREAKING HYPHEN}").replace(" ", "\N{NO-BREAK SPACE}")
