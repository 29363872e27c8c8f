"""A model with more physics: how far the error falls from step to step, and what each effect is worth."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate
from postproc.estimation.posterior import anywhere
from postproc.identification.add import LEAST_FALL, Addition, FitFigures
from postproc.measure.errors import rms
from postproc.model.uncertainty.prediction import predict_sigma
from postproc.numbers import decimals_of, mm
from postproc.report.blocks import Bar, Bars, DataTable, Document, Figure, Section, Values, View
from postproc.report.drawing.residuals import channel_sections
from postproc.report.drawing.steps import Rung, steps_data
from postproc.results.improve.comparison import steps_scene, workspace_section
from postproc.results.improve.fit import (
    error_values,
    fit_values,
    known_of,
    laws_in_symbols,
    parameter_sections,
    parameter_table,
)
from postproc.results.wording import ABOVE_NOISE, SMOOTH_FUNCTIONS, percent

HARDLY_ANY = 0.1
"""Share of the mean square above the floor that must be gone to be more than hardly any: chance takes a few percent."""
EACH_NOTE = "Everything fitted again without the effect: long bars matter."
REGIONS = {
    "near": "near the measured rows",
    "left_out": "in parts of the joint space left out",
    "anywhere": "at any joint angles",
}
BASE_LABEL = "the model as it came, fitted again"
HOLDS = (
    "Standard deviation per axis of a measurement there; parts left out are quarters of the range of the joints along "
    "which the model before the addition is off most differently."
)
FALL = (
    "Step through the model with the buttons, the arrow keys or a click on a bar: laws, residuals in space, charts and "
    "sample targets are those of the step."
)


def addition_document(name: str, addition: Addition) -> Document:
    """Describe an addition of effects to a model, for terminal and page.

    Args:
        name: of the effects and the tables, for the title.
    """
    values, kind, fit = addition_values(addition), addition.fit.observed, addition.fit
    floor, noise = mm(addition.floor), fit.parts.level is not None
    unnamed = fit.unnamed  # of its form, no single row is held out
    rows = "rows of the fit" if unnamed else "rows that the fit has not seen"
    dashed, each = floor if noise else None, f"{kind.unit} per {kind.each}"
    added = list(dict.fromkeys(step.name.removeprefix("+ ") for step in addition.ladder[1:]))

    before, after = _falls(addition)

    def bar(label: str, error: Fit | FitFigures, share: float | None = None) -> Bar:
        """Return the bar of a fit: on held-out rows, of a law without a name on fitted rows alone."""
        if unnamed:
            return Bar(label, 1e3 * error.rms)
        note = f"{1e3 * error.rms:.3f} {kind.unit} in the fit"
        if share and noise:
            note += f", {percent(share)} {ABOVE_NOISE} explained"
        return Bar(label, 1e3 * error.held_out_rms, note)

    ladder = [bar(step.name if k else BASE_LABEL, step.fit, step.share) for k, step in enumerate(addition.ladder)]
    bars = Bars(ladder, dashed, unit=kind.unit, steps=[level.name for level in ladder])
    without = [bar(f"without {key}", f) for key, f in addition.without.items()]
    worth = Bars(without, dashed, unit=kind.unit)
    return Document(
        title=f"postproc add {name}",
        values=values,
        sentence=addition_sentence(addition),
        figures=[
            Figure("error before", mm(before), "before", kind.unit),
            Figure("error after", mm(after), "after", kind.unit),
            Figure("noise" if noise else SMOOTH_FUNCTIONS, floor, unit=kind.unit),
        ],
        sections=[
            Section(f"The error step by step, {each} on {rows}", [bars, View("evidence")], FALL),
            Section("Where it holds", [_where(values["regions"], floor)], HOLDS),
            *workspace_section(kind.name, "What it follows, at this step", program=True),
            Section(f"What each effect is worth, {each} on {rows}", [worth], EACH_NOTE),
            *channel_sections(fit, "What the rest follows", folded=True),
            Section("What to know of this fit", [*laws_in_symbols(fit), *known_of(fit)]),
            *parameter_sections(fit, added),
            Section("Parameters", [parameter_table(fit, [e.key for e in fit.model.effects], brief=True)], folded=True),
        ],
        scene=steps_scene(kind.name, lambda: steps_data(_rungs(addition), added, dashed), several=True),
    )


def addition_values(addition: Addition) -> dict[str, Any]:
    """Return the ``postproc/fit/1`` document, with the error after each added effect and the error without each one."""
    return {
        **fit_values(addition.fit, error_values(addition.before)),
        addition.fit.observed.key("floor"): mm(addition.floor),
        "ladder": [{"step": s.name, **error_values(s.fit), "explained_share": s.share} for s in addition.ladder],
        "regions": _region_values(addition),
        "leave_one_out": [{"without": key, **error_values(f)} for key, f in addition.without.items()],
    }


def addition_sentence(addition: Addition) -> str:
    """Say how far the error falls with the added effects, and what to do next."""
    fit, (first, last) = addition.fit, (1e3 * x for x in _falls(addition))
    each = f"{fit.observed.unit} per {fit.observed.each}"
    known = fit.parts.level is not None
    floor = f"the noise is {1e3 * addition.floor:.3f} {fit.observed.unit}"
    if not known:
        floor = f"{SMOOTH_FUNCTIONS}, without physics, leave {1e3 * addition.floor:.3f} {fit.observed.unit}"
    names = " and ".join(f"`{s.name.removeprefix('+ ')}`" for s in addition.ladder[1:])
    if fit.unnamed and fit.regions is None:
        return (
            f"In the fit the error falls from {first:.3f} to {last:.3f} {each}; {floor}. The form of a curve is "
            "chosen on all rows: what it is worth elsewhere, another table tells (`compare`)."
        )
    if fit.regions is not None and fit.regions.surest is not None:
        return (
            f"Adding {names} helps near the measured rows alone: in parts of the joint space left out, the curve "
            f"searched anew without them, the error is {last:.3f} {each}, {first:.3f} before; {floor}. "
            "The next `compensate` with this model uses the curve near the measured rows and leaves it out elsewhere."
        )
    share, unseen = addition.ladder[-1].share, "on rows that the fit has not seen"
    if fit.unnamed:
        unseen = "in parts of the joint space left out, the curve searched anew without them"
    falls = f"the error falls from {first:.3f} to {last:.3f} {each}"
    then = "Keep the model as it was, and ask `diagnose` what it lacks."
    if last >= (1 - LEAST_FALL) * first:
        text = f"Adding {names} does not help: {unseen}, the error is {last:.3f} {each}, {first:.3f} before"
    elif share is not None and share < HARDLY_ANY:
        text = f"Adding {names} hardly helps: {unseen}, {falls}"
    else:
        text = f"{unseen[0].upper()}{unseen[1:]}, {falls}"
        then = "The next `compensate` with this model corrects what it now predicts."
    return f"{text}; {floor}. {then}"


def _falls(addition: Addition) -> tuple[float, float]:
    """Return the errors [m], [rad] before and after, on rows that neither parameters nor forms come from.

    A curve that was searched on all rows is judged in regions that were left out, or on the rows of the fit where there
    are none.
    """
    before, fit = addition.before, addition.fit
    if not fit.unnamed:
        return before.held_out_rms, fit.held_out_rms
    return (before.rms, fit.rms) if fit.regions is None else (rms(fit.regions.before), rms(fit.regions.after))


def _region_values(addition: Addition) -> dict[str, Any] | None:
    """Return errors [mm] before and after near the measured rows and in regions left out, and the expected ones.

    None without measured positions, or where nothing is known of regions.
    """
    fit, regions = addition.fit, addition.fit.regions
    if regions is None or fit.observed.name != "position":
        return None
    robot, state, model = fit.model.robot, fit.data.state, addition.model
    somewhere = anywhere(state, *np.clip([robot.lower, robot.upper], -np.pi, np.pi))
    noise = 1e-3 * float(model.fit.get("noise_mm", 0.0))
    near, far = (np.hypot(rms(predict_sigma(model, some)), noise) for some in (state, somewhere))
    measured = (mm(addition.before.held_out_rms), mm(fit.held_out_rms), mm(near))
    errors = (measured, (mm(rms(regions.before)), mm(rms(regions.after)), None), (None, None, mm(far)))
    keys = ("before_mm", "after_mm", "expected_mm")
    entries = {name: dict(zip(keys, row, strict=True)) for name, row in zip(REGIONS, errors, strict=True)}
    return {**entries, "local": regions.surest is not None}


def _where(regions: Values | None, floor: float) -> DataTable:
    """Return a table of the errors before and after, and of those to expect, near the measured rows and elsewhere.

    Args:
        regions: that entry of the document; None gives no rows. floor: the noise [mm], by which decimals go.
    """
    rows = [[text, *regions[key].values()] for key, text in REGIONS.items()] if regions else []
    return DataTable("where", ("where", "before mm", "after mm", "expected mm"), rows, decimals=decimals_of(floor))


def _rungs(addition: Addition) -> list[Rung]:
    """Return the steps of the addition for the page, each with its model evaluated on the same measurements."""
    rungs = []
    for k, step in enumerate(addition.ladder):
        fit = step.fit if isinstance(step.fit, Fit) else evaluate(step.model, addition.fit.data)
        error = step.fit.rms if addition.fit.unnamed else step.fit.held_out_rms
        known = isinstance(step.fit, Fit) and not addition.fit.unnamed
        rungs.append(Rung(step.name if k else BASE_LABEL, fit, error, known))
    return rungs
