"""The paper's formulas beside the exact equilibrium: ``python -m tests.bench.paper`` prints the figures of docs/paper.md."""

from __future__ import annotations

import numpy as np

from postproc.arrays import invert
from postproc.compensation.correction.inverse import command
from postproc.model.derivatives.stiffness import stiffness
from postproc.model.derivatives.tangent import tangent
from postproc.model.equilibrium import equilibrium
from postproc.model.file import default_model
from postproc.robot.kinematics import forward, jacobian
from postproc.robot.track import track
from tests.bench.reference import paper_compensation, paper_pose

FORCE = np.array([200.0, -200, -200, 0, 0, 0])
TOOL = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.35], [0, 0, 0, 1]])
START = np.radians([-25.0, 30, 5, 0, 45, 0])


def seam(model, n: int = 201):  # type: ignore[no-untyped-def]
    """A metre of seam across the arm with the torch held still, as in the paper's Figs. 5 and 6: joints and poses."""
    first = forward(model.robot, START[None])[0] @ TOOL
    desired = np.tile(first, (n, 1, 1))
    desired[:, 1, 3] += np.linspace(0.0, 1.0, n)
    desired[:, 2, 3] += 0.05 * np.sin(np.linspace(0.0, np.pi, n))
    return track(model.robot, desired @ invert(TOOL), START), desired


def measure(name: str) -> dict[str, float]:
    """Figures of one geometry, lengths in mm."""
    model = default_model(name)
    q, desired = seam(model)
    n = len(q)
    channels = {"T_flange_tcp": TOOL, "wrench": np.tile(FORCE, (n, 1)), "payload_mass": np.full(n, 5.0)}
    channels["payload_center"] = np.tile([0.0, 0, 0.1], (n, 1))
    state = model.state(q, **channels)

    def gap(T: np.ndarray, to: np.ndarray) -> float:
        return float(np.linalg.norm((T - to)[:, :3, 3], axis=1).max() * 1e3)

    rest = equilibrium(model, state)
    inverse = command(model, state, desired)
    real = equilibrium(model, state.with_(q=inverse.q)).T_base_tcp
    rng = np.random.default_rng(0)
    spread = rng.uniform([-2, -0.4, -0.8, -2, 0.4, -2], [2, 0.9, 0.5, 2, 1.6, 2], (500, 6))
    sample = model.state(
        spread, **{**channels, **{k: np.repeat(v[:1], 500, 0) for k, v in channels.items() if k != "T_flange_tcp"}}
    )
    there = equilibrium(model, sample)
    off = np.linalg.norm((paper_pose(model, sample) - there.T_base_tcp)[:, :3, 3], axis=1) * 1e3
    size = np.linalg.norm((forward(model.robot, spread) @ TOOL - there.T_base_tcp)[:, :3, 3], axis=1) * 1e3
    at = tangent(model, rest)
    K = stiffness(model, state)
    J = np.linalg.inv(jacobian(model.robot, rest.chain.q, TOOL))
    bare = np.swapaxes(J, 1, 2) @ np.diag(1 / model.robot.joint_compliance) @ J  # type: ignore[operator]
    return {
        "error of the real arm before, largest": gap(rest.T_base_tcp, desired),
        "error after the exact inverse": gap(real, desired),
        "error after Eqs. 24-25 corrected, 10 sweeps": float(
            paper_compensation(model, state, desired, printed=False).error_m.max() * 1e3
        ),
        "error after Eqs. 24-25 as printed, 10 sweeps": float(
            paper_compensation(model, state, desired, printed=True).error_m.max() * 1e3
        ),
        "Eq. 23 beside the exact equilibrium, along the seam": gap(paper_pose(model, state), rest.T_base_tcp),
        "Eq. 23 beside the exact equilibrium, 500 poses, median": float(np.median(off)),
        "Eq. 23 beside the exact equilibrium, 500 poses, largest": float(off.max()),
        "largest deflection of those poses": float(size.max()),
        "K without K_E, relative": float((np.abs(bare - K).max(axis=(1, 2)) / np.abs(K).max(axis=(1, 2))).max()),
        "K_E beside K_theta, relative": float(np.abs(at.K_E).max() * model.robot.joint_compliance.min()),  # type: ignore[union-attr]
    }


def main() -> None:
    figures = {name: measure(name) for name in ("irb4600_60_205", "irb4600_60_205_seed")}
    print(f"{'mm, where not relative':58s} " + " ".join(f"{name:>20s}" for name in figures))
    for row in figures["irb4600_60_205"]:
        print(f"{row:58s} " + " ".join(f"{f[row]:20.3g}" for f in figures.values()))


if __name__ == "__main__":
    main()
