"""Laws as curves, and the plainest sentence that describes one."""

from __future__ import annotations

import json

import numpy as np

from postproc import text as text_of
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.servo_lag import ServoLag
from postproc.effects.library.joints.wrist_coupling import WristCoupling
from postproc.identification.add import grown
from postproc.identification.diagnose import diagnose
from postproc.identification.joint_curves import curves
from postproc.results.diagnosis import diagnosis_values
from postproc.results.sentences import headline
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as library
from tests.independent import unknown_effects as unknown
from tests.independent.cells import Hidden, column


def wavy(q: np.ndarray) -> np.ndarray:
    return 2e-4 * np.sin(2 * q + 0.4) + 1.5e-4 * np.sin(5 * q + 1.0) + 1e-4 * np.sin(7 * q)


def wavy_joint(g, arm) -> Hidden:
    """Joint 3 is wrong by three waves."""
    return Hidden("wavy_joint", "joint_error_map", joint=lambda s, tau: column(2, wavy(s.q[:, 2])))


def bent(at: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Without its straight line, which offsets and lengths take up."""
    return values - np.polyval(np.polyfit(at, values, 1), at)


def test_a_map_is_told_as_the_curve_that_it_is():
    data, _ = cell(wavy_joint, seed=971, poses=200)
    found = diagnose(base_fit(data).model, data)
    entry = next(m for m in diagnosis_values(found)["missing"] if m["effect"] == "joint_error_map")
    law = {curve["joint"]: curve for curve in entry["law"]}[3]
    assert set(law) == {"joint", "channel", "unit", "at", "turn_mrad", "sigma_mrad"} and isinstance(law["joint"], int)
    assert (law["channel"], law["unit"]) == ("q3", "deg") and len(law["at"]) == len(law["turn_mrad"]) > 100
    at = np.radians(law["at"])
    off = 1e-3 * bent(at, np.array(law["turn_mrad"])) - bent(at, wavy(at))
    sigma = 1e-3 * np.array(law["sigma_mrad"])
    assert np.mean(np.abs(off) < 2 * sigma) > 0.85 and sigma.max() < 1e-4
    assert "joint 3 along q3: " in text_of(found)
    json.dumps(law, allow_nan=False)


def test_curves_are_told_of_what_follows_angles_alone():
    data, _ = cell(library.wrist_coupling, seed=973)
    told = list(curves(grown(base_fit(data), WristCoupling), "wrist_coupling"))
    assert {(c.joint, c.channel) for c in told} == {(5, "q4"), (6, "q4"), (6, "q5")}
    for curve in told:
        slope = np.ptp(curve.turn) / np.ptp(curve.at)
        assert 5e-5 < slope < 4e-4 and (curve.sigma > 0).any()
    assert not list(curves(base_fit(data), "joint_compliance"))
    assert not list(curves(base_fit(data), ServoLag.key))


def test_a_map_among_causes_is_no_cause_either():
    data, _ = cell(wavy_joint, library.backlash, seed=975, poses=200)
    found = diagnose(base_fit(data).model, data)
    assert {m.key for m in found.missing} == {"backlash", "joint_error_map"}
    assert "; a smooth correction, not a cause)" in headline(found)


def test_a_parabola_in_time_is_no_wave():
    data, _ = cell(unknown.quadratic_drift, seed=978)
    found = diagnose(base_fit(data).model, data)
    assert found.suspects[0].channel == "time"
    assert found.suspects[0].pattern.startswith("growing to either side of ")
    assert found.suspects[0].pattern.endswith(", with the square")


def test_the_map_of_a_module_moves_what_its_curve_says():
    """The curve is the effect's own displacement, whatever the basis."""
    data, _ = cell(wavy_joint, seed=971, poses=200)
    fit = grown(base_fit(data), JointErrorMap)
    effect = fit.model.effect("joint_error_map")
    for curve in curves(fit, "joint_error_map"):
        k = int(curve.channel[1:]) - 1
        q = np.tile(np.median(fit.data.state.q, axis=0), (len(curve.at), 1))
        q[:, k] = curve.at
        state = fit.data.state.rows(np.zeros(len(q), dtype=int)).with_(q=q)
        turn = effect.displacement(state)[:, curve.joint - 1]
        np.testing.assert_allclose(curve.turn, turn - turn.mean(), atol=1e-12)
