"""Certificates to print and sign: what was asked of a program or an arm, what was found, and who accepts it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from hashlib import sha256

from postproc.compensation.conversion import Conversion
from postproc.compensation.judgement.figures import CLAUSES, legend, shown_figures
from postproc.diagnostics import Diagnostic, Matter, Source
from postproc.identification.compare import Comparison
from postproc.numbers import fixed, range_text
from postproc.report.blocks import DataTable, Document, Figure, Section, Values, plain
from postproc.results.convert.conclusion import conclusion
from postproc.results.convert.figures import decimals, is_guess
from postproc.results.improve.comparison import comparison_document, iso_figures
from postproc.results.provenance import compared_rows, hashes, issued, rows_of_fit, versions

COMPUTED = (
    "The deviations are computed with the model of the arm, along the whole path of the program as it was written and "
    "read back. They are no measurement of this arm."
)
Row = tuple[object, ...]
NOT_SAFE = "The program is not safe to compensate; no corrected program was written."
RUN_TIME_ONLY = "Its targets are corrected on the controller, where alone they are known: nothing could be measured."
BY_HAND = "Required figures are filled in by hand where the contract states them."
MODEL_RESTS_ON = "What the model of the arm rests on"
KIND = "What is measured, and what is computed"
KIND_COLUMNS = ("what", "is", "from")


class Verdict(Enum):
    """Whether a program keeps its tolerance, in the words of its certificate."""

    KEPT = "The tolerance is kept."
    NOT_KEPT = "The tolerance is not kept."
    NOT_SHOWN = "That the tolerance is kept on the arm is not shown; in the model it is."


VERDICTS = {"kept": Verdict.KEPT, "not_shown": Verdict.NOT_SHOWN}
VERDICTS |= dict.fromkeys(("not_kept", "not_measured"), Verdict.NOT_KEPT)
"""The verdict of a certificate by that of a document."""


def program_certificate(
    name: str, conversion: Conversion, made: Mapping[str, str] | None = None, files: Sequence[Source] = ()
) -> Document:
    """Describe a corrected program as a certificate to sign: a row for each seam, whose tolerance is kept or not.

    The verdict is "kept" if the program was written, everything that welds was corrected, and each seam keeps its
    tolerance in the proof; without welds, if everything along lines and arcs does. It counts for the real arm only
    where a fitted model is accurate enough.

    Args:
        name: of the program. made: what it was converted with (model, loads, options) as label and text.
        files: that were read beside the program: model, effects, cell, settings.
    """
    document, made = plain(conversion.report), made or {}
    facts = [("program", name), *_digests(conversion), *hashes(files)]
    title = f"Acceptance of {name}"
    if conversion.plan is None:
        sentence = NOT_SAFE if conversion.module is None else RUN_TIME_ONLY
        return _certificate(title, Verdict.NOT_KEPT, sentence, document, facts)
    tolerance, digits = document["tolerance_mm"], decimals(document)
    words = {True: "kept", False: "not kept"}
    seams: list[Row] = []
    for seam in document["welds"]:  # one that was not measured, or of which something was left, keeps no tolerance
        lines, length = f"{seam['line_from']} to {seam['line_to']}", f"{seam['length_mm']:.0f}"
        fell = _fall(seam["before_mm"], seam["after_mm"], digits)
        result = words[seam["kept"] and not seam["left"]]
        seams.append((seam["name"], lines, length, *fell, f"{tolerance:g}", seam["left"], result))
    path: list[Row] = []
    shown = "kept" if document["verdict"] == "kept" else "in the model"
    for row in shown_figures(document["figures"]):
        limit, fell = row["tolerance_mm"], _fall(row["before_mm"], row["after_mm"], digits)
        result = "not kept" if limit is not None and row["after_mm"] > limit else shown
        required = ("", "") if limit is None else (f"{limit:g}", result)
        expected = range_text(row["expected_on_arm_mm"], digits, guess=is_guess(document))
        path.append((CLAUSES[row["place"]], *fell, expected, *required))
    if drawn := document["from_programmed_path"]:
        what = "from the path in the program's numbers, as its work object was taught"
        path.append((what, *_fall(drawn["before_mm"], drawn["after_mm"], digits), "", "", ""))
    columns = ("", "before [mm]", "after, in the model [mm]", "expected on the arm [mm]", "required [mm]", "result")
    parts = [_part("Path accuracy, after ISO 9283, across the path", columns, path, legend(document["figures"]))]
    if seams:
        of_seam = ("seam", "lines", "length [mm]", "before [mm]", "after [mm]", "required [mm]", "left", "result")
        parts.insert(0, _part("Seams, while the arc burns, in the model", of_seam, seams))
    table = {} if conversion.model is None else conversion.model.fit
    parts.append(_part(KIND, KIND_COLUMNS, _kinds(document, rows_of_fit(table), conversion.diagnostics)))
    parts += [_part(MODEL_RESTS_ON, ("what", "with"), rows) for rows in [rows_of_fit(table)] if rows]
    facts += [("arm", document["robot"]), *made.items()]
    _, sentences = conclusion(conversion)
    if seams:
        kept = sum(row[-1] == words[True] for row in seams)
        sentences.insert(1, f"In the model {kept} of {len(seams)} seams keep {tolerance:g} mm.")
    return _certificate(title, VERDICTS[document["verdict"]], " ".join(sentences), document, facts, *parts)


def _kinds(document: Values, fitted: Sequence[Row], findings: Sequence[Diagnostic]) -> list[Row]:
    """Return a row for each kind of figure: what it is, whether it is measured or computed, and from what.

    Args:
        document: that of the conversion. fitted: rows on the measurements of the model, none for one without.
        findings: of the conversion.
    """
    expected = "not known: the model was not fitted to measurements of this arm"
    if any(finding.matter is Matter.CONTRADICTED for finding in findings):
        expected = "not known: what the model was fitted to contradicts itself"
    if document["expected_accuracy"] is not None:
        expected = "how sure the fitted parameters are, and what the model left of the measured rows"
    elif document["expected_on_arm_mm"] is not None:
        expected = "how the stiffness of arms of this type scatters; errors of its geometry are not in it"
    return [
        ("before, and after in the model", "computed", "the model of the arm, along the whole path as it is written"),
        ("expected on the arm", "computed", expected),
        ("model of the arm", *(("fitted", "measured rows, stated below") if fitted else ("not measured", "its type"))),
        ("path of this program on the arm", "not measured", ""),
    ]


def arm_certificate(name: str, comparison: Comparison, files: Sequence[Source] = ()) -> Document:
    """Describe an arm compared with measurements as a certificate: ISO 9283 figures, with room for what is required.

    Args:
        name: of the model and the tables. files: that were read beside the tables, the model first.
    """
    shown = comparison_document(name, comparison)
    document = plain(shown.values)
    kind, data = comparison.fit.observed, comparison.fit.data
    mean, within, largest, noise = (document[kind.key(key)] for key in ("mean", "percentiles", "maximum", "noise"))
    one = "reading" if kind.each == "reading" else "pose"
    figures = [
        *iso_figures(document),
        *(("mean distance from the model", mean), (f"95 % of the {one}s are within", within["95"])),
        ("largest distance from the model", largest),
    ]
    table, excluded = comparison.fit.model.fit, len(comparison.fit.excluded_rows)
    rows = (
        f"{len(data)} compared, {excluded} of them left out as far from everything else" if excluded else str(len(data))
    )
    facts = [("model and measurements", name), *hashes((*files, *data.sources))]
    facts += [
        ("arm", comparison.fit.model.robot.name),
        ("measured rows", rows),
        ("these rows are", compared_rows(table, data.sources)),
    ]
    facts.append((f"noise per {kind.each}", "not known" if noise is None else f"{noise:.3f} {kind.unit}"))
    accuracy = [(what, "" if value is None else f"{value:.3f}", "", "") for what, value in figures]
    columns = ("figure", f"found [{kind.unit}]", f"required [{kind.unit}]", "accepted")
    figures_title = "Pose accuracy and repeatability after ISO 9283" if one == "pose" else "Readings beside the model"
    parts = [_part(figures_title, columns, accuracy, BY_HAND)]
    kinds = [
        (f"{one}s, repeatability and noise", "measured", "the rows of the tables"),
        ("distance from the model", "measured less computed", "the rows of the tables, and the model at their joints"),
    ]
    parts.append(_part(KIND, KIND_COLUMNS, kinds))
    parts += [_part(MODEL_RESTS_ON, ("what", "with"), fitted) for fitted in [rows_of_fit(table)] if fitted]
    return _certificate("Accuracy of an arm", None, shown.sentence, document, facts, *parts)


def _certificate(
    title: str, verdict: Verdict | None, sentence: str, values: Values, facts: Sequence[Row], *parts: Section
) -> Document:
    """Assemble a certificate; it is "good" where the tolerance is kept on the arm, "bad" where it is not in the model.

    Args:
        verdict: of what is computed; None where it is left to who signs. facts: what was examined, as (what, with).
        parts: its tables.
    """
    kind = {Verdict.KEPT: "good", Verdict.NOT_KEPT: "bad"}.get(verdict, "") if verdict else ""
    figure = Figure("verdict", "" if verdict is None else verdict.value, kind)
    facts = [("date", issued()), *facts, ("made with", versions())]
    basis, sections = "" if verdict is None else COMPUTED, [_part("What was examined", ("what", "with"), facts), *parts]
    return Document(title=title, values=values, sentence=sentence, figures=[figure], basis=basis, sections=sections)


def _part(title: str, columns: Sequence[str], rows: Sequence[Row], note: str = "") -> Section:
    """Return a section with one table of the same title.

    Args:
        columns: headings. note: how to read the table.
    """
    return Section(title, [DataTable(title, columns, rows)], note)


def _digests(conversion: Conversion) -> list[tuple[str, str]]:
    """Return rows (original or corrected file, its SHA-256); if there are several, also with the path."""
    sources = {o.statement.source.path: o.statement.source.data for o in conversion.outcomes}
    rows = []
    for path, data in sources.items():
        files = {"original": data} | ({"corrected": conversion.outputs[path]} if path in conversion.outputs else {})
        part = f" {path}" if len(sources) > 1 else ""
        rows += [(f"{kind}{part} file, SHA-256", sha256(content).hexdigest()) for kind, content in files.items()]
    return rows


def _fall(before: float | None, after: float | None, digits: int) -> tuple[str, str]:
    """Return the deviations [mm] before and after correction as texts; None becomes "not measured"."""
    first, last = (fixed(value, digits) or "not measured" for value in (before, after))
    return first, last
