"""Tables of a nominal arm seen by an instrument that stands somewhere: plain numpy, no noise unless asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import tomlkit

from postproc.diagnostics import Source

HEADER = "pose_id," + ",".join(f"q{j}_deg" for j in range(1, 7)) + ",x_mm,y_mm,z_mm"
TOOL = np.array([0.02, -0.01, 0.35])


def poses(n: int, seed: int = 1) -> np.ndarray:
    g = np.random.default_rng(seed)
    low, high = np.array([-100, -40, -50, -170, -100, -180]), np.array([100, 70, 50, 170, 100, 180])
    return g.uniform(low, high, (n, 6))


def points(q_deg: np.ndarray, tool: np.ndarray = TOOL) -> np.ndarray:
    """(n, 3) tool points [mm] of the nominal IRB 4600-60/2.05 in an instrument turned by 0.7 rad about z and set off by metres."""
    axes = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0.0]])
    steps = np.array([[0, 0, 0.495], [0.175, 0, 0], [0, 0, 0.9], [0, 0, 0.175], [0.96, 0, 0], [0.135, 0, 0]])
    found = []
    for row in np.radians(q_deg):
        R, p = np.eye(3), np.zeros(3)
        for axis, step, angle in zip(axes, steps, row, strict=True):
            p, R = p + R @ step, R @ _turn(axis, angle)
        found.append(p + R @ np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0.0]]) @ tool)
    c, s = np.cos(0.7), np.sin(0.7)
    frame = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return 1e3 * (np.array(found) @ frame.T + np.array([1.5, -2.0, 0.3]))


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * S + (1 - np.cos(angle)) * S @ S


def table(n: int = 40, noise_mm: float = 0.03, seed: int = 1) -> list[str]:
    """Lines of a table."""
    q = poses(n, seed)
    y = points(np.round(q, 5)) + np.random.default_rng(seed).normal(0, noise_mm, (n, 3))
    rows = [",".join([f"P{i}", *(f"{x:.5f}" for x in q[i]), *(f"{x:.4f}" for x in y[i])]) for i in range(n)]
    return [HEADER, *rows]


def source(lines: Sequence[str]) -> Source:
    return Source("cell.csv", "\n".join(lines).encode())


def column_map(content) -> Source | None:
    """A column map with this content."""
    return None if content is None else Source("map.toml", tomlkit.dumps(content).encode())


def edited(lines: Sequence[str], columns: Sequence[int], change: Callable[[float], float]) -> list[str]:
    """The same table with some columns changed."""
    body = []
    for line in lines[1:]:
        cells = line.split(",")
        for c in columns:
            cells[c] = f"{change(float(cells[c])):.7f}"
        body.append(",".join(cells))
    return [lines[0], *body]


__all__ = ["HEADER", "TOOL", "column_map", "edited", "points", "poses", "source", "table"]
