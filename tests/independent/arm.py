"""An elastic serial arm in plain numpy: cross products for the loads, a fixed point for the equilibrium.

Every array has n poses in front. SI and radians. Joint j (0..5) stands between body j and body j + 1; body 0 is the pedestal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

G = np.array([0.0, 0.0, -9.81])

# Virtual-spring compliances of the seed paper's Table 2 [rad/(N m)].
TABLE_2 = 1.0 / np.array([0.237e6, 3.32e6, 2.79e6, 0.486e6, 0.521e6, 0.38e6])


def rotation(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(n, 3, 3) turns about one axis (3,) by n angles: I + sin K + (1 - cos) K^2."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=float)
    a = np.asarray(angle, float)[..., None, None]
    return np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * (k @ k)


def rotation_vector(w: np.ndarray) -> np.ndarray:
    """(n, 3, 3) turns by rotation vectors (n, 3)."""
    w = np.asarray(w, float)
    k = np.zeros((*w.shape[:-1], 3, 3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    k -= np.swapaxes(k, -1, -2)
    t = np.linalg.norm(w, axis=-1)[..., None, None]
    s = np.sinc(t / np.pi)
    c = 0.5 * np.sinc(t / (2 * np.pi)) ** 2
    return np.eye(3) + s * k + c * (k @ k)


def transform(r: np.ndarray, p: np.ndarray) -> np.ndarray:
    """(..., 4, 4) from rotation (..., 3, 3) and place (..., 3)."""
    shape = np.broadcast_shapes(r.shape[:-2], p.shape[:-1])
    t = np.zeros((*shape, 4, 4))
    t[..., :3, :3], t[..., :3, 3], t[..., 3, 3] = r, p, 1.0
    return t


def shift(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    return transform(np.eye(3), np.array([x, y, z], float))


def small(xi: np.ndarray) -> np.ndarray:
    """(n, 4, 4) of small displacements (n, 6): translation, then rotation vector."""
    return transform(rotation_vector(xi[..., 3:]), xi[..., :3])


@dataclass(frozen=True)
class Frames:
    """Where everything is in one state of n poses.

    Args:
        body: seven (n, 4, 4): body frames right after each joint's turn (0: base).
        distal: seven (n, 4, 4): the distal end of each body before its small displacement, in the body's axes.
        pivot: six (n, 3) points on the joint axes; axis: six (n, 3) directions.
        flange, tcp: (n, 4, 4).
    """

    body: list[np.ndarray]
    distal: list[np.ndarray]
    pivot: list[np.ndarray]
    axis: list[np.ndarray]
    flange: np.ndarray
    tcp: np.ndarray


@dataclass(frozen=True)
class Arm:
    """T = link0 Exp(xi0) Rot(axis0, q0 + dq0) link1 Exp(xi1) ... link6 Exp(xi6); masses sit on bodies 1..6."""

    name: str
    link: np.ndarray
    axis: np.ndarray
    mass: np.ndarray
    center: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    lengths: dict[str, float] = field(default_factory=dict)
    gyration: np.ndarray = field(default_factory=lambda: np.zeros(7))

    def forward(
        self, q: np.ndarray, tool: np.ndarray, dq: np.ndarray | float = 0.0, xi: np.ndarray | None = None
    ) -> Frames:
        """Frames of n poses ``q`` (n, 6), deflected by ``dq`` (n, 6) and ``xi`` (n, 7, 6)."""
        q = np.atleast_2d(q) + dq
        r, p = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
        body, distal, pivot, axis = [transform(r, p)], [], [], []
        for b in range(7):
            # The small displacement acts at the distal point in the body's axes, before the link's own turn.
            p = p + r @ self.link[b][:3, 3]
            distal.append(transform(r, p))
            if xi is not None and xi[:, b].any():
                p = p + (r @ xi[:, b, :3, None])[:, :, 0]
                r = r @ rotation_vector(xi[:, b, 3:])
            r = r @ self.link[b][:3, :3]
            if b < 6:
                pivot.append(p)
                axis.append(r @ self.axis[b])
                r = r @ rotation(self.axis[b], q[:, b])
                body.append(transform(r, p))
        t = transform(r, p)
        return Frames(body, distal, pivot, axis, t, t @ tool)


@dataclass(frozen=True)
class Wrenches:
    """Forces on bodies: each entry (body, point (n, 3), force (n, 3), moment (n, 3)) in base axes; plus joint torques."""

    parts: list[tuple[int, np.ndarray, np.ndarray, np.ndarray]]
    joint: np.ndarray | float = 0.0


def point_load(body: int, point: np.ndarray, force: np.ndarray) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
    return body, point, np.broadcast_to(force, point.shape), np.zeros_like(point)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rows of a x b; numpy's own is slow on small arrays."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def spring_loads(f: Frames, w: Wrenches) -> tuple[np.ndarray, np.ndarray]:
    """Joint torques (n, 6) and wrenches (n, 7, 6) at the distal ends in body axes, from the forces beyond each spring.

    A body's own forces do not load its distal spring, except those on the last body, which stand for the tool.
    """
    n = len(f.flange)
    force, moment = np.zeros((8, n, 3)), np.zeros((8, n, 3))
    for body, point, push, turn in w.parts:
        force[body] += push
        moment[body] += cross(point, push) + turn
    # Sums over the bodies from b outwards, moments about the base's origin.
    force, moment = np.cumsum(force[::-1], axis=0)[::-1], np.cumsum(moment[::-1], axis=0)[::-1]
    about = moment[1:7] - cross(np.stack(f.pivot), force[1:7])
    tau = (np.stack(f.axis) * about).sum(axis=2).T + w.joint
    ends, beyond = np.stack(f.distal), [1, 2, 3, 4, 5, 6, 6]
    about = moment[beyond] - cross(ends[..., :3, 3], force[beyond])
    both = np.stack([force[beyond], about], axis=-1)  # (7, n, 3, 2) in base axes
    wrench = np.einsum("bnji,bnjk->nbki", ends[..., :3, :3], both).reshape(n, 7, 6)
    return tau, wrench


@dataclass(frozen=True)
class Load:
    """What hangs on the arm: payload (tool included) with its centre in tool0, dead wrench on the TCP in base axes."""

    mass: np.ndarray | float = 0.0
    center: np.ndarray = field(default_factory=lambda: np.zeros(3))
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    moment: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gravity: np.ndarray = field(default_factory=lambda: G)


def dead_loads(arm: Arm, f: Frames, load: Load) -> Wrenches:
    """Weight of the links and the payload, and the wrench on the TCP, where the deflected arm has them."""
    n = len(f.flange)
    parts = []
    for b in range(1, 7):
        c = f.body[b][:, :3, 3] + f.body[b][:, :3, :3] @ arm.center[b]
        parts.append(point_load(b, c, arm.mass[b] * load.gravity))
    m = np.broadcast_to(np.asarray(load.mass, float), (n,))[:, None]
    center = np.broadcast_to(load.center, (n, 3))
    c = f.flange[:, :3, 3] + np.einsum("nij,nj->ni", f.flange[:, :3, :3], center)
    parts.append(point_load(6, c, m * load.gravity))
    tcp = f.tcp[:, :3, 3]
    parts.append((6, tcp, np.broadcast_to(load.force, (n, 3)), np.broadcast_to(load.moment, (n, 3))))
    return Wrenches(parts)


Accelerated = Callable[[np.ndarray], np.ndarray]


def accelerations(f: Frames, v: np.ndarray, a: np.ndarray) -> list[tuple[Accelerated, np.ndarray]]:
    """Of bodies 0 to 6 at joint speeds and accelerations (n, 6): c'' of a point c (n, 3) that it carries, and w' (n, 3)."""
    n = len(f.flange)

    def carried(at: np.ndarray, ddp: np.ndarray, w: np.ndarray, dw: np.ndarray) -> Accelerated:
        return lambda point: ddp + cross(dw, point - at) + cross(w, cross(w, point - at))

    w, dw = np.zeros((n, 3)), np.zeros((n, 3))
    found = [(carried(f.body[0][:, :3, 3], np.zeros((n, 3)), w, dw), dw)]
    for j in range(6):
        ddp = found[-1][0](f.pivot[j])
        turn = f.axis[j] * v[:, j : j + 1]
        dw = dw + f.axis[j] * a[:, j : j + 1] + cross(w, turn)
        w = w + turn
        found.append((carried(f.pivot[j], ddp, w, dw), dw))
    return found


