"""Effects of external axes against closed forms: an arm on a track along x, and work on a table that turns about z."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from numpy.testing import assert_allclose

from postproc.effects.asking import displacement_of
from postproc.effects.base import State
from postproc.effects.example import example_arm
from postproc.effects.library.cell.external_axis_compliance import ExternalAxisCompliance
from postproc.effects.library.cell.external_axis_error import ExternalAxisError
from postproc.effects.library.cell.external_axis_frame import ExternalAxisFrame
from postproc.robot.cells.cell import Cell, CellArm, Joint, Unit
from postproc.robot.cells.station import Station

UP = 0.3
"""Height of the end of the example's pedestal [m]."""


def placed(x: float, y: float, z: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


TRACK = Unit("track", (Joint("track", "a", "linear", np.array([1.0, 0, 0])),), None, placed(0.5, 0, -0.4))
TABLE = Unit("table", (Joint("table", "b", "rotary"),), None, placed(1.0, 0, 0.5))
ARM = CellArm("robot", "", "track", placed(-0.5, 0, 0.4), np.array([0, 0, -9.81]))
STATION = Station(Cell({"track": TRACK, "table": TABLE}, {"robot": ARM}), "robot", ("track", "table"))


def at(a: float, b: float = 0.0, work: str = "", **channels: object) -> State:
    axes = np.full((1, 6), np.nan)
    axes[0, :2] = a, b
    return State(
        q=np.zeros((1, 6)), external_axes=axes, work=np.array([work]), station=STATION, robot=example_arm(), **channels
    )  # type: ignore[arg-type]


def moved(effect: object, state: State) -> np.ndarray:
    return np.asarray(displacement_of(effect, state).body.get(0, np.zeros((1, 6))))[0]  # type: ignore[arg-type]


def test_a_track_shifts_by_legendre_polynomials_that_vanish_at_zero() -> None:
    """On a travel of 0 to 2 m, 1.5 m are x = 0.5: B_1 = x + 1 and B_2 = ((3 x^2 - 1) / 2 - 1) / 2."""
    shift = np.zeros((1, 3, 3))
    shift[0, 1:] = [[0, 1e-4, 0], [0, 0, 2e-4]]
    effect = ExternalAxisError(functions=3, low=(0.0,), high=(2.0,), shift_m=shift)
    assert_allclose(moved(effect, at(1.5)), [0, 1.5e-4, 2e-4 * (-0.125 - 1) / 2, 0, 0, 0], atol=1e-18)
    assert_allclose(moved(effect, at(0.0)), 0)
    assert_allclose(moved(effect, at(9.0)), moved(effect, at(2.0)))  # beyond its travel it keeps the last value


def test_a_track_that_rolls_turns_the_pedestal_about_its_carriage() -> None:
    """The carriage stands 0.4 m below and 0.5 m before the base: a turn about x moves what is above it along -y."""
    effect = ExternalAxisError(functions=2, low=(0.0,), high=(2.0,), turn_rad=[[[1e-4, 0, 0], [0, 0, 0]]])
    assert_allclose(moved(effect, at(1.0)), [0, -1e-4 * (UP + 0.4), 0, 1e-4, 0, 0], atol=1e-8)


def test_a_table_that_strays_one_way_is_an_arm_that_strays_the_other_way() -> None:
    shift = np.zeros((1, 3, 3))
    shift[0, 1:] = [[1e-4, 0, 0], [0, 2e-4, 0]]
    effect = ExternalAxisError(axes=("b",), functions=3, low=(-pi,), high=(pi,), shift_m=shift)
    state = at(0.7, 0.6, "table")
    assert_allclose(moved(effect, state)[:3], [-1e-4 * sin(0.6), -2e-4 * (cos(0.6) - 1), 0], atol=1e-18)
    assert_allclose(moved(effect, at(0.7, 0.6)), 0)  # work that stands in the world does not see the table


def test_a_track_that_goes_another_way() -> None:
    angle, scale, way = 2e-3, 1e-4, 3.0
    effect = ExternalAxisFrame(turn_rad=[[0.5, 0, angle]], place_m=[[1.0, 2, 3]], scale_error=[scale])
    far = way * (1 + scale)
    straight = ExternalAxisFrame(turn_rad=[[0, 0, angle]], scale_error=[scale])
    assert_allclose(moved(straight, at(way)), [far * cos(angle) - way, far * sin(angle), 0, 0, 0, 0], atol=1e-15)
    assert_allclose(moved(effect, at(0.0)), 0, atol=1e-15)  # calibrated at zero
    rolled = ExternalAxisFrame(turn_rad=[[0.5, 0, 0]], place_m=[[0.01, 0.02, 0.03]])
    assert_allclose(moved(rolled, at(way)), 0, atol=1e-15)  # along a track a roll and a place change nothing


def test_a_table_that_turns_about_another_place() -> None:
    """About p in place of 0, work at e goes p - R p too far, and the arm the other way."""
    p, e = np.array([1e-3, -2e-3, 0.0]), 0.9
    R = np.array([[cos(e), -sin(e), 0], [sin(e), cos(e), 0], [0, 0, 1]])
    effect = ExternalAxisFrame(axes=("b",), place_m=[p])
    assert_allclose(moved(effect, at(0.0, e, "table")), [*(R @ p - p), 0, 0, 0], atol=1e-15)


def test_a_column_turns_about_its_foot_by_the_moment_there() -> None:
    """The foot stands at (0.5 - a, 0, -0.4) of a base at a: 5000 N down and 100 N m about y at the pedestal's end."""
    load = np.full((1, 7, 6), np.nan)
    load[0, 0] = [0, 0, -5000, 0, 100, 0]
    effect = ExternalAxisCompliance(tilt_rad_per_Nm=[[1e-8, 2e-8, 3e-8]])
    state = at(2.0, body_load=load, T_base_body=np.tile(np.eye(4), (1, 7, 1, 1)), joint_load=np.zeros((1, 6)))
    turn = 2e-8 * (100 + (2.0 - 0.5) * 5000)
    shift = np.array([cos(turn) - 1, 0, -sin(turn)]) * 1.5 + np.array([sin(turn), 0, cos(turn) - 1]) * (UP + 0.4)
    assert_allclose(moved(effect, state), [*shift, 0, turn, 0], atol=1e-12)


@pytest.mark.parametrize("e", [0.0, 0.4, -2.0])
def test_a_table_on_its_side_sags_by_the_weight_on_its_lever(e: float) -> None:
    """Work that is heavy along its own x, on an axis along the base's y: the table turns by s cos(e) about that axis."""
    lying = np.eye(4)
    lying[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    unit = Unit("table", (Joint("table", "b", "rotary"),), None, placed(1.0, 0, 0.5) @ lying)
    station = Station(Cell({"track": TRACK, "table": unit}, {"robot": ARM}), "robot", ("track", "table"))
    sag = np.zeros((1, 3, 3))
    sag[0, 2, 0] = 1e-4
    effect = ExternalAxisCompliance(axes=("b",), sag_rad=sag)
    bodies = np.tile(np.eye(4), (1, 7, 1, 1))
    state = at(0.0, e, "table", body_load=np.zeros((1, 7, 6)), T_base_body=bodies, joint_load=np.zeros((1, 6)))
    # x of the work points along (cos e, 0, -sin e); its weight, along -z, turns it about +y by its lever cos e.
    assert_allclose(moved(effect, state.with_(station=station))[3:], [0, -1e-4 * cos(e), 0], atol=1e-12)


@pytest.mark.parametrize(
    ("table", "code", "message"),
    [
        ({"axes": ["g"]}, "EFF024", "`axes` of `external_axis_error` names `g`, and external axes are called a to f"),
        ({"axes": ["a", "b"]}, "EFF022", "`low` of `external_axis_error` has one entry for each of `axes`: 2"),
        ({"functions": 1}, "EFF024", "`functions` of `external_axis_error` is 1"),
    ],
)
def test_a_table_of_a_model_file_is_checked(table: dict[str, object], code: str, message: str) -> None:
    first = ExternalAxisError.problems(table)[0]
    assert (first.code, first.message) == (code, message)


def test_an_axis_that_stood_still_is_not_looked_for() -> None:
    still = at(0.4).rows(np.zeros(5, dtype=int))
    for cls in (ExternalAxisError, ExternalAxisFrame, ExternalAxisCompliance):
        assert cls.variants(still) == ()
