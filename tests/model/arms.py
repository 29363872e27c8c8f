"""Arms for the tests: the same numbers as a robot of the package and as an independent arm."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.model.arm import Model
from postproc.model.derivatives.sensitivity import grown_sensitivity
from postproc.robot.arm import Robot
from tests.independent import arm as A


def random_arm(seed: int) -> tuple[Robot, A.Arm]:
    """A serial arm with arbitrary links, axes and masses: nothing in it is special."""
    rng = np.random.default_rng(seed)
    link = A.transform(A.rotation_vector(rng.normal(size=(7, 3))), rng.uniform(-0.5, 0.5, (7, 3)))
    axis = rng.normal(size=(6, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    mass = rng.uniform(5, 60, 7)
    # The independent arm counts body 6's own weight as a load on its far end; without weight both agree.
    mass[6] = 0.0
    center = rng.uniform(-0.2, 0.2, (7, 3))
    gyration = rng.uniform(0.05, 0.3, 7)
    inertia = (mass * gyration**2)[:, None, None] * np.eye(3)
    limit = np.full(6, 6.0)
    robot = Robot("random", link, axis, -limit, limit, limit, limit, limit, mass, center, inertia)
    return robot, A.Arm("random", link, axis, mass, center, -limit, limit, gyration=gyration)


def parameters(model: Model) -> Array:
    """(p,) parameters of all effects, in the order of the model."""
    return np.concatenate([e.vector() for e in model.effects])


def pose_derivatives(model: Model, state: State) -> Array:
    """(n, 6, p) change of the seen pose by every parameter, in the order of the model."""
    at = grown_sensitivity(model, state)
    return np.concatenate([at.by_parameter(e, np.ones(len(e.vector()), dtype=bool)) for e in model.effects], axis=2)


def with_parameters(model: Model, x: Array) -> Model:
    """The same model with other parameters, (p,)."""
    effects, at = [], 0
    for effect in model.effects:
        size = len(effect.vector())
        effects.append(effect.with_vector(x[at : at + size]))
        at += size
    return model.with_effects(*effects)
