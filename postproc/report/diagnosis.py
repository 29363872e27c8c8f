"""The page of a diagnosis: the verdict, the ladder falling to the floor, the ranking with its evidence."""

from __future__ import annotations

from postproc.identify.diagnose import Diagnosis
from postproc.report.document import plain
from postproc.report.page import Section, render_page, table
from postproc.report.residuals import channel_section, workspace_section
from postproc.report.svg import bars


def diagnosis_page(name: str, found: Diagnosis) -> str:
    """HTML of a diagnosis on the table of that name."""
    document = plain(found.as_json())
    ladder = {"the model as it came": document["held_out_rms_mm"]}
    ladder |= {f"+ {m['effect']}": m["held_out_rms_mm_after"] for m in document["missing"]}
    ladder["any function of the channels (bound)"] = document["bound_mm"]
    ranking = [
        (c["effect"], c.get("form"), c["rms_mm_after"], c["p_value"], c["why_not"] or "")
        for c in document["candidates"]
    ]
    sections = [
        Section(
            "The error on rows that the fit has not seen",
            bars(list(ladder), list(ladder.values()), "mm", document["floor_mm"]),
            "Per axis. The dashed line is the noise: nothing falls below it.",
        ),
        workspace_section(found.final, found.final.position_error),
        channel_section(found.final, found.final.position_error, [s.channel for s in found.suspects], found.floor),
        Section(
            "Ranking of effects on the model as it came",
            table(("effect", "form", "rms after [mm]", "p", "not testable because"), ranking),
        ),
    ]
    if found.suspects:
        suspects = [(s["where"], s["channel"], s["pattern"], 100 * s["share"]) for s in document["suspects"]]
        note = "The final model's residual; strongest first."
        sections.append(Section("What remains follows", table(("where", "channel", "pattern", "%"), suspects), note))
    if document["blind_to"]:
        blind = [(b["effect"], b["why"]) for b in document["blind_to"]]
        sections.append(Section("This data could not have shown", table(("effect", "why"), blind)))
    return render_page(f"postproc diagnose {name}", found.text().splitlines()[0], sections, document)
