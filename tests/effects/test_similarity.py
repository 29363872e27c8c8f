"""Ordinary sizes on arms of other mass and length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.effects.registry import effect_library
from postproc.effects.similarity import dimensions, ordinary_sizes
from postproc.robot.catalogue import load_robot

ARM = load_robot("irb4600_60_205")
HALF = ARM.link * np.where(np.arange(4) == 3, 0.5, 1.0) + np.diag([0, 0, 0, 0.5])
SMALL = replace(ARM, mass=ARM.mass / 10, link=HALF)


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        *(("rad/(N m)", (-1, -1)), ("1/(N m^2)", (-1, -2)), ("N/m", (1, -1)), ("kg m", (1, 1))),
        *(("kg", (1, 0)), ("rad/K", (0, 0)), ("m/s", (0, 1)), ("1", (0, 0))),
    ],
)
def test_powers_of_mass_and_length_in_a_unit(unit, powers):
    assert dimensions(unit) == powers


@pytest.mark.parametrize(
    ("key", "factor"),
    [
        *(("bearing_tilt", 20.0), ("link_compliance", 40.0), ("gravity_compensator", 1 / 20)),
        *(("backlash", 1.0), ("thermal_growth", 1.0), ("link_geometry", 1.0), ("servo_lag", 1.0)),
    ],
)
def test_an_arm_of_a_tenth_of_the_mass_at_half_the_length_is_so_much_softer_and_carries_so_much_less(key, factor):
    effect = effect_library()[key].null()
    assert ordinary_sizes(effect, SMALL)[0] / ordinary_sizes(effect, ARM)[0] == pytest.approx(factor)


def test_an_arm_whose_masses_nobody_states_weighs_the_cube_of_its_length():
    """As a share of an arm of 320 kg whose links are 2.3 m long in all."""
    load, length = effect_library()["arm_load"].null(), np.linalg.norm(HALF[1:, :3, 3], axis=1).sum() / 2.3
    unstated = ordinary_sizes(load, replace(ARM, mass=np.zeros(7), link=HALF))
    assert unstated[0] / load.scale()[0] == pytest.approx(length**3)
