"""The pictures of the second tutorial, from the models that its commands have written."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

import postproc
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate
from postproc.robot.kinematics import jacobian

ARM, JOINT = "irb4600_60_205", 1
STYLE = {"svg.hashsalt": "postproc", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3}


def joint_error(fit: Fit) -> np.ndarray:
    """(n,) Error of the joint that explains most of each pose's residual, J_j . e / |J_j|^2 [rad]."""
    state = fit.data.state
    column = jacobian(fit.model.robot, state.q, state.T_flange_tcp)[:, :3, JOINT]
    turned = fit.model.effect("instrument_frame")
    angle = np.zeros(3) if turned is None else np.asarray(turned.turn_rad)  # type: ignore[attr-defined]
    error = fit.position_error + np.cross(fit.position_error, angle)  # seen from the base, turns are small
    return np.einsum("ni,ni->n", column, error) / np.einsum("ni,ni->n", column, column)


def draw(work: Path, folder: Path) -> None:
    """Residuals of joint 2 before and after, and the fall of the error."""
    plt.rcParams.update(STYLE)
    data = postproc.read_measurements(work / "samples" / "measurements" / "simulated_backlash.csv", ARM)
    fits = [evaluate(postproc.read_model(work / "out" / name), data) for name in ("cell.toml", "better.toml")]
    draw_residuals(fits, folder / "hidden-effect.svg")
    draw_fall(data, folder / "error.svg")


def draw_residuals(fits: list[Fit], path: Path) -> None:
    figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.0), sharey=True, layout="constrained")
    for axis, fit, title in zip(axes, fits, ("the model as it came", "with `backlash`"), strict=True):
        state, error = fit.data.state, 1e3 * joint_error(fit)
        assert state.approach is not None
        for side, color in ((1.0, "#c5221f"), (-1.0, "#174ea6")):
            rows = state.approach[:, JOINT] == side
            label = f"joint 2 came from {'below' if side > 0 else 'above'}"
            axis.plot(np.degrees(state.q[rows, JOINT]), error[rows], ".", color=color, label=label)
        axis.set(title=title, xlabel="angle of joint 2 [deg]")
    axes[0].set_ylabel("error of joint 2 [mrad]")
    axes[1].legend()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def draw_fall(data: postproc.Measurements, path: Path) -> None:
    """The error on rows that the fit has not seen, effect by effect, beside the noise."""
    added = postproc.document(postproc.add(postproc.fit(data, ARM).model, ["backlash"], data))
    names = ["frames, zeros, springs", "+ backlash"]
    values = [added["before"]["held_out_rms_mm"], added["held_out_rms_mm"]]
    figure, axis = plt.subplots(figsize=(8.4, 1.6), layout="constrained")
    axis.barh(names, values, color=["#c5221f", "#174ea6"], height=0.55)
    axis.axvline(added["noise_mm"], color="#333", linestyle="--", label="noise of the instrument")
    axis.set(xlabel="error on rows that the fit has not seen, per axis [mm]")
    axis.invert_yaxis()
    axis.legend(loc="lower right")
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
