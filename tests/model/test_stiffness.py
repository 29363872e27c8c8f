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
from postproc.effects.registry import BUILT_IN, effect_library
from postproc.model.arm import Model
from postproc.model.derivatives.sensitivity import sensitivity
from postproc.model.derivatives.stiffness import inertia, natural_frequencies, stiffness, tcp_compliance
from postproc.model.derivatives.tangent import tangent
from postproc.model.equilibrium import equilibrium
from postproc.model.file import default_model
from postproc.robot.kinematics import jacobian
from tests.model.arms import TOOL, loaded, parameter_slope, parameters, pose_derivatives, slope, with_more

ARM = default_model()
LINKS = LinkCompliance(
    body=(2, 4), bending_per_Nm2=[8e-7, 1e-6], torsion_per_Nm2=[1e-6, 2e-6], stretch_per_N=[1e-9, 1e-9]
)
BALANCED = ArmLoad(mass_kg=30.0), GravityCompensator().with_vector(np.array([2000.0, 0.3]))
WEIGHTLESS = replace(ARM.robot, mass=np.zeros(7), inertia=np.zeros((7, 3, 3)))


@pytest.mark.parametrize("effects", [(), (LINKS,), BALANCED], ids=["joints", "links", "balancer"])
def test_compliance_is_the_derivative_of_the_nonlinear_equilibrium(effects):
    model = with_more(ARM, *effects)
    state = loaded(model, 4, np.random.default_rng(17))

    def pushed(k: int):
        return lambda h: equilibrium(model, state.with_(wrench=state.wrench + h * np.eye(6)[k])).T_base_tcp

    expected = np.stack([slope(pushed(k), 60.0) for k in range(6)], axis=-1)
    S, size = tcp_compliance(model, state), np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert (np.abs(S - expected) / size).max() < 2e-8
    # What leaving out K_E costs: the test above can tell.
    at = tangent(model, equilibrium(model, state))
    assert (np.abs(at.J @ at.compliance @ np.swapaxes(at.J, 1, 2) - expected) / size).max() > 1e-4
    # Under forces alone the stiffness is symmetric, and it inverts the compliance.
    forces = state.with_(wrench=state.wrench * [1, 1, 1, 0, 0, 0])
    K = stiffness(model, forces)
    assert np.abs(K - np.swapaxes(K, 1, 2)).max() < 1e-9 * np.abs(K).max()
    assert np.abs(K @ tcp_compliance(model, forces) - np.eye(6)).max() < 1e-6


def test_joint_springs_alone_give_the_textbook_stiffness():
    """Without load K = J^-T K_theta J^-1 (Salisbury)."""
    model = replace(ARM, robot=WEIGHTLESS)
    q = loaded(model, 5, np.random.default_rng(17)).q
    J = np.linalg.inv(jacobian(model.robot, q, TOOL))
    expected = np.swapaxes(J, 1, 2) @ np.diag(1 / model.effects[0].vector()) @ J
    K = stiffness(model, model.state(q, T_flange_tcp=TOOL))
    assert np.abs(K - expected).max() < 1e-9 * np.abs(expected).max()
    assert np.isinf(stiffness(model, model.state(np.zeros((1, 6))))).all()


def test_natural_frequency_of_one_spring_and_one_mass():
    """omega^2 = k / (m r^2) for a payload on a weightless arm that turns about axis 1."""
    model = Model(WEIGHTLESS, (JointCompliance(compliance_rad_per_Nm=[1e-5, 0, 0, 0, 0, 0]),))
    state = model.state(np.zeros((1, 6)), payload_mass=np.array([50.0]), payload_center=np.zeros((1, 3)))
    f = natural_frequencies(model, state)[0]
    assert f[0] == pytest.approx(np.sqrt(1e5 / (50 * 1.270**2)) / (2 * np.pi), rel=1e-9)
    assert np.isinf(f[1:]).all()


def test_natural_frequencies_are_those_of_equation_6():
    state = loaded(ARM, 4, np.random.default_rng(17))
    rest = equilibrium(ARM, state)
    at = tangent(ARM, rest)
    M_cart = np.linalg.inv(at.J @ np.linalg.inv(inertia(rest, at.frame)) @ np.swapaxes(at.J, 1, 2))
    squared = np.sort(np.linalg.eigvals(np.linalg.solve(M_cart, stiffness(ARM, state))).real, axis=1)
    assert natural_frequencies(ARM, state) == pytest.approx(np.sqrt(squared) / (2 * np.pi), rel=1e-6)


@pytest.mark.parametrize("cls", [c for c in BUILT_IN if c.key != "outlier"], ids=lambda c: c.key)
def test_pose_derivatives_against_central_differences(cls: type[Effect]):
    g, n = np.random.default_rng(17), 4
    effect = cls().with_vector(cls().vector() + cls().scale() * g.uniform(0.2, 1.0, len(cls().vector())))
    model = with_more(ARM, effect) if cls is not JointCompliance else ARM.with_effects(effect)
    warming = {"temperature": np.linspace(20, 40, n), "time": np.linspace(0, 900, n), "session": np.arange(n) % 2}
    state = loaded(model, n, g, approach=np.sign(g.normal(size=(n, 6))), **warming)
    state = state.with_(v=1e-3 * g.normal(size=(n, 6))) if "v" in cls.reads else state
    # A tool that moves takes the point of attack of the wrench with it, which the derivatives leave out.
    state = state.with_(wrench=None) if cls.key == "tool_frame" else state
    D, scale = pose_derivatives(model, state), np.concatenate([e.scale() for e in model.effects])
    # Laws with a knee bend within the step of the differences.
    tolerance = {"servo_lag": 3e-4, "nonlinear_compliance": 5e-3}.get(cls.key, 1e-6)
    for k in g.permutation(len(parameters(model)))[:12]:
        expected = parameter_slope(model, state, k, 1e-2 * scale[k])
        assert np.abs(D[:, :, k] - expected).max() <= tolerance * np.abs(expected).max() + 1e-12 / scale[k]


BENDING = ("bearing_tilt", "link_compliance", "base_compliance", "nonlinear_compliance", "arm_load", "dress_pack")


@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("key", BENDING)
def test_many_states_have_the_slopes_of_each(key, half):
    """From a thousand states on loads are worked out where they are read; what is null reads none, and has a slope."""
    null = effect_library()[key].null()
    x = null.vector() + np.where(np.arange(len(null.vector())) % 2 == half, 0.5 * null.scale(), 0.0)
    model = with_more(ARM, null.with_vector(np.clip(x, *null.bounds())))
    state, every = loaded(model, 20, np.random.default_rng(222)), np.ones(len(x), dtype=bool)
    few, many = (
        sensitivity(model, equilibrium(model, s)).by_parameter(model.effects[-1], every)
        for s in (state, state.rows(np.tile(np.arange(20), 51)))
    )
    np.testing.assert_allclose(many, np.tile(few, (51, 1, 1)), atol=1e-7 * np.abs(few).max())
