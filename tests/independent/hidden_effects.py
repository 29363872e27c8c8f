"""Measured cells with a hidden effect, from the independent arm.

Each set is a folder with ``fit.csv`` (noisy, some poses measured three times) and ``validate_true.csv`` (other poses,
true TCP, same instrument frame). The base errors of every cell: joint offsets of
0.03 deg, joint compliances 0.7 to 1.4 times the stated ones, a TCP off by 0.5 mm, an instrument frame (2 mm, 1 mrad).
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent import unknown_effects as U
from tests.independent.cells import DEG, Hidden, States, draw_cell, draw_states, measure

Kind = Callable[[np.random.Generator, A.Arm], Hidden]

LIBRARY: list[Kind] = [
    K.backlash, K.transmission_error, K.joint_error_map, K.arm_load, K.gravity_compensator, K.payload_error, K.dress_pack, K.thermal_growth, K.thermal_joint_drift,
    K.base_compliance, K.bearing_tilt, K.link_compliance, K.nonlinear_tanh, K.nonlinear_cubic, K.servo_lag, K.wrist_coupling, K.frame_drift, K.session_step, K.link_geometry,
]  # fmt: skip
OUTSIDE: list[Kind] = [
    U.angle_step, U.kink, U.friction_load, U.quadratic_drift, U.warm_up, U.joint_product, U.payload_squared, U.floor_sway, U.tracker_scale, U.gap_by_angle, U.speed_squared, U.hot_only, U.payload_by_angle, U.elbow_wave, U.gap_of_another, U.step_in_time, U.joint_sway, U.refraction,
]  # fmt: skip
PAIRS: list[tuple[Kind, Kind]] = [
    (K.backlash, K.arm_load), (K.backlash, K.thermal_growth), (K.transmission_error, K.backlash), (K.wrist_coupling, K.backlash), (K.arm_load, K.frame_drift),
    (K.thermal_joint_drift, K.transmission_error), (K.joint_error_map, K.backlash), (K.link_compliance, K.backlash), (K.nonlinear_tanh, K.backlash),
]  # fmt: skip
OTHER_ARM: list[Kind] = [K.backlash, K.transmission_error, K.joint_error_map, K.thermal_joint_drift, K.frame_drift]


def write_table(path: Path, s: States, places: np.ndarray, ids: list[str], digits: int) -> None:
    names = [
        "pose_id",
        *[f"q{j}_deg" for j in range(1, 7)],
        "x_mm",
        "y_mm",
        "z_mm",
        "payload_kg",
        "payload_x_mm",
        "payload_y_mm",
        "payload_z_mm",
    ]
    names += [f"dir{j}" for j in range(1, 7)] + ["temperature_C", "time_s"]
    if s.v is not None:
        names += [f"v{j}_deg_s" for j in range(1, 7)] + [f"a{j}_deg_s2" for j in range(1, 7)]
    if s.session is not None:
        names.append("session")
    with path.open("w", newline="") as out:
        w = csv.writer(out)
        w.writerow(names)
        for i in range(len(s)):
            row = [
                ids[i],
                *[f"{x:.5f}" for x in s.q[i] / DEG],
                *[f"{x:.{digits}f}" for x in places[i] * 1e3],
                f"{s.mass[i]:g}",
            ]
            row += [f"{x * 1e3:g}" for x in s.center[i]] + [f"{x:+.0f}" for x in s.approach[i]]
            row += [f"{s.temperature[i]:.2f}", f"{s.time[i]:.1f}"]
            if s.v is not None and s.a is not None:
                row += [f"{x:.5f}" for x in s.v[i] / DEG] + [f"{x:.5f}" for x in s.a[i] / DEG]
            if s.session is not None:
                row.append("AB"[s.session[i]])
            w.writerow(row)


@dataclass
class Plan:
    kinds: list[Kind] = field(default_factory=list)
    robot: str = "irb4600_60_205"
    outliers: int = 0
    hung: bool = False


def draw_plan(g: np.random.Generator) -> Plan:
    u = g.random()
    if u < 0.20:
        return Plan()
    if u < 0.65:
        return Plan([LIBRARY[int(g.integers(len(LIBRARY)))]])
    if u < 0.83:
        return Plan([OUTSIDE[int(g.integers(len(OUTSIDE)))]])
    if u < 0.91:
        return Plan(list(PAIRS[int(g.integers(len(PAIRS)))]))
    if u < 0.94:
        return Plan(outliers=int(g.integers(1, 4)))
    robot = str(g.choice(["irb4600_20_250", "irb4600_40_255", "ur10"]))
    return Plan([] if g.random() < 0.3 else [OTHER_ARM[int(g.integers(len(OTHER_ARM)))]], robot)


def make_set(
    folder: Path,
    seed: int,
    plan: Plan | None = None,
    noise_mm: float | None = None,
    poses: int | None = None,
) -> dict[str, object]:
    """Writes one set and returns its answer."""
    g = np.random.default_rng(seed)
    drawn = draw_plan(g)
    plan = plan or drawn
    arm = A.ARMS[plan.robot]()
    hidden = tuple(k(g, arm) for k in plan.kinds)
    noise = noise_mm or float(g.choice([0.01, 0.02, 0.03, 0.03, 0.045, 0.06]))
    n = poses or int(g.choice([40, 60, 100, 150, 150, 150, 220, 300]))
    moving = any(h.needs == "moving" for h in hidden) or (not hidden and g.random() < 0.15)
    session = any(h.needs == "session" for h in hidden) or (not hidden and g.random() < 0.15)
    cell = draw_cell(g, arm, hidden)
    if plan.hung:
        cell = replace(cell, gravity=-cell.gravity)
    s = draw_states(g, n, arm, moving, session)
    true = measure(cell, s)
    twelfth = max(n // 12, 1)
    index = np.concatenate([np.arange(n), *[np.arange(0, n, twelfth)] * 2])
    rows = s.take(index)
    seen = true[index] + g.normal(0, noise * 1e-3, (len(index), 3))
    bad = [int(i) for i in g.choice(n, plan.outliers, replace=False)]
    for i in bad:
        seen[i, int(g.integers(3))] += float(g.choice([99e-3, -10e-3, 5e-3, 1e-3]))
    folder.mkdir(parents=True, exist_ok=True)
    write_table(folder / "fit.csv", rows, seen, [f"P{i + 1:03d}" for i in index], 4)
    t = draw_states(g, 150, arm, moving, session)
    write_table(folder / "validate_true.csv", t, measure(cell, t), [f"P{i + 1:03d}" for i in range(150)], 5)
    outside = [h for h in hidden if h.answer == "unknown"]
    return {
        "set": folder.name,
        "seed": seed,
        "robot": plan.robot,
        "kinds": [h.kind for h in hidden] + (["outlier"] if bad else []),
        "effects": [h.answer for h in hidden if h.answer != "unknown"],
        "accept": [[h.answer, *h.accept] for h in hidden],
        "verdict": "unknown" if outside else "missing" if hidden else "complete",
        "channels": sorted({c for h in outside for c in h.channels}),
        "notes": [h.note for h in hidden],
        "outlier_rows": [i + 2 for i in bad],
        "noise_mm": noise,
        "compliance_rad_per_Nm": cell.compliance.tolist(),
        "poses": n,
    }
