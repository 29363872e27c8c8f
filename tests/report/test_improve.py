"""The pages of compare, diagnose and add: one story first, the laws that were found, steps from the base to the last."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from postproc.estimation.fitted import Fit
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.identification.diagnose import diagnose
from postproc.identification.diagnosis import Diagnosis
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.report.drawing.residuals import suspect_chart
from postproc.report.page import render_certificate, render_page
from postproc.report.terminal import render_text
from postproc.results.certificate import arm_certificate
from postproc.results.improve.addition import BASE_LABEL, addition_document
from postproc.results.improve.comparison import comparison_document, comparison_values
from postproc.results.improve.diagnosis import diagnosis_document
from tests.identification.cells import hidden_found
from tests.independent import arm as A
from tests.independent.cells import Hidden
from tests.report.build import (
    BACKLASH,
    STEP,
    added,
    carried,
    compared,
    diagnosed,
    figures,
    numbers,
    points,
    sample,
    tables,
)


def square_of_warmth(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """The tool's holder bows with the square of how far it is from the temperature at which it was made."""

    def world(s, p):
        turn = arm.forward(s.q, np.eye(4)).flange[:, :3, :3]
        return 2e-5 * (s.temperature[:, None] - 28.43) ** 2 * (turn @ [0.3, -0.8, 0.5])

    return Hidden("square_of_warmth", "unknown", channels=("temperature",), world=world)


def parameters(page: str) -> dict[str, float]:
    """Value of each parameter that the page has in its table, by effect and name."""
    return {f"{row[0]} {row[1]}": float(row[2].split(" ")[0]) for row in tables(page)["parameters"]["rows"] if row[3]}


def gaps(model: Model | None) -> dict[str, Any]:
    """Lost motion of the joints that have any [mrad], as a page shows it."""
    effect = None if model is None else model.effect("backlash")
    assert effect is not None
    values = 1e3 * effect.vector()
    return {f"backlash half_gap[{j + 1}]": pytest.approx(values[j], abs=2e-3) for j in np.flatnonzero(values)}


def test_a_comparison_shows_each_channel_where_it_tells_most() -> None:
    page, values = render_page(comparison_document("cell.csv", compared())), comparison_values(compared())
    assert figures(page)["mean distance"] == f"{values['mean_mm']:.3f} mm"
    every = page.partition("What it follows: every channel")[2].partition("</section>")[0]
    titles = re.findall(r'class="title">([^<]*)<', every)
    channels = [title.split(":")[0] for title in titles]
    assert len(set(channels)) == len(channels) == len({t["channel"] for t in values["channels"]})
    first = values["channels"][0]
    at = "in space" if first["where"] == "space" else f"at {first['where']}"
    assert titles[0] == f"{first['channel']}: {100 * first['share']:.0f} % of the variance {at}"
    assert re.search(r"<title>q2 [-\d.]+ deg: mean [-+\d.]+ \+- [\d.]+ (mrad|mm)</title>", every)
    [step] = carried(page, "steps")["steps"]
    assert 1 <= len(step["charts"]) <= 6 and titles[0] in step["charts"][0]
    worst = values["worst"][0]
    assert f"{worst['pose_id']} (row {worst['row']})" in carried(page, "steps")["label"]
    assert np.linalg.norm(numbers(step["away"]), axis=1).max() == pytest.approx(values["maximum_mm"], abs=1e-3)


def test_a_comparison_says_what_a_function_without_physics_could_do() -> None:
    addition, data = added("backlash"), sample(BACKLASH)[1]
    texts = [
        (addition.ladder[0].model, "A smooth function of all columns, without physics, brings it to "),
        (addition.fit.model, "What is left is of the size of the noise."),
    ]
    for model, text in texts:
        page = render_page(comparison_document("cell.csv", compare(model, data)))
        assert [each for _, each in texts if each in page] == [text]


def test_smooth_functions_cannot_do_worse_where_a_model_has_no_frames() -> None:
    """The arm of the library says nothing of instrument and tool: they are placed, as for the figures of the model."""
    data = sample(BACKLASH)[1]
    framed, bare = compare(added("backlash").ladder[0].model, data), compare(default_model(), data)
    assert bare.bound == pytest.approx(framed.bound, rel=0.1)
    assert "each channel (a recorded column, or what follows from it" in render_text(comparison_document("t", bare))


def test_the_certificate_of_an_arm_has_its_accuracy_and_repeatability() -> None:
    page = render_certificate(arm_certificate("cell.csv", compared()))
    iso = comparison_values(compared())["iso9283"]
    assert f">{iso['accuracy_mean_mm']:.3f}<" in page and f">{iso['repeatability_max_mm']:.3f}<" in page
    assert page.count("name, date, signature") == 3
    fitted = replace(compared(), fit=recorded(added("backlash").fit))
    assert "is what the model was fitted to: no independent check" in render_certificate(arm_certificate("c", fitted))


def recorded(fit: Fit) -> Fit:
    """The fit of a model that was written to a file and read again."""
    return replace(fit, problem=replace(fit.problem, model=recorded_model(fit)))


