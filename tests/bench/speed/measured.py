"""Tables that are diagnosed for their cost: few places in six orientations each, and an arm with an error map."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.diagnostics import Source
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.robot.catalogue import load_robot
from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent import unknown_effects as U
from tests.independent.cells import Cell, Hidden, States, draw_cell, draw_states, seen_by_instrument, settle
from tests.independent.inverse import inverse

NOISE, TURN = 2e-5, 5e-5
"""Of the positions [m] and the orientations [rad]."""
ORIENTATIONS = Rotation.from_euler(
    "zyx", [[0, 180, 0], [60, 150, 0], [-60, 150, 20], [30, 135, -20], [-30, 120, 30], [90, 165, -30]], degrees=True
).as_matrix()


def six_orientations(rows: int) -> Measurements:
    """Poses of an arm with an error map and a wave of the sum of two angles, which has no name; with orientations."""
    g, arm = np.random.default_rng(11), A.ARMS["irb4600_60_205"]()
    cell = draw_cell(g, arm, (K.joint_error_map(g, arm), U.elbow_wave(g, arm)))
    return _read(g, cell, _turned(g, cell, rows), orientations=True)


def mapped(rows: int) -> Measurements:
    """Positions of a collaborative arm of which each joint has a broadband error of 0.3 mrad, orders 1 to 40."""
    g, arm = np.random.default_rng(12), A.ARMS["ur5"]()
    orders = np.arange(1, 41)
    waves = g.normal(0, 1, (2, 6, 40)) / orders
    waves *= 3e-4 * np.sqrt(2) / np.linalg.norm(waves, axis=(0, 2), keepdims=True)

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        angle = s.q[:, :, None] * orders
        return np.asarray(np.sum(waves[0] * np.sin(angle) + waves[1] * np.cos(angle), axis=2))

    cell = draw_cell(g, arm, (Hidden("joint_error_map", "joint_error_map", joint=joint),))
    return _read(g, cell, draw_states(g, rows, arm, moving=False, session=False), orientations=False)


def _turned(g: np.random.Generator, cell: Cell, rows: int) -> States:
    """The states of an arm at random places before it, in all six orientations."""
    found: list[np.ndarray] = []
    while 6 * len(found) < rows:
        tcp = A.transform(ORIENTATIONS, g.uniform([0.9, -0.8, 0.4], [1.5, 0.8, 1.3]))
        q = inverse(cell.arm, tcp @ np.linalg.inv(cell.tool))[:, 0]
        if np.isfinite(q).all() and (q > cell.arm.lower).all() and (q < cell.arm.upper).all():
            found.append(q)
    q = np.radians(np.round(np.degrees(np.vstack(found)[:rows]), 5))
    time = np.arange(rows) * 20.0
    warm = np.round(20 + 6 * (1 - np.exp(-time / 4000.0)) + g.normal(0, 0.2, rows), 2)
    return States(q, np.ones((rows, 6)), warm, time, np.full(rows, 20.0), np.tile([0.03, 0.02, 0.12], (rows, 1)))


def _read(g: np.random.Generator, cell: Cell, states: States, orientations: bool) -> Measurements:
    """What a tracker's file says of these states: angles, positions, orientations and the temperature alone."""
    stands, n = settle(cell, states), len(states)
    seen = seen_by_instrument(cell, states, stands) + g.normal(0, NOISE, (n, 3))
    turned = Rotation.from_matrix(cell.instrument[:3, :3] @ stands.frames.tcp[:, :3, :3])
    quaternion = (turned * Rotation.from_rotvec(g.normal(0, TURN, (n, 3)))).as_quat()[:, [3, 0, 1, 2]]
    names = [f"q{j}_deg" for j in range(1, 7)] + ["x_mm", "y_mm", "z_mm"] + ["qw", "qx", "qy", "qz"] * orientations
    parts = [np.degrees(states.q), 1e3 * seen, *[quaternion] * orientations, states.temperature[:, None]]
    rows = (f"P{i}," + ",".join(f"{x:.9g}" for x in row) for i, row in enumerate(np.hstack(parts)))
    text = "\n".join([",".join(["pose_id", *names, "temperature_C"]), *rows]) + "\n"
    return read_measurements(Source("measured.csv", text.encode()), load_robot(cell.arm.name))
