"""Fits on cells of the independent arm: parameters, intervals, what cannot be known."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from postproc import text as text_of
from postproc.arrays import Array
from postproc.diagnostics import Source
from postproc.effects.base import Displacement, Effect, param
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.effects.registry import effect_library
from postproc.effects.roles import Role
from postproc.estimation.findings import cautions
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.estimation.problem import Problem, make_weights
from postproc.estimation.recorded import recorded_model
from postproc.estimation.solving.solve import Terms
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.measure.checks.repeats import estimate_noise
from postproc.measure.errors import rms
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.together import read_tables
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.file import parse_model
from postproc.model.rewrite import render_model
from postproc.model.uncertainty.prediction import predict_sigma
from postproc.results.improve.fit import fit_values
from postproc.robot.catalogue import load_robot
from tests.build import refused
from tests.identification.cells import base_fit, cell, true_error
from tests.independent import library_effects as kinds
from tests.independent.cells import Hidden, column
from tests.measure.tables import HEADER, points, poses

LIBRARY = effect_library()
NOISE = 3e-5
ARM = load_robot("irb4600_60_205")
FRAMES = [LIBRARY[key].null() for key in ("instrument_frame", "tool_frame")]


def read_back(model: Model, text: str = "") -> Model:
    return parse_model(Source("m.toml", render_model(model, text).encode()))


def codes(found: list) -> list[str]:
    return [d.code for d in found]


def test_a_clean_cell_is_fitted_to_its_noise():
    data, true = cell(seed=11)
    fit = base_fit(data)
    assert fit.rms == pytest.approx(NOISE, rel=0.12) and fit.rms < fit.held_out_rms
    assert true_error(fit, true) < 0.6 * NOISE
    assert fit.variance == pytest.approx(1.0, abs=0.35)


def test_what_positions_cannot_show_is_held_at_null_and_named():
    """Joint 1 turns as the instrument's frame does, no load turns it, and a point does not show how its frame turns."""
    fit = base_fit(cell(seed=11)[0])
    hidden = {"joint_offset.offset_rad[1]", "joint_compliance.compliance_rad_per_Nm[1]"}
    assert hidden | {f"tool_frame.turn_rad[{a}]" for a in "xyz"} <= set(fit_values(fit)["not_identifiable"])
    assert fit.model.effect("joint_offset").vector()[0] == 0.0


@pytest.mark.parametrize("stiff", [1.0, 0.01])  # also where a fit on its way has made a joint much too stiff
@pytest.mark.parametrize("key", ["joint_compliance", "link_geometry", "arm_load", "link_compliance", "backlash"])
def test_columns_are_central_differences_of_the_prediction(key, stiff):
    data, _ = cell(seed=11)
    fit = base_fit(data)
    effect = fit.model.effect(key) or LIBRARY[key].null()
    others = [e.with_vector(e.vector() * (stiff if e.key == "joint_compliance" else 1)) for e in fit.model.effects]
    others = [e for e in others if e.key != key]
    problem = Problem(fit.model, data, make_weights(data, fit.noise)).at([*others, effect])
    columns = problem.slopes(effect, np.ones(len(effect.vector()), dtype=bool))
    state = data.state.with_(T_flange_tcp=fit.model.T_flange_tcp)
    for i in np.flatnonzero(np.linalg.norm(columns, axis=0) * effect.scale() > 1e-3)[:5]:
        step = 1e-2 * effect.scale() * (np.arange(columns.shape[1]) == i)
        up, down = (
            predict(problem.at([*others, effect.with_vector(effect.vector() + s)]).model, state) for s in (step, -step)
        )
        whitened = ((up - down)[:, :3, 3] / (2 * step[i]) * problem.weights.values[:, :3]).ravel()
        # The column leaves out that loads follow the deflection: a few parts in a thousand.
        assert np.linalg.norm(columns[:, i] - whitened) < 0.02 * np.linalg.norm(whitened)


def test_gear_gaps_are_recovered_within_their_intervals():
    fit = fit_model(base_fit(cell(kinds.backlash, seed=21)[0]).model, cell(kinds.backlash, seed=21)[0], [Backlash()])
    assert (np.abs(fit.model.effect("backlash").vector()) > 3 * fit.intervals["backlash"]).any()
    assert fit.rms < 1.2 * NOISE


