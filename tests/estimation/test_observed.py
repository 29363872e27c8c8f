"""Tables of joint encoders alone: the same commands, figures in mrad, what is hidden is named (own numpy tables)."""

import json
from functools import cache

import numpy as np
import pytest

import postproc
from postproc import text as text_of
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.identification.diagnose import diagnose
from postproc.identification.predict import predict_rows
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.results.diagnosis import diagnosis_values
from postproc.results.fit import fit_values
from postproc.robot.catalogue import load_robot
from tests.estimation.encoders import KINDS, NOISE_RAD, encoder_table

ARM = load_robot("irb4600_60_205")
BASE = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")


@cache
def fitted(kind: str, seed: int = 0, joints: int = 6):
    data = read_measurements(encoder_table(kind, seed, joints=joints), ARM)
    return fit_model(Model(ARM), data, [effect_library()[key].null() for key in BASE])


@cache
def diagnosed(kind: str, seed: int = 0, joints: int = 6):
    base = fitted(kind, seed, joints)
    return diagnose(base.model, base.data)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", KINDS)
def test_what_encoders_show_is_named(kind, seed):
    found = diagnosed(kind, seed)
    names = [m.key for m in found.missing]
    assert (found.verdict, names) == (("complete", []) if kind == "nothing" else ("missing", [kind]))
    assert found.final.held_out_rms == pytest.approx(NOISE_RAD, rel=0.15)


def test_figures_are_in_mrad_and_keys_say_so():
    base = fitted("servo_lag")
    assert 2e-4 < base.rms < 3e-3 and base.noise.sigma == pytest.approx(NOISE_RAD, rel=0.25)
    document = fit_values(base)
    assert document["rms_mrad"] == pytest.approx(1e3 * base.rms, abs=1e-6) and document["observed"] == "joint"
    assert not [key for key in document if key.endswith("_mm") and key != "unexplained_mm"]
    assert " mrad per joint" in text_of(base)
    found = diagnosed("servo_lag", 0)
    document = diagnosis_values(found)
    assert {"rms_mrad", "noise_mrad", "bound_mrad"} <= document.keys() and "rms_mm" not in document
    text = text_of(found)
    assert "mrad per joint" in text and " mm" not in text.splitlines()[0]
    beside = compare(base.model, base.data)
    assert set(postproc.document(beside)["per_joint_mrad"]) == set("123456") and "mrad" in text_of(beside)
    json.dumps(postproc.document(beside), allow_nan=False)


def test_add_shows_the_error_of_the_joints_fall():
    base = fitted("servo_lag")
    found = add_effects(base.model, base.data, ["servo_lag"])
    assert found.before.held_out_rms > 1e-4 and found.fit.held_out_rms < 1.2 * NOISE_RAD
    assert text_of(found).startswith("On rows that the fit has not seen, the error falls from")
    assert postproc.document(found)["ladder"][1]["held_out_rms_mrad"] < 0.01
    assert found.model.fit["rms_mrad"] < 0.01


def test_three_encoders_are_enough():
    base = fitted("backlash", seed=3, joints=3)
    assert base.data.joint is not None and np.isnan(base.data.joint[:, 3:]).all()
    found = diagnosed("backlash", seed=3, joints=3)
    assert found.base.observed.unit == "mrad"
    assert found.final.held_out_rms == pytest.approx(NOISE_RAD, rel=0.15)


def test_a_model_of_encoders_predicts_the_pose_with_its_uncertainty():
    base = fitted("nothing")
    told = predict_rows(recorded_model(base), base.data)
    assert np.isfinite(told.position).all() and np.isfinite(told.sigma).all()
