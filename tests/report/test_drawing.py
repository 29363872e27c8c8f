"""What pages draw: charts, tables and columns, and the laws of effects, worked out here from their equations."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.effects.base import Effect, Load, param
from postproc.effects.library.joints.backlash import Backlash
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.model.uncertainty.scatter import stiffness_factors
from postproc.report.blocks import Bar, Bars, Chart, DataTable, Document, Figure, Scene, Section
from postproc.report.drawing.charts import DrawnCurve, scatter, shares
from postproc.report.drawing.columns import exact, packed
from postproc.report.drawing.laws import Law, law_charts, laws_of
from postproc.report.drawing.parameters import correlated_pairs, correlations, drawn_parameters, parameter_chart
from postproc.report.drawing.postures import AtTool, posture_drawings
from postproc.report.page import render_page
from postproc.report.terminal import render_text
from postproc.results.wording import named_values
from tests.report.build import BACKLASH, chain, line, numbers, points, sample, tables

DIRECTIONS = np.array([-1.0, 1.0])


def document(*blocks: object, **how: object) -> Document:
    return Document(title="t", values={}, sentence="s", sections=[Section("a", blocks)], **how)  # type: ignore[arg-type]


def test_points_stand_at_their_values_in_a_band_of_noise() -> None:
    svg = scatter(np.array([0.0, 1.0, np.nan]), np.array([2.0, -2.0, 5.0]), "q1 [deg]", "error", noise=1.0)
    (x0, y0), (x1, y1) = points(svg)
    assert x0 < x1 and y0 < y1 and 'class="noise"' in svg  # larger is higher up, at fewer pixels
    assert scatter(np.array([np.nan]), np.array([1.0]), "x", "y") == ""
    many = scatter(np.linspace(0, 1, 100_000), np.zeros(100_000), "x", "y")
    assert len(points(many)) < 1000  # what falls on the same half pixel is drawn once


@pytest.mark.parametrize(("low", "labels"), [(-1.0, ["-1", "-0.5", "0", "0.5", "1"]), (-0.1, ["0", "0.5", "1"])])
def test_round_values_run_from_limit_to_limit(low: float, labels: list[str]) -> None:
    svg = scatter(np.arange(2.0), np.zeros(2), "x", "y", across=(low, 1.0))
    assert re.findall(r'text-anchor="end">([^<]*)<', svg) == labels


def test_rings_stand_round_their_points_where_these_are_spread() -> None:
    x, y = np.append(np.repeat(DIRECTIONS, 50), np.nan), np.append(np.tile(np.arange(50.0), 2), 0.0)
    svg = scatter(x, y, "dir2", "mrad", marks=[(7, "P8"), (100, "not measured")])
    [ring] = np.array(re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', svg), float)
    assert np.linalg.norm(points(svg) - ring, axis=1).min() < 0.5


def test_a_law_is_drawn_in_its_band() -> None:
    x = np.linspace(0.0, 1.0, 11)
    svg = scatter(x, x, "q1 [deg]", "mrad", curve=DrawnCurve(x, x, np.full(11, 0.1)))
    law, band, data = line(svg, "line law"), line(svg, "sure"), points(svg)
    assert law == pytest.approx(data, abs=0.6)  # points and law are the same here
    pixels = data[0, 1] - data[-1, 1]  # of a unit of y
    assert band[:11, 1] - law[:, 1] == pytest.approx(np.minimum(0.2, x + 0.05) * pixels, abs=0.6)
    bars = DrawnCurve(DIRECTIONS, np.zeros(2), np.zeros(2))
    steps = scatter(np.repeat(DIRECTIONS, 20), np.zeros(40), "dir2", "mrad", curve=bars)
    assert steps.count('class="line law"') == 2  # a bar at each of two values, no line between them


def test_shares_rise_to_all_of_the_poses() -> None:
    curve = line(shares({"held out": ("means", np.arange(1.0, 101.0))}, "mm", "near"), "line means")
    assert (np.diff(curve[:, 1]) <= 0).all()
    half = curve[np.argmin(np.abs(curve[:, 1] - curve[:, 1].mean()))]
    assert half[0] == pytest.approx((curve[0, 0] + curve[-1, 0]) / 2, rel=0.1)


def test_columns_are_read_as_they_were_written() -> None:
    x = np.array([[1.0, -2.0, np.nan], [0.25, 3.0, 7.0]])
    assert numbers(exact(x)) == pytest.approx(x, nan_ok=True)
    assert numbers(packed(x)) == pytest.approx(x, abs=9.0 / 65_000, nan_ok=True)
    assert numbers(exact(np.array([3, -1]))).tolist() == [3, -1]
    assert np.isnan(numbers(packed([np.nan]))).all() and numbers(packed([2.5, 2.5])) == pytest.approx([2.5, 2.5])


def test_bars_end_at_the_floor() -> None:
    block = Bars([Bar("a", 1.0), Bar("b", 0.5), Bar("unknown", None)], 0.1, grey="b", steps=["a"])
    page = render_page(document(block))
    assert re.findall(r"width: ([\d.]+)%", page.partition('class="bars"')[2]) == ["100.0", "50.0"]
    assert set(re.findall(r"left: ([\d.]+)%", page)) == {"10.0"}
    assert 'class="aside" style="width: 50.0%"' in page and '<button type="button" data-step="0">a</button>' in page
    assert ">noise<" in page and "0.100 mm" in page
    assert render_text(document(block)).splitlines()[-4:] == [
        "  a           1.000",
        "  b           0.500",
        "  unknown   unknown",
        "  noise       0.100",
    ]


def test_charts_stand_side_by_side_where_they_are_wide_enough() -> None:
    page = render_page(document(Chart(lambda: ["<p>a</p>", "", "<p>b</p>"], least=300)))
    assert '<div class="grid" style="--least: 300px"><p>a</p><p>b</p></div>' in page


def test_a_table_has_the_columns_with_values_and_links_of_one_of_them() -> None:
    rows = [(1, None, "</script><x>"), (0.5, "", "x"), (None, None, "y")]
    page = render_page(document(DataTable("t", ("left", "empty", "name"), rows, links=(2, ["a.html", None, None]))))
    spec = tables(page)["t"]
    assert [(column["title"], column["number"]) for column in spec["columns"]] == [("left", True), ("name", False)]
    assert spec["rows"] == [[1, "</script><x>", "a.html"], [0.5, "x", None], [None, "y", None]]
    assert spec["link"] == 1 and "<x>" not in page


@pytest.mark.parametrize("name", ["path", "steps", "programs"])
def test_pages_load_nothing_and_are_small(name: str) -> None:
    page = re.sub(r"/\*!.*?\*/", "", render_page(document(Chart(lambda: ["<p>b</p>"]), scene=Scene(name, dict))))
    assert not re.search(r"""(src|href)\s*=\s*["']|https?:(?!//www\.w3\.org/)|@import|url\(""", page)
    assert len(page) < 750_000


