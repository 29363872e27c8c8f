"""How often 95 % intervals hold the truth: ``python -m tests.bench.coverage [CELLS]``; the independent arm, fresh seeds.

Every cell three times, with some poses measured three times, without any repeats, and with noise of heavy tails (Student's t of
four degrees, another size along each axis); after ``fit`` of what is there, and after
``diagnose`` and ``add`` where an effect is hidden. Counted are the coordinates of predicted places against the true ones,
and the joint compliances, which no other parameter can stand in for.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from postproc.estimation.fitted import Fit
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import add_effects
from postproc.identification.diagnose import diagnose
from postproc.measure.measurements import Measurements
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.prediction import predict_sigma
from tests.identification.cells import base_fit, cell, true_compliance
from tests.independent import library_effects as kinds

ARMS = ("irb4600_60_205", "ur10", "ur5")
POSES = (40, 100, 200)
NOISES = (0.012, 0.03, 0.06)
HIDDEN = (kinds.backlash, kinds.transmission_error, kinds.thermal_joint_drift, kinds.wrist_coupling)


def single(data: Measurements) -> Measurements:
    """The first row of every pose: nothing tells the noise."""
    return data.rows(np.unique(data.repeats, return_index=True)[1])


def heavy(data: Measurements, noise: float, seed: int) -> Measurements:
    """Rows of a cell without noise [mm], with heavy tails and twice as much along one axis as along another."""
    tails = np.random.default_rng(seed).standard_t(4, data.position.shape) / np.sqrt(2)
    return replace(data, position=data.position + 1e-3 * noise * tails * [0.63, 0.9, 1.26])


def predictions(fit: Fit, true: Measurements) -> np.ndarray:
    """(n, 3) whether each coordinate of a true place lies within 1.96 standard deviations of the prediction."""
    model = recorded_model(fit)
    error = predict(model, true.state)[:, :3, 3] - true.position
    return np.asarray(np.abs(error) < 1.96 * predict_sigma(model, true.state)[:, None])


def compliances(fit: Fit, truth: np.ndarray) -> np.ndarray:
    """Whether the intervals of the fitted joint compliances hold the true ones."""
    width = fit.intervals["joint_compliance"]
    fitted = np.isfinite(width)
    return np.abs(fit.model.effect("joint_compliance").vector() - truth)[fitted] < width[fitted]


def main(count: int) -> None:
    seen: dict[str, list[list[float]]] = {}
    for i in range(count):
        robot, poses, noise = ARMS[i % 3], POSES[i // 3 % 3], NOISES[(i + i // 3) % 3]
        hidden = (HIDDEN[i % len(HIDDEN)],) if i % 2 else ()
        terms = {"seed": 5300 + i, "noise": noise, "poses": poses, "robot": robot}
        whole, true = cell(*hidden, **terms)
        still = cell(*hidden, **{**terms, "noise": 1e-5})[0]
        truth = true_compliance(*hidden, **terms)
        for name, data in (("repeats", whole), ("none", single(whole)), ("heavy", heavy(still, noise, i))):
            fit = base_fit(data, robot)
            if hidden:
                named = [m.key for m in diagnose(fit.model, data).missing]
                fit = add_effects(fit.model, data, named).fit if named else fit
            inside, known = predictions(fit, true), compliances(fit, truth)
            path = "diagnose + add" if hidden else "fit"
            print(f"{robot:15s} {poses:4d} poses {noise:.3f} mm {name:8s} {path:15s} {inside.mean():.3f}", flush=True)
            for key in (
                "all",
                f"repeats: {name}",
                f"path: {path}",
                f"arm: {robot}",
                f"poses: {poses}",
                f"noise: {noise}",
            ):
                seen.setdefault(key, []).append([inside.mean(), known.sum(), len(known)])
    for key, rows in seen.items():
        inside, held, known = np.array(rows).T
        print(
            f"{key:24s} {len(rows):4d} cells  predictions {inside.mean():.3f}  compliances {held.sum() / known.sum():.3f}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
