"""Tables of an arm whose joint angles are read on the output side: plain numpy, nothing of the package.

The encoders see the commanded angle, a zero error of each joint, what is hidden, and noise of their own.
"""

from __future__ import annotations

import numpy as np

from postproc.diagnostics import Source

LOW, HIGH = np.array([-100, -40, -50, -170, -100, -170.0]), np.array([100, 70, 50, 170, 100, 170.0])
NOISE_RAD = 5e-6
KINDS = ("nothing", "servo_lag", "backlash", "transmission_error")
"""What may be hidden, by the keys of the library."""


def hidden(kind: str, g: np.random.Generator, q: np.ndarray, v: np.ndarray, side: np.ndarray) -> np.ndarray:
    """(n, 6) error of each joint [rad]: a lag of 1 to 3 ms, gaps of 60 to 200 microradian, one wave of a gear."""
    error = np.zeros_like(q)
    if kind == "servo_lag":
        error = -g.uniform(1e-3, 3e-3, 6) * v
    elif kind == "backlash":
        some = g.choice(6, 2, replace=False)
        error[:, some] = -g.uniform(60e-6, 200e-6, 2) * side[:, some]
    elif kind == "transmission_error":
        j, order = int(g.integers(6)), int(g.integers(2, 9))
        error[:, j] = g.uniform(80e-6, 250e-6) * np.sin(order * q[:, j] + g.uniform(0, 6.28))
    return error


def encoder_table(kind: str, seed: int, n: int = 120, joints: int = 6, repeats: int = 10) -> Source:
    """A table with ``mq1_deg`` .. and no position, some poses three times.

    Args:
        joints: so many of them are measured, from the first on.
    """
    g = np.random.default_rng([seed, KINDS.index(kind)])
    q = np.radians(g.uniform(LOW, HIGH, (n, 6)))
    v = np.radians(g.uniform(-60, 60, (n, 6)))
    side = g.choice([-1.0, 1.0], (n, 6))
    index = np.concatenate([np.arange(n), np.repeat(np.arange(repeats), 2)])
    q, v, side = q[index], v[index], side[index]
    zero = g.normal(0, 5e-4, 6)
    mq = q + zero + hidden(kind, g, q, v, side) + g.normal(0, NOISE_RAD, q.shape)
    names = ["pose_id", *(f"q{j}_deg" for j in range(1, 7)), *(f"mq{j}_deg" for j in range(1, joints + 1))]
    names += [f"dir{j}" for j in range(1, 7)]
    columns = [np.degrees(q), np.degrees(mq[:, :joints]), side]
    if kind in ("servo_lag", "nothing"):
        names += [f"v{j}_deg_s" for j in range(1, 7)]
        columns.append(np.degrees(v))
    lines = [",".join(names)]
    for k, row in zip(index, np.hstack(columns), strict=True):
        lines.append(",".join([f"P{k:03d}", *(f"{x:.7f}" for x in row)]))
    return Source("encoders.csv", "\n".join(lines).encode())
