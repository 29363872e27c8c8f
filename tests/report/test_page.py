"""Pages stand alone, say the main thing first and carry their document."""

from __future__ import annotations

import builtins
import json
import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from postproc.compensate.options import Options
from postproc.convert import Conversion, compensate_program
from postproc.diagnostics import Source
from postproc.effects.library.backlash import Backlash
from postproc.effects.library.instrument_frame import InstrumentFrame
from postproc.effects.library.joint_offset import JointOffset
from postproc.effects.library.tool_frame import ToolFrame
from postproc.identify.add import add_effects
from postproc.identify.compare import compare
from postproc.identify.diagnose import diagnose
from postproc.identify.diagnosis import Diagnosis
from postproc.identify.words.text import diagnosis_json
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.report.addition import addition_page
from postproc.report.batch import batch_page
from postproc.report.charts import Bins, bars, course, scatter, vectors
from postproc.report.comparison import comparison_page
from postproc.report.compensation import compensation_page
from postproc.report.diagnosis import diagnosis_page
from postproc.report.figures import chosen, enlargement, plane_views, space_view
from postproc.report.page import Section, grid, render_page, table
from postproc.report.residuals import suspect_chart
from postproc.report.svg import arrows, ticks
from postproc.resources import resource
from tests.identify.cells import hidden_found
from tests.render.test_effect_file import square_of_warmth

BASE = (InstrumentFrame, ToolFrame, JointOffset)


@pytest.fixture(scope="module")
def conversion() -> Conversion:
    data = resource("samples", "paper_case.mod").read_bytes()
    return compensate_program(Source("paper_case.mod", data), default_model(), Options(force=(200.0, -200.0, -200.0)))


def sample(name: str) -> tuple[Model, Measurements]:
    """A table of the samples, and the shipped model with the usual base at null."""
    model = replace(default_model(), effects=(*default_model().effects, *(e.null() for e in BASE)))
    data = resource("samples", "measurements", name).read_bytes()
    return model, read_measurements(Source("cell.csv", data), model.robot)


@cache
def diagnosed(name: str) -> Diagnosis:
    return diagnose(*sample(name))


