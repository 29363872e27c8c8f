"""Figures of the case study: motion profile, error along the path before and after, and the three curves.

    python docs/figures/case_study.py

Reads ``samples/paper_case.mod``, converts it for both geometries with the force of the study, and writes SVG files
beside this script. The figures it prints stand in ``docs/paper.md``.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.equilibrium import predict
from postproc.model.file import default_model
from postproc.runtime.passes import correct_program

HERE = Path(__file__).resolve().parent
SAMPLE = HERE.parent.parent / "samples" / "paper_case.mod"
OPTIONS = Options(tolerance_m=1e-5, force=(200.0, -200.0, -200.0), inertia=False)
plt.rcParams.update({"svg.hashsalt": "postproc", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3})


def arc_length(points: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def draw(name: str) -> None:
    model = default_model(name)
    result: Conversion = correct_program(Source(SAMPLE.name, SAMPLE.read_bytes()), model, OPTIONS)
    assert result.judged is not None and result.plan is not None and result.judged.after is not None
    motion = result.plan.motion
    timeline, samples = motion.timeline, motion.samples

    seam = timeline.place < len(motion.moves) - 1  # the departure is fast and would set the scale
    figure, axes = plt.subplots(3, 1, figsize=(6.4, 5.2), sharex=True)
    for values, axis, label in (
        (timeline.q, axes[0], "joint angle [deg]"),
        (timeline.v, axes[1], "speed [deg/s]"),
        (timeline.a, axes[2], "acceleration [deg/s$^2$]"),
    ):
        axis.plot(timeline.t[seam], np.degrees(values[seam]), lw=0.9)
        axis.set_ylabel(label)
    axes[2].set_xlabel("time [s]")
    axes[0].legend(
        [f"axis {j}" for j in range(1, 7)], ncol=6, fontsize=7, loc="lower center", bbox_to_anchor=(0.5, 1.0)
    )
    save(figure, f"motion_{name}.svg")

    space = ~samples.curves.joint[samples.move] & (samples.goal > samples.start)[samples.move]
    wanted = samples.T_work_tcp[space, :3, 3]  # the study's work does not move
    real = predict(model, motion.at(slice(None)))[space, :3, 3]
    s = arc_length(wanted)
    figure, axes = plt.subplots(1, 2, figsize=(7.6, 3.0))
    axes[0].plot(s * 1e3, np.linalg.norm(real - wanted, axis=1) * 1e3, "tab:red", lw=1.2)
    axes[0].set_title("before")
    after = result.judged.after
    rows = np.argsort(after.owner + after.u, kind="stable")
    rows = rows[~samples.curves.joint[after.owner[rows]]]
    place = np.interp(after.owner[rows] + after.u[rows], (samples.move + samples.u)[space], s)
    axes[1].plot(place * 1e3, after.distance[rows] * 1e3, "tab:green", lw=1.0)
    axes[1].set_title("after")
    axes[0].set_ylabel("position error [mm]")
    axes[1].set_ylabel("distance from the path [mm]")
    for axis in axes:
        axis.set_xlabel("along the path [mm]")
        axis.set_ylim(bottom=0)
    save(figure, f"error_{name}.svg")

    wanted, real = wanted * 1e3, real * 1e3
    magnified = 30.0
    figure = plt.figure(figsize=(6.4, 4.4))
    axis = figure.add_subplot(projection="3d")
    axis.plot(*wanted.T, "k", lw=1.2, label="programmed")
    axis.plot(*(wanted + magnified * (real - wanted)).T, "tab:red", lw=1.0, label="uncompensated")
    corrected = wanted + magnified * 1e3 * residual(result, space)
    axis.plot(*corrected.T, "tab:green", lw=1.0, ls="--", label="compensated")
    axis.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axis.legend(title=f"deviations x {magnified:g}", fontsize=8)
    save(figure, f"curves_{name}.svg")

    largest, left = np.linalg.norm(real - wanted, axis=1).max(), result.report["max_error_after_mm"]
    print(f"{name}: {largest:.3f} mm before, {left:.4f} mm after, {100 * (1 - left / largest):.2f} % better")


def residual(result: Conversion, space: np.ndarray) -> np.ndarray:
    """Size of the remaining deviation along the path, drawn upwards."""
    assert result.judged is not None and result.plan is not None and result.judged.after is not None
    samples, after = result.plan.motion.samples, result.judged.after
    order = np.argsort(after.owner + after.u, kind="stable")
    size = np.interp((samples.move + samples.u)[space], (after.owner + after.u)[order], after.distance[order])
    return np.column_stack([0 * size, 0 * size, size])


def save(figure: plt.Figure, name: str) -> None:
    figure.tight_layout()
    figure.savefig(HERE / name, metadata={"Date": None})
    plt.close(figure)


if __name__ == "__main__":
    for robot in ("irb4600_60_205", "irb4600_60_205_seed"):
        draw(robot)
