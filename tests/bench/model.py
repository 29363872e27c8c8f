"""Speed of the inverse of the model on one core: ``python -m tests.bench.model``.

Prints poses per second for 6 joint springs and for 18 springs (joints, upper arm, forearm), and beside them a plain loop
that solves pose by pose with pinocchio and scipy's root finder.
"""

from __future__ import annotations

# ruff: noqa: E402 - threads are counted when numpy is first imported
import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from postproc.compensate.correction.inverse import command
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium
from postproc.model.file import default_model
from postproc.robot.kinematics import forward

TOOL = np.array([[0.0, 0, 1, 0.1], [0, 1, 0, 0], [-1, 0, 0, 0.35], [0, 0, 0, 1]])
LINKS = LinkCompliance(
    body=(2, 4), bending_per_Nm2=[8e-7, 1e-6], torsion_per_Nm2=[1e-6, 2e-6], stretch_per_N=[1e-9, 1e-9]
)


def states(model: Model, n: int) -> Any:
    rng = np.random.default_rng(0)
    q = rng.uniform([-2, -0.4, -0.8, -2, 0.2, -3], [2, 0.9, 0.4, 2, 1.8, 3], (n, 6))
    return model.state(
        q,
        T_flange_tcp=TOOL,
        payload_mass=np.full(n, 5.0),
        payload_center=np.tile([0, 0, 0.1], (n, 1)),
        wrench=np.tile([200.0, -200, -200, 0, 0, 0], (n, 1)),
    )


def best_of(work: Callable[[], Any], times: int = 3) -> float:
    """Shortest time [s]: the machine may be busy with other things."""
    found = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        found.append(time.perf_counter() - start)
    return min(found)


def pose_by_pose(model: Model, state: Any, desired: np.ndarray) -> np.ndarray:
    """What one would write first: for every pose a root of the deflected forward kinematics, pinocchio inside."""
    import pinocchio as pin
    from scipy.optimize import root

    bodies = model.multibody()
    arm, data = bodies.model, bodies.model.createData()
    flange = pin.SE3(model.robot.link[6][:3, :3], model.robot.link[6][:3, 3])
    frame = arm.addFrame(pin.Frame("tcp", 6, 0, flange * pin.SE3(TOOL[:3, :3], TOOL[:3, 3]), pin.FrameType.OP_FRAME))
    data = arm.createData()
    compliance = model.effects[0].compliance_rad_per_Nm  # type: ignore[attr-defined]
    result = np.empty_like(state.q)
    for i, q in enumerate(state.q):
        goal = pin.SE3(desired[i, :3, :3], desired[i, :3, 3])
        payload = flange * pin.SE3(np.eye(3), state.payload_center[i])

        def real(command: np.ndarray, i: int = i, payload: Any = payload) -> Any:
            theta = command.copy()
            for _ in range(4):
                pin.framesForwardKinematics(arm, data, theta)
                J = pin.computeFrameJacobian(arm, data, theta, frame, pin.LOCAL_WORLD_ALIGNED)
                tool = data.oMf[frame].translation
                arm_of_payload = (data.oMi[6] * payload).translation - tool
                weight = state.payload_mass[i] * model.gravity
                wrench = state.wrench[i] + np.r_[weight, np.cross(arm_of_payload, weight)]
                load = J.T @ wrench - pin.computeGeneralizedGravity(arm, data, theta)
                theta = command + compliance * load
            pin.framesForwardKinematics(arm, data, theta)
            return data.oMf[frame]

        result[i] = root(lambda x, goal=goal, real=real: pin.log6(real(x).actInv(goal)).vector, q).x
    return result


def main() -> None:
    n, few = 20_000, 200
    model = default_model()
    state = states(model, n)
    desired = forward(model.robot, state.q) @ TOOL
    speeds = {}
    # A milliradian off, so that the nominal inverse kinematics is part of the work.
    start_at = state.with_(q=state.q + 1e-3)
    for name, extra in (("6 joint springs", ()), ("18 springs", (LINKS,))):
        arm = model.with_effects(*model.effects, *extra)
        result = command(arm, start_at, desired)
        seconds = best_of(lambda arm=arm: command(arm, start_at, desired))  # type: ignore[misc]
        off = equilibrium(arm, state.with_(q=result.q)).T_base_tcp - desired
        speeds[name] = n / seconds
        solved = (result.residual_m <= 1e-9).mean()
        print(
            f"{name:16s} {n / seconds:9,.0f} poses/s   solved to 1e-9 m: {solved:.2%}   "
            f"median residual on the real arm: {np.median(np.abs(off).max(axis=(1, 2))):.1e} m"
        )
        forwards = best_of(lambda arm=arm: equilibrium(arm, state))  # type: ignore[misc]
        print(f"{'':16s} {n / forwards:9,.0f} poses/s   forward model (elastic equilibrium)")

    part = state.rows(slice(0, few))
    plain = default_model()
    start = time.perf_counter()
    q = pose_by_pose(plain, part, desired[:few])
    rate = few / (time.perf_counter() - start)
    gap = np.abs(command(model, part, desired[:few]).q - q).max()
    print(
        f"{'pose by pose':16s} {rate:9,.0f} poses/s   pinocchio + scipy root, 6 joint springs; agrees to {gap:.0e} rad"
    )
    print(f"{'':16s} {speeds['6 joint springs'] / rate:9,.0f} times slower than the batched inverse")


if __name__ == "__main__":
    main()
