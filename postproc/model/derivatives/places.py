"""The places where an effect can move or load the arm: joints, far ends of bodies, tool, instrument, set-up."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import Displacement, Load

JOINT, BODY, TOOL, INSTRUMENT, SETUP, PLACES = 0, 6, 48, 54, 60, 66
"""First column of joints, bodies, tool, instrument and unknowns of set-ups, and how many there are."""
BATCH = 500  # poses taken at once whose matrices of the whole arm are held: 48 coordinates squared, a few times
LOAD_PLACES = 54
"""Columns of a load: torques of the joints (6), then the wrench that every body and the tool carry (8 x 6)."""


def displacement_parts(displacement: Displacement) -> dict[int, Array]:
    """Return a displacement in parts, (n, 6) or (6,) each, by number of the first of their columns.

    The ``PLACES`` columns are six of the joints, six each of bodies 0 to 6, of the tool, of the instrument and of
    set-ups.
    """
    parts = {BODY + 6 * body: np.asarray(xi) for body, xi in displacement.body.items()}
    others = {JOINT: displacement.joint, TOOL: displacement.tool, INSTRUMENT: displacement.instrument}
    others[SETUP] = displacement.setup
    return parts | {at: np.asarray(xi) for at, xi in others.items() if xi is not None}


def flat(parts: dict[int, Array], n: int, places: int) -> Array:
    """Write parts, as of `displacement_parts` or `load_parts`, into one array (n, places) that is zero elsewhere."""
    result = np.zeros((n, places))
    for at, part in parts.items():
        result[:, at : at + 6] = part
    return result


def plus(one: dict[int, Array], other: dict[int, Array], times: float = 1.0) -> dict[int, Array]:
    """Return one + times * other, in parts as of `displacement_parts` or `load_parts`; zero parts are left out."""
    both = {at: times * part + one.get(at, 0.0) for at, part in other.items()}
    return {at: part for at, part in (one | both).items() if part.any()}


def load_parts(load: Load) -> dict[int, Array]:
    """Return joint torques and body wrenches of a load in parts, (n, 6) each, by number of the first of their columns.

    The ``LOAD_PLACES`` columns are six of the joints, then six each of bodies 0 to 6 and the flange.
    """
    parts = {6 + 6 * body: wrench for body, wrench in load.body.items()}
    return parts if load.joint is None else {0: load.joint, **parts}
