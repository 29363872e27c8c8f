"""Correlations as text: what a file of a thousand parameters holds, against the matrix itself in plain numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.cli.output import write_model
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.model.arm import Model
from postproc.model.file import read_model
from postproc.model.uncertainty.packed import pack_correlation, unpack_correlation
from postproc.model.uncertainty.prediction import Uncertainty, read_uncertainty, uncertainty_table
from postproc.robot.catalogue import load_robot


def posterior(count: int, rows: int, rng: np.random.Generator) -> np.ndarray:
    """Correlation of parameters that random rows determine beside a prior, every tenth nearly twice in the rows."""
    columns = rng.normal(size=(rows, count)) * rng.uniform(0.1, 3.0, count)
    columns[:, 1::10] = columns[:, ::10][:, : len(columns[0, 1::10])] + 1e-4 * columns[:, 1::10]
    covariance = np.linalg.inv(columns.T @ columns / 0.01 + np.eye(count))
    sigma = np.sqrt(np.diag(covariance))
    return covariance / np.outer(sigma, sigma)


@pytest.mark.parametrize(
    ("count", "rows", "close"), [(1, 3, 1e-8), (2, 3, 1e-6), (30, 90, 1e-4), (300, 200, 0.01), (1000, 700, 0.1)]
)
def test_every_combination_of_parameters_keeps_its_variance(count, rows, close):
    """The eigenvalues of S^-1 R S^-T with C = S S^T bound the ratio of variances by R and by C in any direction."""
    correlation = posterior(count, rows, np.random.default_rng(count))
    again = unpack_correlation(pack_correlation(correlation), count)
    half = np.linalg.inv(np.linalg.cholesky(correlation))
    assert abs(np.linalg.eigvalsh(half @ again @ half.T) - 1.0).max() < close
    np.testing.assert_allclose(np.diag(again), 1.0, rtol=1e-12)


TEXT = pack_correlation(np.eye(4))


@pytest.mark.parametrize(("text", "count"), [(TEXT, 3), (TEXT, 5), (TEXT[:-8], 4), ("", 2), ("\u00e9" * 8, 2)])
def test_a_text_of_other_parameters_is_refused(text, count):
    with pytest.raises(ValueError, match="the text is not"):
        unpack_correlation(text, count)


def test_a_model_of_a_thousand_parameters_is_a_file_that_can_be_read(tmp_path):
    rng, path = np.random.default_rng(4), tmp_path / "large.toml"
    count = len(JointErrorMap(order=83).vector())
    assert count > 1000
    effect = JointErrorMap(order=83).with_vector(rng.normal(size=count) * 1e-5)
    model = Model(load_robot("ur10"), (effect,), robot_name="ur10")
    sigma = 10.0 ** rng.uniform(-7, -4, count)
    covariance = posterior(count, 700, rng) * np.outer(sigma, sigma)
    known = Uncertainty(tuple(("joint_error_map", i) for i in range(count)), covariance, 3e-5)
    write_model(path, replace(model, fit=uncertainty_table(model, known)))
    assert path.stat().st_size < 1_000_000
    again = read_uncertainty(read_model(path))
    assert again is not None and again.parameters == known.parameters
    np.testing.assert_allclose(np.sqrt(np.diag(again.covariance)), sigma, rtol=1e-8)
    for direction in rng.normal(size=(20, count)) / sigma:
        assert direction @ again.covariance @ direction == pytest.approx(direction @ covariance @ direction, rel=0.02)
    before = path.read_bytes()
    write_model(path, read_model(path))
    assert path.read_bytes() == before