def test_a_terminal_shows_tables_without_heads_and_what_stands_beneath_a_row() -> None:
    rows = [(1, 1234.56, "a", "far", "why"), (2, None, 5, "", "")]
    table = DataTable("t", ("line", "x [mm]", "mixed", "note", ""), rows, beneath=3, decimals=1)
    bare, empty = DataTable("t", ("", ""), [("a", "b"), ("cc", "")]), DataTable("t", ("a",), [])
    sections = [Section("", [table]), Section("Bare", [bare]), Section("Nothing", [empty])]
    shown = Document(title="t", values={}, sentence="s", figures=[Figure("size", None)], sections=sections)
    assert render_text(shown).splitlines() == [
        "s",
        "  line  x [mm]  mixed",
        "     1  1234.6  a",
        "       note: far",
        "       why",
        "     2          5",
        "",
        "Bare:",
        "  a   b",
        "  cc",
    ]
    page = render_page(shown)
    assert "Nothing" not in page and "size" not in re.findall(r"<dt>(.*?)</dt>", page)


def test_a_posture_is_drawn_from_the_side_and_from_above(fitted: Fit) -> None:
    model, q = fitted.model, fitted.problem.sensitivity.state.q[:3]
    for drawing, row in zip(posture_drawings(model, q, ["a<1>", "b", "c"], above=True), q, strict=True):
        x, y, z, _ = chain(model.robot.link, model.robot.axis, row)[-1] @ np.append(model.T_flange_tcp[:3, 3], 1.0)
        limbs = re.findall(r'<path d="([^"]*)" class="line (?:limb|tool)"', drawing)
        side, above = (np.array(re.findall(r"[ML]([-\d.]+) ([-\d.]+)", limbs[k] + limbs[k + 1]), float) for k in (0, 2))
        tip = above[-1] - above[0]
        assert np.arctan2(-tip[1], tip[0]) == pytest.approx(np.arctan2(y, x), abs=0.03)
        assert (side[0, 1] - side[-1, 1]) / (side[-1, 0] - side[0, 0]) == pytest.approx(z / np.hypot(x, y), rel=0.05)
        assert "<1>" not in drawing


