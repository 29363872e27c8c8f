"""The pages of compare, diagnose and add: one story first, the laws that were found, steps from the base to the last."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.files import resource
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.identification.diagnose import diagnose
from postproc.identification.diagnosis import Diagnosis
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.report.drawing.residuals import suspect_chart
from postproc.report.page import render_certificate, render_page
from postproc.results.addition import addition_document
from postproc.results.certificate import arm_certificate
from postproc.results.comparison import comparison_document, comparison_values
from postproc.results.diagnosis import diagnosis_document, diagnosis_values
from tests.identification.cells import hidden_found
from tests.render.test_effect_file import square_of_warmth
from tests.report.conftest import carried, numbers, points, tables

BASE = (InstrumentFrame, ToolFrame, JointOffset)


def sample(name: str) -> tuple[Model, Measurements]:
    """A table of the samples, and the shipped model with the usual base at null."""
    model = replace(default_model(), effects=(*default_model().effects, *(e.null() for e in BASE)))
    data = resource("samples", "measurements", name).read_bytes()
    return model, read_measurements(Source("cell.csv", data), model.robot)


@cache
def diagnosed(name: str) -> Diagnosis:
    return diagnose(*sample(name))


def figures(page: str) -> dict[str, str]:
    return dict(re.findall(r"<dt>(.*?)</dt><dd[^>]*>(.*?)</dd>", page))


def test_comparison_page_shows_each_channel_where_it_tells_most() -> None:
    found = compare(default_model(), sample("simulated_backlash.csv")[1])
    page = render_page(comparison_document("cell.csv", found))
    j = comparison_values(found)
    assert figures(page)["mean distance"] == f"{j['mean_mm']:.3f} mm"
    every = page.partition("What it follows: every channel")[2].partition("</section>")[0]
    titles = re.findall(r'class="title">([^<]*)<', every)
    channels = [title.split(":")[0] for title in titles]
    assert len(set(channels)) == len(channels) == len({t["channel"] for t in j["channels"]})
    first = j["channels"][0]
    at = "in space" if first["where"] == "space" else f"at {first['where']}"
    assert titles[0] == f"{first['channel']}: {100 * first['share']:.0f} % of the error {at}"
    assert re.search(r"<title>q2 [-\d.]+ deg: mean [-+\d.]+ \+- [\d.]+ (mrad|mm)</title>", every)
    [step] = carried(page, "steps")["steps"]
    assert 1 <= len(step["charts"]) <= 6 and titles[0] in step["charts"][0]
    label = carried(page, "steps")["label"]
    assert f"{j['worst'][0]['pose_id']} (row {j['worst'][0]['row']})" in label
    away = np.linalg.norm(numbers(step["away"]), axis=1)
    assert away.max() == pytest.approx(j["maximum_mm"], abs=1e-3)


def test_the_certificate_of_an_arm() -> None:
    found = compare(default_model(), sample("simulated_backlash.csv")[1])
    page, iso = render_certificate(arm_certificate("cell.csv", found)), comparison_values(found)["iso9283"]
    assert f">{iso['accuracy_mean_mm']:.3f}<" in page and f">{iso['repeatability_max_mm']:.3f}<" in page
    assert page.count("name, date, signature") == 3


def test_diagnosis_page_names_what_is_missing_in_words_and_units() -> None:
    found = diagnosed("simulated_backlash.csv")
    page = render_page(diagnosis_document("cell.toml cell.csv", found))
    assert "The model lacks <code>backlash</code> (joints 2 and 4): a joint stops short" in page
    assert figures(page)["missing"] == "backlash"
    assert tables(page)["missing effects"]["rows"][0][:2] == [
        "backlash",
        "a joint stops short on the side from which it came",
    ]
    gap = found.final.model.effect("backlash").vector()  # type: ignore[union-attr]
    told = {row[1]: float(row[2].split(" ")[0]) for row in tables(page)["parameters"]["rows"]}
    assert told == {
        "half_gap[2]": pytest.approx(1e3 * gap[1], abs=2e-3),
        "half_gap[4]": pytest.approx(1e3 * gap[3], abs=2e-3),
    }
    steps = carried(page, "steps")["steps"]
    assert [step["name"] for step in steps] == ["the model as it came", "with what is missing"]
    assert [len(step["laws"]) for step in steps] == [0, 2]


def test_an_unknown_effect_shows_as_it_is_without_what_the_fit_took_on() -> None:
    found = diagnosed("simulated_step.csv")
    assert (found.suspects[0].channel, found.suspects[0].where) == ("q4", "joint 4")
    at = np.array(points(suspect_chart(found.searched, found.suspects[0], found.floor)))
    # Flat on both sides of the step; the plain residual is a saw tooth, because the fit has taken part of it on.
    edges = np.unique(at[:, 0])[10:-10]
    split = max(edges, key=lambda x: abs(at[at[:, 0] < x, 1].mean() - at[at[:, 0] >= x, 1].mean()))
    left, right = at[at[:, 0] < split, 1], at[at[:, 0] >= split, 1]
    assert abs(left.mean() - right.mean()) > 4 * max(left.std(), right.std())


def test_an_unknown_effect_of_the_tool_shows_along_the_way_that_it_goes() -> None:
    found = hidden_found(square_of_warmth, seed=411, poses=60)
    [first] = (s for s in found.suspects if s.where == "tool")
    chart = suspect_chart(found.searched, first, found.floor)
    x, y = np.array(points(chart)).T
    square = np.polynomial.Polynomial.fit(x, y, 2)
    warmth = found.searched.data.state.temperature
    scale = np.ptp(warmth) / np.ptp(x)
    assert np.std(y - square(x)) < 0.03 * np.ptp(y)
    assert warmth.min() + (square.deriv().roots()[0] - x.min()) * scale == pytest.approx(28.43, abs=0.3)
    assert "mm at tool, along (" in chart
    wide = replace(first, form=replace(first.form, factors=(), parts=(first.form, first.form)))
    assert suspect_chart(found.searched, wide, found.floor) == ""
    for where, ours in (
        ("base", "mrad"),
        ("body 3", "mrad"),
        ("body 3, shifted", "mm"),
        ("instrument, turned", "mrad"),
    ):
        assert f"{ours} at {where}, along (" in suspect_chart(found.searched, replace(first, where=where), found.floor)
    for where in ("instrument, shifted and turned", "tool, under a weight", "instrument, azimuth"):
        assert suspect_chart(found.searched, replace(first, where=where), found.floor) == ""
    assert figures(render_page(diagnosis_document("cell.toml cell.csv", found)))[
        "error with what has no name, at best"
    ].startswith("0.03")


def test_the_page_of_a_long_table_shows_the_rows_that_were_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    model, measured = sample("simulated_step.csv")
    whole = diagnosis_values(diagnosed("simulated_step.csv"))
    monkeypatch.setattr("postproc.identification.refits.MOST_NUMBERS_SEARCHED", 3 * len(measured) // 2)
    found = diagnose(model, measured)
    assert len(found.searched.data) < 0.6 * len(found.final.data)
    assert found.suspects[0].where == "joint 4"
    page = render_page(diagnosis_document("cell.toml cell.csv", found))
    assert "joint 4: step near" in page
    # The error that an effect would leave is told from the rows on which its fall was measured.
    after = {c["effect"]: c["rms_mm_after"] for c in whole["candidates"] if c["testable"]}
    half = {c["effect"]: c["rms_mm_after"] for c in carried(page)["candidates"]}
    assert half["joint_error_map"] == pytest.approx(after["joint_error_map"], rel=0.25)


def test_addition_page_shows_what_each_effect_is_worth() -> None:
    found = add_effects(*sample("simulated_backlash.csv"), ["backlash"])
    page = render_page(addition_document("cell.toml cell.csv", found))
    bars = re.findall(r">([^<>]*)</(?:span|button)><b><i[^>]*></i>.*?</b><span>([\d.]+) mm</span>", page)
    expected = [("the model as it came", found.before), ("+ backlash", found.fit)]
    expected += [(f"without {key}", fit) for key, fit in found.without.items()]
    assert bars == [(label, f"{1e3 * fit.held_out_rms:.3f}") for label, fit in expected]
    gap = found.fit.model.effect("backlash").vector()  # type: ignore[union-attr]
    told = {tuple(row[:2]): row[2] for row in tables(page)["parameters"]["rows"]}
    assert float(told["backlash", "half_gap[2]"].split(" ")[0]) == pytest.approx(1e3 * gap[1], abs=2e-3)
    assert carried(page)["schema"] == "postproc/fit/1"


def test_the_steps_of_an_addition_are_its_ladder() -> None:
    """Residuals of every step are those of its model, and its sample targets are what that model commands."""
    found = add_effects(*sample("simulated_backlash.csv"), ["joint_error_map", "backlash"])
    steps = carried(render_page(addition_document("cell.toml cell.csv", found)), "steps")
    assert [step["name"] for step in steps["steps"]] == ["the model as it came", "+ joint_error_map", "+ backlash"]
    assert [step["error"] for step in steps["steps"]] == pytest.approx([1e3 * s.fit.held_out_rms for s in found.ladder])
    for step, rung in zip(steps["steps"], found.ladder, strict=True):
        away = numbers(step["away"])
        assert np.sqrt(np.mean(away**2)) == pytest.approx(1e3 * rung.fit.rms, rel=1e-3)
    last = steps["steps"][-1]["program"][0]
    i = [str(x) for x in found.fit.data.pose_id].index(last["name"])
    state = found.fit.problem.equilibrium.state.rows([i])
    moved = np.linalg.norm(np.subtract(last["written"], last["programmed"]))
    assert 0.05 < moved < 10  # the joint offsets and the deflection of this arm, without the tool that nobody named
    assert len(state) == 1
