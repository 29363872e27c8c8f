"""Arms for the tests: the same numbers as a robot of the package and as an independent arm; states, and differences."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.model.arm import Model
from postproc.model.derivatives.sensitivity import grown_sensitivity
from postproc.model.equilibrium import predict
from postproc.robot.arm import Robot
from postproc.robot.pose import pose_error
from tests.independent import arm as A

TOOL = np.array([[0.0, 0, 1, 0.1], [0, 1, 0, -0.05], [-1, 0, 0, 0.35], [0, 0, 0, 1]])
LOW, HIGH = [-2, -0.4, -0.8, -2, 0.4, -2], [2, 0.9, 0.4, 2, 1.6, 2]
"""Joint angles [rad] far from singular poses."""


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


def with_more(model: Model, *effects: Any) -> Model:
    return model.with_effects(*model.effects, *effects)


def loaded(model: Model, n: int, g: np.random.Generator, **more: Any) -> State:
    """States far from singular poses with a tool, a payload of 40 kg, and a force with a moment."""
    load = {"payload_mass": np.full(n, 40.0), "payload_center": np.tile([0.02, 0.05, 0.15], (n, 1))}
    wrench = np.tile([200.0, -200, -200, 20, 30, -10], (n, 1))
    return model.state(g.uniform(LOW, HIGH, (n, 6)), **{"T_flange_tcp": TOOL, "wrench": wrench, **load, **more})


def parameters(model: Model) -> Array:
    """(p,) parameters of all effects, in the order of the model."""
    return np.concatenate([e.vector() for e in model.effects])


def pose_derivatives(model: Model, state: State) -> Array:
    """(n, 6, p) change of the seen pose by every parameter, in the order of the model."""
    at = grown_sensitivity(model, state)
    return np.concatenate([at.by_parameter(e, np.ones(len(e.vector()), dtype=bool)) for e in model.effects], axis=2)


def with_parameters(model: Model, x: Array) -> Model:
    """The same model with other parameters, (p,)."""
    ends = np.cumsum([len(e.vector()) for e in model.effects])[:-1]
    parts = zip(model.effects, np.split(x, ends), strict=True)
    return model.with_effects(*(effect.with_vector(part) for effect, part in parts))


def slope(moved: Callable[[float], Array], step: float) -> Array:
    """(n, 6) derivative of a pose at 0; Richardson's extrapolation removes the cubic term of the differences."""
    single, double = (pose_error(moved(-h), moved(h)) / (2 * h) for h in (step, 2 * step))
    return (4 * single - double) / 3


def parameter_slope(model: Model, state: State, k: int, step: float) -> Array:
    """(n, 6) derivative of the predicted pose by parameter k of the model, by differences."""
    x, unit = parameters(model), np.eye(len(parameters(model)))[k]
    return slope(lambda h: predict(with_parameters(model, x + h * unit), state), step)
