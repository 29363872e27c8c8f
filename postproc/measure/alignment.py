"""Instrument frame and tool from nominal flange poses and measured points, without a starting guess."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.robot.kinematics import skew
from postproc.robot.pose import transform

SAME_SCALE = 0.05
"""Scales that differ by less than this from 1 are those of an arm and its own points."""
FLAT = 0.2
"""Singular values of the linear map lie this far apart where points on a plane or a line tell nothing across it."""
LOOSE_FIT = 1e-4
"""Noise [m] over the distance [m] of a point from the flange: where hardly anything turns, it does not run away."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """How the instrument sees the arm.

    Args:
        T_instrument_base: (4, 4).
        tool: (3,) the measured point in the flange frame [m].
        scale: instrument length over nominal length; 1 where the units are right.
        mirrored: the best linear map turns right hands into left ones (swapped columns, wrong sign).
        residual: (n, 3) measured minus aligned [m]; NaN where the scale is outside of 0.2 to 5, or not one
            that is looked for.
        typical: median length of the residual [m]; infinite at such a scale.
    """

    T_instrument_base: Array
    tool: Array
    scale: float
    mirrored: bool
    residual: Array
    typical: float


def align(
    T_base_flange: Array,
    position: Array,
    tool: bool = True,
    fitted: NDArray[np.bool_] | None = None,
    scales: Sequence[float] = (),
) -> Alignment:
    """Fit the place of the base in the instrument's frame and the measured point t to y = T_instrument_base (p + R t).

    First p = A y - c - R t is solved, linear in 15 unknowns, without a guess; A is projected on the rotations (Kabsch),
    and its singular values give the scale. Gauss-Newton with Huber weights follows. Points on a plane or a line,
    reached with one orientation, do not determine A: the rotation is then that of the flanges' own positions onto the
    points, and ``mirrored`` is False. Flanges that turn about one point do not determine A either: the rotation is then
    told by how the points turn with them, and the scale is 1.

    Args:
        T_base_flange: (n, 4, 4) [m] with rotation R and position p; position: (n, 3) measured y [m], finite.
        tool: whether t is fitted; False where the measured point is the origin of the flange frames, so that t = 0.
        fitted: (n,) mask of the points that count, all by default; residuals are of all points.
        scales: those that are looked for: what is mirrored or has no such scale (`SAME_SCALE`) is not refined.
    """
    if fitted is not None and not fitted.all():
        part = align(T_base_flange[fitted], position[fitted], tool, scales=scales)
        T = part.T_instrument_base @ T_base_flange
        return replace(part, residual=position - T[:, :3, :3] @ part.tool - T[:, :3, 3])
    R, p, y = T_base_flange[:, :3, :3], T_base_flange[:, :3, 3], position
    p0, y0, n = p - np.median(p, axis=0), y - np.median(y, axis=0), len(p)
    spread = spread_of(y0)
    design = linear_design(R, y0 / spread, tool)
    near = np.eye(3, 15, 12) * LOOSE_FIT
    weight = np.ones(n)
    for _ in range(12):
        root = np.sqrt(weight)[:, None]
        equations = np.vstack([(design * root[:, :, None]).reshape(-1, 15), near])
        solution, *_ = np.linalg.lstsq(equations, np.append(p0 * root, np.zeros(3)), rcond=1e-9)
        error = np.linalg.norm(design @ solution - p0, axis=1)
        weight = huber_weights(error)
    A = solution[:9].reshape(3, 3) / spread
    U, singular, Vt = np.linalg.svd(A)
    mirrored = bool(np.linalg.det(A) < 0)
    scale = 1.0 / max(float(np.exp(np.mean(np.log(np.maximum(singular, 1e-12))))), 1e-12)
    if singular[-1] < FLAT * singular[0]:
        U, _, Vt = np.linalg.svd(p0.T @ y0)
        solution[12:] = 0.0
        mirrored, scale = False, float(np.linalg.norm(y0)) / max(float(np.linalg.norm(p0)), 1e-12)
    about = _about_a_point(R, p, y) if tool and (mirrored or abs(scale - 1) > SAME_SCALE) else None
    if about is not None:
        return about
    point = np.asarray(solution[12:], dtype=float)
    unwanted = bool(scales) and (mirrored or all(abs(scale / one - 1) > SAME_SCALE for one in scales))
    if unwanted or not 0.2 < scale < 5:
        return Alignment(np.eye(4), point, scale, mirrored, np.full((n, 3), np.nan), np.inf)
    rotation = (U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt).T
    result = _refine(R if tool else np.zeros_like(R), p, y, rotation, point)
    return replace(result, scale=scale, mirrored=mirrored)


def spread_of(points: Array) -> float:
    """Return the typical (root median square) distance [m] from the origin of the points (n, 3) off it, never 0."""
    square = np.sum(points**2, axis=1)
    return max(float(np.sqrt(np.median(square[square > 0]))), 1e-12) if square.any() else 1e-12


def linear_design(R: Array, y: Array, tool: bool) -> Array:
    """Return (n, 3, 15) derivatives of p = A y - c - R t by the nine numbers of A (row by row), c and t.

    Args:
        R: (n, 3, 3); y: (n, 3); tool: whether t has columns that are not zero.
    """
    n = len(R)
    design = np.zeros((n, 3, 15))
    design[:, :, :9] = np.einsum("nk,ij->nijk", y, np.eye(3)).reshape(n, 3, 9)
    design[:, :, 9:12] = -np.eye(3)
    design[:, :, 12:] = -R if tool else 0.0
    return design


def turning_point(R: Array, p: Array) -> tuple[Array, float]:
    """Return the point c (3,) of flanges R, p that moves least, p + R c = s, and its median distance to s."""
    turns = np.concatenate([R, np.broadcast_to(-np.eye(3), R.shape)], axis=2)
    both, *_ = np.linalg.lstsq(turns.reshape(-1, 6), -p.ravel(), rcond=1e-9)
    return both[:3], float(np.median(np.linalg.norm(p + turns @ both, axis=1)))


def _about_a_point(R: Array, p: Array, y: Array) -> Alignment | None:
    """Return the alignment where flanges turn about one fixed point of theirs (single-point measurements), else None.

    With that point c in the flange frame, p + R c is constant, and y = s + T R d with the measured point at c + d:
    linear in the products T_ij d_k, whose best approximation of rank one gives the rotation T.

    Args:
        R: (n, 3, 3) and p: (n, 3) [m] of the flange; y: (n, 3) measured points [m].
    """
    n, (centre, off) = len(p), turning_point(R, p)
    near = FLAT * float(np.median(np.linalg.norm(y - np.median(y, axis=0), axis=1)))
    if off > near:
        return None
    products, *_ = np.linalg.lstsq(np.hstack([R.reshape(n, 9), np.ones((n, 1))]), y, rcond=1e-9)
    turn = np.linalg.svd(products[:9].T.reshape(9, 3), full_matrices=False)[0][:, 0]
    U, _, Vt = np.linalg.svd(turn.reshape(3, 3))
    result = _refine(R, p, y, np.linalg.det(U @ Vt) * U @ Vt, centre)
    return result if result.typical < near else None


def _refine(R: Array, p: Array, y: Array, rotation: Array, tool: Array) -> Alignment:
    """Return the alignment refined by Gauss-Newton with Huber weights, at scale 1 and not mirrored.

    Args:
        R, p, y: as in `_about_a_point`; rotation: (3, 3) and tool: (3,) [m] to start from.
    """
    n = len(p)
    shift = np.median(y - (p + R @ tool) @ rotation.T, axis=0)
    weight = np.ones(n)
    for _ in range(30):
        base = (p + R @ tool) @ rotation.T
        residual = y - base - shift
        error = np.linalg.norm(residual, axis=1)
        weight = huber_weights(error)
        design = np.concatenate([np.broadcast_to(np.eye(3), (n, 3, 3)), -skew(base), rotation @ R], axis=2)
        root = np.sqrt(weight)[:, None]
        equations = np.vstack([(design * root[:, :, None]).reshape(-1, 9), np.eye(3, 9, 6) * LOOSE_FIT])
        step, *_ = np.linalg.lstsq(equations, np.append(residual * root, -LOOSE_FIT * tool), rcond=1e-10)
        rotation = Rotation.from_rotvec(step[3:6]).as_matrix() @ rotation
        shift, tool = shift + step[:3], tool + step[6:]
        if np.linalg.norm(step) < 1e-10:
            break
    residual = y - (p + R @ tool) @ rotation.T - shift
    typical = float(np.median(np.linalg.norm(residual, axis=1)))
    return Alignment(transform(shift, rotation), tool, 1.0, False, residual, typical)


def huber_weights(error: Array) -> Array:
    """Return (n,) Huber weights of errors, limited at twice their median."""
    limit = max(2.0 * float(np.median(error)), 1e-12)
    return np.minimum(1.0, limit / np.maximum(error, 1e-300))
