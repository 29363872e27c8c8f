"""The page of a corrected program says the main thing first and carries what it draws."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.file import default_model
from postproc.report.drawing.path import path_data
from postproc.report.page import render_certificate, render_page
from postproc.results.certificate import Verdict, program_certificate
from postproc.results.conversion import conversion_document
from postproc.runtime.passes import correct_program
from tests.report.conftest import carried, numbers, tables


def test_the_first_screen(conversion: Conversion) -> None:
    page = render_page(
        conversion_document("a<b>.mod", conversion, {"model": "cell.toml", "force on the TCP [N]": "0,0,-50"})
    )
    r = conversion.report
    made = {row[0]: row[1] for row in tables(page)["how this was made"]["rows"]}
    assert (made["model"], made["force on the TCP [N]"], made["arm"]) == ("cell.toml", "0,0,-50", r["robot"])
    fell = f"At most {r['max_arc_error_after_mm']:.3f} mm of deviation remain while the arc burns"
    assert fell in page and f"where there were {r['max_arc_error_before_mm']:.3f} mm" in page
    figures = re.findall(r"<dt>(.*?)</dt><dd[^>]*>(.*?)</dd>", page)
    assert [text for _, text in figures][:2] == [f"{r[f'max_arc_error_{w}_mm']:.3f} mm" for w in ("before", "after")]
    assert len(figures) == 3
    assert "a&lt;b&gt;.mod" in page
    assert f"Arm <code>{r['robot']}</code>" in page and f"tolerance {r['tolerance_mm']:g} mm" in page
    assert carried(page) == json.loads(json.dumps(r))


def test_what_remains_beside_the_steady_way_stands_in_the_first_sentence(conversion: Conversion) -> None:
    def sentence(**figures: float | None) -> str:
        page = render_page(conversion_document("x.mod", replace(conversion, report={**conversion.report, **figures})))
        return re.findall(r'<p class="sentence">(.*?)</p>', page)[0]

    steady = {
        "max_arc_error_before_mm": None,
        "max_arc_error_after_mm": None,
        "max_error_before_mm": 0.5,
        "max_error_after_mm": 0.004,
        "tolerance_mm": 0.01,
    }
    fell = "At most 0.004 mm of deviation remain along lines and arcs"
    assert sentence(**steady, max_transient_mm=0.01, max_transition_mm=0.0) == f"{fell}, where there were 0.500 mm."
    assert sentence(**steady, max_transient_mm=0.062, max_transition_mm=0.2) == (
        f"{fell} at steady speed, where there were 0.500 mm; up to 0.062 mm while the speed changes and 0.200 mm where "
        "the correction jumps."
    )
    assert sentence(**steady, max_transient_mm=0.01, max_transition_mm=0.0, unproved_statements=3).endswith(
        "3 of these statements also run where they cannot be followed: what remains there is not proved."
    )


def test_names_in_a_page_are_text(conversion: Conversion) -> None:
    hostile = dict(
        conversion.report["statements"][0], routine="r<1>", reason="loop </script> index", residual_mm=np.nan
    )
    found = replace(conversion, report={**conversion.report, "statements": [hostile]})
    page = render_page(conversion_document("x.mod", found))
    assert "r<1>" not in page and "loop </script>" not in page
    assert carried(page)["statements"][0]["reason"] == "loop </script> index"
    assert carried(page)["statements"][0]["residual_mm"] is None


def test_a_refused_program_says_so() -> None:
    refused = correct_program(Source("x.mod", b"hello"), default_model(), Options())
    page = render_page(conversion_document("x.mod", refused))
    assert "no program was written" in page
    findings = tables(page)["findings"]
    titles = [c["title"] for c in findings["columns"]]
    assert [row[titles.index("code")] for row in findings["rows"]] == ["RAP011"]
    assert "The tolerance is not kept." in render_certificate(program_certificate("x.mod", refused))


def test_the_path_carries_the_largest_deviations(seam: Conversion) -> None:
    data = path_data(seam)
    places, moves = data["places"], {name: numbers(column) for name, column in data["moves"].items()}
    of = numbers(places["move"]).astype(int)
    welding = moves["welding"][of] == 1
    for name, key in (("before", "max_arc_error_before_mm"), ("after", "max_arc_error_after_mm")):
        size = np.linalg.norm(numbers(places[name]), axis=1)
        assert size[welding].max() == pytest.approx(seam.report[key], abs=2e-4)
    t = numbers(places["t"])
    assert (np.diff(t) >= -1e-3).all() and t[-1] == pytest.approx(seam.report["cycle_time_before_s"], rel=0.02)
    # The place of each statement's last run is where its target is.
    k = next(i for i, text in enumerate(data["targets"]) if text == "pSeam50")
    rows = np.flatnonzero(moves["statement"][of] == k)
    assert seam.plan is not None
    move = seam.plan.motion.moves[of[rows[-1]]]
    assert move.T_work_tcp is not None
    assert numbers(places["p"])[rows[-1]] == pytest.approx(move.T_work_tcp[:3, 3], abs=1e-6)


def test_the_deviation_is_measured_across_the_path(seam: Conversion) -> None:
    """At targets as between them: no step where a line ends, whatever points along it."""
    data = path_data(seam)
    places, moves = data["places"], {name: numbers(column) for name, column in data["moves"].items()}
    of, p, away = (numbers(places[name]) for name in ("move", "p", "before"))
    of = of.astype(int)
    for i in np.flatnonzero((moves["welding"] == 1) & (moves["space"] == 1)):
        rows = np.flatnonzero(of == i)
        line = p[rows[-1]] - p[rows[0]]
        along = away[rows] @ (line / np.linalg.norm(line))
        assert np.abs(along).max() < 2e-4
        step = np.abs(np.diff(np.linalg.norm(away[rows], axis=1)))
        assert step.max() < 0.02


def test_torques_are_those_of_an_independent_arm(seam: Conversion) -> None:
    """Standing still at the start, the motors carry the weights: tau = sum of m g . d p / d q, from plain differences."""
    assert seam.plan is not None and seam.model is not None
    data, robot = path_data(seam), seam.model.robot
    speed = numbers(data["places"]["speed"])
    still = int(np.flatnonzero(speed.max(axis=1) < 0.05)[0])
    q = numbers(data["places"]["q"])[still]
    move = seam.plan.motion.moves[int(numbers(data["places"]["move"])[still])]

    def energy(q: np.ndarray) -> float:
        T, total = np.eye(4), robot.mass[0] * robot.center[0][2]
        for j in range(6):
            x, y, z = robot.axis[j]
            S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            turn = np.eye(4)
            turn[:3, :3] += np.sin(q[j]) * S + (1 - np.cos(q[j])) * S @ S
            T = T @ robot.link[j] @ turn
            total += robot.mass[j + 1] * (T @ [*robot.center[j + 1], 1])[2]
        T = T @ robot.link[6]
        return 9.81 * float(total + move.payload_mass * (T @ [*move.payload_center, 1])[2])

    eps = 1e-5 * np.eye(6)
    expected = np.array([(energy(q + e) - energy(q - e)) / 2e-5 for e in eps])
    assert numbers(data["places"]["torque"])[still] == pytest.approx(expected, abs=1.5)


def test_the_certificate_of_a_program(seam: Conversion) -> None:
    page = render_certificate(program_certificate("hull_seam.mod", seam, {"model": "cell.toml"}))
    assert Verdict.NOT_SHOWN.value in page and "1 of 1 seams keep 0.01 mm." in page
    row = re.search(r"<td[^>]*>rShellSeam</td>.*?</tr>", page, re.DOTALL)
    assert row and ">kept<" in row[0] and f">{seam.report['max_arc_error_after_mm']:.3f}<" in row[0]
    assert page.count("name, date, signature") == 3 and "<script" not in page
    assert "not fitted to measurements" in page
    for sure, verdict in ((0.005, Verdict.KEPT), (0.05, Verdict.NOT_SHOWN)):
        fitted = replace(seam, report={**seam.report, "expected_accuracy": {"within_95_percent_mm": sure}})
        assert verdict.value in render_certificate(program_certificate("hull_seam.mod", fitted))
    bad = {**seam.report["welds"][0], "after_mm": 0.02}
    missed = replace(seam, report={**seam.report, "welds": [bad]})
    assert "The tolerance is not kept." in render_certificate(program_certificate("hull_seam.mod", missed))
    left = replace(seam, report={**seam.report, "welds": [{**seam.report["welds"][0], "left": 1}]})
    assert "The tolerance is not kept." in render_certificate(program_certificate("hull_seam.mod", left))
