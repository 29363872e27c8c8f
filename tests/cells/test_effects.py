"""Programs on tracks and positioners that are not what the controller believes: the model holds it, and the path is kept.

The real cell is written in plain numpy from the equations that the effects state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.cells import world as W
from tests.cells.test_paths import ARM, FORCE, LIMIT, Case, axis, check, converted, positioner, track
from tests.independent import arm as A

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
RAIL = {"shift": [[0, 1e-4, -2e-4], [3e-4, -1e-4, 2e-4]], "turn": [[1e-4, -2e-4, 0], [0, 1e-4, 2e-4]]}
TABLE = {"shift": [[1e-4, 2e-4, 0], [2e-4, 1e-4, -1e-4]], "turn": [[1e-4, 0, 2e-4], [-1e-4, 2e-4, 3e-4]]}
TURN, PLACE, SCALE = np.array([0.3e-3, -0.8e-3, 1.1e-3]), np.array([0.6e-3, -0.9e-3, 0.4e-3]), 2e-4
TILT, SAG = np.array([0.8e-7, 1.5e-7, 0.5e-7]), np.array([[0.0] * 3, [0.0] * 3, [2e-4, -3e-4, 1e-4]])


def on_track() -> Case:
    return track(1500.0, 2700.0, 2300.0)


def on_table() -> tuple[Case, np.ndarray]:
    """Work on a table, and the frame (4, 4) in which the table turns."""
    case = positioner(20.0, -30.0, -55.0)
    return case, case.world.units["STN1"](np.zeros((1, 6)))[0]


def real(case: Case, **changes: object) -> Case:
    return replace(case, world=replace(case.world, real=replace(case.world, **changes)))


def stated(effect: str, letter: str, **keys: object) -> str:
    lines = "".join(f"{key} = {value}\n" for key, value in keys.items())
    return f'[effects.{effect}]\naxes = ["{letter}"]\n{lines}'


def strays(e: np.ndarray, low: float, high: float, size: dict[str, list[list[float]]]) -> np.ndarray:
    """(n, 4, 4) of positions in SI: the first two Legendre polynomials over the travel, x and (3 x^2 - 1) / 2 over two."""

    def functions(position: np.ndarray) -> np.ndarray:
        x = 2 * (position - low) / (high - low) - 1
        return np.stack([x, (3 * x**2 - 1) / 4], axis=-1)

    B = functions(e) - functions(np.zeros(1))
    return A.small(np.concatenate([B @ np.array(size["shift"]), B @ np.array(size["turn"])], axis=1))


def error(letter: str, low: float, high: float, size: dict[str, list[list[float]]]) -> str:
    shift, turn = ([[[0.0] * 3, *size[name]]] for name in ("shift", "turn"))
    return stated("external_axis_error", letter, functions=3, low=[low], high=[high], shift_m=shift, turn_rad=turn)


def crooked_track() -> tuple[Case, str]:
    case = on_track()
    base = W.after(case.world.base, lambda axes: strays(axes[:, 0] / 1e3, 0.0, 3.0, RAIL))
    return real(case, base=base), error("a", 0.0, 3.0, RAIL)


def crooked_table() -> tuple[Case, str]:
    case, place = on_table()

    def unit(axes: np.ndarray) -> np.ndarray:
        e = np.radians(axes[:, 1])
        return place @ strays(e, -1.5, 1.5, TABLE) @ A.transform(A.rotation(Z, e), np.zeros(3))

    return real(case, units={"STN1": unit}), error("b", -1.5, 1.5, TABLE)


def frame(letter: str) -> str:
    keys = {"place_m": [PLACE.tolist()], "turn_rad": [TURN.tolist()], "scale_error": [SCALE]}
    return stated("external_axis_frame", letter, **keys)


def askew(place: np.ndarray, motion: Callable[[np.ndarray], np.ndarray], letter: int) -> W.Place:
    """An axis that moves in a frame beside the stated one, and farther than it is told to."""
    C = place @ A.transform(A.rotation_vector(TURN), PLACE)
    return lambda axes: C @ motion(axes[:, letter] * (1 + SCALE)) @ np.linalg.inv(C) @ place


def askew_track() -> tuple[Case, str]:
    slide = askew(np.eye(4), lambda e: A.transform(np.eye(3), e[:, None] / 1e3 * X), 0)
    return real(on_track(), base=slide), frame("a")


def askew_table() -> tuple[Case, str]:
    case, place = on_table()
    turn = askew(place, lambda e: A.transform(A.rotation(Z, np.radians(e)), np.zeros(3)), 1)
    return real(case, units={"STN1": turn}), frame("b")


def compliance(letter: str, tilt: np.ndarray, sag: np.ndarray) -> str:
    return stated("external_axis_compliance", letter, tilt_rad_per_Nm=[tilt.tolist()], sag_rad=[sag.tolist()])


def leaning_column() -> tuple[Case, str]:
    """The track's foot stands 0.7 m below and beside the base: weights and the process force turn it about that point."""
    foot = np.array([-0.3, 0.4, -0.7])

    def leans(axes: np.ndarray, base: np.ndarray, now: np.ndarray, f: A.Frames, load: A.Load) -> np.ndarray:
        moment = np.zeros((len(axes), 3))
        for _, point, push, _ in A.dead_loads(ARM, f, load).parts:
            at = now[:, :3, 3] + (now[:, :3, :3] @ point[:, :, None])[:, :, 0]
            moment += np.cross(at - foot, (now[:, :3, :3] @ push[:, :, None])[:, :, 0])
        about = A.transform(np.eye(3), foot)
        return about @ A.transform(A.rotation_vector(TILT * moment), np.zeros(3)) @ np.linalg.inv(about) @ base

    axes = axis("a", "linear", "robot", unit='"TRACK_1"', xyz_mm=(1e3 * foot).tolist())
    return replace(real(on_track(), leans=leans), axes=axes), compliance("a", TILT, np.zeros((3, 3)))