def test_a_diagnosis_names_what_is_missing_in_words_and_units() -> None:
    diagnosis = diagnosed(BACKLASH)
    page = render_page(diagnosis_document("cell.toml cell.csv", diagnosis))
    assert "The model lacks <code>backlash</code> (joints 2 and 4): a joint stops short" in page
    assert figures(page)["missing"] == "backlash"
    title = "a joint stops short on the side from which it came"
    assert tables(page)["missing effects"]["rows"][0][:2] == ["backlash", title]
    assert parameters(page) == gaps(diagnosis.final.model)
    steps = carried(page, "steps")["steps"]
    assert [(step["name"], len(step["laws"])) for step in steps] == [
        (BASE_LABEL, 0),
        ("with what is missing", 2),
    ]


def test_an_unknown_effect_shows_as_it_is_without_what_the_fit_took_on() -> None:
    found = searched_in_part()
    assert (found.remaining[0].channel, found.remaining[0].where) == ("q4", "joint 4")
    at = points(suspect_chart(found.searched, found.remaining[0], found.floor))
    # Flat on both sides of the step; the plain residual is a saw tooth, because the fit has taken part of it on.
    edges = np.unique(at[:, 0])[10:-10]
    split = max(edges, key=lambda x: abs(at[at[:, 0] < x, 1].mean() - at[at[:, 0] >= x, 1].mean()))
    left, right = at[at[:, 0] < split, 1], at[at[:, 0] >= split, 1]
    assert abs(left.mean() - right.mean()) > 4 * max(left.std(), right.std())


def test_an_unknown_effect_of_the_tool_shows_along_the_way_that_it_goes() -> None:
    found = hidden_found(square_of_warmth, seed=411, poses=60)
    [first] = (s for s in found.remaining if s.where == "tool")
    chart = suspect_chart(found.searched, first, found.floor)
    x, y = points(chart).T
    square = np.polynomial.Polynomial.fit(x, y, 2)
    warmth = found.searched.data.state.temperature
    scale = np.ptp(warmth) / np.ptp(x)
    assert np.std(y - square(x)) < 0.03 * np.ptp(y)
    assert warmth.min() + (square.deriv().roots()[0] - x.min()) * scale == pytest.approx(28.43, abs=0.3)
    assert "mm at tool, along (" in chart
    wide = replace(first, form=replace(first.form, factors=(), parts=(first.form, first.form)))
    assert suspect_chart(found.searched, wide, found.floor) == ""
    units = {"base": "mrad", "body 3": "mrad", "body 3, shifted": "mm", "instrument, turned": "mrad"}
    for where, ours in units.items():
        assert f"{ours} at {where}, along (" in suspect_chart(found.searched, replace(first, where=where), found.floor)
    for where in ("instrument, shifted and turned", "tool, under a weight", "instrument, azimuth"):
        assert suspect_chart(found.searched, replace(first, where=where), found.floor) == ""
    page = render_page(diagnosis_document("cell.toml cell.csv", found))
    assert figures(page)["error in parts left out with what has no name"].startswith("0.03")


@cache
def searched_in_part() -> Diagnosis:
    """What is missing in the table with the step, searched on half of its rows, as in a table that is long."""
    model, measured = sample(STEP)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("postproc.identification.refits.MOST_NUMBERS_SEARCHED", 3 * len(measured) // 2)
        return diagnose(model, measured)


def test_the_page_of_a_long_table_shows_the_rows_that_were_searched() -> None:
    found = searched_in_part()
    assert len(found.searched.data) < 0.6 * len(found.final.data)
    assert found.remaining[0].where == "joint 4"
    page = render_page(diagnosis_document("cell.toml cell.csv", found))
    assert "joint 4: step near" in page
    # The error that an effect would leave is told from the rows on which its fall was measured.
    half = {c["effect"]: c["rms_mm_after"] for c in carried(page)["candidates"]}
    whole = add_effects(*sample(STEP), ["joint_error_map"]).fit
    assert half["joint_error_map"] == pytest.approx(1e3 * whole.rms, rel=0.25)


def test_an_addition_shows_what_each_effect_is_worth() -> None:
    addition = added("backlash")
    page = render_page(addition_document("cell.toml cell.csv", addition))
    bars = re.findall(r">([^<>]*)</(?:span|button)><b><i[^>]*></i>.*?</b><span>([\d.]+) mm</span>", page)
    fits = {BASE_LABEL: addition.before, "+ backlash": addition.fit}
    fits |= {f"without {key}": fit for key, fit in addition.without.items()}  # type: ignore[misc]
    assert bars == [(name, f"{1e3 * fit.held_out_rms:.3f}") for name, fit in fits.items()]
    assert gaps(addition.fit.model).items() <= parameters(page).items()
    assert carried(page)["schema"] == "postproc/fit/1"


def test_the_steps_of_an_addition_are_its_ladder() -> None:
    """Residuals of every step are those of its model, and sample targets move by what that model corrects."""
    addition = added("backlash", "transmission_error")
    steps = carried(render_page(addition_document("cell.toml cell.csv", addition)), "steps")["steps"]
    assert [step["name"] for step in steps] == [BASE_LABEL, "+ backlash", "+ transmission_error"]
    for step, rung in zip(steps, addition.ladder, strict=True):
        assert step["error"] == pytest.approx(1e3 * rung.fit.held_out_rms)
        assert np.sqrt(np.mean(numbers(step["away"]) ** 2)) == pytest.approx(1e3 * rung.fit.rms, rel=1e-3)
    last = steps[-1]["program"][0]
    assert last["name"] in map(str, addition.fit.data.pose_id)
    moved = np.linalg.norm(np.subtract(last["written"], last["programmed"]))
    assert 0.05 < moved < 10  # the joint offsets and the deflection of this arm, without the tool that nobody named
