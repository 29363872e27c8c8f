"""The residual against channels: bins against plain means, rows that the fit left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc import text as text_of
from postproc.estimation.recorded import recorded_model
from postproc.identification.compare import compare
from postproc.identification.compare import residual_trends
from postproc.results.comparison import comparison_values
from tests.identification.cells import base_fit, cell


def test_levels_of_a_grid_are_one_bin_each_and_rows_left_out_count_nowhere():
    data, _ = cell(seed=3)
    g = np.random.default_rng(0)
    level = g.integers(0, 5, len(data))
    jitter = 1e-4 * g.normal(size=len(data))  # the same level, measured anew
    position = data.position + 1e-4 * level[:, None]
    position[7] += 0.01
    moved = replace(data, position=position, state=data.state.with_(temperature=20.0 + level + jitter))
    fit = base_fit(moved)
    assert fit.excluded == (7,)
    found = next(t for t in residual_trends(fit) if (t.channel, t.where) == ("temperature", "space"))
    assert np.allclose(found.centre, 20.0 + np.arange(5), atol=1e-3)
    error = 1e3 * np.delete(fit.problem.error[:, :3], 7, axis=0)
    along = (error - error.mean(axis=0)) @ found.direction
    kept = np.delete(level, 7)
    for k, (mean, spread) in enumerate(zip(found.mean, found.spread, strict=True)):
        some = along[kept == k]
        assert np.isclose(mean, some.mean()) and np.isclose(spread, some.std() / np.sqrt(len(some)))
    assert np.isnan(found.values[7]) and found.share > 0.3


def test_rows_that_stand_out_are_named_and_in_no_figure_of_a_comparison():
    data, _ = cell(seed=3)
    position = data.position.copy()
    position[7, 1] *= -1  # a sign that was forgotten
    model = recorded_model(base_fit(data))
    found = compare(model, replace(data, position=position))
    far = comparison_values(found)["worst"][0]["error_mm"]
    assert f"Row 8 was left out: it lies {far:.1f} mm off, far from everything else." in text_of(found)
    assert "per axis), without a row that lies far from everything else; " in text_of(found).splitlines()[0]
    assert "without" not in text_of(compare(model, data)).splitlines()[0]
    told, others = comparison_values(found), np.delete(np.arange(len(data)), 7)
    assert told["set_aside_rows"] == [8] and told["worst"][0]["row"] == 8
    clean = comparison_values(compare(model, data.rows(others)))
    for name in ("rms_mm", "mean_mm", "maximum_mm", "percentiles_mm", "per_axis_mm"):
        assert told[name] == clean[name]
    assert told["bound_mm"] < 1.5 * clean["bound_mm"]
