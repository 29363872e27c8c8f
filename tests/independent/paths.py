"""Commanded paths of executed moves on the controller's nominal arm, and where the elastic arm really goes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent.rapid import Motion
from tests.worlds.geometry import quaternion_of_matrix


@dataclass(frozen=True)
class Leg:
    """One move as samples: commanded T_base_tcp (n, 4, 4), q (n, 6), fraction u (n,) from its start to its goal.

    A joint move has its goal alone. ``problem`` says why a leg could not be played.
    """

    motion: Motion
    command: np.ndarray
    q: np.ndarray
    u: np.ndarray
    problem: str | None = None
    conf_wrong: bool = False


def log_rotation(r: np.ndarray) -> np.ndarray:
    """(..., 3) rotation vectors of (..., 3, 3), exact up to half a turn."""
    v = 0.5 * np.stack([r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1)
    s = np.linalg.norm(v, axis=-1)
    angle = np.arctan2(s, 0.5 * (np.trace(r, axis1=-2, axis2=-1) - 1))
    with np.errstate(invalid="ignore", divide="ignore"):
        k = np.where(s > 1e-12, angle / s, 1.0)
    return v * k[..., None]


def slerp(a: np.ndarray, b: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(n, 3, 3): from a towards b about one fixed axis."""
    return a @ A.rotation_vector(u[:, None] * log_rotation(a.T @ b))


def line(start: np.ndarray, goal: np.ndarray, u: np.ndarray) -> np.ndarray:
    p = start[:3, 3] + u[:, None] * (goal[:3, 3] - start[:3, 3])
    return A.transform(slerp(start[:3, :3], goal[:3, :3], u), p)


@dataclass(frozen=True)
class Circle:
    center: np.ndarray
    normal: np.ndarray
    radius: float
    start: np.ndarray
    sweep: float

    def at(self, u: np.ndarray) -> np.ndarray:
        return self.center + A.rotation(self.normal, u * self.sweep) @ (self.start - self.center)

    def distance(self, p: np.ndarray) -> np.ndarray:
        """(n,) from points to the arc, its ends included."""
        d = p - self.center
        height = d @ self.normal
        flat = d - height[:, None] * self.normal
        x = (self.start - self.center) / self.radius
        y = np.cross(self.normal, x)
        angle = np.arctan2(flat @ y, flat @ x)
        middle = self.sweep / 2
        angle = middle + np.arctan2(np.sin(angle - middle), np.cos(angle - middle))
        near = self.at(np.clip(angle / self.sweep, 0, 1))
        return np.linalg.norm(p - near, axis=1)


def circle(a: np.ndarray, via: np.ndarray, b: np.ndarray) -> Circle:
    """The arc from a through via to b (3,)."""
    u, v = via - a, b - a
    n = np.cross(u, v)
    m = n @ n
    center = a + (np.cross(n, u) * (v @ v) + np.cross(v, n) * (u @ u)) / (2 * m)
    normal = n / np.sqrt(m)
    x, y = a - center, b - center
    sweep = np.arctan2(np.cross(x, y) @ normal, x @ y) % (2 * np.pi)
    return Circle(center, normal, float(np.linalg.norm(x)), a, float(sweep))