def test_a_row_far_off_is_set_aside_and_named():
    data, _ = cell(seed=11)
    off = np.where(np.arange(len(data)) == 17, 0.099, 0.0)[:, None] * [0, 1, 0]
    fit = base_fit(replace(data, position=data.position + off))
    assert fit.excluded == (17,) and fit_values(fit)["set_aside_rows"] == [18]
    assert fit.rms == pytest.approx(NOISE, rel=0.15)


def test_a_warm_start_ends_where_a_cold_one_does():
    data, _ = cell(seed=11)
    cold = base_fit(data)
    warm = fit_model(cold.model, data)
    for effect in cold.model.effects:
        np.testing.assert_allclose(warm.model.effect(effect.key).vector(), effect.vector(), atol=1e-7)


def test_the_fit_is_written_and_read_back():
    data, _ = cell(seed=11)
    model = recorded_model(base_fit(data))
    before = '# my cell\nrobot = "irb4600_60_205"  # the big one\n'
    again = read_back(model, before)
    assert all(comment in render_model(model, before) for comment in ("# my cell", "# the big one"))
    np.testing.assert_allclose(predict(again, data.state), predict(model, data.state), atol=1e-12)
    assert again.fit["noise_mm"] == pytest.approx(1e3 * estimate_noise(data, model.robot).sigma, abs=1e-5)


@pytest.mark.parametrize(
    ("rows", "message"), [(range(4), "DAT020"), ([0] * 30, "30 rows of 1 pose"), ([0, 1, 2] * 30, "90 rows of 3 poses")]
)
def test_too_few_rows_are_a_finding_and_repeats_alone_tell_nothing_of_the_arm(rows, message):
    data, _ = cell(seed=11)
    few = replace(data.rows(np.array(rows)), pose_id=tuple(map(str, range(len(rows)))))
    noise = np.random.default_rng(1).normal(0, 1e-5, few.position.shape)
    (found,) = refused(lambda: base_fit(replace(few, position=few.position + noise), more=("link_geometry",)))
    assert found.code == "DAT020" and message in f"{found.code} {found.message}"


def test_one_pose_measured_often_can_be_compared():
    data, _ = cell(seed=11)
    again = data.rows(np.zeros(30, dtype=int))
    noise = np.random.default_rng(1).normal(0, 1e-5, again.position.shape)
    found = compare(recorded_model(base_fit(data)), replace(again, position=again.position + noise))
    assert found.iso.poses == 1 and 5e-6 < found.fit.noise.sigma < 2e-5


def measured(name: str, rows: Array, q: Array, places: Array, *more: str) -> Source:
    """A table of places [mm] by joint angles [deg]; more: the name of a column and its words."""
    lines = [",".join([HEADER, *more[:1]])]
    for i in rows:
        lines.append(",".join([f"P{i}", *(f"{x:.6f}" for x in (*q[i], *places[i])), *(word[i] for word in more[1:])]))
    return Source(name, "\n".join(lines).encode())


def test_a_session_is_known_by_its_name_in_other_tables():
    """The step that was fitted to `tuesday` belongs to `tuesday`, first, last or alone in another table."""
    q, day = poses(40), ["monday"] * 20 + ["tuesday"] * 20
    places = points(q) + np.outer(np.array(day) == "tuesday", [0.2, -0.1, 0.3])

    def table(rows: Array) -> Measurements:
        return read_measurements(measured("s.csv", rows, q, places, "session", day), ARM)

    every, effects = np.arange(40), [*FRAMES, LIBRARY["session"].null(session=("tuesday",))]
    model = read_back(recorded_model(fit_model(Model(ARM, robot_name=ARM.name), table(every), effects)))
    for data in (table(rows) for rows in (every[::-1], every[20:], every[:20])):
        assert predict(model, data.state)[:, :3, 3] == pytest.approx(data.position, abs=2e-6)


