"""The library's effects at ordinary random sizes, written independently of the package."""

from __future__ import annotations

import numpy as np

from tests.independent import arm as A
from tests.independent.cells import DEG, Hidden, States, column, pick


def backlash(g: np.random.Generator, arm: A.Arm) -> Hidden:
    gap = np.zeros(6)
    for j in pick(g, [0, 1, 2, 3, 4], 3):
        gap[j] = g.uniform(0.004, 0.011) * DEG * (1 if j < 3 else 2)
    return Hidden(
        "backlash",
        "backlash",
        joint=lambda s, tau: -gap * s.approach,
        note=f"half gap deg {np.round(gap / DEG, 4).tolist()}",
    )


def transmission_error(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j = int(g.choice([0, 1, 2, 3, 4]))
    low = [2, 3, 4, 5, 7, 10, 16] if j in (0, 3) else [3, 4, 5, 8, 12, 20]
    n, size, phase = int(g.choice(low)), g.uniform(0.006, 0.015) * DEG * (1 if j < 3 else 3), g.uniform(0, 2 * np.pi)
    return Hidden(
        "transmission_error", "transmission_error", joint=lambda s, tau: column(j, size * np.sin(n * s.q[:, j] + phase)),
        accept=("joint_error_map",) if n <= 3 else (), channels=(f"q{j + 1}",), note=f"joint {j + 1} order {n} amplitude {size / DEG:.4f} deg",
    )  # fmt: skip


def joint_error_map(g: np.random.Generator, arm: A.Arm) -> Hidden:
    joints = pick(g, [0, 1, 2, 3], 2)
    waves: dict[int, list[tuple[int, float, float]]] = {}
    for j in joints:
        orders = np.arange(1, int(g.integers(6, 13)))
        w = g.normal(size=len(orders)) / np.sqrt(orders)
        w *= g.uniform(0.010, 0.022) * DEG * (1 if j < 3 else 2.5) * np.sqrt(2) / np.linalg.norm(w)
        waves[j] = [(int(n), float(x), float(g.uniform(0, 2 * np.pi))) for n, x in zip(orders, w, strict=True)]

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        out = np.zeros((len(s), 6))
        for j, terms in waves.items():
            out[:, j] = sum(x * np.sin(n * s.q[:, j] + p) for n, x, p in terms)
        return out

    return Hidden(
        "joint_error_map",
        "joint_error_map",
        joint=joint,
        channels=tuple(f"q{j + 1}" for j in joints),
        note=f"joints {[j + 1 for j in joints]}",
    )


def weighed(
    s: States, f: A.Frames, b: int, point: np.ndarray, mass: float
) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
    """Weight and inertia of a mass [kg] at a point (n, 3) that body b carries."""
    moved = 0.0 if s.v is None or s.a is None else A.accelerations(f, s.v, s.a)[b][0](point)
    return A.point_load(b, point, mass * (A.G - moved))


def arm_load(g: np.random.Generator, arm: A.Arm) -> Hidden:
    b = int(g.choice([2, 3, 3, 4, 5]))
    mass = float(g.uniform(*{2: (30, 60), 3: (12, 30), 4: (8, 20), 5: (6, 14)}[b]))
    middle = {2: [0.0, 0.12, 0.35], 3: [0.05, 0.1, 0.3], 4: [0.3, 0.08, 0.15], 5: [0.0, 0.05, 0.1]}[b]
    place = np.array(middle) + g.uniform(-0.06, 0.06, 3)

    def force(s: States, f: A.Frames) -> A.Wrenches:
        point = f.body[b][:, :3, 3] + f.body[b][:, :3, :3] @ place
        return A.Wrenches([weighed(s, f, b, point, mass)])

    # A mass on the upper arm loads joint 2 with sin(q2 + phase), exactly as a balancer does.
    accept = {2: ("gravity_compensator",), 5: ("payload_error",)}.get(b, ())
    return Hidden(
        "arm_load",
        "arm_load",
        force=force,
        accept=accept,
        note=f"{mass:.1f} kg on body {b} at {place.round(3).tolist()}",
    )


def gravity_compensator(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k, q0 = g.uniform(900, 2500), g.uniform(-0.2, 0.2)
    return Hidden(
        "gravity_compensator", "gravity_compensator",
        force=lambda s, f: A.Wrenches([], column(1, -k * np.sin(s.q[:, 1] + q0))), accept=("arm_load",), note=f"{k:.0f} N m, {q0:.2f} rad",
    )  # fmt: skip


def payload_error(g: np.random.Generator, arm: A.Arm) -> Hidden:
    mass = float(g.uniform(6, 15)) * float(g.choice([-1, 1], p=[0.3, 0.7]))
    place = np.array([g.uniform(-0.06, 0.06), g.uniform(-0.06, 0.06), g.uniform(0.05, 0.25)])

    def force(s: States, f: A.Frames) -> A.Wrenches:
        point = f.flange[:, :3, 3] + f.flange[:, :3, :3] @ place
        return A.Wrenches([weighed(s, f, 6, point, mass)])

    return Hidden(
        "payload_error",
        "payload_error",
        force=force,
        accept=("arm_load",),
        note=f"{mass:.1f} kg at {place.round(3).tolist()}",
    )


def dress_pack(g: np.random.Generator, arm: A.Arm) -> Hidden:
    b = int(g.choice([3, 4]))
    anchor = np.array([0.15, g.uniform(-0.1, 0.1), 0.25]) if b == 3 else np.array([0.3, g.uniform(-0.1, 0.1), 0.2])
    end = np.array([g.uniform(-0.05, 0.05), g.uniform(0.05, 0.12), 0.05])
    far = arm.lengths.get("d4", 0.6) - anchor[0]
    k, slack = g.uniform(800, 2500), far * g.uniform(0.6, 0.95)

    def force(s: States, f: A.Frames) -> A.Wrenches:
        p = f.body[b][:, :3, 3] + f.body[b][:, :3, :3] @ anchor
        e = f.flange[:, :3, 3] + f.flange[:, :3, :3] @ end
        d = p - e
        length = np.linalg.norm(d, axis=1, keepdims=True)
        pull = k * np.maximum(length - slack, 0) * d / length
        return A.Wrenches([A.point_load(6, e, pull), A.point_load(b, p, -pull)])

    return Hidden(
        "dress_pack",
        "dress_pack",
        force=force,
        note=f"{k:.0f} N/m, slack {slack:.2f} m, body {b} {anchor.round(2).tolist()} to flange {end.round(2).tolist()}",
    )


def thermal_growth(g: np.random.Generator, arm: A.Arm) -> Hidden:
    alpha = float(g.choice([11.5e-6, 10.5e-6, 17e-6, 23e-6]))

    def body(s: States, f: A.Frames, wrench: np.ndarray) -> np.ndarray:
        xi = np.zeros((len(s), 7, 6))
        for b in range(7):
            xi[:, b, :3] = alpha * (s.temperature - 20)[:, None] * arm.link[b][:3, 3]
        return xi

    return Hidden("thermal_growth", "thermal_growth", body=body, note=f"{alpha:.2e} per K")


def thermal_joint_drift(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k = np.zeros(6)
    for j in pick(g, [0, 1, 2, 4], 2):
        k[j] = g.uniform(0.0008, 0.002) * DEG * g.choice([-1, 1]) * (1 if j < 3 else 2)
    return Hidden(
        "thermal_joint_drift",
        "thermal_joint_drift",
        joint=lambda s, tau: k * (s.temperature - 20)[:, None],
        note=f"deg/K {np.round(k / DEG, 5).tolist()}",
    )


def base_compliance(g: np.random.Generator, arm: A.Arm) -> Hidden:
    c = g.uniform(3e-8, 8e-8)

    def body(s: States, f: A.Frames, wrench: np.ndarray) -> np.ndarray:
        xi = np.zeros((len(s), 7, 6))
        moment = wrench[:, 0, 3:] + np.cross(arm.link[0][:3, 3], wrench[:, 0, :3])
        xi[:, 0, 3:5] = c * moment[:, :2]
        return xi

    return Hidden("base_compliance", "base_compliance", body=body, accept=("bearing_tilt",), note=f"{c:.1e} rad/(N m)")


def bearing_tilt(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j = int(g.choice([0, 1, 2, 3]))
    c = g.uniform(*{0: (3e-8, 8e-8), 1: (1.5e-7, 4e-7), 2: (2e-7, 6e-7), 3: (3e-7, 9e-7)}[j])

    def body(s: States, f: A.Frames, wrench: np.ndarray) -> np.ndarray:
        # The tilt sits where joint j stands: at the distal end of body j, across the joint's axis.
        xi = np.zeros((len(s), 7, 6))
        across = np.eye(3) - np.outer(arm.axis[j], arm.axis[j])
        xi[:, j, 3:] = c * wrench[:, j, 3:] @ across
        return xi

    accept = ("base_compliance",) if j == 0 else ("link_compliance",)
    return Hidden("bearing_tilt", "bearing_tilt", body=body, accept=accept, note=f"joint {j + 1} {c:.1e} rad/(N m)")


def beam(length: float, ei: float, gj: float, ea: float, along: int) -> np.ndarray:
    """(6, 6) tip compliance of a beam along axis 0 (x) or 2 (z) of the body."""
    c = np.zeros((6, 6))
    i, b1, b2 = along, (along + 1) % 3, (along + 2) % 3
    c[i, i], c[i + 3, i + 3] = length / ea, length / gj
    for t, r, sign in ((b1, b2, 1.0), (b2, b1, -1.0)):
        c[t, t], c[r + 3, r + 3] = length**3 / (3 * ei), length / ei
        c[t, r + 3] = c[r + 3, t] = sign * length**2 / (2 * ei)
    return c


def link_compliance(g: np.random.Generator, arm: A.Arm) -> Hidden:
    forearm = bool(g.random() < 0.6)
    ei = g.uniform(0.35e6, 1.0e6) if forearm else g.uniform(0.6e6, 1.5e6)
    b, length, along = (4, arm.lengths["d4"], 0) if forearm else (2, arm.lengths["a2"], 2)
    c = beam(length, ei, 0.5 * ei, 4e9, along)

    def body(s: States, f: A.Frames, wrench: np.ndarray) -> np.ndarray:
        xi = np.zeros((len(s), 7, 6))
        xi[:, b] = wrench[:, b] @ c.T
        return xi

    return Hidden(
        "link_compliance", "link_compliance", body=body, accept=("bearing_tilt",), note=f"body {b} EI {ei:.2e}"
    )


def nonlinear_tanh(g: np.random.Generator, arm: A.Arm) -> Hidden:
    joints, e, t0 = pick(g, [1, 2], 2), np.zeros(6), np.ones(6)
    for j in joints:
        t0[j] = g.uniform(200, 700) * (1 if j == 1 else 0.6)
        e[j] = g.uniform(1.2e-4, 3.0e-4) / t0[j]
    return Hidden(
        "nonlinear_tanh",
        "nonlinear_compliance",
        joint=lambda s, tau: e * t0 * np.tanh(tau / t0),
        note=f"e {e.tolist()} t0 {t0.round(0).tolist()}",
    )


def nonlinear_cubic(g: np.random.Generator, arm: A.Arm) -> Hidden:
    joints, k = pick(g, [1, 2], 2), np.zeros(6)
    for j in joints:
        k[j] = g.uniform(3e-4, 8e-4) / (2500.0 if j == 1 else 1000.0) ** 3
    return Hidden("nonlinear_cubic", "nonlinear_compliance", joint=lambda s, tau: k * tau**3, note=f"{k.tolist()}")


def servo_lag(g: np.random.Generator, arm: A.Arm) -> Hidden:
    lag = g.uniform(0.0003, 0.0012, 6) * (g.random(6) < 0.7)
    lag[1] = max(lag[1], 0.0004)

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        assert s.v is not None
        return -lag * s.v

    return Hidden("servo_lag", "servo_lag", joint=joint, note=f"ms {np.round(lag * 1e3, 2).tolist()}", needs="moving")


def wrist_coupling(g: np.random.Generator, arm: A.Arm) -> Hidden:
    k54, k64, k65 = g.uniform(1e-4, 3e-4, 3) * g.choice([-1, 1], 3)

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        return column(4, k54 * s.q[:, 3]) + column(5, k64 * s.q[:, 3] + k65 * s.q[:, 4])

    return Hidden("wrist_coupling", "wrist_coupling", joint=joint, note=f"{k54:.1e} {k64:.1e} {k65:.1e}")


def frame_drift(g: np.random.Generator, arm: A.Arm) -> Hidden:
    way = g.normal(size=3)
    rate = way / np.linalg.norm(way) * g.uniform(0.03, 0.08) * 1e-3 / 3600
    return Hidden(
        "frame_drift",
        "frame_drift",
        world=lambda s, p: rate * s.time[:, None],
        note=f"mm/h {np.round(rate * 3.6e6, 3).tolist()}",
    )


def session_step(g: np.random.Generator, arm: A.Arm) -> Hidden:
    way = g.normal(size=3)
    step = way / np.linalg.norm(way) * g.uniform(0.12, 0.35) * 1e-3

    def world(s: States, p: np.ndarray) -> np.ndarray:
        assert s.session is not None
        return step * (s.session == 1)[:, None]

    return Hidden("session", "session", world=world, note=f"mm {np.round(step * 1e3, 3).tolist()}", needs="session")


def link_geometry(g: np.random.Generator, arm: A.Arm) -> Hidden:
    xi0 = np.zeros((7, 6))
    for b in range(1, 6):
        xi0[b] = np.concatenate([g.normal(0, 0.2e-3, 3), g.normal(0, 0.25e-3, 3)])
    return Hidden(
        "link_geometry",
        "link_geometry",
        body=lambda s, f, w: np.broadcast_to(xi0, (len(s), 7, 6)),
        note="0.2 mm, 0.25 mrad a body",
    )
