"""Closed-form inverse kinematics and configuration data of an arm with a spherical wrist."""

from __future__ import annotations

import numpy as np

from tests.independent import arm as A


def inverse(arm: A.Arm, flange: np.ndarray) -> np.ndarray:
    """(n, 8, 6) joint angles of a spherical-wrist arm in (-pi, pi], NaN where out of reach.

    Branch 4 s + 2 e + w: s facing forward/backward, e elbow up/down, w wrist q5 >= 0 or < 0.
    """
    g = arm.lengths
    r, p = flange[:, :3, :3], flange[:, :3, 3]
    wrist = p - g["d6"] * r[:, :, 2]
    forearm = np.hypot(g["a3"], g["d4"])
    lean = np.arctan2(g["d4"], g["a3"])
    out = np.full((len(flange), 8, 6), np.nan)
    zero_tool = arm.link[6][:3, :3]
    for s in (0, 1):
        sign = 1.0 if s == 0 else -1.0
        q1 = np.arctan2(sign * wrist[:, 1], sign * wrist[:, 0])
        reach = sign * np.hypot(wrist[:, 0], wrist[:, 1]) - g["a1"]
        height = wrist[:, 2] - g["d1"]
        dist = np.hypot(reach, height)
        cosine = (g["a2"] ** 2 + dist**2 - forearm**2) / (2 * g["a2"] * dist)
        with np.errstate(invalid="ignore"):
            inner = np.arccos(cosine)
        for e in (0, 1):
            q2 = np.arctan2(reach, height) - (inner if e == 0 else -inner)
            q23 = np.arctan2(reach - g["a2"] * np.sin(q2), height - g["a2"] * np.cos(q2)) - lean
            q3 = q23 - q2
            base = A.rotation(np.array([0, 0, 1.0]), q1) @ A.rotation(np.array([0, 1.0, 0]), q23)
            m = np.swapaxes(base, 1, 2) @ r @ zero_tool.T
            bend = np.hypot(m[:, 1, 0], m[:, 2, 0])
            for w in (0, 1):
                f = 1.0 if w == 0 else -1.0
                q4 = np.arctan2(f * m[:, 1, 0], -f * m[:, 2, 0])
                q5 = np.arctan2(f * bend, m[:, 0, 0])
                q6 = np.arctan2(f * m[:, 0, 1], f * m[:, 0, 2])
                q = np.stack([q1, q2, q3, q4, q5, q6], axis=1)
                out[:, 4 * s + 2 * e + w] = np.where(np.isfinite(inner)[:, None], wrap(q), np.nan)
    return out


def wrap(q: np.ndarray) -> np.ndarray:
    return np.arctan2(np.sin(q), np.cos(q))


def confdata(arm: A.Arm, q: np.ndarray) -> np.ndarray:
    """(n, 4) integers cf1, cf4, cf6, cfx as an ABB controller states them for a serial six-axis arm."""
    q = np.atleast_2d(q)
    g = arm.lengths
    quarter = np.floor(q[:, [0, 3, 5]] / (np.pi / 2) + 1e-12).astype(int)
    q2, q3 = q[:, 1], q[:, 2]
    forward = g["d4"] * np.cos(q3) + g["a3"] * np.sin(q3)
    reach = g["a1"] + g["a2"] * np.sin(q2) + g["d4"] * np.cos(q2 + q3) + g["a3"] * np.sin(q2 + q3)
    cfx = 4 * (reach < 0) + 2 * (forward < 0) + (q[:, 4] < 0)
    return np.column_stack([quarter, cfx])


def solve_target(arm: A.Arm, flange: np.ndarray, conf: tuple[int, ...]) -> np.ndarray | None:
    """(6,) joint angles of one flange pose (4, 4) in the stated configuration within the limits, None when there is none."""
    best, misfit = None, np.inf
    for q in inverse(arm, flange[None])[0]:
        if not np.isfinite(q).all() or confdata(arm, q)[0, 3] != conf[3]:
            continue
        for k, c in ((0, conf[0]), (3, conf[1]), (5, conf[2])):
            middle = (c + 0.5) * np.pi / 2
            q[k] += 2 * np.pi * np.round((middle - q[k]) / (2 * np.pi))
        if (q < arm.lower - 1e-6).any() or (q > arm.upper + 1e-6).any():
            continue
        # Near a quadrant boundary the stated index may be the neighbour's: the nearest such solution counts.
        off = float(np.abs(q[[0, 3, 5]] - (np.array(conf[:3]) + 0.5) * np.pi / 2).max()) - np.pi / 4
        if off < misfit:
            best, misfit = q, off
    return best if misfit < np.radians(5.0) else None


def follow(arm: A.Arm, flange: np.ndarray, start: np.ndarray) -> np.ndarray | None:
    """(n, 6) joint angles along n neighbouring flange poses, continuous from ``start`` (6,); None where out of reach."""
    branches = inverse(arm, flange)
    first = branches[0]
    gap = np.abs(wrap(first - start))
    gap = np.where(np.isfinite(gap), gap, 9.0).max(axis=1)
    q = branches[:, int(np.argmin(gap))]
    if not np.isfinite(q).all():
        return None
    q = np.unwrap(np.vstack([start, q]), axis=0)[1:]
    return q
