"""The page of a diagnosis: the verdict, the ladder falling to the floor, the ranking with its evidence."""

from __future__ import annotations

from typing import Any

from postproc.fit.words.wording import FREE, p_text, place
from postproc.identify.diagnosis import Diagnosis
from postproc.identify.words.sentences import NAMED, doubts, headline
from postproc.identify.words.text import UNNAMED, diagnosis_json
from postproc.measure.observations import Observation
from postproc.report.charts import bars
from postproc.report.document import plain
from postproc.report.page import Section, render_page, table
from postproc.report.parameters import parameter_table
from postproc.report.residuals import channel_section, suspect_chart, workspace_section

LOOKS = (
    " The chart shows the first without the share that the fitted parameters have taken on. `postproc diagnose --draft "
    "OWN.py` writes it as an effect, `postproc add` adds it."
)
NOISE = "The dashed line is the noise: no model can be expected below it. "
MOST_TELLING = 8  # channels of the model as it came; `compare` shows all of them


def diagnosis_page(name: str, found: Diagnosis) -> str:
    """HTML of a diagnosis.

    Args:
        name: of the model and the table.
    """
    document = plain(diagnosis_json(found))
    kind = found.base.observed
    error, floor = kind.key("held_out_rms"), document[kind.key("floor")]
    ladder = {"the model as it came": document[error]}
    ladder |= {f"+ {m['effect']}": m[f"{error}_after"] for m in document["missing"]}
    if document[f"{error}_unnamed"] is not None:
        ladder[UNNAMED] = document[f"{error}_unnamed"]
    ladder[FREE] = document[kind.key("bound")]
    key = {
        **_verdict(document),
        f"error per {kind.each} as it came": document[error],
        "with what was found": document[f"{error}_after"] if document["missing"] else None,
        "with what has no name": document[f"{error}_unnamed"],
        f"noise per {kind.each}": floor,
    }
    sections = [
        Section(
            "The error on rows that the fit has not seen",
            bars(ladder, floor, FREE, kind.unit),
            f"Rms per {kind.each}, {kind.unit}. "
            + (NOISE if floor else "")
            + "Grey: what a smooth function of all channels, without physics, reaches.",
        )
    ]
    if document["missing"]:
        sections.append(_found(found, document))
    if found.suspects:
        suspects = [(s["where"], s["channel"], s["pattern"], f"{100 * s['share']:.0f} %") for s in document["suspects"]]
        chart = suspect_chart(found.searched, found.suspects[0], found.floor)
        note = "Of what the final model leaves above the noise; strongest first." + (LOOKS if chart else "")
        columns = ("where", "channel", "pattern", "explains")
        sections.append(Section("What remains follows", chart + table(columns, suspects), note))
    if found.missing:
        sections.append(workspace_section(found.base, "Where the model as it came is off"))
        sections.append(channel_section(found.base, found.floor, "What its error follows", most=MOST_TELLING))
    suspected = [(s.channel, s.where) for s in found.suspects]
    sections += [
        workspace_section(found.final, "Where it is off in the end"),
        channel_section(found.final, found.floor, "What the rest follows", suspected),
        _ranking(document, kind),
    ]
    if document["blind_to"]:
        blind = [(b["effect"], b["why"]) for b in document["blind_to"]]
        sections.append(Section("This data could not have shown", table(("effect", "why"), blind)))
    return render_page(f"postproc diagnose {name}", headline(found), sections, document, key)


def _verdict(document: dict[str, Any]) -> dict[str, object]:
    each = [(m["effect"], _alike(m)) for m in document["missing"]]
    several = ((name, alike if len(alike) <= NAMED else ["others"]) for name, alike in each)
    missing = ", ".join(" or ".join([name, *alike]) for name, alike in several)
    if document["verdict"] == "missing":
        return {"missing": missing}
    return {"verdict": document["verdict"], "found": missing or None}


def _alike(missing: dict[str, Any]) -> list[str]:
    """What explains the data as well as an effect that was found."""
    return [key for key in missing["not_separable_from"] if key not in missing["not_seen_beside"]]


def _found(found: Diagnosis, document: dict[str, Any]) -> Section:
    rows, kind = [], found.base.observed
    for m in document["missing"]:
        effect = found.told.model.effect(m["effect"])
        title = effect.title if effect is not None else ""
        rows.append((m["effect"], title, place(m["form"]), _p(m["p_value"]), m[f"{kind.key('held_out_rms')}_after"]))
    columns = ("effect", "what it is", "form", "p", f"held out with it [{kind.unit}]")
    values = parameter_table(found.told, [m["effect"] for m in document["missing"]])
    note = " ".join([*doubts(found), "`postproc add` writes the model that has it."])
    return Section("What is missing", table(columns, rows) + values, note)


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
    return Section("Ranking of effects", table(columns, rows), note)


def _p(value: float) -> str:
    return p_text(value).replace("-", "\N{NON-BREAKING HYPHEN}").replace(" ", "\N{NO-BREAK SPACE}")
