"""Tables of a nominal arm seen by an instrument that stands somewhere: plain numpy, no noise unless asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from postproc.diagnostics import Source
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.robot.catalogue import load_robot

ARM = load_robot("irb4600_60_205")
JOINTS = tuple(f"q{j}_deg" for j in range(1, 7))
PLACES = ("x_mm", "y_mm", "z_mm")
HEADER = ",".join(("pose_id", *JOINTS, *PLACES))
TOOL = np.array([0.02, -0.01, 0.35])


def poses(n: int, seed: int = 1) -> np.ndarray:
    g = np.random.default_rng(seed)
    low, high = np.array([-100, -40, -50, -170, -100, -180]), np.array([100, 70, 50, 170, 100, 180])
    return g.uniform(low, high, (n, 6))


def flanges(q_deg: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes (n, 3, 3) and places (n, 3) [m] of the flange of the nominal IRB 4600-60/2.05."""
    axes = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0.0]])
    steps = np.array([[0, 0, 0.495], [0.175, 0, 0], [0, 0, 0.9], [0, 0, 0.175], [0.96, 0, 0], [0.135, 0, 0]])
    turns, places = [], []
    for row in np.radians(q_deg):
        R, p = np.eye(3), np.zeros(3)
        for axis, step, angle in zip(axes, steps, row, strict=True):
            p, R = p + R @ step, R @ _turn(axis, angle)
        turns.append(R @ np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0.0]]))
        places.append(p)
    return np.array(turns), np.array(places)


def points(q_deg: np.ndarray, tool: np.ndarray = TOOL) -> np.ndarray:
    """(n, 3) tool points [mm] in an instrument turned by 0.7 rad about z and set off by metres."""
    R, p = flanges(q_deg)
    c, s = np.cos(0.7), np.sin(0.7)
    frame = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return 1e3 * ((p + R @ tool) @ frame.T + np.array([1.5, -2.0, 0.3]))


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * S + (1 - np.cos(angle)) * S @ S


def columns(q_deg: np.ndarray, seen_mm: np.ndarray, digits: int = 5, **more: Any) -> dict[str, list[str]]:
    """Columns of a table as text: names, commanded angles, measured points, and further ones."""
    cells = {"pose_id": [f"P{i}" for i in range(len(q_deg))]}
    cells |= {name: [f"{x:.{digits}f}" for x in q_deg[:, k]] for k, name in enumerate(JOINTS)}
    cells |= {name: [f"{x:.4f}" for x in seen_mm[:, k]] for k, name in enumerate(PLACES)}
    return cells | {name: [str(x) for x in values] for name, values in more.items()}


def measured(n: int = 40, noise_mm: float = 0.03, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Commanded angles [deg] and points [mm] with noise."""
    q = poses(n, seed)
    return q, points(np.round(q, 5)) + np.random.default_rng(seed).normal(0, noise_mm, (n, 3))


def lines(cells: dict[str, list[str]]) -> list[str]:
    return [",".join(row) for row in [list(cells), *zip(*cells.values(), strict=True)]]


def table(n: int = 40, noise_mm: float = 0.03, seed: int = 1) -> list[str]:
    """Lines of a table."""
    return lines(columns(*measured(n, noise_mm, seed)))


def repeats(n: int, times: int, shift_mm: np.ndarray, **more: Any) -> dict[str, list[str]]:
    """Columns of n poses without noise, each measured a few times and shifted by (n times, 3) [mm]."""
    q, y = (np.repeat(part, times, axis=0) for part in measured(n, 0.0))
    names = [f"P{i}" for i in range(n) for _ in range(times)]
    return {
        "pose_id": names,
        **{name: cells for name, cells in columns(q, y + shift_mm, **more).items() if name != "pose_id"},
    }


def source(rows: Sequence[str], path: str = "cell.csv") -> Source:
    return Source(path, "\n".join(rows).encode())


def read(content: dict[str, list[str]] | Sequence[str], **terms: Any) -> Measurements:
    """What is read of columns or of lines."""
    rows = lines(content) if isinstance(content, dict) else content
    return read_measurements(source(rows), ARM, terms=Reading(**terms))