def inertial_loads(arm: Arm, f: Frames, v: np.ndarray, a: np.ndarray, load: Load) -> Wrenches:
    """D'Alembert forces at joint speeds and accelerations (n, 6): -m c'' and -(I w' + w x I w), I = m r^2; payload a point."""
    n, moving, parts = len(f.flange), accelerations(f, v, a), []
    for b in range(1, 7):
        c, (pulled, dw) = f.body[b][:, :3, 3] + f.body[b][:, :3, :3] @ arm.center[b], moving[b]
        parts.append((b, c, -arm.mass[b] * pulled(c), -arm.mass[b] * arm.gyration[b] ** 2 * dw))
    m = np.broadcast_to(np.asarray(load.mass, float), (n,))[:, None]
    c = f.flange[:, :3, 3] + np.einsum("nij,nj->ni", f.flange[:, :3, :3], np.broadcast_to(load.center, (n, 3)))
    parts.append((6, c, -m * moving[6][0](c), np.zeros((n, 3))))
    return Wrenches(parts)


Displace = Callable[[Frames, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
Extra = Callable[[Frames], Wrenches]


def joint_springs(compliance: np.ndarray) -> Displace:
    def displace(f: Frames, tau: np.ndarray, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return tau * compliance, np.zeros((len(tau), 7, 6))

    return displace


def body_springs(compliance: np.ndarray, bodies: dict[int, np.ndarray]) -> Displace:
    """Joint compliances (6,) and 6x6 compliances at the distal ends of named bodies."""

    def displace(f: Frames, tau: np.ndarray, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        xi = np.zeros((len(tau), 7, 6))
        for b, c in bodies.items():
            xi[:, b] = wrench[:, b] @ c.T
        return tau * compliance, xi

    return displace


@dataclass(frozen=True)
class Equilibrium:
    frames: Frames
    dq: np.ndarray
    xi: np.ndarray
    tau: np.ndarray
    wrench: np.ndarray
    change: float


def equilibrium(
    arm: Arm,
    q: np.ndarray,
    tool: np.ndarray,
    load: Load,
    displace: Displace,
    extra: Extra | None = None,
    sweeps: int = 12,
) -> Equilibrium:
    """Fixed point: the loads in the deflected geometry cause just that deflection."""
    q = np.atleast_2d(q)
    dq, xi = np.zeros((len(q), 6)), np.zeros((len(q), 7, 6))
    change = np.inf
    for _ in range(sweeps):
        f = arm.forward(q, tool, dq, xi)
        w = dead_loads(arm, f, load)
        if extra is not None:
            more = extra(f)
            w = replace(w, parts=w.parts + more.parts, joint=more.joint)
        tau, wrench = spring_loads(f, w)
        new_dq, new_xi = displace(f, tau, wrench)
        change = max(float(np.abs(new_dq - dq).max()), float(np.abs(new_xi - xi).max()))
        dq, xi = new_dq, new_xi
        if change < 1e-10:  # [rad], [m]: the next sweep would change a hundredth of it, or less
            break
    return Equilibrium(arm.forward(q, tool, dq, xi), dq, xi, tau, wrench, change)


# Estimated centres of mass in base coordinates at the zero pose of the 60/2.05 (robots.md), bodies 0..6.
_MASS = np.array([103.0, 128, 72, 86, 22, 11, 3])
_CENTER_AT_ZERO = np.array(
    [
        [0, 0, 0],
        [0.09, 0.01, 0.36],
        [0.185, 0.04, 0.90],
        [0.26, -0.01, 1.50],
        [0.78, 0, 1.57],
        [1.14, 0, 1.57],
        [1.24, 0, 1.57],
    ]
)
_GYRATION = np.array([0, 0.30, 0.35, 0.25, 0.22, 0.10, 0.05])
_LIMITS = np.radians([[-180, 180], [-90, 150], [-180, 75], [-400, 400], [-125, 120], [-400, 400]])


def irb4600(
    a2: float = 0.900,
    d4: float = 0.960,
    d6: float = 0.135,
    name: str = "irb4600_60_205",
    cast: tuple[float, float] | None = None,
) -> Arm:
    """ABB IRB 4600; zero pose: upper arm up, forearm forward; axes +z +y +y +x +y +x.

    Centres of mass keep their place in the body's own frame when the lengths differ from the 60/2.05 (the misprint of the
    study); another size (``cast`` gives its moving mass and its reach) has masses and centres of the rule for all arms.
    """
    a1, a3, d1 = 0.175, 0.175, 0.495
    tool0 = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    link = np.stack(
        [
            np.eye(4),
            shift(a1, 0, d1),
            shift(0, 0, a2),
            shift(0, 0, a3),
            shift(d4),
            np.eye(4),
            transform(tool0, np.array([d6, 0.0, 0.0])),
        ]
    )
    origin = np.array(
        [
            [0, 0, 0],
            [0, 0, 0],
            [0.175, 0, 0.495],
            [0.175, 0, 1.395],
            [0.175, 0, 1.57],
            [1.135, 0, 1.57],
            [1.135, 0, 1.57],
        ]
    )
    axis = np.array([[0.0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]])
    center = _CENTER_AT_ZERO - origin
    mass, gyration = _MASS.copy(), _GYRATION
    if cast is not None:
        moving, reach = cast
        mass = np.array([57.0, *(np.array([0.37, 0.26, 0.24, 0.10, 0.022, 0.008]) * moving)])
        offset = [[0, 0, 0], [0.5 * a1, 0, 0.73 * d1], [0, 0.04 * a2, 0.45 * a2], [0.09 * d4, 0, 0.6 * a3]]
        center = np.array([*offset, [0.63 * d4, 0, 0], [0, 0, 0], [0.78 * d6, 0, 0]])
        gyration = np.array([0.0, 0.6 * d1, 0.39 * a2, 0.26 * d4, 0.23 * d4, 0.10 * reach / 2.05, 0.05 * reach / 2.05])
    lengths = {"a1": a1, "a2": a2, "a3": a3, "d1": d1, "d4": d4, "d6": d6}
    return Arm(name, link, axis, mass, center, _LIMITS[:, 0], _LIMITS[:, 1], lengths, gyration)


def _dh(name: str, rows: list[tuple[float, float, float]], mass: list[float], center: list[list[float]]) -> Arm:
    link = [np.eye(4)]
    for a, d, alpha in rows:
        link.append(shift(a, 0, d) @ transform(rotation(np.array([1.0, 0, 0]), np.array(alpha)), np.zeros(3)))
    body = [np.zeros(3)] + [t[:3, 3] + t[:3, :3] @ np.array(c) for t, c in zip(link[1:], center, strict=True)]
    limit = np.full(6, 2 * np.pi)
    return Arm(
        name, np.stack(link), np.tile([0.0, 0, 1], (6, 1)), np.array([0.0, *mass]), np.stack(body), -limit, limit
    )


def ur10() -> Arm:
    h = np.pi / 2
    rows = [(0, 0.1273, h), (-0.612, 0, 0), (-0.5723, 0, 0), (0, 0.163941, h), (0, 0.1157, -h), (0, 0.0922, 0)]
    center = [
        [0.021, 0, 0.027],
        [0.38, 0, 0.158],
        [0.24, 0, 0.068],
        [0, 0.007, 0.018],
        [0, 0.007, 0.018],
        [0, 0, -0.026],
    ]
    return _dh("ur10", rows, [7.778, 12.93, 3.87, 1.96, 1.96, 0.202], center)


def ur5() -> Arm:
    h = np.pi / 2
    rows = [(0, 0.089159, h), (-0.425, 0, 0), (-0.39225, 0, 0), (0, 0.10915, h), (0, 0.09465, -h), (0, 0.0823, 0)]
    center = [
        [0, -0.02561, 0.00193],
        [0.2125, 0, 0.11336],
        [0.15, 0, 0.0265],
        [0, -0.0018, 0.01634],
        [0, 0.0018, 0.01634],
        [0, 0, -0.001159],
    ]
    return _dh("ur5", rows, [3.7, 8.393, 2.275, 1.219, 1.219, 0.1879], center)


ARMS: dict[str, Callable[[], Arm]] = {
    "irb4600_60_205": irb4600,
    "irb4600_60_205_seed": lambda: irb4600(a2=1.075, name="irb4600_60_205_seed"),
    "irb4600_20_250": lambda: irb4600(1.095, 1.2305, 0.085, "irb4600_20_250", (355.0, 2.51)),
    "irb4600_40_255": lambda: irb4600(1.095, 1.270, 0.135, "irb4600_40_255", (378.0, 2.55)),
    "ur10": ur10,
    "ur5": ur5,
}