def test_the_side_of_a_gauge_and_the_way_of_a_load_are_drawn(fitted: Fit) -> None:
    model, q = fitted.model, fitted.problem.sensitivity.state.q[:1]
    for gauge, down in ((1.0, True), (-1.0, False)):
        at_tool = AtTool(np.array([[0.0, 0, gauge]]), np.array([[0.0, 0, -gauge]]), ["+z; 5 N"])
        (drawing,) = posture_drawings(model, q, ["a"], True, at_tool)
        tool = np.array(re.findall(r"L([-\d.]+) ([-\d.]+)\" class=\"line tool\"", drawing), float)[:, 1]
        seen = [re.findall(rf'<g class="{kind}">(.*?)</g>', drawing) for kind in ("gauge", "load")]
        (dial, ring), (arrow, away) = seen
        assert (float(re.findall(r'cy="([-\d.]+)"', dial)[0]) < tool[0]) == down
        tail, tip = map(float, re.findall(r"[ML][-\d.]+ ([-\d.]+)", arrow)[:2])
        assert (tail < tip) == down
        assert ("dot" in ring) == ("cross" in away) == down and "+z; 5 N" in drawing


def law(fit: Fit, key: str, where: str) -> Law:
    [law] = [law for law in laws_of(fit, [key]) if law.where == where]
    return law


def parameter(fit: Fit, key: str, index: int) -> tuple[float, float]:
    """Value and standard deviation."""
    effect = fit.model.effect(key)
    assert effect is not None
    return float(effect.vector()[index]), fit.sigma[key, index]


@pytest.fixture(scope="module")
def fitted() -> Fit:
    return fit_model(*sample(BACKLASH), [Backlash.null()])


def test_a_spring_is_a_line_through_the_load(fitted: Fit) -> None:
    """Compliance C of joint 2: mrad = 1000 C N m, its band 1000 sigma_C N m."""
    spring = law(fitted, "joint_compliance", "joint 2")
    C, sigma = parameter(fitted, "joint_compliance", 1)
    assert (spring.channel, spring.unit) == ("load2", "mrad")
    assert spring.curve.y == pytest.approx(1e3 * C * spring.curve.x, rel=1e-6, abs=1e-9)
    assert spring.curve.sigma == pytest.approx(1e3 * sigma * np.abs(spring.curve.x), rel=1e-3)
    # The data scatter about the law by the noise at the lever of the arm, not by the deflection itself.
    assert np.nanstd(spring.y - 1e3 * C * spring.x) < 0.2 * np.nanstd(spring.y)


def test_lost_motion_is_a_step_of_the_approach(fitted: Fit) -> None:
    step = law(fitted, "backlash", "joint 4")
    gap = 1e3 * parameter(fitted, "backlash", 3)[0]
    assert step.channel == "dir4" and step.curve.x.tolist() == [-1.0, 1.0]
    assert np.abs(step.curve.y) == pytest.approx([gap, gap]) and step.curve.y[0] == -step.curve.y[1]


def test_what_is_the_same_everywhere_is_no_law(fitted: Fit) -> None:
    assert laws_of(fitted, ["joint_offset", "tool_frame", "instrument_frame", "unknown"]) == []


