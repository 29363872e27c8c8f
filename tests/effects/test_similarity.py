"""Ordinary sizes on arms of other mass and length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.effects.registry import effect_library
from postproc.effects.similarity import dimensions, ordinary_sizes, size
from postproc.robot.catalogue import load_robot


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("rad/(N m)", (-1, -1)),
        ("1/(N m^2)", (-1, -2)),
        ("N/m", (1, -1)),
        ("kg m", (1, 1)),
        ("kg", (1, 0)),
        ("rad/K", (0, 0)),
        ("m/s", (0, 1)),
        ("1", (0, 0)),
    ],
)
def test_powers_of_mass_and_length_in_a_unit(unit, powers):
    assert dimensions(unit) == powers


def test_an_arm_of_a_tenth_of_the_weight_is_ordinarily_so_much_softer_and_carries_so_much_less():
    arm = load_robot("irb4600_60_205")
    small = replace(arm, mass=arm.mass / 10, link=_shorter(arm.link, 2.0))
    library = effect_library()
    for key, power in (("bearing_tilt", 20.0), ("link_compliance", 40.0), ("gravity_compensator", 1 / 20)):
        effect = library[key].null()
        ratio = (ordinary_sizes(effect, small) / ordinary_sizes(effect, arm))[0]
        assert ratio == pytest.approx(power), key
    for key in ("backlash", "thermal_growth", "link_geometry", "servo_lag"):
        effect = library[key].null()
        np.testing.assert_array_equal(ordinary_sizes(effect, small), ordinary_sizes(effect, arm))


def test_an_arm_whose_masses_nobody_states_weighs_what_a_similar_one_does():
    arm = load_robot("irb4600_60_205")
    mass, length = size(replace(arm, mass=np.zeros(7), link=_shorter(arm.link, 2.0)))
    assert mass == pytest.approx(length**3)


def _shorter(link, factor):
    found = link.copy()
    found[:, :3, 3] /= factor
    return found
