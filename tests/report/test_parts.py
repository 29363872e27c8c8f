"""Charts, tables and columns that the pages are put together from."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc.report.blocks import Bar, Bars, Chart, DataTable, Document, Figure, Scene, Section
from postproc.report.drawing.charts import DrawnCurve, bars, histogram, scatter, shares
from postproc.report.drawing.columns import exact, packed
from postproc.report.drawing.svg import ticks
from postproc.report.page import grid, render_page, table
from postproc.report.terminal import render_text
from tests.report.conftest import numbers, points, tables


def test_charts_place_points_and_band() -> None:
    svg = scatter(np.array([0.0, 1.0, np.nan]), np.array([2.0, -2.0, 5.0]), "q1 [deg]", "error", noise=1.0)
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


def test_rings_stand_round_their_points_where_these_are_spread() -> None:
    x, y = np.append(np.repeat([-1.0, 1.0], 50), np.nan), np.append(np.tile(np.arange(50.0), 2), 0.0)
    svg = scatter(x, y, "dir2", "mrad", marks=[(7, "P8"), (100, "not measured")])
    ((cx, cy),) = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', svg)
    assert min(np.hypot(*(np.array(points(svg)) - [float(cx), float(cy)]).T)) < 0.5


def test_bars_end_at_the_floor() -> None:
    chart = bars(Bars([Bar("a", 1.0), Bar("b", 0.5), Bar("unknown", None)], 0.1, grey="b"))
    assert re.findall(r"width: ([\d.]+)%", chart) == ["100.0", "50.0"]
    assert set(re.findall(r"left: ([\d.]+)%", chart)) == {"10.0"}
    assert ">noise<" in chart
    assert "0.100 mm" in chart
    assert 'class="aside" style="width: 50.0%"' in chart
    assert '<button type="button" data-step="0">b</button>' in bars(
        Bars([Bar("a", 1.0), Bar("b", 0.5)], None, steps=["b"])
    )
    assert grid(["a", "b"], 300) == '<div class="grid" style="--least: 300px">ab</div>'


def test_a_law_is_drawn_in_its_band() -> None:
    x = np.linspace(0.0, 1.0, 11)
    svg = scatter(x, x, "q1 [deg]", "mrad", curve=DrawnCurve(x, x, np.full(11, 0.1)))
    law = np.array(
        re.findall(r"[ML]([\d.]+) ([\d.]+)", re.findall(r'<path d="([^"]*)" class="line law"', svg)[0]), float
    )
    band = np.array(re.findall(r"([\d.]+) ([\d.]+)", re.findall(r'<path d="([^"]*)" class="sure"', svg)[0]), float)
    at = np.array(points(svg))
    assert law == pytest.approx(at, abs=0.6)  # points and law are the same here
    per = (at[0, 1] - at[-1, 1]) / 1.0
    assert band[:11, 1] - law[:, 1] == pytest.approx(np.minimum(0.2, x + 0.05) * per, abs=0.6)
    steps = scatter(
        np.repeat([-1.0, 1.0], 20),
        np.zeros(40),
        "dir2",
        "mrad",
        curve=DrawnCurve(np.array([-1.0, 1.0]), np.zeros(2), np.zeros(2)),
    )
    assert steps.count('class="line law"') == 2  # a bar at each of two values, no line between them


def test_shares_rise_to_all_of_the_poses() -> None:
    svg = shares({"held out": ("means", np.arange(1.0, 101.0))}, "mm", "near")
    line = re.findall(r'<path d="(M[^"]*)" class="line means"', svg)[0]
    at = np.array(re.findall(r"[ML]([\d.]+) ([\d.]+)", line), float)
    assert (np.diff(at[:, 1]) <= 0).all()
    half = at[np.argmin(np.abs(at[:, 1] - at[:, 1].mean()))]
    assert half[0] == pytest.approx((at[0, 0] + at[-1, 0]) / 2, rel=0.1)


def test_a_histogram_counts_every_program() -> None:
    svg = histogram(
        {"before": ("was", np.array([1.0, 1.1, 0.2])), "after": ("is", np.array([0.01, np.nan, 0.0]))}, "mm", "t"
    )
    counts = re.findall(r"<title>(before|after): (\d+) from", svg)
    assert sum(int(n) for name, n in counts if name == "before") == 3
    assert sum(int(n) for name, n in counts if name == "after") == 1
    assert histogram({"before": ("was", np.array([np.nan]))}, "mm", "t") == ""


def test_tables_are_text_and_align() -> None:
    page = table(
        DataTable("t", ("name", "value"), [("</script><x>", 1.23456), ("y", None)], links=(0, ["a.html", None]))
    )
    assert page.count("</script>") == 1
    spec = tables(page)["t"]
    assert spec["rows"] == [["</script><x>", 1.23456, "a.html"], ["y", None, None]]
    assert [column["number"] for column in spec["columns"]] == [False, True]
    assert tables(table(DataTable("t", ("name",), [])))["t"]["rows"] == []
    rows = [(1, None, "y"), (0, "", "x")]
    spec = tables(table(DataTable("t", ("left", "empty", "name"), rows, links=(2, ["a.html", None]))))["t"]
    assert [column["title"] for column in spec["columns"]] == ["left", "name"]  # a column without any value is left out
    assert (spec["rows"], spec["link"]) == ([[1, "y", "a.html"], [0, "x", None]], 1)


def test_columns_are_read_as_they_were_written() -> None:
    x = np.array([[1.0, -2.0, np.nan], [0.25, 3.0, 7.0]])
    assert numbers(exact(x)) == pytest.approx(x, nan_ok=True)
    assert numbers(packed(x)) == pytest.approx(x, abs=9.0 / 65_000, nan_ok=True)
    assert numbers(exact(np.array([3, -1]))).tolist() == [3, -1]
    assert np.isnan(numbers(packed([np.nan]))).all() and numbers(packed([2.5, 2.5])) == pytest.approx([2.5, 2.5])


@pytest.mark.parametrize("name", ["path", "steps"])
def test_pages_load_nothing_and_are_small(name: str) -> None:
    scene = Scene(name, dict)
    section = Section("a", [Chart(lambda: ["<p>b</p>"])])
    page = render_page(Document(title="t", values={}, sentence="s", sections=[section], scene=scene))
    assert not re.search(r"""(src|href)\s*=\s*["']|https?:(?!//www\.w3\.org/)|@import|url\(""", page)
    assert len(page) < 100_000


def test_a_terminal_shows_tables_without_heads_and_what_stands_beneath_a_row() -> None:
    rows = [(1, 1234.56, "far", "why"), (2, None, "", "")]
    table = DataTable("t", ("line", "x [mm]", "note", ""), rows, beneath=2, decimals=1)
    bare = DataTable("t", ("", ""), [("a", "b"), ("cc", "")])
    document = Document(
        title="t", values={}, sentence="s", figures=[Figure("size", None)],
        sections=[Section("", [table]), Section("Bare", [bare]), Section("Nothing", [DataTable("t", ("a",), [])])],
    )  # fmt: skip
    assert render_text(document).splitlines() == [
        "s", "  line  x [mm]", "     1  1234.6", "       note: far", "       why", "     2", "",
        "Bare:", "  a   b", "  cc",
    ]  # fmt: skip
    page = render_page(document)
    assert "Nothing" not in page and "size" not in re.findall(r"<dt>(.*?)</dt>", page)
