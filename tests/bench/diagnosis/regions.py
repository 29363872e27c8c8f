"""Tables in which a part of the joint space is not measured: a quarter of a joint's range, a quadrant, an octant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tests.bench.diagnosis.sets import MAIN, NOISES, Recipe, Set, Truth, read_rows
from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent import two_joints as T
from tests.independent import unknown_effects as U
from tests.independent.cells import States, draw_cell, draw_states, measure

COUNT = 48
SEED = 70_000_000
"""Of the first set; seeds are far from those of all other kinds."""
ASKED = 150
"""Poses with true places in the region, and as many beside the measured rows."""

Side = Mapping[int, tuple[float, bool]]
"""By joint: a share of the poses, and whether the part above it is meant; a region is where all joints are so."""

QUARTERS: list[Side] = [{j: (0.75 if up else 0.25, up)} for up in (True, False) for j in (0, 1, 2, 4)]
QUADRANTS: list[Side] = [
    {a: (0.5, bool(k & 1)), b: (0.5, bool(k & 2))} for k in (0, 1, 3, 2) for a, b in ((0, 1), (1, 2))
]
OCTANTS: list[Side] = [{j: (0.5, bool(k >> j & 1)) for j in range(3)} for k in range(8)]

WITHIN = [
    *(Recipe(()), Recipe((K.backlash,)), Recipe((K.arm_load,)), Recipe((K.transmission_error,))),
    *(Recipe((K.joint_error_map,)), Recipe((K.gravity_compensator,)), Recipe((K.link_geometry,), "ur10")),
    *(Recipe((K.wrist_coupling,)), Recipe((K.nonlinear_tanh,)), Recipe((K.joint_error_map,), "ur10")),
    *(Recipe((K.base_compliance,)), Recipe((K.link_compliance, K.transmission_error)), Recipe((), "ur10")),
]
OUTSIDE = [
    *(Recipe((U.broadband_map,)), Recipe((T.wave_of_a_sum,)), Recipe((U.gear_lines,)), Recipe((U.kink,))),
    *(Recipe((T.product_of_waves,)), Recipe((U.angle_step,)), Recipe((U.broadband_map, K.link_geometry), "ur10")),
    *(Recipe((T.product_of_curves,)), Recipe((U.joint_product,)), Recipe((U.gear_lines,), "ur10")),
    *(Recipe((U.elbow_wave,)), Recipe((U.gap_by_angle,)), Recipe((T.wave_of_a_sum,), "ur10")),
    *(Recipe((U.tracker_scale,)), Recipe((K.joint_error_map, T.product_of_waves)), Recipe((U.payload_by_angle,))),
]
"""Laws of the library, or nothing, and laws that it does not have; every second set hides one of these."""


def region_of(index: int) -> Side:
    """Quarters, quadrants and octants in turn."""
    return (QUARTERS, QUADRANTS, OCTANTS)[index % 3][index // 3 % 8]


def recipe_of(index: int) -> Recipe:
    """Every region is asked with a law of the library in one round of 24 sets, with another law in the other round."""
    some = OUTSIDE if (index + index // 24) % 2 else WITHIN
    return some[index // 2 % len(some)]


def inside_region(q: np.ndarray, side: Side, drawn: np.ndarray) -> np.ndarray:
    """(n,) which of some joint angles (n, 6) lie in a region. Args: drawn: (m, 6) of whose parts it speaks."""
    parts = [(q[:, j] > np.quantile(drawn[:, j], share)) == up for j, (share, up) in side.items()]
    return np.asarray(np.all(parts, axis=0))


def region_set(kind: str, index: int) -> Set:
    """150 to 220 poses outside a region, twelve of them three times but in every twelfth set; true places on both sides."""
    recipe, side = recipe_of(index), region_of(index)
    g = np.random.default_rng(SEED + index)
    arm = A.ARMS[recipe.robot]()
    hidden = tuple(k(g, arm) for k in recipe.kinds)
    noise, n = float(g.choice(NOISES)), int(g.choice([150, 180, 220]))
    cell = draw_cell(g, arm, hidden)
    every = draw_states(g, 12 * (n + ASKED), arm, moving=False, session=False)
    missing = inside_region(every.q, side, every.q)
    away, near = np.flatnonzero(missing), g.permutation(np.flatnonzero(~missing))
    rows = np.sort(near[:n])
    again = rows[:: n // 12][: 0 if index % 12 == 11 else 12]
    rows = np.concatenate([rows, again, again])
    asked = np.sort(np.concatenate([g.permutation(away)[:ASKED], near[n : n + ASKED]]))
    tables = []
    for some, spread, digits in ((rows, 1e-3 * noise, 4), (asked, 0.0, 6)):
        s: States = every.take(some)
        seen = measure(cell, s) + g.normal(0, spread, (len(s), 3))
        tables.append(read_rows(recipe.robot, s, seen, [f"P{i:04d}" for i in some], digits))
    words = " ".join(f"q{j + 1}{'>' if up else '<'}{share:g}" for j, (share, up) in side.items())
    robot = "" if recipe.robot == MAIN else f" on {recipe.robot}"
    name = f"{'+'.join(k.__name__ for k in recipe.kinds) or 'nothing'}{robot}, without {words} #{index}"
    masks = {"region": missing[asked], "near": ~missing[asked]}
    return Set(kind, name, recipe.robot, *tables, Truth.of(hidden), 1e-3 * noise, asked=masks)
