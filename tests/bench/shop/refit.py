"""The true structure fitted to the same rows by plain numpy: what a fit that knows it can reach."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.bench.shop.arms import Shop
from tests.bench.shop.sets import Rows
from tests.independent import arm as A
from tests.independent.cells import Cell, Hidden, States, settle

PRIOR = np.array([1e-3] * 6 + [0.7] * 6 + [0.5e-3] * 3 + ([0.2e-3] * 3 + [0.25e-3] * 3) * 5)
"""What is known before: zeros [rad], logarithms of compliances, TCP [m], each link between two joints [m], [rad].

The law of the TCP and of the links is that from which the true arms are drawn.
"""
ORDINARY = np.array([1e-3] * 6 + [0.7] * 6 + [0.5e-3] * 3 + ([0.3e-3] * 3 + [1e-3] * 3) * 5)
"""The same of a fit that knows of links what it knows of arms in general."""
STEP = np.array([1e-4] * 6 + [0.02] * 6 + [1e-4] * 33)
WIDE = 10.0
"""Standard deviation of what belongs to a set-up [m]: nothing is known."""


@dataclass(frozen=True)
class Refit:
    """A fitted arm. Args: cell: of the fit. x: (45,) its parameters. covariance: (45, 45)."""

    cell: Cell
    x: np.ndarray
    covariance: np.ndarray


def moved(s: Shop, x: np.ndarray) -> Cell:
    """The stated arm, off by parameters (45,), with the hidden effects that are no lengths of links."""
    xi = np.zeros((7, 6))
    xi[1:6] = x[15:].reshape(5, 6)
    lengths = Hidden("lengths", "", body=lambda states, f, wrench: np.broadcast_to(xi, (len(states), 7, 6)))
    n = s.nominal
    others = tuple(h for h in s.cell.hidden if h.kind != "link_geometry")
    return replace(
        n, offset=x[:6], compliance=n.compliance * np.exp(x[6:12]), tool=n.tool @ A.shift(*x[12:15]), hidden=(lengths, *others)
    )  # fmt: skip


def tcp(cell: Cell, states: States) -> np.ndarray:
    return settle(cell, states).frames.tcp[:, :3, 3]


def residual(r: Rows, p: np.ndarray, setups: dict[str, np.ndarray]) -> np.ndarray:
    """Misfit of all rows over its standard deviation, for TCP (n, 3) and unknowns of the set-ups."""
    out, at = [], {label: i for i, label in enumerate(r.label)}
    for kind in dict.fromkeys(r.kind):
        k = np.flatnonzero((r.kind == kind) & ((r.kind != "between") | (r.name != "")))
        u = np.array([setups.get(name, np.zeros(0)) for name in r.name[k]])
        if kind == "tip":
            e = p[k] - u
        elif kind == "plane":
            e = (p[k] * u[:, :3]).sum(axis=1) / np.linalg.norm(u[:, :3], axis=1) - u[:, 3]
        elif kind == "distance":
            e = np.linalg.norm(p[k] - u[:, :3], axis=1) - r.reading[k] - u[:, 3]
        elif kind == "gauge":
            e = (r.normal[k] * p[k]).sum(axis=1) - r.reading[k] - u[:, 0]
        elif kind == "between":
            e = np.linalg.norm(p[k] - p[[at[name] for name in r.name[k]]], axis=1) - r.reading[k]
        else:
            frame = A.small(u)
            e = np.einsum("nij,nj->ni", frame[:, :3, :3], r.place[k]) + frame[:, :3, 3] - p[k]
        out.append((e.reshape(len(k), -1) / r.sigma[k, None]).ravel())
    return np.concatenate(out)


def refit(s: Shop, r: Rows, before: np.ndarray = PRIOR) -> Refit:
    """Least squares with priors (45,), Gauss and Newton; the set-ups begin where they are."""
    names = [name for name in r.truth for _ in r.truth[name]]
    start = np.concatenate([*r.truth.values(), []])
    # A length of a bar that is known has no zero of its own; the normal of a plane has two directions, not three.
    free = [WIDE] * len(start)
    for i, name in enumerate(names):
        if len(r.truth[name]) == 4 and names[i - 3 : i + 1] == [name] * 4 and "distance" in r.kind[r.name == name]:
            free[i] = WIDE if r.offset_free else 1e-9
    prior, step = np.concatenate([before, free]), np.concatenate([STEP, np.full(len(start), 1e-5)])
    x = np.concatenate([np.zeros(45), start])

    def split(x: np.ndarray) -> dict[str, np.ndarray]:
        sizes = np.cumsum([len(v) for v in r.truth.values()])[:-1] if r.truth else []
        return dict(zip(r.truth, np.split(x[45:], sizes), strict=True)) if r.truth else {}

    mean = np.concatenate([np.zeros(45), start])
    for _ in range(5):
        p = tcp(moved(s, x[:45]), r.states)
        e = residual(r, p, split(x))
        slope = np.empty((len(e), len(x)))
        for i, d in enumerate(np.diag(step)):
            q = tcp(moved(s, (x + d)[:45]), r.states) if i < 45 else p
            slope[:, i] = (residual(r, q, split(x + d)) - e) / step[i]
        # In units of what is known before, so that the inverse is well conditioned.
        scaled = slope * prior
        normal = scaled.T @ scaled + np.eye(len(x))
        dx = -prior * np.linalg.solve(normal, scaled.T @ e + (x - mean) / prior)
        x = x + dx
        if np.abs(dx / prior)[:45].max() < 1e-4:
            break
    covariance = (np.linalg.inv(normal) * np.outer(prior, prior))[:45, :45]
    return Refit(moved(s, x[:45]), x[:45], covariance)


def placed(p: np.ndarray, onto: np.ndarray, scaled: bool = False) -> np.ndarray:
    """(n, 3) points after the rotation and shift, and scale where asked, that bring them nearest to others."""
    a, b = p.mean(axis=0), onto.mean(axis=0)
    u, _, v = np.linalg.svd((p - a).T @ (onto - b))
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v
    moved = (p - a) @ turn
    return moved * (float((moved * (onto - b)).sum() / (moved**2).sum()) if scaled else 1.0) + b


def rms(e: np.ndarray) -> float:
    """Root mean square length of (n, 3) [mm]."""
    return 1e3 * float(np.sqrt((e**2).sum(axis=-1).mean()))
