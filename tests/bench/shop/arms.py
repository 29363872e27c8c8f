"""Arms of known truth, and the postures in which they touch something: plain numpy, nothing of the package."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.bench.loads.arms import arm_type
from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent.cells import DEG, Cell, States, settle
from tests.independent.hidden_effects import Kind

ROBOTS = ("irb4600_60_205", "irb1600_10_145", "ur10")
"""Stiffness measured on one such arm, by the rule for arms that nobody measured, and unknown."""
OFFSET, TOOL, SPRINGS = 0.5e-3, 0.5e-3, (0.4, 2.5)
"""Standard deviations of zeros [rad] and TCP [m] of the true arms, range of their compliances over those of the type."""
UR10_COMPLIANCE = np.array([3e-5, 3e-5, 3e-5, 8e-5, 8e-5, 8e-5])
LOW, HIGH = np.radians([-100, -40, -60, -170, -105, -180]), np.radians([100, 70, 45, 170, 105, 180])
UR_LOW, UR_HIGH = np.radians([-150, -120, -120, -170, -150, -170]), np.radians([150, -30, 120, 170, 150, 170])


@dataclass(frozen=True)
class Shop:
    """An arm in a shop.

    Args:
        cell: the true arm, its base as it is drawn. nominal: the arm as its file has it, with the stated TCP.
        tool: (3,) stated TCP in tool0 [m]. center: (3,) of a load in tool0 [m]. light, full: loads [kg]. reach: [m].
    """

    robot: str
    cell: Cell
    nominal: Cell
    tool: np.ndarray
    center: np.ndarray
    light: float
    full: float
    reach: float

    def states(self, q: np.ndarray, mass: np.ndarray | float, approach: np.ndarray | None = None) -> States:
        """States at joints (n, 6) [rad] under loads (n,) [kg]; sides (n, 6) from below where none are given."""
        n = len(q)
        side = np.ones((n, 6)) if approach is None else approach
        load = np.broadcast_to(np.asarray(mass, float), (n,)).copy()
        return States(q, side, np.full(n, 20.0), np.arange(n) * 60.0, load, np.tile(self.center, (n, 1)))


def shop(robot: str, seed: int, kinds: tuple[Kind, ...] = (), geometry: bool = True) -> Shop:
    """An arm with wrong zeros, springs, lengths and TCP, and with hidden effects."""
    g = np.random.default_rng([43, ROBOTS.index(robot), seed])
    if robot == "ur10":
        arm, compliance, rated, reach = A.ur10(), UR10_COMPLIANCE, 10.0, 1.3
    else:
        t = arm_type(robot)
        arm, compliance, rated, reach = t.arm, t.compliance, t.payload, t.reach
    lever = reach / 2.05
    tool, center = np.round(lever * np.array([0.02, -0.01, 0.35]), 4), np.round(lever * np.array([0.03, 0.02, 0.12]), 4)
    hidden = ((K.link_geometry(g, arm),) if geometry else ()) + tuple(kind(g, arm) for kind in kinds)
    springs = compliance * np.exp(g.uniform(*np.log(SPRINGS), 6))
    nominal = Cell(arm, np.zeros(6), compliance, A.shift(*tool), np.eye(4))
    true = replace(
        nominal, offset=g.normal(0, OFFSET, 6), compliance=springs, hidden=hidden, tool=A.shift(*(tool + g.normal(0, TOOL, 3)))
    )  # fmt: skip
    return Shop(robot, true, nominal, tool, center, round(0.1 * rated, 1), rated, reach)


def postures(g: np.random.Generator, s: Shop, n: int) -> np.ndarray:
    """(n, 6) joints at random [rad], the wrist bent, to 1e-4 deg as they are written."""
    low, high = (UR_LOW, UR_HIGH) if s.robot.startswith("ur") else (LOW, HIGH)
    low, high = np.maximum(low, s.cell.arm.lower), np.minimum(high, s.cell.arm.upper)
    q = g.uniform(low, high, (n, 6))
    q[:, 4] += np.radians(20) * np.where(q[:, 4] < 0, -1, 1) * (np.abs(q[:, 4]) < np.radians(20))
    return np.round(q / DEG, 4) * DEG


def sides(g: np.random.Generator, n: int) -> np.ndarray:
    """(n, 6) from which each joint was approached, at random."""
    return g.choice([-1.0, 1.0], (n, 6))


def free_postures(g: np.random.Generator, s: Shop, n: int) -> np.ndarray:
    """(n, 6) postures at random with the TCP above the floor and before the arm's column."""
    q = postures(g, s, 8 * n)
    p = s.nominal.arm.forward(q, s.nominal.tool).tcp[:, :3, 3]
    good = (p[:, 2] > 0.1 * s.reach) & (np.hypot(p[:, 0], p[:, 1]) > 0.3 * s.reach)
    return q[good][:n]


CONE = np.radians(75)
"""From the direction in which a tool points to where it may point [rad]."""


def touching(
    g: np.random.Generator,
    s: Shop,
    points: np.ndarray,
    way: np.ndarray,
    approach: np.ndarray,
    load: np.ndarray | None = None,
) -> States:
    """States with the joints that are commanded when the real TCP is at points (n, 3), found by jogging, to 1e-4 deg.

    Args:
        way: (3,) direction in which the tool points, about; approach: (n, 6) sides; load: (n,) [kg], light where None.
    """
    pool = postures(g, s, 30_000)
    f = s.nominal.arm.forward(pool, s.nominal.tool).tcp
    pool, f = pool[aimed := f[:, :3, 2] @ way > np.cos(CONE - 0.2)], f[aimed]
    q, left = np.zeros((len(points), 6)), np.arange(len(points))
    every = s.states(q, s.light if load is None else load, approach)
    for _ in range(30):
        far = np.linalg.norm(f[None, :, :3, 3] - points[left, None], axis=2)
        near = np.argsort(far, axis=1)[:, :60]
        start = pool[near[np.arange(len(left)), g.integers(60, size=len(left))]]
        found, good = jog(s, replace(every.take(left), q=start), points[left], way)
        q[left[good]] = found[good]
        if not len(left := left[~good]):
            return replace(every, q=np.round(q / DEG, 4) * DEG)
    raise RuntimeError(f"{s.robot} cannot touch {points[left[0]]}")


def jog(s: Shop, at: States, points: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joints (n, 6) from which the real TCP has come to the points by the shortest way, and whether it could."""
    q = at.q
    for _ in range(12):
        e = settle(s.cell, replace(at, q=q))
        off = points - e.frames.tcp[:, :3, 3]
        if np.abs(off).max() < 1e-8:
            break
        arm = [np.cross(a, e.frames.tcp[:, :3, 3] - p) for a, p in zip(e.frames.axis, e.frames.pivot, strict=True)]
        step = np.einsum("nji,ni->nj", np.linalg.pinv(np.stack(arm, axis=2)), off)
        q = q + np.clip(step, -0.15, 0.15)
    good = np.linalg.norm(points - e.frames.tcp[:, :3, 3], axis=1) < 1e-7
    good &= e.frames.tcp[:, :3, 2] @ way > np.cos(CONE)
    good &= (q > s.cell.arm.lower + 0.02).all(axis=1) & (q < s.cell.arm.upper - 0.02).all(axis=1)
    return q, good & (np.abs(q[:, 4]) > np.radians(10))