def test_an_instrument_that_was_set_up_anew_gets_a_frame_of_its_own():
    """Seen from metres away by another angle, half of the rows say of the arm what they said before."""
    q, rows, off = poses(60, seed=9), np.arange(60), np.array([0, 0.02, -0.03, 0.01, 0.02, 0])
    turn, shift = np.array([[0, -1, 0], [0.6, 0, 0.8], [-0.8, 0, 0.6]]), np.array([3200.0, -900.0, 400.0])
    noise, true = np.random.default_rng(4).normal(0, 0.002, (60, 3)), points(q + off)
    first = measured("a.csv", rows[:35], q, true + noise)
    near, far = (measured("b.csv", rows[35:], q, p + noise) for p in (true, true @ turn.T + shift))
    effects = [*FRAMES, LIBRARY["joint_offset"].null()]

    def fit(*tables: Source) -> Fit:
        return fit_model(Model(ARM, robot_name=ARM.name), read_tables(tables, ARM), effects)

    both = fit(first, far)
    moved = read_back(recorded_model(both))
    assert fit(first, near).model.effect("session") is None and moved.effect("session").session == ("b",)
    assert both.excluded == ()
    assert np.degrees(moved.effect("joint_offset").vector()) == pytest.approx(off, abs=2e-3)
    seen = np.concatenate([true[:35], (true @ turn.T + shift)[35:]])
    assert predict(moved, both.data.state)[:, :3, 3] * 1e3 == pytest.approx(seen, abs=0.01)
    # A model of the first table meets the second: its frame is found, and nothing of the arm changes.
    alone = fit(first).model
    beside = evaluate(alone, read_tables([first, far], ARM))
    assert beside.rms == pytest.approx(2e-6, rel=0.3)
    assert (beside.model.effect("joint_offset").vector() == alone.effect("joint_offset").vector()).all()
    assert evaluate(beside.model, read_tables([first, far], ARM)).parameters == ()
    later = compare(alone, read_tables([far], ARM))
    assert rms(later.error) == pytest.approx(2e-6, rel=0.3) and "these points place it" in later.moved[0].message
    assert compare(alone, read_tables([first], ARM)).moved == []


def lifting(compliance: float):
    """A hidden load that lifts joint 2 the more, the more gravity pulls."""
    return lambda g, arm: Hidden("lifted", "unknown", joint=lambda s, tau: column(1, compliance * tau[:, 1]))


LITTLE, MUCH = lifting(-2e-6), lifting(-3e-5)


def test_a_joint_that_yields_against_its_load_is_named():
    """Also where its compliance stops at its lower bound."""
    odd, usual = (base_fit(cell(*kind, seed=961)[0]) for kind in ([LITTLE], []))
    bound = base_fit(cell(MUCH, seed=963, poses=60)[0])
    (found,) = (d for d in cautions(odd) if d.code == "DAT026")
    assert re.search(r"negative, -.* \(joint 2\)", found.message) and found.message[1:] in text_of(odd)
    assert ("joint_compliance", 1) in bound.at_bound and "DAT026" in codes(cautions(bound))
    assert "DAT026" not in codes(cautions(usual))


class Lifted(Effect, reads=("load",)):
    """Joint 2 follows its load. Source: none."""

    again_rad_per_Nm: float = param(unit="rad/(N m)", low=-1e-3, high=1e-3, typical=1e-6)

    def displacement(self, state):
        return Displacement(joint=self.again_rad_per_Nm * state.joint_load * np.eye(6)[1])


class LostMotion(Effect, reads=("approach",)):
    """Lost motion that cannot be negative, the other way round than it acts. Source: none."""

    gap_rad: Array = param(unit="rad", shape=(6,), low=0.0, high=0.01, typical=1e-4)

    def displacement(self, state):
        return self.gap_rad * state.approach


def test_what_was_held_beside_a_parameter_goes_on_where_that_stops_at_its_bound():
    before = base_fit(cell(MUCH, seed=963, poses=60)[0])
    fit = fit_model(before.model, before.data, [Lifted.null()])
    assert ("joint_compliance", 1) in fit.at_bound and Lifted.key in {key for key, _ in fit.parameters}
    assert fit.rms == pytest.approx(NOISE, rel=0.12) and before.rms > 10 * NOISE
    total = fit.model.effect("joint_compliance").vector()[1] + fit.model.effect(Lifted.key).vector()[0]
    assert total == pytest.approx(-3e-5, rel=0.05)


@pytest.mark.parametrize("added", [True, False])
def test_a_sign_that_cannot_be_is_not_fitted(added):
    base = base_fit(cell(kinds.backlash, seed=962)[0])
    fit = fit_model(base.model, base.data, [LostMotion()])
    fit = add_effects(base.model, base.data, ["lost_motion"], [LostMotion]).fit if added else fit
    assert (fit.model.effect("lost_motion").vector() >= 0.0).all() and fit.rms > 0.9 * base.rms