def sagging_table() -> tuple[Case, str]:
    """The work's weight turns the table about its own axis, and the reaction to the process force tilts it."""
    case, place = on_table()

    def leans(axes: np.ndarray, base: np.ndarray, now: np.ndarray, f: A.Frames, load: A.Load) -> np.ndarray:
        turn = place[:3, :3] @ A.rotation(Z, np.radians(axes[:, 1]))
        weight = np.cross(np.swapaxes(turn, 1, 2), [0.0, 0.0, -1.0]) @ place[:3, :3]
        push = np.broadcast_to(-load.force, (len(axes), 3))
        reaction = np.cross(f.tcp[:, :3, 3] - place[:3, 3], push) @ place[:3, :3]
        vector = np.einsum("ij,nji->ni", SAG, weight) + 20 * TILT * reaction
        # A work that turns one way is a base that turns the other way about the same place.
        return place @ np.linalg.inv(A.transform(A.rotation_vector(vector), np.zeros(3))) @ np.linalg.inv(place) @ base

    return real(case, leans=leans), compliance("b", 20 * TILT, SAG)


CELLS = (crooked_track, crooked_table, askew_track, askew_table, leaning_column, sagging_table)


@pytest.mark.parametrize("cell", CELLS, ids=lambda c: c.__name__)
def test_a_program_goes_where_it_should_on_the_real_cell(cell: Callable[[], tuple[Case, str]]) -> None:
    case, effect = cell()
    result = converted(replace(case, axes=effect + case.axes), force=FORCE)
    assert result.output is not None, [str(d) for d in result.diagnostics]
    kept = check(case, result.output.decode())
    assert not kept.problems and kept.after <= LIMIT
    # What the effect moves is no small matter: on a cell as the controller believes it the same program is wrong.
    assert check(case, result.output.decode(), replace(case.world, real=None)).after > 3 * LIMIT


def test_an_effect_of_an_axis_that_nobody_describes_is_left_out_and_said() -> None:
    case = track(1500.0, 1500.0, 1500.0)
    result = converted(replace(case, axes=frame("c") + case.axes))
    (message,) = [d.message for d in result.diagnostics if d.code == "CMP016"]
    assert "`external_axis_frame` speaks of `eax_c`, and nobody says what carries the arm" in message
    assert result.output is not None
