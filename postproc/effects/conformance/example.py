"""An arm and a rich set of states on which the conformance kit tries effects: every channel is there and varies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.arrays import gravity_in
from postproc.channels.state import State
from postproc.robot.arm import Robot
from postproc.robot.kinematics import body_poses

if TYPE_CHECKING:
    from postproc.robot.cells.station import Station


def example_arm() -> Robot:
    """Return an elbow arm of 60 kg payload with rounded dimensions; all body axes are parallel to the base at zero."""
    ends = [(0.0, 0, 0.3), (0.2, 0, 0.2), (0, 0, 0.9), (0.3, 0, 0.15), (0.7, 0, 0), (0.1, 0, 0), (0.05, 0, 0)]
    link = np.tile(np.eye(4), (7, 1, 1))
    link[:, :3, 3] = ends
    axis = np.array([[0, 0, 1.0], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]])
    mass = np.array([100.0, 120, 70, 80, 20, 10, 3])
    center = link[:, :3, 3] / 2
    inertia = mass[:, None, None] * 0.04 * np.eye(3)
    six = np.ones(6)
    return Robot("example", link, axis, -3 * six, 3 * six, 3 * six, 10 * six, 100 * six, mass, center, inertia)


def example_station() -> Station:
    """Return the example arm on a track of 3 m, beside a table that turns about an axis tilted by 40 degrees."""
    from postproc.robot.cells.cell import Cell, CellArm, Joint, Unit
    from postproc.robot.cells.station import Station
    from postproc.robot.pose import rpy, transform

    track = Unit("track", (Joint("track", "a", "linear", np.array([1.0, 0.0, 0.0])),))
    leaning = transform(np.array([1.0, 0.5, 0.6]), rpy(np.array([0.7, 0.0, 0.0])))
    table = Unit("table", (Joint("table", "b", "rotary"),), None, leaning)
    arm = CellArm("robot", "", "track", np.eye(4), gravity_in(np.eye(3)))
    return Station(Cell({"track": track, "table": table}, {"robot": arm}), "robot", ("track", "table"))


def example_state(n: int = 240) -> State:
    """Return n states spread over the joint space, with every channel recorded and loads of the usual size."""
    rng = np.random.default_rng(1)
    robot = example_arm()
    spread = np.array([3.1, 2.6, 3.1, 6.9, 2.2, 6.9])
    q = rng.uniform(-spread, spread, (n, 6))
    return State(
        q=q,
        v=rng.normal(0.0, 1.0, (n, 6)),
        a=rng.normal(0.0, 3.0, (n, 6)),
        approach=rng.choice([-1.0, 0.0, 1.0], (n, 6), p=[0.45, 0.1, 0.45]),
        payload_mass=rng.choice([5.0, 30.0, 60.0], n),
        payload_center=rng.normal(0.0, 0.1, (n, 3)),
        wrench=rng.normal(0.0, 150.0, (n, 6)),
        temperature=rng.uniform(5.0, 45.0, n),
        time=np.sort(rng.uniform(0.0, 28800.0, n)),
        external_axes=np.column_stack([rng.uniform([-1.5, -1.5], 1.5, (n, 2)), np.full((n, 4), np.nan)]),
        work=np.full(n, "table"),
        session=rng.integers(0, 3, n).astype(float),
        reflector=np.tile([0.0, 1.0, 2.0], n)[:n],
        setup=np.tile([0, 1, -1], n)[:n],
        setup_names=("tip 1", "plane 1"),
        channels={"row": np.arange(n, dtype=float)},
        robot=robot,
        station=example_station(),
        T_base_body=body_poses(robot, q),
        joint_load=rng.normal(0.0, 1000.0, (n, 6)),
        body_load=rng.normal(0.0, 1000.0, (n, 7, 6)),
    )