class ForearmSpring(Effect, reads=("q", "pose", "robot")):
    """A spring pulls the forearm up, k sin q2 [N] in z at its joint. Source: this test."""

    stiffness_N: float = param(unit="N", typical=100.0)

    def load(self, state: State) -> Load:
        T = np.asarray(state.T_base_body)
        force = np.zeros((len(state), 3))
        force[:, 2] = self.stiffness_N * np.sin(state.q[:, 1])
        point = T[:, 3, :3, 3] + 0.4 * T[:, 3, :3, 0]
        return Load(body={3: np.hstack([force, np.cross(point, force)])})


@pytest.mark.parametrize("joint", [2, 3])
def test_a_force_is_drawn_as_torques_on_the_joints(fitted: Fit, joint: int) -> None:
    """Virtual work: the torque on a joint is f . dp/dq, here from plain differences of the forward kinematics."""
    model = fitted.model.with_effects(*fitted.model.effects, ForearmSpring(stiffness_N=200.0))
    fit = replace(fitted, problem=replace(fitted.problem, model=model))
    robot, q = model.robot, fit.problem.sensitivity.state.q
    torque = law(fit, "forearm_spring", f"torque on joint {joint}")

    def height(q: np.ndarray) -> float:
        forearm = chain(robot.link, robot.axis, q)[2]
        return float((forearm @ [0.4, 0.0, 0.0, 1.0])[2])

    # The bodies stand where the deflected arm has them, a millimetre or so from here.
    step = 1e-5 * np.eye(6)[joint - 1]
    lever = np.array([(height(row + step) - height(row - step)) / 2e-5 for row in q])
    assert torque.unit == "N m" and torque.y == pytest.approx(200.0 * np.sin(q[:, 1]) * lever, abs=1.0)


def test_parameters_stand_on_the_axis_of_their_prior(fitted: Fit) -> None:
    """Springs in logarithms, ln(C / C_type) over ln(factor) / 1.96; correlations are those of the covariance."""
    words = named_values(fitted, ["joint_compliance", "backlash"])
    drawn = {(one.effect, one.name): one for one in drawn_parameters(fitted, words)}
    C, sigma = parameter(fitted, "joint_compliance", 1)
    robot = fitted.model.robot
    assert robot.joint_compliance is not None
    spread = np.log(stiffness_factors(robot)[1]) / 1.96
    spring = drawn["joint_compliance", "compliance[2]"]
    assert spring.at == pytest.approx(np.log(C / robot.joint_compliance[1]) / spread, rel=1e-3)
    assert spring.high - spring.low == pytest.approx(2 * 1.96 * sigma / C / spread, rel=0.1) and spring.determined
    assert not drawn["joint_compliance", "compliance[1]"].determined
    chart = parameter_chart(list(drawn.values()))
    assert chart.count('class="axis"') + chart.count('class="axis open"') == len(drawn)
    assert chart.count("not told by these rows<") == sum(not one.determined for one in drawn.values())
    names, rho = correlations(fitted)
    a, b = (names.index(name) for name in (("joint_compliance", 1), ("joint_compliance", 2)))
    k, m = (fitted.posterior.names.index(names[i]) for i in (a, b))
    cov = (
        fitted.posterior.covariance
        + (fitted.posterior.directions.T @ fitted.posterior.directions)[
            : len(fitted.posterior.names), : len(fitted.posterior.names)
        ]
    )
    assert rho[a, b] == pytest.approx(cov[k, m] / np.sqrt(cov[k, k] * cov[m, m])) and np.diag(rho) == pytest.approx(1.0)
    strongest = correlated_pairs(fitted, words, ["backlash"])
    assert all(abs(float(row[2])) >= 0.5 for row in strongest)
    assert strongest and all(("sum" in row[3]) == row[2].startswith("-") for row in strongest)


def test_every_law_has_a_chart(fitted: Fit) -> None:
    charts = law_charts(laws_of(fitted, ["backlash"]))
    assert charts and all(chart.count('class="line law"') == 2 for chart in charts)
    assert "backlash: joint 4" in charts[0]
