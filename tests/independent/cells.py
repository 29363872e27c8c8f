"""A measured cell: the independent arm with base errors and hidden effects, and the states it is measured in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from tests.independent import arm as A

DEG = np.pi / 180


@dataclass(frozen=True)
class States:
    """n measured states; SI and radians, temperature in degC, time in s; force and moment (n, 3) on the TCP, base axes."""

    q: np.ndarray
    approach: np.ndarray
    temperature: np.ndarray
    time: np.ndarray
    mass: np.ndarray
    center: np.ndarray
    v: np.ndarray | None = None
    a: np.ndarray | None = None
    session: np.ndarray | None = None
    force: np.ndarray | None = None
    moment: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.q)

    def take(self, index: np.ndarray) -> States:
        parts = {k: (None if (x := getattr(self, k)) is None else x[index]) for k in self.__dataclass_fields__}
        return States(**parts)


Joint = Callable[[States, np.ndarray], np.ndarray]
Body = Callable[[States, A.Frames, np.ndarray], np.ndarray]
Force = Callable[[States, A.Frames], A.Wrenches]
World = Callable[[States, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Hidden:
    """One effect: shares of joint angle, body displacement, force, or place seen by the instrument.

    Args:
        answer: library key, or ``unknown``; accept: other right answers; channels: what the structure follows.
    """

    kind: str
    answer: str
    joint: Joint | None = None
    body: Body | None = None
    force: Force | None = None
    world: World | None = None
    accept: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    note: str = ""
    needs: str = ""


@dataclass(frozen=True)
class Cell:
    arm: A.Arm
    offset: np.ndarray
    compliance: np.ndarray
    tool: np.ndarray
    instrument: np.ndarray
    hidden: tuple[Hidden, ...] = ()
    gravity: np.ndarray = field(default_factory=lambda: A.G)


def settle(cell: Cell, s: States) -> A.Equilibrium:
    """Where the arm stands under all loads."""
    none = np.zeros(3)
    force, moment = (none if x is None else x for x in (s.force, s.moment))
    load = A.Load(s.mass, s.center, force, moment, cell.gravity)

    def displace(f: A.Frames, tau: np.ndarray, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        dq = cell.offset + tau * cell.compliance
        xi = np.zeros((len(s), 7, 6))
        for h in cell.hidden:
            if h.joint:
                dq = dq + h.joint(s, tau)
            if h.body:
                xi += h.body(s, f, wrench)
        return dq, xi

    def extra(f: A.Frames) -> A.Wrenches:
        parts, joint = [], np.zeros((len(s), 6))
        if s.v is not None and s.a is not None:
            parts += A.inertial_loads(cell.arm, f, s.v, s.a, load).parts
        for h in cell.hidden:
            if h.force:
                more = h.force(s, f)
                parts, joint = parts + more.parts, joint + more.joint
        return A.Wrenches(parts, joint)

    return A.equilibrium(cell.arm, s.q, cell.tool, load, displace, extra, sweeps=8)


def measure(cell: Cell, s: States) -> np.ndarray:
    """(n, 3) true TCP in the instrument's frame [m]."""
    return seen_by_instrument(cell, s, settle(cell, s))


def seen_by_instrument(cell: Cell, s: States, e: A.Equilibrium) -> np.ndarray:
    """(n, 3) true TCP in the instrument's frame [m], of an arm that stands there."""
    p = e.frames.tcp[:, :3, 3]
    seen = p @ cell.instrument[:3, :3].T + cell.instrument[:3, 3]
    for h in cell.hidden:
        if h.world:
            seen = seen + h.world(s, seen)
    return seen


def column(j: int, x: np.ndarray) -> np.ndarray:
    out = np.zeros((len(x), 6))
    out[:, j] = x
    return out


def pick(g: np.random.Generator, joints: list[int], most: int) -> list[int]:
    k = int(g.integers(1, most + 1))
    return sorted(int(j) for j in g.choice(joints, size=min(k, len(joints)), replace=False))


def draw_states(
    g: np.random.Generator, n: int, arm: A.Arm, moving: bool, session: bool, span: float = 21600.0
) -> States:
    if arm.name.startswith("ur"):
        low, high = np.radians([-150, -120, -120, -170, -150, -170]), np.radians([150, -30, 120, 170, 150, 170])
        masses = [1.0, 5.0, 10.0] if arm.name == "ur10" else [1.0, 2.5, 5.0]
    else:
        low, high = np.radians([-100, -40, -60, -170, -105, -180]), np.radians([100, 70, 45, 170, 105, 180])
        masses = [5.0, 30.0, 60.0] if "205" in arm.name else [2.0, 10.0, 20.0]
    q = g.uniform(low, high, (n, 6))
    small = np.abs(q[:, 4]) < np.radians(20)
    q[small, 4] = np.radians(20) * np.where(q[small, 4] < 0, -1, 1) + q[small, 4]
    time = np.sort(g.uniform(0, span, n))
    temperature = 19 + 21 * (1 - np.exp(-time / 5500.0)) + g.normal(0, 1.2, n)
    s = States(
        q=np.round(q / DEG, 5) * DEG, approach=g.choice([-1.0, 1.0], (n, 6)), temperature=np.round(temperature, 2), time=np.round(time, 1),
        mass=g.choice(masses, n), center=np.tile([0.03, 0.02, 0.12], (n, 1)),
    )  # fmt: skip
    if moving:
        v = g.uniform(-1, 1, (n, 6)) * [60, 50, 50, 90, 90, 120]
        a = g.uniform(-1, 1, (n, 6)) * [120, 100, 100, 200, 200, 250]
        s = replace(s, v=np.round(v, 5) * DEG, a=np.round(a, 5) * DEG, approach=np.sign(v))
    if session:
        s = replace(s, session=(np.arange(n) >= n // 2).astype(int))
    return s


def draw_cell(g: np.random.Generator, arm: A.Arm, hidden: tuple[Hidden, ...]) -> Cell:
    nominal = A.TABLE_2 if not arm.name.startswith("ur") else np.array([3e-5, 3e-5, 3e-5, 8e-5, 8e-5, 8e-5])
    turn = g.normal(0, 1e-3 / np.sqrt(3), 3)
    return Cell(
        arm, g.normal(0, 0.03, 6) * DEG, nominal * g.uniform(0.7, 1.4, 6), A.shift(*(np.array([0.02, -0.01, 0.35]) + g.normal(0, 0.5e-3, 3))),
        A.transform(A.rotation_vector(turn), g.normal(0, 2e-3 / np.sqrt(3), 3)), hidden,
    )  # fmt: skip


STEPS = np.array([1e-4] * 15 + [1e-1] * 6)


def base_slope(cell: Cell, s: States) -> np.ndarray:
    """(3 n, 21) change of the places by a step of frame, TCP, offsets and compliances, nothing hidden."""
    plain = replace(cell, hidden=())

    def model(p: np.ndarray) -> np.ndarray:
        moved = replace(
            plain,
            offset=cell.offset + p[9:15],
            compliance=cell.compliance * (1 + p[15:21]),
            tool=cell.tool @ A.shift(*p[6:9]),
            instrument=A.transform(A.rotation_vector(p[3:6]), p[:3]) @ cell.instrument,
        )
        return measure(moved, s).ravel()

    return np.stack([(model(d) - model(-d)) / 2 for d in np.diag(STEPS)], axis=1)


def base_residual(gap: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """What of a gap (n, 3) [m] frames, TCP, offsets and compliances cannot explain, to first order."""
    x = np.linalg.lstsq(slope, gap.ravel(), rcond=1e-7)[0]
    return gap - (slope @ x).reshape(gap.shape)