def arc(start: np.ndarray, via: np.ndarray, goal: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Circle in space; the orientation turns with the path and evenly relative to it, the long way where via stands on that."""
    c = circle(start[:3, 3], via[:3, 3], goal[:3, 3])
    turn = A.rotation(c.normal, u * c.sweep)
    # From a quaternion: half circles with one orientation turn by half a turn relative to the path.
    w, *v = quaternion_of_matrix(start[:3, :3].T @ A.rotation(c.normal, np.array(-c.sweep)) @ goal[:3, :3])
    sine = float(np.linalg.norm(v))
    size = 2 * float(np.arctan2(sine, w))
    relative = np.array(v) * (size / max(sine, 1e-15))
    if size > np.radians(5.0):
        d = via[:3, 3] - c.center
        x = (c.start - c.center) / c.radius
        share = float(np.arctan2(d @ np.cross(c.normal, x), d @ x) % (2 * np.pi)) / c.sweep
        seen = start[:3, :3].T @ A.rotation(c.normal, np.array(-share * c.sweep)) @ via[:3, :3]
        long_way = relative * (1 - 2 * np.pi / size)
        off = [float(np.linalg.norm(log_rotation(A.rotation_vector(share * w).T @ seen))) for w in (relative, long_way)]
        relative = long_way if off[1] < off[0] / 2 else relative
    return A.transform(turn @ start[:3, :3] @ A.rotation_vector(u[:, None] * relative), c.at(u))


def shape(start: np.ndarray, m: Motion, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Fractions u (n,) and poses (n, 4, 4) of a line or arc with at most ``step`` metres between samples."""
    if m.kind == "C":
        assert m.via is not None
        c = circle(start[:3, 3], m.via[:3, 3], m.goal[:3, 3])
        length = c.radius * c.sweep
    else:
        length = float(np.linalg.norm(m.goal[:3, 3] - start[:3, 3]))
    turn = float(np.linalg.norm(log_rotation(start[:3, :3].T @ m.goal[:3, :3])))
    n = max(int(np.ceil(length / step)), int(np.ceil(turn / 0.02)), 4)
    u = np.linspace(0, 1, n + 1)
    return u, (arc(start, m.via, m.goal, u) if m.kind == "C" else line(start, m.goal, u))  # type: ignore[arg-type]


def to_flange(t: np.ndarray, m: Motion) -> np.ndarray:
    """(n, 4, 4) flange poses for poses of the TCP on the work, which is in the base or on the flange."""
    return m.tool @ np.linalg.inv(t) if m.stationary else t @ np.linalg.inv(m.tool)


def on_work(flange: np.ndarray, m: Motion) -> np.ndarray:
    """(n, 4, 4) poses of the TCP on the work."""
    return np.linalg.inv(flange) @ m.tool if m.stationary else flange @ m.tool


def play(arm: A.Arm, moves: list[Motion], step: float = 0.002) -> list[Leg]:
    """Every move on the nominal arm, joint angles continuous; a leg that cannot be played restarts the chain."""
    legs: list[Leg] = []
    q: np.ndarray | None = None
    for m in moves:
        if m.kind == "A":
            assert m.q is not None
            q = m.q
            legs.append(Leg(m, on_work(arm.forward(q[None], np.eye(4)).flange, m), q[None], np.ones(1)))
            continue
        if m.kind == "J" or q is None:
            found = I.solve_target(arm, to_flange(m.goal[None], m)[0], m.conf)
            problem = None if found is not None else "no solution in the stated configuration"
            if found is None and q is not None:
                path = I.follow(arm, to_flange(m.goal[None], m), q)
                found = None if path is None else path[0]
            q = found
            joints = np.zeros((0, 6)) if q is None else q[None]
            legs.append(Leg(m, m.goal[None], joints, np.ones(1), problem, q is not None and _wrong(arm, q, m)))
            continue
        start = on_work(arm.forward(q[None], np.eye(4)).flange, m)[0]
        u, command = shape(start, m, step)
        path = I.follow(arm, to_flange(command, m), q)
        if path is None:
            legs.append(Leg(m, command, np.zeros((0, 6)), u, "out of reach"))
            q = I.solve_target(arm, to_flange(m.goal[None], m)[0], m.conf)
            continue
        problem = None
        if (path < arm.lower - 1e-9).any() or (path > arm.upper + 1e-9).any():
            problem = "joint limit"
        elif np.abs(np.diff(path, axis=0)).max() > 0.3:
            problem = "joint jump (singularity)"
        q = path[-1]
        legs.append(Leg(m, command, path, u, problem, _wrong(arm, q, m)))
    return legs


def _wrong(arm: A.Arm, q: np.ndarray, m: Motion) -> bool:
    """Whether confdata selects another posture: axes 1, 4, 6 more than one quadrant from theirs, or another cfx."""
    return not selects(arm, q, m.conf, -1e-4)


def selects(arm: A.Arm, q: np.ndarray, conf: tuple[int, ...], margin: float = 0.0) -> bool:
    """Whether confdata means joint angles (6,): cfx is theirs, axes 1, 4, 6 at most one quadrant off less a margin [rad]."""
    away = np.abs(q[[0, 3, 5]] - (np.array(conf[:3]) + 0.5) * np.pi / 2).max()
    return bool(away <= 0.75 * np.pi - margin and I.confdata(arm, q)[0, 3] == conf[3])


def real(
    arm: A.Arm, q: np.ndarray, m: Motion, displace: A.Displace, force: np.ndarray, moment: np.ndarray
) -> np.ndarray:
    """(n, 3) where the TCP of the elastic arm is on the work."""
    load = A.Load(m.mass, m.center, force, moment)
    if m.stationary:
        # The tool pushes where it stands, whatever part of the bent arm's work is there.
        point = np.broadcast_to(m.tool[:3, 3], (len(q), 3))
        push = A.Wrenches([(6, point, np.broadcast_to(force, point.shape), np.broadcast_to(moment, point.shape))])
        bent = A.equilibrium(arm, q, np.eye(4), A.Load(m.mass, m.center), displace, lambda f: push).frames.flange
        return on_work(bent, m)[:, :3, 3]
    return A.equilibrium(arm, q, m.tool, load, displace).frames.tcp[:, :3, 3]


def corner(before: np.ndarray, goal: np.ndarray, after: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(n, 4, 4) a parabola past the goal, and the matching turn, between two poses."""
    p = (
        (1 - u[:, None]) ** 2 * before[:3, 3]
        + 2 * (u * (1 - u))[:, None] * goal[:3, 3]
        + (u**2)[:, None] * after[:3, 3]
    )
    a = slerp(before[:3, :3], goal[:3, :3], u)
    b = slerp(goal[:3, :3], after[:3, :3], u)
    r = np.stack([slerp(x, y, np.array([w]))[0] for x, y, w in zip(a, b, u, strict=True)])
    return A.transform(r, p)


def cut_corners(legs: list[Leg], n: int = 16) -> list[np.ndarray]:
    """Commanded samples per leg with corners of zone goals replaced by parabolas.

    A zone is at most half the way to the neighbouring goals. The first half of a corner belongs to the leg that ends there.
    """
    out = [leg.command for leg in legs]
    lengths = [_length(leg.command) for leg in legs]
    trimmed = [[0.0, 1.0] for _ in legs]
    curves: dict[int, np.ndarray] = {}
    for i in range(len(legs) - 1):
        a, b = legs[i], legs[i + 1]
        if (
            a.motion.kind not in "LC"
            or b.motion.kind not in "LC"
            or a.motion.zone <= 0
            or not np.allclose(a.motion.tool, b.motion.tool)
            or a.motion.stationary != b.motion.stationary
        ):
            continue
        r = min(a.motion.zone, lengths[i] / 2, lengths[i + 1] / 2)
        if r < 1e-6:
            continue
        fa, fb = r / lengths[i], r / lengths[i + 1]
        before, after = _at(a, 1 - fa), _at(b, fb)
        curves[i] = corner(before, a.motion.goal, after, np.linspace(0, 1, 2 * n + 1))
        trimmed[i][1], trimmed[i + 1][0] = 1 - fa, fb
    for i, leg in enumerate(legs):
        lo, hi = trimmed[i]
        if (lo, hi) == (0.0, 1.0):
            continue
        parts = [leg.command[(leg.u >= lo) & (leg.u <= hi)]]
        if i - 1 in curves:
            parts.insert(0, curves[i - 1][n:])
        if i in curves:
            parts.append(curves[i][: n + 1])
        out[i] = np.concatenate(parts)
    return out


def _length(t: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(t[:, :3, 3], axis=0), axis=1).sum())


def _at(leg: Leg, u: float) -> np.ndarray:
    """(4, 4) on the leg's own samples."""
    k = int(np.clip(np.searchsorted(leg.u, u) - 1, 0, len(leg.u) - 2))
    w = (u - leg.u[k]) / (leg.u[k + 1] - leg.u[k])
    return line(leg.command[k], leg.command[k + 1], np.array([w]))[0]


def polyline_distance(p: np.ndarray, path: np.ndarray) -> np.ndarray:
    """(n,) from points (n, 3) to a polyline (m, 3)."""
    if len(path) == 1:
        return np.linalg.norm(p - path, axis=1)
    a, d = path[:-1], np.diff(path, axis=0)
    d2 = np.maximum((d * d).sum(axis=1), 1e-30)
    best = np.full(len(p), np.inf)
    for i in range(0, len(p), 256):
        rel = p[i : i + 256, None] - a
        w = np.clip((rel * d).sum(axis=2) / d2, 0, 1)
        best[i : i + 256] = np.linalg.norm(rel - w[..., None] * d, axis=2).min(axis=1)
    return best