def embedded(page: str) -> Any:
    found = re.search(r'<script type="application/json" id="document">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_compensation_page(conversion: Conversion) -> None:
    page = compensation_page("a<b>.mod", conversion, {"model": "cell.toml", "force on the TCP [N]": "0,0,-50"})
    r = conversion.report
    for asked in ("cell.toml", "0,0,-50", r["robot"]):
        assert f"<td>{asked}</td>" in page.partition("How this was made")[2]
    assert f"from {r['max_error_before_mm']:.3f} mm to {r['max_error_after_mm']:.3f} mm" in page
    assert f"<dt>after</dt><dd>{r['max_error_after_mm']:.3f} mm</dd>" in page
    assert "a&lt;b&gt;.mod" in page
    assert len(re.findall(r'<svg [^>]*role="img" aria-label="[^"]+"', page)) == 4
    assert page.count("<svg") == 4  # the deviation before and after, the way from above and from the side
    assert "plotly" not in page.lower()
    assert embedded(page) == json.loads(json.dumps(r))


def test_what_remains_beside_the_steady_way_stands_in_the_first_sentence(conversion: Conversion) -> None:
    def sentence(**figures: float) -> str:
        page = compensation_page("x.mod", replace(conversion, report={**conversion.report, **figures}))
        return re.findall(r'<p class="sentence">(.*?)</p>', page)[0]

    steady = {
        "max_arc_error_before_mm": None,
        "max_arc_error_after_mm": None,
        "max_error_before_mm": 0.5,
        "max_error_after_mm": 0.004,
        "tolerance_mm": 0.01,
    }
    assert sentence(**steady, max_transient_mm=0.01, max_transition_mm=0.0) == (
        "The largest deviation falls from 0.500 mm to 0.004 mm."
    )
    assert sentence(**steady, max_transient_mm=0.062, max_transition_mm=0.2) == (
        "At steady speed the deviation falls from 0.500 mm to 0.004 mm; there remain up to 0.062 mm while the speed changes "
        "and 0.200 mm where the correction jumps."
    )
    assert sentence(**steady, max_transient_mm=0.01, max_transition_mm=0.0, unproved_statements=3) == (
        "The largest deviation falls from 0.500 mm to 0.004 mm. 3 of these statements also run where they cannot be followed: "
        "what remains there is not proved."
    )


def test_names_in_a_page_are_text(conversion: Conversion) -> None:
    hostile = dict(
        conversion.report["statements"][0], routine="r<1>", reason="loop </script> index", residual_mm=np.nan
    )
    found = replace(conversion, report={**conversion.report, "statements": [hostile]})
    page = compensation_page("x.mod", found)
    assert "r<1>" not in page.split('id="document"')[0]
    assert "loop &lt;/script&gt; index" in page
    assert embedded(page)["statements"][0]["reason"] == "loop </script> index"
    assert embedded(page)["statements"][0]["residual_mm"] is None


def test_a_refused_program_says_so() -> None:
    refused = compensate_program(Source("x.mod", b"hello"), default_model(), Options())
    page = compensation_page("x.mod", refused)
    assert "no program was written" in page
    assert "RAP011" in page


def test_the_course_shows_the_largest_deviation(conversion: Conversion) -> None:
    page = compensation_page("x.mod", conversion)
    path = re.findall(r'<path d="M([^"]*)" fill="none" stroke="#c5221f"', page)[0]
    heights = [float(part.split()[1]) for part in re.split("[ML]", path)]
    assert conversion.before is not None
    # The axis ends 6 % above the largest value; 24 and 154 are its ends on the page.
    assert min(heights) == pytest.approx(154 - 130 / 1.06, abs=0.1)


def test_pages_load_nothing_from_elsewhere() -> None:
    html = space_view(np.random.default_rng(0).normal(size=(50, 3)), np.full((50, 3), 1e-4), 100.0, ["</script>"] * 50)
    page = render_page("t", "s", [Section("a", html)], {})
    assert 'class="space"' in page
    assert len(page) > 3e6
    own, bundle = page.split("<script>", 1)
    assert own.count("</script>") == 2  # the figure's and the document's: labels do not end an element
    assert not re.search(r"""(src|href)\s*=\s*["']""", own)
    assert not re.search(r"""<(script|link|img)[^>]+(src|href)=""", bundle)
    plain = render_page("t", "s", [Section("a", scatter(np.arange(5.0), np.arange(5.0), "x", "y", band=1.0))], {})
    assert len(plain) < 1e4


def test_space_fits_the_data_and_states_lengths() -> None:
    position = np.array([[1.0, 2.0, 3.0], [1.5, 2.0, 3.0]])
    vector = np.array([[1e-3, 0.0, 0.0], [0.0, 0.0, 2e-3]])
    html = space_view(position, vector, 100.0, ["P1", "P2"])
    figure = json.loads(re.findall(r'<script type="application/json">(.*)</script>', html)[0])
    ranges = [figure["layout"]["scene"][f"{axis}axis"]["range"] for axis in "xyz"]
    assert ranges == [pytest.approx([0.985, 1.515]), pytest.approx([1.985, 2.015]), pytest.approx([2.985, 3.215])]
    assert figure["data"][2]["text"] == ["P1", "P2"]


def test_vectors_are_drawn_without_plotly(monkeypatch: pytest.MonkeyPatch) -> None:
    original = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name.startswith("plotly"):
            raise ImportError(name)
        return original(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    assert space_view(np.eye(3), np.full((3, 3), 1e-3), 1.0, ["a", "b", "c"]) == ""
    assert plane_views(np.eye(3), np.full((3, 3), 1e-3), 100.0).count("<svg") == 2


def test_arrows_are_enlarged_by_a_round_number() -> None:
    assert enlargement(np.eye(3), np.full((3, 3), 1e-3)) == 60.0  # 0.1 of 1 m, 1.7 mm each
    vector = np.zeros((5000, 3))
    vector[17] = 1.0
    rows = chosen(vector)
    assert 17 in rows
    assert len(rows) < 700


def test_arrows_point_from_start_to_end() -> None:
    svg = vectors(np.zeros((1, 2)), np.array([[1.0, 1.0]]), "x", "y", way=np.array([[0.0, 0.0], [0.0, 1.0]]))
    x0, y0, x1, y1 = map(float, re.findall(r'<path d="M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)M', svg)[0])
    assert x1 > x0
    assert y1 < y0  # up on the page
    assert x1 - x0 == pytest.approx(y0 - y1)


def test_the_head_of_an_arrow_stands_across_it() -> None:
    drawn = arrows(np.array([[0.0, 0.0]]), np.array([[6.0, 8.0]]), "red")
    at = np.array(re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", drawn), dtype=float)
    assert at[1].tolist() == at[3].tolist() == [6.0, 8.0]
    # 4 long and 1.6 to each side of a direction (0.6, 0.8).
    assert at[[2, 4]] == pytest.approx(
        np.array([[6 - 2.4 - 1.28, 8 - 3.2 + 0.96], [6 - 2.4 + 1.28, 8 - 3.2 - 0.96]]), abs=0.06
    )


def test_comparison_page_shows_each_channel_where_it_tells_most() -> None:
    found = compare(default_model(), sample("simulated_backlash.csv")[1])
    page = comparison_page("cell.csv", found)
    j = found.as_json()
    assert f"<dt>mean distance</dt><dd>{j['mean_mm']:.3f} mm</dd>" in page
    titles = re.findall(r'font-weight="bold">([^<]*)<', page)
    channels = [title.split(":")[0] for title in titles]
    assert len(set(channels)) == len(channels) == len({t["channel"] for t in j["channels"]})
    first = j["channels"][0]
    at = "in space" if first["where"] == "space" else f"at {first['where']}"
    assert titles[0] == f"{first['channel']}: {100 * first['share']:.0f} % of the error {at}"
    assert re.search(r"<title>q2 [-\d.]+ deg: mean [-+\d.]+ \+- [\d.]+ (mrad|mm)</title>", page)
    assert f"{j['worst'][0]['pose_id']} (row {j['worst'][0]['row']})" in page


def test_diagnosis_page_names_what_is_missing_in_words_and_units() -> None:
    found = diagnosed("simulated_backlash.csv")
    page = diagnosis_page("cell.toml cell.csv", found)
    assert "The model lacks <code>backlash</code> (joints 2 and 4): a joint stops short" in page
    assert "<dt>missing</dt><dd>backlash</dd>" in page
    assert Backlash.title in page
    gap = found.final.model.effect("backlash").vector()  # type: ignore[union-attr]
    assert float(re.search(r"<td>half_gap.2.</td><td>(\S+) ± ", page)[1]) == pytest.approx(1e3 * gap[1], abs=2e-3)
    assert float(re.search(r"<td>half_gap.4.</td><td>(\S+) ± ", page)[1]) == pytest.approx(1e3 * gap[3], abs=2e-3)
    assert "half_gap[1]" not in page.split('id="document"')[0]


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
    found = hidden_found(square_of_warmth, seed=411)
    [first] = (s for s in found.suspects if s.where == "tool")
    chart = suspect_chart(found.searched, first, found.floor)
    x, y = np.array(points(chart)).T
    square = np.polynomial.Polynomial.fit(x, y, 2)
    warmth = found.searched.data.state.temperature
    scale = np.ptp(warmth) / np.ptp(x)
    assert np.std(y - square(x)) < 0.03 * np.ptp(y)
    assert warmth.min() + (square.deriv().roots()[0] - x.min()) * scale == pytest.approx(28.43, abs=0.3)
    assert "mm at tool, along (" in chart
    wide = replace(first, values=np.stack([first.values] * 2, axis=1))
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
    assert "<dt>with what has no name</dt><dd>0.03" in diagnosis_page("cell.toml cell.csv", found)


def test_the_page_of_a_long_table_shows_the_rows_that_were_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    model, measured = sample("simulated_step.csv")
    whole = diagnosis_json(diagnosed("simulated_step.csv"))
    monkeypatch.setattr("postproc.identify.refits.ENOUGH", 3 * len(measured) // 2)
    found = diagnose(model, measured)
    assert len(found.searched.data) < 0.6 * len(found.final.data)
    assert found.suspects[0].where == "joint 4"
    page = diagnosis_page("cell.toml cell.csv", found)
    assert "joint 4: step near" in page
    # The error that an effect would leave is told from the rows on which its fall was measured.
    after = {c["effect"]: c["rms_mm_after"] for c in whole["candidates"] if c["testable"]}
    half = {c["effect"]: c["rms_mm_after"] for c in embedded(page)["candidates"]}
    assert half["joint_error_map"] == pytest.approx(after["joint_error_map"], rel=0.25)


def test_addition_page_shows_what_each_effect_is_worth() -> None:
    found = add_effects(*sample("simulated_backlash.csv"), ["backlash"])
    page = addition_page("cell.toml cell.csv", found)
    rungs = re.findall(r"<span>([^<]*)</span><b><i[^>]*></i>.*?</b><span>([\d.]+) mm</span>", page)
    expected = [("the model as it came", found.before), ("+ backlash", found.fit)]
    expected += [(f"without {key}", fit) for key, fit in found.without.items()]
    assert rungs == [(label, f"{1e3 * fit.held_out_rms:.3f}") for label, fit in expected]
    gap = found.fit.model.effect("backlash").vector()  # type: ignore[union-attr]
    assert float(re.search(r"<td>half_gap.2.</td><td>(\S+) ± ", page)[1]) == pytest.approx(1e3 * gap[1], abs=2e-3)
    assert embedded(page)["schema"] == "postproc/fit/1"


def test_batch_page_puts_failures_and_the_farthest_first() -> None:
    finding = {
        "path": "b<1>.mod",
        "line": 3,
        "severity": "error",
        "code": "RAP007",
        "message": "PROC `main`",
        "help": "x",
    }
    kinds = (
        ("info", "MOT012", "x"),
        ("warning", "CMP005", "left"),
        *(("warning", "CMP006", f"{x} mm off") for x in (0.1, 0.92)),
    )
    told = [{**finding, "severity": s, "code": c, "message": m} for s, c, m in kinds]
    figures = {"max_error_before_mm": 2.0, "added_targets": 1, "cycle_time_s": 9.0, "statements": {"skipped": 2}}
    doubt = {"unproved_statements": 71}
    tasks = [
        {"name": "a.mod", "status": "compensated", "cached": True, **doubt, **figures, "max_error_after_mm": 0.01, "diagnostics": told},
        {"name": "b<1>.mod", "status": "failed", "cached": False, "diagnostics": [finding]},
        {"name": "c.mod", "status": "compensated", "cached": False, **figures, "max_error_after_mm": 0.2, "diagnostics": told[-2:-1]},
    ]  # fmt: skip
    counts = {"compensated": 2, "unchanged": 0, "failed": 1, "cached": 1, "copied": 0}
    page = batch_page("cell", {"tasks": tasks, "counts": counts, "diagnostics": []})
    assert (
        "2 of 3 programs are corrected; 1 failed and have no output; at most 0.200 mm remain, in <code>c.mod</code>."
        in page
    )
    for label, figure in (
        ("corrected", "2"),
        ("worst before", "2.000 mm"),
        ("worst after", "0.200 mm"),
        ("failed", "1"),
    ):
        assert f"<dt>{label}</dt><dd>{figure}</dd>" in page
    assert "nothing to correct" not in page
    shown, _, rest = page.partition("Every program")
    assert re.findall(r"<td>([A-Z]{3}\d{3})</td>", shown) == ["RAP007"]
    every, _, warned = rest.partition("</script>")[0].partition('id="document"')[0].partition("<h2>Warnings")
    assert re.findall(r"<td>([A-Z]{3}\d{3})</td>", warned) == ["CMP006", "CMP005"]
    assert re.search(r">3</td><td[^>]*>2</td>.*0.92 mm off", warned) and "0.1 mm off" not in warned
    assert every.count(">71<") == 1 and "also run where they cannot be followed" in every
    assert [every.index(f"<td>{name}</td>") for name in ("b&lt;1&gt;.mod", "c.mod", "a.mod")] == sorted(
        every.index(f"<td>{name}</td>") for name in ("b&lt;1&gt;.mod", "c.mod", "a.mod")
    )
    assert "compensated, as before" in every
    assert "<td>PROC <code>main</code></td>" in page


def points(svg: str) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in re.findall(r"M([\d.]+) ([\d.]+)h0", svg)]


def test_charts_place_points_and_band() -> None:
    svg = scatter(np.array([0.0, 1.0, np.nan]), np.array([2.0, -2.0, 5.0]), "q1 [deg]", "error", band=1.0)
    (x0, y0), (x1, y1) = points(svg)
    assert x0 < x1
    assert y0 < y1  # larger is higher up
    assert "<rect" in svg
    assert scatter(np.array([np.nan]), np.array([1.0]), "x", "y") == ""
    many = scatter(np.linspace(0, 1, 100_000), np.zeros(100_000), "x", "y")
    assert len(points(many)) < 1000  # what falls on the same half pixel is drawn once


def test_round_values_run_from_limit_to_limit() -> None:
    assert ticks(-1.0, 1.0).tolist() == [-1.0, -0.5, 0.0, 0.5, 1.0]
    first = ticks(-0.1, 1.0)[0]
    assert first == 0.0 and not np.signbit(first)


def test_few_values_become_columns() -> None:
    svg = scatter(np.repeat([-1.0, 1.0], 50), np.tile(np.arange(50.0), 2), "dir2", "mrad")
    x = np.array(points(svg))[:, 0]
    assert len(np.unique(x)) > 30
    assert np.sort(x)[49] < np.sort(x)[50] - 50  # the columns stay apart


def test_rings_stand_round_their_points_where_these_are_spread() -> None:
    x, y = np.append(np.repeat([-1.0, 1.0], 50), np.nan), np.append(np.tile(np.arange(50.0), 2), 0.0)
    svg = scatter(x, y, "dir2", "mrad", marks=[(7, "P8"), (100, "not measured")])
    ((cx, cy),) = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', svg)
    assert min(np.hypot(*(np.array(points(svg)) - [float(cx), float(cy)]).T)) < 0.5


def test_means_and_marks_speak_when_pointed_at() -> None:
    bins = Bins(np.arange(8.0), np.zeros(8), np.full(8, 0.1), [f"bin {i}" for i in range(8)])
    svg = scatter(np.arange(8.0), np.arange(8.0), "x", "y", bins=bins, marks=[(1, "P<1>")])
    assert svg.count("<title>") == 9
    assert "<title>P&lt;1&gt;</title>" in svg


def test_bars_end_at_the_floor() -> None:
    chart = bars({"a": 1.0, "b": 0.5, "unknown": None}, 0.1, aside="b")
    assert re.findall(r"width: ([\d.]+)%", chart) == ["100.0", "50.0"]
    assert set(re.findall(r"left: ([\d.]+)%", chart)) == {"10.0"}
    assert ">noise<" in chart
    assert "0.100 mm" in chart
    assert (
        course(np.arange(5.0), np.ones(5), "t", "mm", limit=0.5, color="#000", title="x").count("stroke-dasharray") == 1
    )
    assert grid(["a", "b"], 300) == '<div class="grid" style="--least: 300px">ab</div>'


def test_tables_escape_and_align() -> None:
    html = table(("name", "value"), [("<x>", 1.23456), ("y", None)])
    assert "&lt;x&gt;" in html
    assert '<td class="number">1.235</td>' in html
    assert table(("name",), []) == '<table><tr><th scope="col">name</th></tr></table>'
