"""Measured tables of arms of known truth: three sizes, with and without a hidden effect, under gravity or pulled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tests.bench.loads.arms import Type, arm_type
from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent.cells import DEG, Cell, Hidden, States, measure, settle

ARMS = ("irb4600_60_205", "irb1200_5_09", "irb6700_200_260")
"""Stiffness measured on one such arm, measured with a factor, and by the rule for arms that nobody measured."""
TABLES = ("one payload", "two payloads", "three payloads", "pulled")
"""Payloads in the table; `pulled` has one payload, and in a third of the poses a force of one direction, off and on."""
POSES = (60, 150, 30)
HIDDEN: dict[str, Callable[[np.random.Generator, A.Arm], Hidden]] = {
    "backlash": K.backlash,
    "arm_load": K.arm_load,
    "base_compliance": K.base_compliance,
    "payload_error": K.payload_error,
    "transmission_error": K.transmission_error,
    "gravity_compensator": K.gravity_compensator,
    "link_compliance": K.link_compliance,
    "thermal_growth": K.thermal_growth,
    "bearing_tilt": K.bearing_tilt,
    "nonlinear_compliance": K.nonlinear_tanh,
    "thermal_joint_drift": K.thermal_joint_drift,
    "link_geometry": K.link_geometry,
    "wrist_coupling": K.wrist_coupling,
}
UNSEEN = 60
"""Poses at which the loads are asked."""
FORCES = np.array(
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, -1], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 1, 0], [1, 0, 0]],
    float,
)  # fmt: skip
MOMENTS = np.array([*[[0, 0, 0]] * 7, [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0]], float)
"""Directions of the twelve loads in base axes: forces along and across the axes, moments, both at once."""


@dataclass(frozen=True)
class Posterior:
    """Springs after a fit: the arm that it fits, covariance (6, 6) of the logarithms of its compliances, their errors (6,)."""

    cell: Cell
    covariance: np.ndarray
    error: np.ndarray


@dataclass(frozen=True)
class Set:
    """One table and what is true of its arm.

    Args:
        table: one of ``TABLES``. key: of the hidden effect, empty for none. rounded: angles to 0.01 deg.
        csv: the table as a file. noise: standard deviation per axis [m] of what is measured.
        cell: the true arm. tool: (4, 4) nominal. size: force [N] of every load that is asked, arm: of its moments [m].
        asked: the unseen states without load.
        best: what can be had from this table: the posterior of a fit that knows what is hidden. base: that of a fit
            which does not, and takes for noise what it leaves. sure: (6,) standard deviations of the first one; told:
            (6,) these over those before anything is measured.
    """

    name: str
    type: Type
    table: str
    key: str
    rounded: bool
    poses: int
    csv: str
    noise: float
    cell: Cell
    tool: np.ndarray
    size: float
    arm: float
    asked: States
    best: Posterior
    base: Posterior

    @property
    def sure(self) -> np.ndarray:
        return np.sqrt(np.diag(self.best.covariance))

    @property
    def told(self) -> np.ndarray:
        return self.sure / self.type.spread

    def under(self, k: int | None) -> States:
        """The unseen states under the k-th load, with zeros under none."""
        n = len(self.asked)
        way = np.zeros(3) if k is None else FORCES[k] / max(float(np.linalg.norm(FORCES[k])), 1.0)
        turn = np.zeros(3) if k is None else MOMENTS[k]
        force, moment = self.size * way, self.size * self.arm * turn
        return replace(self.asked, force=np.tile(force, (n, 1)), moment=np.tile(moment, (n, 1)))

    @cached_property
    def every(self) -> States:
        """The unseen states without load, then under each load, one after another."""
        parts = [self.under(k) for k in (None, *range(len(FORCES)))]
        names = [name for name in States.__dataclass_fields__ if getattr(parts[0], name) is not None]
        return States(**{name: np.concatenate([getattr(s, name) for s in parts]) for name in names})

    def changes(self, places: np.ndarray) -> np.ndarray:
        """(loads, n, 3) by which the loads move the places of ``every``."""
        at = places.reshape(len(FORCES) + 1, len(self.asked), 3)
        return at[1:] - at[0]

    def true_change(self, cell: Cell | None = None) -> np.ndarray:
        """(loads, n, 3) [m] by which the loads move the true TCP, or that of another arm, base axes."""
        return self.changes(settle(cell or self.cell, self.every).frames.tcp[:, :3, 3])


def resized(h: Hidden, t: Type) -> Hidden:
    """An effect of ordinary size on the IRB 4600-60/2.05 as it is on another arm: the same angles under its own loads."""
    heavy = t.payload / 60 if h.kind in ("arm_load", "payload_error") else t.torque
    joint, body, force = h.joint, h.body, h.force
    if force is not None and heavy != 1:
        own = force

        def weighed(s: States, f: A.Frames) -> A.Wrenches:
            w = own(s, f)
            return A.Wrenches([(b, p, heavy * F, heavy * M) for b, p, F, M in w.parts], heavy * np.asarray(w.joint))

        force = weighed
    if h.kind == "nonlinear_tanh" and joint is not None:
        law = joint
        joint = lambda s, tau: law(s, tau / t.torque)  # noqa: E731
    if h.kind in ("base_compliance", "bearing_tilt", "link_compliance") and body is not None:
        bent = body
        body = lambda s, f, wrench: bent(s, f, wrench / t.torque)  # noqa: E731
    return replace(h, joint=joint, body=body, force=force)


@dataclass(frozen=True)
class Recipe:
    """What a set is made of. Args: as in `Set`."""

    robot: str
    table: str
    key: str
    poses: int
    rounded: bool

    @classmethod
    def of(cls, index: int) -> Recipe:
        """Arms, tables and hidden effects in turn; half of the sets hide nothing."""
        block, arm = index // 6, index % 3
        key = list(HIDDEN)[(3 * block + arm) % len(HIDDEN)] if index % 6 >= 3 else ""
        return cls(ARMS[arm], TABLES[block % 4], key, POSES[(block + arm + index // 24) % 3], index % 5 == 2)


def title(index: int) -> str:
    """What the set of a number is called."""
    r = Recipe.of(index)
    words = [f"{index:02d} {r.robot} {r.table}", f"{r.poses} poses", r.key or "nothing hidden", "rounded" * r.rounded]
    return ", ".join(word for word in words if word)


def draw(index: int, seed: int = 0, masses: bool = False) -> Set:
    """The set of a number; sizes are drawn.

    Args:
        masses: the links of the true arm weigh otherwise than its file says, by the file's factors.
    """
    g, recipe = np.random.default_rng([39, seed, index]), Recipe.of(index)
    t, key, table, poses, rounded = arm_type(recipe.robot), recipe.key, recipe.table, recipe.poses, recipe.rounded
    hidden = (resized(HIDDEN[key](g, t.arm), t),) if key else ()
    tool = A.shift(*(t.lever * np.array([0.02, -0.01, 0.35])))
    turn = A.rotation(np.array([0.0, 0.0, 1.0]), g.uniform(-np.pi, np.pi)) @ A.rotation_vector(g.normal(0, 1e-3, 3))
    cell = Cell(
        replace(t.arm, mass=t.arm.mass * np.exp(g.normal(0, t.weight))) if masses else t.arm,
        g.choice([-1, 1], 6) * g.uniform(0.1e-3, 0.5e-3, 6),
        t.compliance * np.exp(g.normal(0, t.spread)),
        tool @ A.shift(*g.normal(0, 0.5e-3, 3)),
        A.transform(turn, g.uniform(-2, 2, 3)),
        hidden,
    )
    rated = {"one payload": [0.7], "pulled": [0.5], "two payloads": [0.1, 0.9], "three payloads": [0.1, 0.5, 0.9]}[
        table
    ]
    payloads = [round(share * t.payload, 2) for share in rated]
    force = 200 * t.payload / 60
    s = states(g, poses, t, payloads)
    noise = float(g.uniform(0.02e-3, 0.05e-3))
    again = np.concatenate([np.arange(poses), *[np.arange(0, poses, max(poses // 12, 1))] * 2])
    rows = s.take(again)
    if table == "pulled":
        pulled = np.arange(0, poses, 3)
        way = np.array([[0, 1, 0], [0, 0, -1], [1, 0, 0], [0, -1, 0]])[int(g.integers(4))]
        rows = s.take(np.concatenate([again, pulled]))
        again = np.concatenate([again, pulled])
        loads = np.zeros((len(rows), 3))
        loads[len(rows) - len(pulled) :] = force * way
        rows = replace(rows, force=loads, moment=np.zeros_like(loads))
    seen = measure(cell, rows) + g.normal(0, noise, (len(rows), 3))
    digits = 2 if rounded else 5
    text = csv_of(rows, seen, [f"P{i + 1:03d}" for i in again], digits)
    asked = states(g, UNSEEN, t, payloads)
    asked = replace(asked, temperature=np.full(UNSEEN, float(np.median(s.temperature))))
    # To a fit that takes rounded angles for the true ones, the rest of them is noise.
    written = replace(rows, q=np.round(rows.q / DEG, digits) * DEG)
    spread = float(np.hypot(noise, 0.01 * DEG / np.sqrt(12) * 0.7 * t.reach if rounded else 0))
    before = np.log(t.compliance / cell.compliance)
    base = replace(cell, arm=t.arm, hidden=())
    fits = [posterior(c, written, seen, x, before, t.spread) for c, x in ((cell, spread), (base, None))]
    return Set(
        title(index), t, table, key, rounded, poses, text, noise, cell, tool, force, 0.15 * t.reach, asked, *fits
    )


def states(g: np.random.Generator, n: int, t: Type, payloads: list[float]) -> States:
    """Poses all over the joint range, warming up, with payloads in turn."""
    low = np.maximum(np.radians([-100, -40, -60, -170, -105, -180]), t.arm.lower + 2 * DEG)
    high = np.minimum(np.radians([100, 70, 45, 170, 105, 180]), t.arm.upper - 2 * DEG)
    q = g.uniform(low, high, (n, 6))
    q[:, 4] = np.where(q[:, 4] < 0, -1, 1) * np.maximum(np.abs(q[:, 4]), 20 * DEG)
    time = np.sort(g.uniform(0, 21600, n))
    warm = 19 + 21 * (1 - np.exp(-time / 5500.0)) + g.normal(0, 1.2, n)
    center = np.tile(np.round(t.lever * np.array([0.03, 0.02, 0.12]), 4), (n, 1))
    return States(
        np.round(q / DEG, 5) * DEG, g.choice([-1.0, 1.0], (n, 6)), np.round(warm, 2), np.round(time, 1),
        np.array(payloads)[g.integers(len(payloads), size=n)], center,
    )  # fmt: skip


def csv_of(s: States, seen: np.ndarray, ids: list[str], digits: int) -> str:
    """The table as a file: joint angles [deg] with so many decimals, positions [mm] with four."""
    joints = range(1, 7)
    names = ["pose_id", *(f"q{j}_deg" for j in joints), "x_mm", "y_mm", "z_mm", "payload_kg"]
    names += [*(f"payload_{c}_mm" for c in "xyz"), *(f"dir{j}" for j in joints), "temperature_C", "time_s"]
    names += [f"f{c}_N" for c in "xyz"] if s.force is not None else []
    lines = [",".join(names)]
    for i, label in enumerate(ids):
        row = [
            label,
            *(f"{x:.{digits}f}" for x in s.q[i] / DEG),
            *(f"{x:.4f}" for x in seen[i] * 1e3),
            f"{s.mass[i]:g}",
        ]
        row += [*(f"{x * 1e3:g}" for x in s.center[i]), *(f"{x:+.0f}" for x in s.approach[i])]
        row += [f"{s.temperature[i]:.2f}", f"{s.time[i]:.1f}"]
        row += [f"{x:g}" for x in s.force[i]] if s.force is not None else []
        lines.append(",".join(row))
    return "\n".join(lines) + "\n"


STEPS = np.array([1e-4] * 15 + [0.1] * 6)
WEAK = np.array([10.0] * 3 + [1.0] * 3 + [0.1] * 3 + [2e-3] * 6)
"""What is known before of instrument, TCP and zeros: next to nothing ([m], [rad], [m], [rad])."""


def posterior(
    cell: Cell, s: States, seen: np.ndarray, noise: float | None, before: np.ndarray, spread: np.ndarray
) -> Posterior:
    """What a fit knows of the springs, to first order, if the compliances of arms scatter about those of their type.

    Args:
        cell: the true arm, or as much of it as the fit has. seen: (n, 3) measured [m]. noise: standard deviation per
            axis [m]; None for what the fit leaves.
        before: (6,) logarithm of the type's compliances over the true ones. spread: (6,) its standard deviation.
    """

    def places(p: np.ndarray) -> np.ndarray:
        moved = replace(
            cell, offset=cell.offset + p[9:15], compliance=cell.compliance * (1 + p[15:]), tool=cell.tool @ A.shift(*p[6:9]),
            instrument=A.transform(A.rotation_vector(p[3:6]), p[:3]) @ cell.instrument,
        )  # fmt: skip
        return measure(moved, s).ravel()

    at = places(np.zeros(21))
    slope = np.stack([(places(d) - at) / size for d, size in zip(np.diag(STEPS), STEPS, strict=True)], axis=1)
    off = seen.ravel() - at
    # In units of what is known before, so that the inverse is well conditioned.
    unit = np.concatenate([WEAK, spread])
    scaled = slope * unit
    if noise is None:
        left = off - scaled @ np.linalg.lstsq(scaled, off, rcond=1e-9)[0]
        noise = float(np.sqrt(left @ left / (len(off) - len(unit))))
    covariance = np.linalg.inv(scaled.T @ scaled / noise**2 + np.eye(len(unit)))
    error = unit * (covariance @ (scaled.T @ off / noise**2 + np.concatenate([np.zeros(15), before / spread])))
    return Posterior(cell, covariance[15:, 15:] * np.outer(spread, spread), error[15:])
