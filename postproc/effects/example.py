"""An arm and a rich set of states on which the conformance kit tries effects: every channel is there and varies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.effects.contract import State
from postproc.robot.arm import Robot
from postproc.robot.kinematics import body_poses


def example_arm() -> Robot:
    """A 60 kg class elbow arm with rounded dimensions; axes z y y x y x, all body axes parallel to the base at zero."""
    ends = [(0.0, 0, 0.3), (0.2, 0, 0.2), (0, 0, 0.9), (0.3, 0, 0.15), (0.7, 0, 0), (0.1, 0, 0), (0.05, 0, 0)]
    link = np.tile(np.eye(4), (7, 1, 1))
    link[:, :3, 3] = ends
    axis = np.array([[0, 0, 1.0], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]])
    mass = np.array([100.0, 120, 70, 80, 20, 10, 3])
    center = link[:, :3, 3] / 2
    inertia = mass[:, None, None] * 0.04 * np.eye(3)
    six = np.ones(6)
    return Robot("example", link, axis, -3 * six, 3 * six, 3 * six, 10 * six, 100 * six, mass, center, inertia)


def example_state(n: int = 240, seed: int = 1) -> State:
    """States spread over the joint space, with every channel recorded and the model's share filled in."""
    rng = np.random.default_rng(seed)
    robot = example_arm()
    spread = np.array([3.1, 2.6, 3.1, 6.9, 2.2, 6.9])
    state = State(
        q=rng.uniform(-spread, spread, (n, 6)),
        v=rng.normal(0.0, 1.0, (n, 6)),
        a=rng.normal(0.0, 3.0, (n, 6)),
        approach=rng.choice([-1.0, 0.0, 1.0], (n, 6), p=[0.45, 0.1, 0.45]),
        payload_mass=rng.choice([5.0, 30.0, 60.0], n),
        payload_center=rng.normal(0.0, 0.1, (n, 3)),
        wrench=rng.normal(0.0, 150.0, (n, 6)),
        temperature=rng.uniform(5.0, 45.0, n),
        time=np.sort(rng.uniform(0.0, 28800.0, n)),
        session=rng.integers(0, 3, n).astype(float),
        channels={"row": np.arange(n, dtype=float)},
        robot=robot,
    )
    return with_loads(state, robot)


def with_loads(state: State, robot: Robot) -> State:
    """Body poses, and the loads of links, payload and wrench on joints and bodies, by plain statics of the chain."""
    n = len(state)
    T = body_poses(robot, state.q)
    tip = T[:, 6] @ robot.link[6]
    joint, body = np.zeros((n, 6)), np.zeros((n, 7, 6))
    assert state.wrench is not None and state.payload_mass is not None and state.payload_center is not None
    # Force and moment about the base origin, summed from the flange inwards.
    force = state.wrench[:, :3] + state.payload_mass[:, None] * state.gravity
    center = (tip[:, :3, :3] @ state.payload_center[:, :, None])[:, :, 0] + tip[:, :3, 3]
    moment = state.wrench[:, 3:] + np.cross(tip[:, :3, 3], state.wrench[:, :3])
    moment = moment + np.cross(center, state.payload_mass[:, None] * state.gravity)
    for b in range(6, -1, -1):
        end = (T[:, b] @ robot.link[b])[:, :3, 3]
        at_end = np.concatenate([force, moment - np.cross(end, force)], axis=1).reshape(n, 2, 3)
        body[:, b] = (at_end @ T[:, b, :3, :3]).reshape(n, 6)
        weight = robot.mass[b] * state.gravity
        force = force + weight
        moment = moment + np.cross(T[:, b, :3, :3] @ robot.center[b] + T[:, b, :3, 3], weight)
        if b > 0:
            about = moment - np.cross(T[:, b, :3, 3], force)
            joint[:, b - 1] = np.sum(about * (T[:, b, :3, :3] @ robot.axis[b - 1]), axis=1)
    return replace(state, T_base_body=T, joint_load=joint, body_load=body)
