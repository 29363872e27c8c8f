"""A module for run time, as it is written, run and compared with the exact correction of the model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensate.correction.inverse import command
from postproc.diagnostics import PostprocError, Source
from postproc.model.arm import Model
from postproc.rapid.data.records import NO_AXIS
from postproc.robot.configuration import confdata
from postproc.robot.kinematics import forward
from postproc.robot.pose import displace, transform
from postproc.runtime.conditions import Conditions, at_run_time
from postproc.runtime.formulas.correction import SOLVED_M, quaternion
from postproc.runtime.module import MARKER
from postproc.runtime.proof.execution import Execution
from postproc.runtime.proof.lanes import SINGLE, Answer, Value

TARGETS = 1000
REACHED_M = 1e-6
REASONS = {
    1: "not reached", 2: "by tool or load", 3: "outside the region", 4: "next to a singular pose", 5: "too large",
}  # fmt: skip
FUNCTION = "ppCorrected"
FORCE, MOMENT = "ppforce", "ppmoment"


@dataclass(frozen=True)
class Check:
    """What a module does with targets of the region.

    Args:
        corrected: number of targets that it corrects; returned: those that it returns as they came, by `ppReason`.
        raised: number of targets at which an error leaves the function.
        largest_m, rms_m: distance from the exact correction; correction_m: largest correction.
    """

    corrected: int
    returned: dict[int, int]
    raised: int
    largest_m: float
    rms_m: float
    correction_m: float


def said(found: Check, done: Conditions) -> str:
    """What a check found, as one line."""
    returned = ", ".join(f"{times} {REASONS.get(why, 'by an error')}" for why, times in found.returned.items())
    return (
        f"with {done.mass:g} kg, over {found.corrected} targets drawn from the region: largest error "
        f"{1e3 * found.largest_m:.4f} mm, rms {1e3 * found.rms_m:.4f} mm, largest correction "
        f"{1e3 * found.correction_m:.3f} mm; returned as they came: {returned or 'none'}"
    )


def check_module(source: Source, model: Model, conditions: Conditions, count: int = TARGETS, seed: int = 5) -> Check:
    """Run a module on targets drawn from the region, in single precision, and compare it with the model.

    The force is that of the module (`ppForce`, `ppMoment`), with ``Weld`` given.

    Raises:
        PostprocError: RUN002 the file is no such module, RUN003 it holds what cannot be calculated; MOD010.
    """
    if MARKER.encode() not in source.data:
        text, help_ = f"`{source.path}` is no module that corrects targets", "name one of `postproc runtime write`"
        raise PostprocError.of("RUN002", text, source, help=help_)
    q = conditions.drawn(count, seed)
    controller = Controller(model, q)
    run = Execution(source, len(q), controller.functions())
    done = replace(conditions, force=_stated(run, FORCE), moment=_stated(run, MOMENT))
    kept, _ = at_run_time(model, done.channels)
    desired = forward(model.robot, q) @ done.T_flange_tcp
    target = controller.target(desired, q)
    answer, raised = run.call(FUNCTION, [target, _tool(done, len(q))], {"weld": run.everywhere})
    trans, *rest = answer or target  # nothing is returned where an error leaves the function everywhere
    here = transform(1e-3 * np.array(trans, dtype=float).T, controller.rotation(rest[0]))
    exact = command(kept, done.states(q), desired)
    moved = np.linalg.norm(here[:, :3, 3] - desired[:, :3, 3], axis=1)
    reason = np.asarray(run.data["ppreason"].value)
    good = (reason == 0) & ~raised
    used = good & (exact.residual_m < SOLVED_M)
    far = np.linalg.norm((here - exact.T_base_tcp)[used, :3, 3], axis=1)
    why, times = np.unique(reason[~good].astype(int), return_counts=True)
    return Check(
        int(np.count_nonzero(good)),
        dict(zip(why.tolist(), times.tolist(), strict=True)),
        int(np.count_nonzero(raised)),
        float(far.max(initial=0.0)),
        float(np.sqrt(np.mean(far**2))) if len(far) else 0.0,
        float(moved[used].max(initial=0.0)),
    )


def _stated(run: Execution, name: str) -> Array:
    """(3,) numbers of the module's own data; zero where it has none of that name."""
    place = run.data.get(name)
    return np.zeros(3) if place is None else np.array([float(x[0]) for x in place.value])