class Known(Effect, reads=("q",)):
    """A law. Source: none."""

    size_rad: float = param(unit="rad", low=-1e-2, high=1e-2, typical=1e-4)

    def displacement(self, state):
        return np.outer(self.size_rad * np.sin(state.q[:, 1]), np.eye(6)[3])


class Guess(Known, role=Role.CURVE):
    """The same as a law whose form was chosen on the rows. Source: none."""


def mostly_another(g, arm):
    """A wave of joint 4, which nobody adds, and a third as much of the known law."""
    return Hidden(
        "two", "unknown", joint=lambda s, tau: column(3, 3e-4 * np.sin(9 * s.q[:, 3]) + 1.1e-4 * np.sin(s.q[:, 1]))
    )


@pytest.mark.parametrize(
    ("kind", "law", "begins", "ends"),
    [
        ((), "wrist_coupling", "Adding `wrist_coupling` does not help: on rows that the fit has not", "Keep the model"),
        (
            (mostly_another,),
            Known,
            "Adding `known` hardly helps: on rows that the fit has not seen, the",
            "Keep the model",
        ),
        (
            (kinds.backlash,),
            "backlash",
            "On rows that the fit has not seen, the error falls from",
            "The next `compensate`",
        ),
    ],
)
def test_whether_an_effect_helps_is_said(kind, law, begins, ends):
    fit = base_fit(cell(*kind, seed=962)[0])
    keys, further = ([law], []) if isinstance(law, str) else ([law.key], [law])
    text = text_of(add_effects(fit.model, fit.data, keys, further))
    assert text.startswith(begins) and ends in text


def test_what_stays_unexplained_is_the_error_on_other_poses_and_little_where_nothing_is_missing():
    data, true = cell(kinds.backlash, seed=211)
    lacking, clean = base_fit(data), base_fit(cell(seed=101)[0])
    assert lacking.unexplained == pytest.approx(true_error(lacking, true), rel=0.25)
    assert lacking.unexplained < lacking.rms * np.sqrt(3 * len(data) / lacking.freedom)
    assert clean.unexplained < 0.4 * clean.noise.sigma


def test_an_effect_whose_channel_was_not_measured_is_said():
    data, _ = cell(seed=962)
    fit = base_fit(replace(data, state=data.state.with_(temperature=None)), more=("thermal_joint_drift",))
    (found,) = cautions(fit)
    assert found.code == "DAT021" and "`thermal_joint_drift` reads temperature" in found.message


def test_lost_motion_of_a_joint_that_came_from_one_side_alone_may_be_there():
    """Nothing in the data contradicts a gap in joint 1: from the other side the arm may be off by a whole one."""
    data, _ = cell(kinds.backlash, seed=402)
    side = np.where(np.arange(6) == 0, 1.0, data.state.approach)
    data = replace(data, state=data.state.with_(approach=side))
    free = Terms({"backlash": np.isin(np.arange(6), [1, 2])})
    after = fit_model(base_fit(data).model, data, [Backlash()], terms=free)
    assert ("backlash", 0) in after.unknown and ("backlash", 3) not in after.unknown
    assert "backlash.half_gap_rad[1]" in fit_values(after)["not_identifiable"]
    model, back = recorded_model(after), data.state.with_(approach=side * [-1, 1, 1, 1, 1, 1])
    wider = predict_sigma(model, back) ** 2 - predict_sigma(model, data.state) ** 2
    lever = np.linalg.norm(data.position[:, :2], axis=1)
    assert wider == pytest.approx((2 * 1e-4 * lever) ** 2 / 3, rel=0.05)


def test_what_only_says_the_same_in_other_axes_is_not_listed_as_not_determined():
    """The pedestal moves with the frame of the instrument, the flange with that of the tool."""
    data, _ = cell(seed=403, poses=60)
    names, same = LinkGeometry().names(), {"shift_m[1,x]", "shift_m[7,x]", "turn_rad[1,z]"}
    free = np.array([name == "shift_m[4,x]" for name in names])
    after = fit_model(base_fit(data).model, data, [LinkGeometry()], terms=Terms({"link_geometry": free}))
    listed = fit_values(after)["not_identifiable"]
    assert same <= {names[i] for key, i in after.unknown if key == "link_geometry"}
    assert same.isdisjoint(name.removeprefix("link_geometry.") for name in listed)
    assert set(recorded_model(after).fit["not_identifiable"]) <= set(listed)
