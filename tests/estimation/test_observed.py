"""Tables of joint encoders alone: the same commands, figures in mrad, what is hidden is named.

The encoders see the commanded angle, a zero error of each joint, what is hidden, and noise of their own: plain numpy.
"""

import json
from functools import cache

import numpy as np
import pytest

import postproc
from postproc import text as text_of
from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.identification.diagnose import diagnose
from postproc.identification.diagnosis import Diagnosis
from postproc.identification.predict import predict_rows
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.robot.catalogue import load_robot
from tests.identification.cells import BASE

ARM = load_robot("irb4600_60_205")
LOW, HIGH = np.array([-100, -40, -50, -170, -100, -170.0]), np.array([100, 70, 50, 170, 100, 170.0])
NOISE_RAD = 5e-6
KINDS = ("nothing", "servo_lag", "backlash", "transmission_error")
"""What may be hidden, by the keys of the library."""


def hidden(kind: str, g: np.random.Generator, q: np.ndarray, v: np.ndarray, side: np.ndarray) -> np.ndarray:
    """(n, 6) error of each joint [rad]: a lag of 1 to 3 ms, gaps of 60 to 200 microradian, one wave of a gear."""
    error = np.zeros_like(q)
    if kind == "servo_lag":
        error = -g.uniform(1e-3, 3e-3, 6) * v
    elif kind == "backlash":
        two = g.choice(6, 2, replace=False)
        error[:, two] = -g.uniform(60e-6, 200e-6, 2) * side[:, two]
    elif kind == "transmission_error":
        j, order = int(g.integers(6)), int(g.integers(2, 9))
        error[:, j] = g.uniform(80e-6, 250e-6) * np.sin(order * q[:, j] + g.uniform(0, 6.28))
    return error


def encoder_table(kind: str, seed: int, joints: int = 6) -> Source:
    """A table of 120 poses, 10 of them three times, with ``mq1_deg`` .. and no position.

    Args:
        joints: so many of them are measured, from the first on.
    """
    g = np.random.default_rng([seed, KINDS.index(kind)])
    index = np.concatenate([np.arange(120), np.repeat(np.arange(10), 2)])
    q, v = np.radians(g.uniform(LOW, HIGH, (120, 6)))[index], np.radians(g.uniform(-60, 60, (120, 6)))[index]
    side = g.choice([-1.0, 1.0], (120, 6))[index]
    zero = g.normal(0, 5e-4, 6)
    mq = q + zero + hidden(kind, g, q, v, side) + g.normal(0, NOISE_RAD, q.shape)
    columns = {"q{}_deg": np.degrees(q), "mq{}_deg": np.degrees(mq[:, :joints]), "dir{}": side}
    columns |= {"v{}_deg_s": np.degrees(v)} if kind in ("servo_lag", "nothing") else {}
    names = [name.format(j + 1) for name, values in columns.items() for j in range(values.shape[1])]
    lines = [",".join(["pose_id", *names])]
    for k, row in zip(index, np.hstack([*columns.values()]), strict=True):
        lines.append(",".join([f"P{k:03d}", *(f"{x:.7f}" for x in row)]))
    return Source("encoders.csv", "\n".join(lines).encode())


@cache
def fitted(kind: str, seed: int = 0, joints: int = 6) -> Fit:
    data = read_measurements(encoder_table(kind, seed, joints=joints), ARM)
    return fit_model(Model(ARM), data, [effect_library()[key].null() for key in BASE])


@cache
def diagnosed(kind: str, seed: int = 0, joints: int = 6) -> Diagnosis:
    base = fitted(kind, seed, joints)
    return diagnose(base.model, base.data)


@pytest.mark.parametrize(
    ("kind", "seed", "joints"),
    [("nothing", 0, 6), ("servo_lag", 0, 6), ("transmission_error", 1, 6), ("backlash", 3, 3)],
)
def test_what_encoders_show_is_named_also_by_three_of_them(kind, seed, joints):
    found = diagnosed(kind, seed, joints)
    assert found.verdict == ("complete" if kind == "nothing" else "missing")
    assert found.base.observed.unit == "mrad" and np.isnan(found.base.data.joint[:, joints:]).all()
    assert found.final.held_out_rms == pytest.approx(NOISE_RAD, rel=0.15)
    if joints == 6:
        assert [m.key for m in found.missing] == ([] if kind == "nothing" else [kind])


def test_errors_of_joints_stand_in_no_table_of_millimetres():
    base = fitted("servo_lag")
    added = add_effects(base.model, base.data, ["servo_lag"])
    assert added.fit.regions is not None and added.fit.regions.helps
    assert postproc.document(added)["regions"] is None and "Where it holds" not in text_of(added)


def test_figures_are_in_mrad_and_keys_say_so():
    base, found = fitted("servo_lag"), diagnosed("servo_lag")
    beside = compare(base.model, base.data)
    document, diagnosis, comparison = (postproc.document(x) for x in (base, found, beside))
    assert 2e-4 < base.rms < 3e-3 and base.noise.sigma == pytest.approx(NOISE_RAD, rel=0.25)
    assert document["rms_mrad"] == pytest.approx(1e3 * base.rms, abs=1e-6) and document["observed"] == "joint"
    assert [key for key in document if key.endswith("_mm")] == ["unexplained_mm", "beyond_mm"]
    assert {"rms_mrad", "noise_mrad", "bound_mrad"} <= diagnosis.keys() and "rms_mm" not in diagnosis
    assert set(comparison["per_joint_mrad"]) == set("123456")
    assert all(" mrad per joint" in text_of(x) for x in (base, found)) and "mrad" in text_of(beside)
    assert " mm" not in text_of(found).splitlines()[0]
    json.dumps(comparison, allow_nan=False)


def test_add_shows_the_error_of_the_joints_fall():
    base = fitted("servo_lag")
    found = add_effects(base.model, base.data, ["servo_lag"])
    assert found.before.held_out_rms > 1e-4 and found.fit.held_out_rms < 1.2 * NOISE_RAD
    assert text_of(found).startswith("On rows that the fit has not seen, the error falls from")
    assert postproc.document(found)["ladder"][1]["held_out_rms_mrad"] < 0.01 > found.model.fit["rms_mrad"]


def test_a_model_of_encoders_predicts_the_pose_with_its_uncertainty():
    base = fitted("nothing")
    told = predict_rows(recorded_model(base), base.data)
    assert np.isfinite(told.position).all() and np.isfinite(told.sigma).all()
