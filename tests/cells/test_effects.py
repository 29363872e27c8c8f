"""Programs on tracks and positioners that are not what the controller believes: the model holds it, and the path is kept.

The real cell is written in plain numpy from the equations that the effects state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.cells import world as W
from tests.cells.test_paths import ARM, FORCE, LIMIT, Case, axis, converted, positioner, track
from tests.independent import arm as A

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
RAIL = {"shift": [[0, 1e-4, -2e-4], [3e-4, -1e-4, 2e-4]], "turn": [[1e-4, -2e-4, 0], [0, 1e-4, 2e-4]]}
TABLE = {"shift": [[1e-4, 2e-4, 0], [2e-4, 1e-4, -1e-4]], "turn": [[1e-4, 0, 2e-4], [-1e-4, 2e-4, 3e-4]]}


def strays(e: np.ndarray, low: float, high: float, size: dict[str, list[list[float]]]) -> np.ndarray:
    """(n, 4, 4) of positions in SI: the first two Legendre polynomials over the travel, x and (3 x^2 - 1) / 2 over two."""

    def functions(position: np.ndarray) -> np.ndarray:
        x = 2 * (position - low) / (high - low) - 1
        return np.stack([x, (3 * x**2 - 1) / 4], axis=-1)

    B = functions(e) - functions(np.zeros(1))
    return A.small(np.concatenate([B @ np.array(size["shift"]), B @ np.array(size["turn"])], axis=1))


def error(letter: str, low: float, high: float, size: dict[str, list[list[float]]]) -> str:
    shift, turn = ([[[0.0] * 3, *size[name]]] for name in ("shift", "turn"))
    keys = f'axes = ["{letter}"]\nfunctions = 3\nlow = [{low}]\nhigh = [{high}]\nshift_m = {shift}\nturn_rad = {turn}\n'
    return f"[effects.external_axis_error]\n{keys}"


def crooked_track() -> tuple[Case, str]:
    case = track(1500.0, 2700.0, 2300.0)
    base = W.after(case.world.base, lambda axes: strays(axes[:, 0] / 1e3, 0.0, 3.0, RAIL))
    return real(case, base=base), error("a", 0.0, 3.0, RAIL)


def crooked_table() -> tuple[Case, str]:
    case = positioner(20.0, -30.0, -55.0)
    place = case.world.units["STN1"](np.zeros((1, 6)))[0]

    def unit(axes: np.ndarray) -> np.ndarray:
        e = np.radians(axes[:, 1])
        return place @ strays(e, -1.5, 1.5, TABLE) @ A.transform(A.rotation(Z, e), np.zeros(3))

    return real(case, units={"STN1": unit}), error("b", -1.5, 1.5, TABLE)


TURN, PLACE, SCALE = np.array([0.3e-3, -0.8e-3, 1.1e-3]), np.array([0.6e-3, -0.9e-3, 0.4e-3]), 2e-4


def frame(letter: str) -> str:
    keys = f"place_m = [{PLACE.tolist()}]\nturn_rad = [{TURN.tolist()}]\nscale_error = [{SCALE}]\n"
    return f'[effects.external_axis_frame]\naxes = ["{letter}"]\n{keys}'


def askew(letter: int, place: np.ndarray, kind: str) -> W.Place:
    C = place @ A.transform(A.rotation_vector(TURN), PLACE)

    def end(axes: np.ndarray) -> np.ndarray:
        e = axes[:, letter] * (1 + SCALE)
        turn = A.rotation(Z, np.radians(e))
        move = A.transform(np.eye(3), e[:, None] / 1e3 * X) if kind == "linear" else A.transform(turn, np.zeros(3))
        return C @ move @ np.linalg.inv(C) @ place

    return end


def askew_track() -> tuple[Case, str]:
    case = track(1500.0, 2700.0, 2300.0)
    return real(case, base=askew(0, np.eye(4), "linear")), frame("a")


def askew_table() -> tuple[Case, str]:
    case = positioner(20.0, -30.0, -55.0)
    place = case.world.units["STN1"](np.zeros((1, 6)))[0]
    return real(case, units={"STN1": askew(1, place, "rotary")}), frame("b")


TILT, SAG = np.array([0.8e-7, 1.5e-7, 0.5e-7]), np.array([[0.0] * 3, [0.0] * 3, [2e-4, -3e-4, 1e-4]])


def leaning_column() -> tuple[Case, str]:
    """The track's foot stands 0.7 m below and beside the base: weights and the process force turn it about that point."""
    case = track(1500.0, 2700.0, 2300.0)
    foot = np.array([-0.3, 0.4, -0.7])

    def leans(axes: np.ndarray, base: np.ndarray, now: np.ndarray, f: A.Frames, load: A.Load) -> np.ndarray:
        moment = np.zeros((len(axes), 3))
        for _, point, push, _ in A.dead_loads(ARM, f, load).parts:
            there = now[:, :3, 3] + (now[:, :3, :3] @ point[:, :, None])[:, :, 0]
            moment += np.cross(there - foot, (now[:, :3, :3] @ push[:, :, None])[:, :, 0])
        about = A.transform(np.eye(3), foot)
        return about @ A.transform(A.rotation_vector(TILT * moment), np.zeros(3)) @ np.linalg.inv(about) @ base

    axes = axis("a", "linear", "robot", unit='"TRACK_1"', xyz_mm=(1e3 * foot).tolist())
    keys = f'axes = ["a"]\ntilt_rad_per_Nm = [{TILT.tolist()}]\nsag_rad = [{np.zeros((3, 3)).tolist()}]\n'
    return replace(real(case, leans=leans), axes=axes), f"[effects.external_axis_compliance]\n{keys}"


