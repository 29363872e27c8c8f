"""Effects of external axes against closed forms: an arm on a track along x, and work on a table that turns about z."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest
from numpy.testing import assert_allclose

from postproc.effects.asking import displacement_of
from postproc.effects.base import State
from postproc.effects.conformance.example import example_arm
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


# The carriage stands 0.4 m below and 0.5 m before the base.
TRACK = Unit("track", (Joint("track", "a", "linear", np.array([1.0, 0, 0])),), None, placed(0.5, 0, -0.4))
TABLE = Unit("table", (Joint("table", "b", "rotary"),), None, placed(1.0, 0, 0.5))
ARM = CellArm("robot", "", "track", placed(-0.5, 0, 0.4), np.array([0, 0, -9.81]))
BODIES = np.tile(np.eye(4), (1, 7, 1, 1))


def at(a: float, b: float = 0.0, work: str = "", table: Unit = TABLE, load: np.ndarray | None = None) -> State:
    """One state at these places of the axes, with this force and moment at the end of the pedestal."""
    axes, body_load = np.full((1, 6), np.nan), np.zeros((1, 7, 6))
    axes[0, :2] = a, b
    body_load[0, 0] = 0 if load is None else load
    station = Station(Cell({"track": TRACK, "table": table}, {"robot": ARM}), "robot", ("track", "table"))
    known = {"external_axes": axes, "work": np.array([work]), "station": station, "robot": example_arm()}
    return State(np.zeros((1, 6)), body_load=body_load, T_base_body=BODIES, joint_load=np.zeros((1, 6)), **known)


def rows(**entries: list[float]) -> np.ndarray:
    """(1, 3, 3) with some rows: `s1` is the second."""
    array = np.zeros((1, 3, 3))
    for name, value in entries.items():
        array[0, int(name[1])] = value
    return array


def turned(p: np.ndarray, e: float) -> np.ndarray:
    return np.array([[cos(e), -sin(e), 0], [sin(e), cos(e), 0], [0, 0, 1]]) @ p


# On a travel of 0 to 2 m, 1.5 m are x = 0.5: B_1 = x + 1 and B_2 = ((3 x^2 - 1) / 2 - 1) / 2.
STRAYS = ExternalAxisError(functions=3, low=(0.0,), high=(2.0,), shift_m=rows(s1=[0, 1e-4, 0], s2=[0, 0, 2e-4]))
ROLLS = ExternalAxisError(functions=2, low=(0.0,), high=(2.0,), turn_rad=[[[1e-4, 0, 0], [0, 0, 0]]])
WAVES = ExternalAxisError(
    axes=("b",), functions=3, low=(-pi,), high=(pi,), shift_m=rows(s1=[1e-4, 0, 0], s2=[0, 2e-4, 0])
)
ASKEW = ExternalAxisFrame(turn_rad=[[0, 0, 2e-3]], scale_error=[1e-4])
FAR = 3.0 * (1 + 1e-4)
ELSEWHERE = np.array([1e-3, -2e-3, 0.0])
# 5000 N down and 100 N m about y at the pedestal's end; the foot stands at (0.5 - a, 0, -0.4) of a base at a.
COLUMN = ExternalAxisCompliance(tilt_rad_per_Nm=[[1e-8, 2e-8, 3e-8]])
LEAN = 2e-8 * (100 + (2.0 - 0.5) * 5000)


@pytest.mark.parametrize(
    ("effect", "state", "expected"),
    [
        (STRAYS, at(1.5), [0, 1.5e-4, 2e-4 * (-0.125 - 1) / 2, 0, 0, 0]),
        (STRAYS, at(0.0), [0] * 6),
        (STRAYS, at(9.0), [0, 2e-4, 0, 0, 0, 0]),  # beyond its travel it keeps the last value
        (ROLLS, at(1.0), [0, -1e-4 * (UP + 0.4), 0, 1e-4, 0, 0]),
        # A table that strays one way is an arm that strays the other way; work in the world does not see the table.
        (WAVES, at(0.7, 0.6, "table"), [-1e-4 * sin(0.6), -2e-4 * (cos(0.6) - 1), 0, 0, 0, 0]),
        (WAVES, at(0.7, 0.6), [0] * 6),
        (ASKEW, at(3.0), [FAR * cos(2e-3) - 3.0, FAR * sin(2e-3), 0, 0, 0, 0]),
        # Calibrated at zero; along a track a roll and a place change nothing.
        (replace(ASKEW, turn_rad=[[0.5, 0, 2e-3]], place_m=[[1.0, 2, 3]]), at(0.0), [0] * 6),
        (ExternalAxisFrame(turn_rad=[[0.5, 0, 0]], place_m=[[0.01, 0.02, 0.03]]), at(3.0), [0] * 6),
        # About p in place of 0, work at e goes p - R p too far, and the arm the other way.
        (
            ExternalAxisFrame(axes=("b",), place_m=[ELSEWHERE]),
            *(at(0.0, 0.9, "table"), [*(turned(ELSEWHERE, 0.9) - ELSEWHERE), 0, 0, 0]),
        ),
        (
            COLUMN,
            at(2.0, load=np.array([0, 0, -5000, 0, 100, 0])),
            [
                1.5 * (cos(LEAN) - 1) + (UP + 0.4) * sin(LEAN),
                *(0, (UP + 0.4) * (cos(LEAN) - 1) - 1.5 * sin(LEAN), 0, LEAN, 0),
            ],
        ),
    ],
)
def test_an_axis_moves_the_pedestal_as_its_formula_says(effect, state, expected) -> None:
    moved = displacement_of(effect, state).body.get(0, np.zeros((1, 6)))
    assert_allclose(moved[0], expected, atol=1e-8 if effect is ROLLS else 1e-12)


@pytest.mark.parametrize("e", [0.0, 0.4, -2.0])
def test_a_table_on_its_side_sags_by_the_weight_on_its_lever(e: float) -> None:
    """Work that is heavy along its x, on an axis along the base's y: the table turns by s cos(e) about that axis."""
    lying = np.eye(4)
    lying[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    state = at(0.0, e, "table", Unit("table", TABLE.joints, None, placed(1.0, 0, 0.5) @ lying))
    effect = ExternalAxisCompliance(axes=("b",), sag_rad=rows(s2=[1e-4, 0, 0]))
    # x of the work points along (cos e, 0, -sin e); its weight, along -z, turns it about +y by its lever cos e.
    assert_allclose(displacement_of(effect, state).body[0][0, 3:], [0, -1e-4 * cos(e), 0], atol=1e-12)


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


@pytest.mark.parametrize("cls", [ExternalAxisError, ExternalAxisFrame, ExternalAxisCompliance])
def test_an_axis_that_stood_still_is_not_looked_for(cls: type[ExternalAxisError]) -> None:
    assert cls.variants(at(0.4).rows(np.zeros(5, dtype=int))) == ()
