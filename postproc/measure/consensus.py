"""Which rows agree on where the instrument stands: the others cannot have been measured as the table says.

The instrument's place and the tool are 9 unknowns, a placed session with a known tool 6. Random samples of rows propose
them, the proposal with the least median distance of all rows is improved on the better half of the rows, and what then
lies many times farther off than is typical is wrong. That holds while more than half of the rows are right. Sources:
Fischler and Bolles (1981); Rousseeuw (1984), least median of squares; Rousseeuw and van Driessen (1999), concentration.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.measure.alignment import Alignment, align, linear_design, spread_of
from postproc.measure.checks.readings import SUSPICIOUS_M, PlacedArm, fits, near
from postproc.measure.measurements import Measurements
from postproc.robot.arm import Robot
from postproc.robot.kinematics import jacobian, skew
from postproc.robot.pose import transform

LEAST_M, TIMES, TIMES_FITTED = 0.005, 8.0, 10.0
"""No arm is so far [m], and so many times farther than in its typical row, from its nominal kinematics; and from that
with its joint zeros fitted, which leave little in most rows and more where an arm is heavily accelerated."""
MOVING_M = 0.05
"""The same of an arm that moves: it lags behind, and yields to the inertia of what it carries."""
LARGEST_SHARE_OUT = 1 / 3
"""Share of the rows of a session that may be wrong: the rest could not be believed, either."""
SAMPLES, BEST, HALVINGS = 400, 8, 6
"""Samples that are drawn, those that are improved, and how often. Of eight rows, all are right in 1 sample of 17 where
three rows in ten are wrong: 400 samples hold none of these once in 10^10 tables."""
ENOUGH, ENOUGH_PLACED = 16, 6
"""Rows of a session without and with a known tool in which one that is wrong can be told."""
TINY = 1e-8
"""Added to the squares of a sample of unit size: what its rows leave open stays small."""
FEWEST_PLACED = 5
"""Poses of a session from which its place can be had: the linear alignment has 15 unknowns, a pose three numbers."""
ENOUGH_ZEROS = 40
"""Rows of a session in which joint zeros are told as well."""
LOOKED_AT = 600
"""Rows of a session by which samples are judged; all rows are held against what is found."""


@dataclass(frozen=True)
class Agreement:
    """What k rows of a table agree on.

    Args:
        rows: (k,) index of those with a commanded state and a position. wrong: (k,) those that cannot be right.
        error: (k, 3) measured minus the point of the nominal arm at the fitted place [m], axes of the instrument.
        typical: (k,) its median length in the session of the row [m]. doubtful: names of sessions so many rows of which
            are wrong that none of them can be believed, "" where there are no sessions.
        fits: whether the rows that agree fit the nominal arm, at a scale of 1 and not mirrored; near: the same without
            scale and mirror, which poses in a small part of space do not tell.
    """

    rows: NDArray[np.int_]
    wrong: NDArray[np.bool_]
    error: Array
    typical: Array
    doubtful: tuple[str, ...]
    fits: bool
    near: bool


def agreement(data: Measurements, robot: Robot) -> Agreement:
    """Return which rows agree on where the instrument is; each session has a place, and the tool of the largest.

    Where no session has `FEWEST_PLACED` poses, all rows are taken to be seen from one place.
    """
    located = np.isfinite(data.position).all(axis=1) & np.isfinite(data.state.q).all(axis=1)
    rows = np.flatnonzero(located & ~data.off_arm)
    arm, q = PlacedArm(robot, data.state.T_reference_base).rows(rows), data.state.q[rows]
    T = arm.flange(q)
    if data.tool_known:
        T = T @ data.state.T_flange_tcp[rows]
    sessions, reflectors = sessions_of(data)[rows], data.state.reflector_of_rows[rows]
    points = reflector_points(T, data.position[rows], reflectors, sessions)
    T = T @ transform(np.array([points[name] for name in reflectors]).reshape(-1, 3))
    error, typical, wrong = np.zeros((len(rows), 3)), np.zeros(len(rows)), np.zeros(len(rows), dtype=bool)
    first: Alignment | None = None
    doubtful, names = [], sessions.copy()
    if max((poses_among(q[names == name]) for name in np.unique(names)), default=0) < FEWEST_PLACED:
        names[:] = ""
    for name, _ in Counter(names.tolist()).most_common():
        members = np.flatnonzero(names == name)
        few = poses_among(q[members]) < (ENOUGH if first is None else ENOUGH_PLACED)
        alignment = _placed(T[members], data.position[rows[members]], few, first)
        error[members], typical[members] = alignment.residual, alignment.typical
        lost = first is not None and first.typical < SUSPICIOUS_M < alignment.typical
        far = _wrong(alignment, T[members], arm.rows(members), q[members], few)
        wrong[members] = lost or far & (np.linalg.norm(alignment.residual, axis=1) > _least(data, rows[members]))
        if wrong[members].mean() > LARGEST_SHARE_OUT:
            doubtful.append(str(name))
        if first is None:
            first, T = alignment, T @ transform(alignment.tool)
    if first is None:
        return Agreement(rows, wrong, error, typical, (), False, False)
    return Agreement(rows, wrong, error, typical, tuple(doubtful), fits(first), first.typical < SUSPICIOUS_M)


def reflector_points(
    T: Array, position: Array, reflectors: NDArray[np.str_], sessions: NDArray[np.str_]
) -> dict[str, Array]:
    """Return where each reflector is on the tool beside that of most rows, (3,) [m] by name in axes of the tool.

    A session is placed by a reflector whose point is known, and a reflector by the rows of a placed session: the median
    of its point in these. Reflectors that no chain of sessions joins to the first stay with it.

    Args:
        T: (n, 4, 4) poses of the tool [m]; position: (n, 3) measured [m]; reflectors, sessions: (n,) names.
    """
    names = list(dict.fromkeys(reflectors.tolist()))
    points = {name: np.zeros(3) for name in names}
    groups = Counter(zip(sessions.tolist(), reflectors.tolist(), strict=True)).most_common()
    if len(names) < 2:
        return points
    known, frames, tool = {largest(reflectors)}, dict[str, Array](), None
    for _ in groups:
        # The largest group that places a session, then the largest that places a reflector.
        placing = next((g for g in groups if g[0][0] not in frames and g[0][1] in known), None)
        if placing is not None:
            (session, name), _ = placing
            rows = (sessions == session) & (reflectors == name)
            shifted = T[rows] @ transform(points[name] + (0.0 if tool is None else tool))
            few, y = poses_among(T[rows, :3, 3]) < ENOUGH, position[rows]
            placed = _placed(shifted, y, few, None) if tool is None else _settled(shifted, y, False, near(y))
            frames[session] = placed.T_instrument_base
            tool = placed.tool if tool is None else tool
        for (session, name), _ in groups:
            if name not in known and session in frames:
                rows, frame = (sessions == session) & (reflectors == name), frames[session]
                seen = (position[rows] - frame[:3, 3]) @ frame[:3, :3] - T[rows, :3, 3]
                assert tool is not None
                points[name] = np.median(np.einsum("nji,nj->ni", T[rows, :3, :3], seen), axis=0) - tool
                known.add(name)
    return points


def largest(names: NDArray[np.str_]) -> str:
    """Return the name that stands most often among (n,) names, n > 0."""
    return Counter(names.tolist()).most_common(1)[0][0]


def _least(data: Measurements, rows: NDArray[np.int_]) -> Array:
    """Return (k,) least error [m] at which each of ``rows`` may be wrong: `MOVING_M` where the arm moves, else 0."""
    moves = [np.any(x[rows] != 0, axis=1) for x in (data.state.v, data.state.a) if x is not None]
    return np.where(np.any(moves, axis=0), MOVING_M, 0.0) if moves else np.zeros(len(rows))


def sessions_of(data: Measurements) -> NDArray[np.str_]:
    """Return (n,) name of the session of each row, "" where there are none."""
    return np.full(len(data), "") if data.state.session is None else data.state.session_of_rows


def poses_among(q: Array) -> int:
    """Return how many of the joint angles (n, 6) [rad] differ."""
    return len(np.unique(np.round(q, 6), axis=0))


def _wrong(alignment: Alignment, T: Array, arm: PlacedArm, q: Array, few: bool) -> NDArray[np.bool_]:
    """Return (n,) mask of rows that cannot be right; all False if the arm does not fit as a whole.

    Of few poses at most one can be told: all False, too, if more seem wrong.

    Args:
        alignment: the alignment with the residuals; T: (n, 4, 4) flanges [m]; arm: at these rows; q: (n, 6) [rad].
        few: whether there are few poses.
    """
    off = np.linalg.norm(alignment.residual, axis=1)
    if alignment.typical > SUSPICIOUS_M:
        return np.zeros(len(off), dtype=bool)
    wrong = off > max(LEAST_M, TIMES * alignment.typical)
    if len(off) >= ENOUGH_ZEROS and off.max() > LEAST_M and not few and wrong.mean() < LARGEST_SHARE_OUT:
        off = _with_zeros(alignment, T, arm, q)
        wrong |= off > max(LEAST_M, TIMES_FITTED * float(np.median(off)))
    return np.asarray(wrong & (not few or wrong.sum() == 1))


def _placed(T: Array, position: Array, few: bool, first: Alignment | None) -> Alignment:
    """Return the alignment of the rows of a session that agree; residuals are of all its rows, typical their median.

    Args:
        T: (n, 4, 4) flanges, or poses of the measured point once a session has determined it; position: (n, 3) [m].
        few: whether there are too few poses to choose among.
        first: alignment of the largest session, whose place stands in for that of a session with few poses.
    """
    if few and first is not None:
        frame = first.T_instrument_base
        residual = position - T[:, :3, 3] @ frame[:3, :3].T - frame[:3, 3]
        return replace(first, tool=np.zeros(3), residual=residual)
    tool = first is None
    plain = align(T, position, tool, near(position))
    if few or np.linalg.norm(plain.residual, axis=1).max() < LEAST_M:
        return plain  # nothing to choose
    others = _settled(T, position, tool, _proposed(T, position, tool))
    return min(_settled(T, position, tool, near(position)), others, key=lambda placed: placed.typical)


def _with_zeros(alignment: Alignment, T: Array, arm: PlacedArm, q: Array) -> Array:
    """Return (n,) distances [m] that a fit of joint zeros, place and tool leaves (least trimmed squares).

    Most of what an arm lacks in its nominal kinematics is in its zeros, so that a smaller error of a row shows.

    Args:
        alignment: the alignment to start from; T: (n, 4, 4) flanges; q: (n, 6) [rad].
    """
    R, tcp = alignment.T_instrument_base[:3, :3], T @ transform(alignment.tool)
    turned = jacobian(arm.robot, q, np.linalg.inv(arm.flange(q)) @ tcp)[:, :3]
    if arm.T_reference_base is not None:
        turned = arm.T_reference_base[:, :3, :3] @ turned
    placed, tool = tcp[:, :3, 3] @ R.T, R @ T[:, :3, :3]
    design = np.concatenate([np.broadcast_to(np.eye(3), tool.shape), -skew(placed), tool, R @ turned], axis=2)
    kept = int(np.ceil((1 - LARGEST_SHARE_OUT) * len(T)))
    kept_rows = np.flatnonzero(_closest_half(design, alignment.residual, 8))
    for _ in range(HALVINGS):
        step, *_ = np.linalg.lstsq(design[kept_rows].reshape(-1, 15), alignment.residual[kept_rows].ravel(), rcond=1e-6)
        off = np.linalg.norm(alignment.residual - design @ step, axis=1)
        kept_rows = np.argsort(off)[:kept]
    return np.asarray(off)


def _settled(T: Array, position: Array, tool: bool, agree: NDArray[np.bool_]) -> Alignment:
    """Return the alignment of the rows that agree with it, found by iteration; typical is the median of all rows.

    Args:
        T, position: as in `_placed`; tool: whether the tool is fitted; agree: (n,) mask of rows to start from.
    """
    for _ in range(HALVINGS):
        alignment = align(T, position, tool, agree)
        # An alignment at another scale has no residuals.
        off = np.nan_to_num(np.linalg.norm(alignment.residual, axis=1), nan=np.inf)
        alignment = replace(alignment, typical=float(np.median(off)))
        closer = off <= max(LEAST_M, TIMES * alignment.typical)
        if (closer == agree).all() or alignment.typical == np.inf:
            break
        agree = closer
    return alignment


def _proposed(T: Array, position: Array, tool: bool) -> NDArray[np.bool_]:
    """Return (n,) mask of the half of the rows that one linear map (`linear_design`) brings nearest to the arm.

    Args:
        T, position, tool: as in `_settled`.
    """
    y = position - np.median(position, axis=0)
    design = linear_design(T[:, :3, :3], y / spread_of(y), tool)
    return _closest_half(design, T[:, :3, 3] - np.median(T[:, :3, 3], axis=0), 8 if tool else 6)


def _closest_half(design: Array, wanted: Array, size: int) -> NDArray[np.bool_]:
    """Return (n,) mask of the half of the rows that the best x of design x = wanted fits, found from random samples.

    Args:
        design: (n, 3, u); wanted: (n, 3). size: rows of a sample, more than are needed: that makes it steadier.
    """
    sample = np.linspace(0, len(wanted) - 1, min(len(wanted), LOOKED_AT)).astype(int)
    design, wanted = design[sample], wanted[sample]
    g = np.random.default_rng(0)
    drawn = np.array([g.choice(len(sample), size, replace=False) for _ in range(SAMPLES)])
    off = _distances(design, wanted, drawn)
    for _ in range(HALVINGS):
        best = np.argsort(np.median(off, axis=1))[:BEST]
        drawn = np.argsort(off[best], axis=1)[:, : len(sample) // 2]
        off = _distances(design, wanted, drawn)
    agree = np.zeros(int(sample[-1]) + 1, dtype=bool)
    agree[sample[drawn[np.argmin(np.median(off, axis=1))]]] = True
    return agree


def _distances(design: Array, wanted: Array, drawn: NDArray[np.int_]) -> Array:
    """Return (k, n) norms of design x - wanted of all rows, for k least-squares solutions x from m rows each.

    Args:
        design: (n, 3, u); wanted: (n, 3); drawn: (k, m) indices of the rows of each solution.
    """
    A = design[drawn].reshape(len(drawn), -1, design.shape[2])
    turned = np.swapaxes(A, 1, 2)
    right = turned @ wanted[drawn].reshape(len(drawn), -1, 1)
    x = np.linalg.solve(turned @ A + TINY * np.eye(A.shape[2]), right)
    return np.asarray(np.linalg.norm(np.einsum("nij,kj->kni", design, x[:, :, 0]) - wanted, axis=2))