def sagging_table() -> tuple[Case, str]:
    """The work's weight turns the table about its own axis, and the reaction to the process force tilts it."""
    case = positioner(20.0, -30.0, -55.0)
    place = case.world.units["STN1"](np.zeros((1, 6)))[0]

    def leans(axes: np.ndarray, base: np.ndarray, now: np.ndarray, f: A.Frames, load: A.Load) -> np.ndarray:
        turn = place[:3, :3] @ A.rotation(Z, np.radians(axes[:, 1]))
        weight = np.cross(np.swapaxes(turn, 1, 2), [0.0, 0.0, -1.0]) @ place[:3, :3]
        sag = np.einsum("ij,nji->ni", SAG, weight)
        push = np.broadcast_to(-load.force, (len(axes), 3))
        reaction = np.cross(f.tcp[:, :3, 3] - place[:3, 3], push) @ place[:3, :3]
        moved = A.transform(A.rotation_vector(sag + 20 * TILT * reaction), np.zeros(3))
        # A work that turns one way is a base that turns the other way about the same place.
        return place @ np.linalg.inv(moved) @ np.linalg.inv(place) @ base

    keys = f'axes = ["b"]\ntilt_rad_per_Nm = [{(20 * TILT).tolist()}]\nsag_rad = [{SAG.tolist()}]\n'
    return real(case, leans=leans), f"[effects.external_axis_compliance]\n{keys}"


def real(case: Case, **changes: object) -> Case:
    return replace(case, world=replace(case.world, real=replace(case.world, **changes)))


CELLS = (crooked_track, crooked_table, askew_track, askew_table, leaning_column, sagging_table)


@pytest.mark.parametrize("cell", CELLS, ids=lambda c: c.__name__)
def test_a_program_goes_where_it_should_on_the_real_cell(cell: Callable[[], tuple[Case, str]]) -> None:
    case, effect = cell()
    result = converted(replace(case, axes=effect + case.axes), force=FORCE)
    assert result.output is not None, [str(d) for d in result.diagnostics]
    found = W.check(case.text, result.output.decode(), case.world, ARM, np.array(FORCE))
    assert not found.problems and found.after <= LIMIT
    # What the effect moves is no small matter: on a cell as the controller believes it the same program is wrong.
    believed = replace(case.world, real=None)
    assert W.check(case.text, result.output.decode(), believed, ARM, np.array(FORCE)).after > 3 * LIMIT


def test_an_effect_of_an_axis_that_nobody_describes_is_left_out_and_told() -> None:
    case = track(1500.0, 1500.0, 1500.0)
    result = converted(replace(case, axes=frame("c") + case.axes))
    told = [d.message for d in result.diagnostics if d.code == "CMP016"]
    assert told and "`external_axis_frame` speaks of `eax_c`, and nobody says what carries the arm" in told[0]
    assert result.output is not None
