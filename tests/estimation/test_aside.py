"""Rows that the fit leaves out: typing errors, or poses that show what is missing."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc.estimation.channels import channels
from postproc.estimation.findings import cautions, data_findings, outlying_rows
from postproc.estimation.least_squares import fit_model
from postproc.estimation.problem import Weights
from postproc.identification.diagnose import diagnose
from postproc.patterns.dictionary import patterns
from postproc.patterns.screening import PatternScreen
from tests.identification.cells import base_fit, cell
from tests.independent.cells import Hidden, column


def worn_tooth(g: np.random.Generator, arm: object) -> Hidden:
    """Joint 3 is 0.4 mrad off, but only within a few degrees of -20 deg."""
    at, width = np.radians(-20.0), np.radians(2.5)
    return Hidden(
        "worn_tooth",
        "unknown",
        channels=("q3",),
        joint=lambda s, tau: column(2, 4e-4 * np.exp(-0.5 * ((s.q[:, 2] - at) / width) ** 2)),
    )


def test_poses_that_show_a_local_error_are_not_taken_for_bad_readings():
    data, _ = cell(worn_tooth, seed=911, poses=80, noise=0.01)
    found = diagnose(base_fit(data).model, data)
    assert found.verdict == "unknown"
    assert "q3" in [s.channel for s in found.suspects[:3]]


def test_rows_that_stand_out_are_one_finding_at_the_farthest():
    data, _ = cell(worn_tooth, seed=911, poses=80, noise=0.01)
    fit = base_fit(data)
    rows = outlying_rows(fit)
    size = np.linalg.norm(fit.position_error[rows], axis=1)
    assert 1 < len(rows) < 10
    (found,) = (d for d in data_findings(fit) if d.code == "DAT025")
    assert found.message.startswith(f"row {fit.data.row[rows[np.argmax(size)]]} lies {1e3 * size.max():.2f} mm from")
    assert found.place.split(":")[1] == str(fit.data.line[rows[np.argmax(size)]])
    others = found.message.partition("; so do ")[2]
    assert {int(n) for n in re.findall(r"row (\d+)", others)} == {fit.data.row[i] for i in rows} - {
        fit.data.row[rows[np.argmax(size)]]
    }


def test_typing_errors_are_findings_about_the_data():
    data, _ = cell(seed=921, poses=80, outliers=3)
    found = diagnose(base_fit(data).model, data)
    assert len(found.final.excluded_rows) >= 2
    assert (found.verdict, found.suspects) == ("complete", ())


def test_repeats_speak_against_a_noise_that_was_stated_too_small():
    data, _ = cell(seed=101)
    low = diagnose(base_fit(data).model, data, noise=2.0e-5)
    assert low.verdict == "complete" and "DAT027" in [d.code for d in low.diagnostics]
    right = fit_model(base_fit(data).model, data, noise=3.0e-5)
    assert "DAT027" not in [d.code for d in cautions(right)]


def test_a_pattern_holds_for_fits_that_set_other_rows_aside():
    """A suspect found on one fit stands beside the next one, whose rows may be fewer."""
    data, _ = cell(worn_tooth, seed=912, poses=80, noise=0.01)
    fit = base_fit(data)
    problem = fit.problem
    state, position = problem.sensitivity.state, problem.equilibrium.T_base_tcp[:, :3, 3]
    suspect = PatternScreen(problem, fit.linear, patterns(channels(state, position), state, position)).suspects()[0]
    fewer = problem.weights.values.copy()
    fewer[5] = 0.0
    assert suspect.columns(problem.weighted(Weights(fewer))) == pytest.approx(
        np.delete(suspect.columns(problem), np.arange(15, 18), axis=0)
    )
