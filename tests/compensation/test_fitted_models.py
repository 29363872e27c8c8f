"""A fitted model in a conversion: what of it holds for the program, and how accurate the result can be expected to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.judgement.accuracy import WITHIN_95
from postproc.diagnostics import Source
from postproc.model.arm import Model
from postproc.model.file import parse_model
from postproc.rapid.data.records import RobTarget
from tests.build import arm, codes, convert, events, module, places, target, written

TEXT = module(
    f"CONST robtarget p1:={target(1350, -500)};\nCONST robtarget p2:={target(1350, -100)};",
    "MoveJ p1,v200,fine,tT;\nMoveL p2,v50,fine,tT;",
)
NO_FORCE = (0.0, 0.0, 0.0)
ZEROS = "[0, 0, 0, 0, 0, 0]"


def model(text: str) -> Model:
    return parse_model(Source("arm.toml", f'robot = "irb4600_60_205"\n{text}'.encode()))


def shift(found: Conversion) -> np.ndarray:
    """How far the first goal was moved [mm], in base axes."""
    return np.subtract(places(written(found))[0], places(TEXT)[0])


def test_the_instruments_frame_is_not_the_arms_business() -> None:
    """Where the tracker believes the base to be moves no target."""
    frame = "[effects.instrument_frame]\nshift_m = [0.8, -1.2, 0.3]\nturn_rad = [0, 0, 0.4]\n"
    offset = "[effects.joint_offset]\noffset_rad = [0.0005, 0, 0, 0, 0, 0]\n"
    both, alone = (convert(TEXT, model(text), force=NO_FORCE) for text in (offset + frame, offset))
    assert np.abs(shift(both) - shift(alone)).max() < 1e-9
    assert np.linalg.norm(shift(alone)) == pytest.approx(0.5 * np.hypot(1.35, 0.5), abs=2e-3)


def test_the_error_of_another_tool_is_left_out_and_said() -> None:
    offset = "[effects.joint_offset]\noffset_rad = [0.0005, 0, 0, 0, 0, 0]\n"
    found = convert(TEXT, model(offset + "[effects.tool_frame]\nshift_m = [0.001, 0, 0]\n"), force=NO_FORCE)
    assert "CMP011" in codes(found)
    assert "tT" in next(d.message for d in found.diagnostics if d.code == "CMP011")
    assert np.abs(shift(found) - shift(convert(TEXT, model(offset), force=NO_FORCE))).max() < 1e-9


@pytest.mark.parametrize(
    "text",
    [
        "[tool]\nxyz_mm = [0, 0, 350]\n[effects.tool_frame]\nshift_m = [0.001, 0, 0]\n",
        "[effects.tool_frame]\nshift_m = [0.001, 0, 0.350]\n",  # fitted from tool0, as `fit` writes it
    ],
)
def test_the_error_of_the_measured_tool_is_corrected(text: str) -> None:
    """The TCP lies 1 mm off along the tool's own x axis: the command moves by 1 mm against it."""
    found = convert(TEXT, model(text), force=NO_FORCE)
    assert "1.00 mm" in next(d.message for d in found.diagnostics if d.code == "CMP011")
    goal = events(TEXT)[0].target
    assert isinstance(goal, RobTarget)
    w, x, y, z = np.array(goal.rot) / np.linalg.norm(goal.rot)
    x_axis = np.array([w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)])
    assert shift(found) == pytest.approx(-x_axis, abs=1e-3)


def test_nothing_is_claimed_where_nothing_was_measured() -> None:
    found = convert(TEXT)
    assert found.report["expected_accuracy"] is None
    assert not {"CMP010", "CMP011"} & set(codes(found))


def fitted(sigma_rad: float, unexplained_mm: float, low: float = -3.0) -> Model:
    names = [f"joint_offset.{n}" for n in model(f"[effects.joint_offset]\noffset_rad = {ZEROS}\n").effects[0].names()]
    fit = {
        "parameters": names[:1],
        "covariance": [[sigma_rad**2]],
        "unexplained_mm": unexplained_mm,
        "range": {"q1": [low, 3.0]},
    }
    return replace(model("[effects.joint_offset]\noffset_rad = [0.0005, 0, 0, 0, 0, 0]\n"), fit=fit)


def test_expected_accuracy_in_closed_form() -> None:
    """An offset of axis 1 known to sigma moves the TCP by sigma times its distance from the axis."""
    found = convert(TEXT, fitted(2e-5, 0.05), force=NO_FORCE)
    reach = np.array([np.hypot(1350, 500), np.hypot(1350, 100)])
    each = np.sqrt(((2e-5 * reach) ** 2 + 3 * 0.05**2) / 3)
    claim = found.report["expected_accuracy"]
    assert claim["sigma_mm"] == pytest.approx(np.sqrt(np.mean(each**2)), rel=2e-3)
    assert claim["within_95_percent_mm"] == pytest.approx(2.796 * each.max(), rel=2e-3)


def test_95_percent_of_a_normal_error_in_space() -> None:
    """The distance of three independent normal errors of deviation 1 stays below the factor in 95 of 100 cases."""
    drawn = np.linalg.norm(np.random.default_rng(4).normal(size=(200_000, 3)), axis=1)
    assert np.mean(drawn < WITHIN_95) == pytest.approx(0.95, abs=0.002)


def test_outside_the_measured_range() -> None:
    """The program turns axis 1 below -20 deg; the model was measured down to -10 deg only."""
    found = convert(TEXT, fitted(2e-5, 0.05, low=np.radians(-10)), force=NO_FORCE)
    warning = next(d for d in found.diagnostics if d.code == "CMP010")
    assert "joint 1" in warning.message and "-10.0" in warning.message
    assert found.exit_code == 0
    assert "CMP010" not in codes(convert(TEXT, fitted(2e-5, 0.05), force=NO_FORCE))


def test_the_shipped_model_needs_no_measurement() -> None:
    assert arm().fit == {}
