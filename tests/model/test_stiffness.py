"""Stiffness, frequencies and derivatives against differences of the nonlinear equilibrium."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.effects.base import Effect
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.effects.library.loads.gravity_compensator import GravityCompensator
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.effects.registry import BUILT_IN
from postproc.model.arm import Model
from postproc.model.derivatives.stiffness import natural_frequencies, stiffness, tcp_compliance
from postproc.model.derivatives.tangent import tangent
from postproc.model.equilibrium import equilibrium, predict
from postproc.model.file import default_model
from postproc.robot.kinematics import jacobian
from postproc.robot.pose import pose_error
from tests.model.arms import parameters, pose_derivatives, with_parameters

RNG = np.random.default_rng(17)
TOOL = np.array([[0.0, 0, 1, 0.1], [0, 1, 0, -0.05], [-1, 0, 0, 0.35], [0, 0, 0, 1]])
LINKS = LinkCompliance(
    body=(2, 4), bending_per_Nm2=[8e-7, 1e-6], torsion_per_Nm2=[1e-6, 2e-6], stretch_per_N=[1e-9, 1e-9]
)


@pytest.fixture(autouse=True)
def same_draws_whatever_ran_before() -> None:
    RNG.bit_generator.state = np.random.default_rng(17).bit_generator.state


def loaded(model: Model, n: int = 4):  # type: ignore[no-untyped-def]
    q = RNG.uniform([-2, -0.4, -0.8, -2, 0.4, -2], [2, 0.9, 0.5, 2, 1.6, 2], (n, 6))
    return model.state(
        q,
        T_flange_tcp=TOOL,
        payload_mass=np.full(n, 40.0),
        payload_center=np.tile([0.02, 0.05, 0.15], (n, 1)),
        wrench=np.tile([200.0, -200, -200, 20, 30, -10], (n, 1)),
    )


def differences(model: Model, state, push: float) -> np.ndarray:  # type: ignore[no-untyped-def]
    columns = []
    for k in range(6):
        step = push * np.eye(6)[k]
        ends = [equilibrium(model, state.with_(wrench=state.wrench + s * step)).T_base_tcp for s in (1, -1)]
        columns.append(pose_error(ends[1], ends[0]) / (2 * push))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize(
    "extra", [(), (LINKS,), (ArmLoad(mass_kg=30.0), GravityCompensator().with_vector(np.array([2000.0, 0.3])))]
)
def test_compliance_is_the_derivative_of_the_nonlinear_equilibrium(extra: tuple[Effect, ...]) -> None:
    model = default_model()
    model = model.with_effects(*model.effects, *extra)
    state = loaded(model)
    S = tcp_compliance(model, state)
    # Richardson's extrapolation removes the cubic term of the differences.
    expected = (4 * differences(model, state, 60.0) - differences(model, state, 120.0)) / 3
    size = np.abs(S).max(axis=(1, 2), keepdims=True)
    assert (np.abs(S - expected) / size).max() < 2e-8
    at = tangent(model, equilibrium(model, state))
    without = at.J @ at.compliance @ np.swapaxes(at.J, 1, 2)
    # What leaving out K_E costs; the issue is that the test above can tell.
    assert (np.abs(without - expected) / size).max() > 1e-4


def test_stiffness_is_symmetric_under_forces_alone_and_inverts_compliance() -> None:
    model = default_model()
    model = model.with_effects(*model.effects, LINKS)
    state = loaded(model)
    forces = state.with_(wrench=state.wrench * [1, 1, 1, 0, 0, 0])
    K = stiffness(model, forces)
    assert np.abs(K - np.swapaxes(K, 1, 2)).max() < 1e-9 * np.abs(K).max()
    assert np.abs(K @ tcp_compliance(model, forces) - np.eye(6)).max() < 1e-6


def test_joint_springs_alone_give_the_textbook_stiffness() -> None:
    """Without load K = J^-T K_theta J^-1 (Salisbury)."""
    model = default_model()
    model = replace(model, robot=replace(model.robot, mass=np.zeros(7), inertia=np.zeros((7, 3, 3))))
    q = RNG.uniform([-2, -0.4, -0.8, -2, 0.4, -2], [2, 0.9, 0.5, 2, 1.6, 2], (5, 6))
    J = np.linalg.inv(jacobian(model.robot, q, TOOL))
    compliance = model.effects[0].compliance_rad_per_Nm  # type: ignore[attr-defined]
    expected = np.swapaxes(J, 1, 2) @ np.diag(1 / compliance) @ J
    K = stiffness(model, model.state(q, T_flange_tcp=TOOL))
    assert np.abs(K - expected).max() < 1e-9 * np.abs(expected).max()
    assert np.isinf(stiffness(model, model.state(np.zeros((1, 6))))).all()


def test_natural_frequency_of_one_spring_and_one_mass() -> None:
    """omega^2 = k / (m r^2) for a payload on a weightless arm that turns about axis 1."""
    model = default_model()
    bare = replace(model.robot, mass=np.zeros(7), inertia=np.zeros((7, 3, 3)))
    soft = np.array([1e-5, 0, 0, 0, 0, 0])
    model = replace(model, robot=bare).with_effects(JointCompliance(compliance_rad_per_Nm=soft))
    state = model.state(np.zeros((1, 6)), payload_mass=np.array([50.0]), payload_center=np.zeros((1, 3)))
    f = natural_frequencies(model, state)[0]
    assert f[0] == pytest.approx(np.sqrt(1e5 / (50 * 1.270**2)) / (2 * np.pi), rel=1e-9)
    assert np.isinf(f[1:]).all()


def test_natural_frequencies_are_those_of_equation_6() -> None:
    model = default_model()
    state = loaded(model)
    rest = equilibrium(model, state)
    at = tangent(model, rest)
    from postproc.model.derivatives.stiffness import inertia

    M = inertia(rest, at.frame)
    M_cart = np.linalg.inv(at.J @ np.linalg.inv(M) @ np.swapaxes(at.J, 1, 2))
    squared = np.sort(np.linalg.eigvals(np.linalg.solve(M_cart, stiffness(model, state))).real, axis=1)
    assert natural_frequencies(model, state) == pytest.approx(np.sqrt(squared) / (2 * np.pi), rel=1e-6)


@pytest.mark.parametrize("cls", [c for c in BUILT_IN if c.key not in ("outlier",)], ids=lambda c: c.key)
def test_pose_derivatives_against_central_differences(cls: type[Effect]) -> None:
    model = default_model()
    n = 4
    effect = cls()
    x = effect.vector() + effect.scale() * RNG.uniform(0.2, 1.0, len(effect.vector()))
    effect = effect.with_vector(x)
    model = model.with_effects(*model.effects, effect) if cls is not JointCompliance else model.with_effects(effect)
    state = loaded(model, n).with_(
        approach=np.sign(RNG.normal(size=(n, 6))),
        temperature=np.linspace(20, 40, n),
        time=np.linspace(0, 900, n),
        session=np.arange(n) % 2,
    )
    state = state.with_(v=RNG.normal(size=(n, 6)) * 1e-3) if "v" in cls.reads else state
    # A tool that moves takes the point of attack of the wrench with it, which the derivatives leave out.
    state = state.with_(wrench=None) if cls.key == "tool_frame" else state
    D = pose_derivatives(model, state)
    x = parameters(model)
    scale = np.concatenate([e.scale() for e in model.effects])
    # Laws with a knee bend within the step of the differences.
    tolerance = {"servo_lag": 3e-4, "nonlinear_compliance": 5e-3}.get(cls.key, 1e-6)
    for k in RNG.permutation(len(x))[:12]:
        slopes = []
        for size in (1e-2 * scale[k], 2e-2 * scale[k]):
            up, down = (predict(with_parameters(model, x + s * size * np.eye(len(x))[k]), state) for s in (1, -1))
            slopes.append(pose_error(down, up) / (2 * size))
        # Richardson's extrapolation removes the cubic term of the differences.
        expected = (4 * slopes[0] - slopes[1]) / 3
        assert np.abs(D[:, :, k] - expected).max() <= tolerance * np.abs(expected).max() + 1e-9 / scale[k] * 1e-3