def _tool(done: Conditions, count: int) -> Value:
    frame = done.T_flange_tcp

    def every(numbers: Array) -> Value:
        return [np.full(count, x, dtype=SINGLE) for x in numbers]

    load = [
        every(np.array([done.mass]))[0],
        every(1e3 * done.center),
        every(np.array([1.0, 0, 0, 0])),
        *every(np.zeros(3)),
    ]
    pose = [every(1e3 * frame[:3, 3]), every(quaternion(frame[:3, :3]))]
    return [np.ones(count, dtype=bool), pose, load]


@dataclass(frozen=True)
class Controller:
    """The functions of a controller, for n targets at once; work objects stand in the base.

    Args:
        model: whose nominal arm it is. near: (n, 6) joint angles near which targets are solved [rad].
    """

    model: Model
    near: Array

    def functions(self) -> dict[str, Callable[..., Answer]]:
        """By lower-case name, as `Execution` calls them."""
        simple: dict[str, Callable[..., Value]] = {
            "sin": lambda x: np.sin(np.radians(x.astype(float))).astype(SINGLE),
            "cos": lambda x: np.cos(np.radians(x.astype(float))).astype(SINGLE),
            "abs": np.abs,
            "trunc": np.trunc,
            "dim": lambda table, _: np.full(len(self.near), len(table.values), SINGLE),
            "distance": lambda a, b: np.linalg.norm(np.array(a) - np.array(b), axis=0).astype(SINGLE),
            "numtostr": lambda *_: "",
            "posevect": self._pose_vect,
            "reltool": self._rel_tool,
        }
        found = {name: (lambda *given, f=f, **options: (f(*given, **options), None)) for name, f in simple.items()}
        return {**found, "calcjointt": self._calc_joint_t, "calcrobt": self._calc_rob_t}

    def target(self, T: Array, q: Array) -> Value:
        """Robtargets at poses (n, 4, 4) [m] with the configuration of joint angles (n, 6)."""
        conf = confdata(self.model.robot, q) if self.model.robot.opw is not None else np.zeros((len(q), 4))
        trans = [x.astype(SINGLE) for x in (1e3 * T[:, :3, 3]).T]
        rot = [x.astype(SINGLE) for x in quaternion(T[:, :3, :3]).T]
        axes = [np.full(len(q), NO_AXIS, dtype=SINGLE) for _ in range(6)]
        return [trans, rot, [x.astype(SINGLE) for x in conf.T], axes]

    @staticmethod
    def rotation(rot: Value) -> Array:
        """(n, 3, 3) of quaternions by component."""
        w, x, y, z = (np.asarray(part, dtype=float) for part in rot)
        return np.asarray(Rotation.from_quat(np.stack([x, y, z, w], axis=1)).as_matrix())

    def _pose(self, place: Value) -> Array:
        """(n, 4, 4) [m] of a pose or a robtarget."""
        return transform(1e-3 * np.array(place[0], dtype=float).T, self.rotation(place[1]))

    def _pose_vect(self, pose: Value, vector: Value) -> Value:
        moved = self._pose(pose)[:, :3] @ np.array([*vector, np.full(len(self.near), 1e3)], dtype=float).T[:, :, None]
        return [x.astype(SINGLE) for x in moved[:, :, 0].T]

    def _rel_tool(self, target: Value, x: Value, y: Value, z: Value, **turns: Value) -> Value:
        zero = np.zeros(len(self.near))
        angles = np.radians(np.stack([turns.get(name, zero) for name in ("rx", "ry", "rz")], axis=1))
        step = displace(np.zeros((len(self.near), 6)))
        step[:, :3, :3] = Rotation.from_euler("XYZ", angles).as_matrix()
        step[:, :3, 3] = 1e-3 * np.stack([x, y, z], axis=1)
        trans, rot, _, _ = self.target(self._pose(target) @ step, self.near)
        return [trans, rot, *target[2:]]

    def _calc_joint_t(self, target: Value, tool: Value) -> Answer:
        T_tcp, T_tool = self._pose(target), self._pose(tool[1])
        rigid = self.model.with_effects()
        found = command(rigid, rigid.state(self.near, T_flange_tcp=T_tool), T_tcp)
        here = forward(self.model.robot, found.q)
        lost = np.linalg.norm((here @ T_tool - T_tcp)[:, :3, 3], axis=1) > REACHED_M
        beyond = ((found.q < self.model.robot.lower) | (found.q > self.model.robot.upper)).any(axis=1)
        return [[x.astype(SINGLE) for x in np.degrees(found.q).T], target[3]], lost | beyond

    def _calc_rob_t(self, joints: Value, tool: Value) -> Answer:
        q = np.radians(np.array(joints[0], dtype=float).T)
        trans, rot, conf, _ = self.target(forward(self.model.robot, q) @ self._pose(tool[1]), q)
        return [trans, rot, conf, joints[1]], None
