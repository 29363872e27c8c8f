"""Fits on cells of the independent arm: parameters, intervals, what cannot be known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc import text as text_of
from postproc.arrays import Array
from postproc.diagnostics import PostprocError, Source
from postproc.effects.base import Displacement, Effect, param
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.effects.library.loads.dress_pack import DressPack
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.effects.registry import effect_library
from postproc.effects.similarity import ordinary_sizes
from postproc.estimation.findings import cautions
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.estimation.problem import Problem, make_weights
from postproc.estimation.recorded import recorded_model
from postproc.estimation.solving.determined import slope
from postproc.estimation.solving.solve import FREED, LEAST, Terms, _made_up_for, _unidentifiable_at_prior, advance
from postproc.identification.add import Addition, Step, add_effects
from postproc.identification.compare import compare
from postproc.measure.checks.repeats import estimate_noise
from postproc.measure.errors import rms
from postproc.measure.observations import observations
from postproc.measure.read.table import read_measurements
from postproc.measure.read.together import read_tables
from postproc.model.arm import Model
from postproc.model.derivatives.places import TOOL
from postproc.model.equilibrium import predict
from postproc.model.file import parse_model
from postproc.model.rewrite import render_model
from postproc.model.uncertainty import predict_sigma
from postproc.results.addition import addition_sentence
from postproc.results.fit import fit_values
from postproc.robot.catalogue import load_robot
from tests.identification.cells import base_fit, cell, true_error
from tests.independent import library_effects as kinds
from tests.independent.cells import Hidden, column
from tests.measure.tables import HEADER, points, poses

LIBRARY = effect_library()


def test_a_clean_cell_is_fitted_to_its_noise():
    data, true = cell(seed=11)
    fit = base_fit(data)
    assert fit.rms == pytest.approx(3e-5, rel=0.12)
    assert fit.held_out_rms > fit.rms
    assert true_error(fit, true) < 0.6 * 3e-5
    assert fit.variance == pytest.approx(1.0, abs=0.35)


def test_what_positions_cannot_show_is_held_at_null_and_named():
    fit = base_fit(cell(seed=11)[0])
    named = fit_values(fit)["not_identifiable"]
    assert "joint_offset.offset_rad[1]" in named  # turns the whole arm, as the instrument's frame does
    assert "joint_compliance.compliance_rad_per_Nm[1]" in named  # no load turns axis 1
    assert {f"tool_frame.turn_rad[{a}]" for a in "xyz"} <= set(named)
    offset = fit.model.effect("joint_offset")
    assert offset is not None and offset.vector()[0] == 0.0


@pytest.mark.parametrize("stiff", [1.0, 0.01])
@pytest.mark.parametrize("key", ["joint_compliance", "link_geometry", "arm_load", "link_compliance", "backlash"])
def test_columns_are_the_derivatives_of_the_prediction(key, stiff):
    data, _ = cell(seed=11)
    fit = base_fit(data)
    effect = fit.model.effect(key) or LIBRARY[key].null()
    # Also where a fit on its way has made a joint much stiffer than is ordinary.
    others = [
        e.with_vector(e.vector() * stiff) if e.key == "joint_compliance" else e
        for e in fit.model.effects
        if e.key != key
    ]
    problem = Problem(fit.model, data, make_weights(data, fit.noise)).at([*others, effect])
    free = np.ones(len(effect.vector()), dtype=bool)
    columns = problem.slopes(effect, free)
    index = np.flatnonzero(np.linalg.norm(columns, axis=0) * effect.scale() > 1e-3)[:5]
    state = data.state.with_(T_flange_tcp=fit.model.T_flange_tcp)
    for i in index:
        step = np.zeros(len(free))
        step[i] = 1e-2 * effect.scale()[i]
        ends = [
            predict(problem.at([*others, effect.with_vector(effect.vector() + s)]).model, state) for s in (step, -step)
        ]
        slope = (ends[0] - ends[1])[:, :3, 3] / (2 * step[i])
        whitened = (slope * problem.weights.values[:, :3])[problem.weights.used[:, :3]]
        # The column leaves out that loads follow the deflection: a few parts in a thousand.
        assert np.linalg.norm(columns[:, i] - whitened) < 0.02 * np.linalg.norm(whitened)


def test_gear_gaps_are_recovered_within_their_intervals():
    data, _ = cell(kinds.backlash, seed=21)
    fit = fit_model(base_fit(data).model, data, [LIBRARY["backlash"].null()])
    gap, width = fit.model.effect("backlash").vector(), fit.intervals["backlash"]
    real = np.abs(gap) > 3 * width
    assert real.any() and fit.rms < 3.6e-5


def test_a_row_far_off_is_set_aside_and_named():
    data, _ = cell(seed=11)
    position = data.position.copy()
    position[17] += [0.0, 0.099, 0.0]
    fit = base_fit(replace(data, position=position))
    assert fit.excluded == (17,)
    assert fit_values(fit)["set_aside_rows"] == [18]
    assert fit.rms == pytest.approx(3e-5, rel=0.15)


def test_a_warm_start_ends_where_a_cold_one_does():
    data, _ = cell(seed=11)
    cold = base_fit(data)
    warm = fit_model(cold.model, data)
    for effect in cold.model.effects:
        np.testing.assert_allclose(warm.model.effect(effect.key).vector(), effect.vector(), atol=1e-7)


def test_orientations_are_weighted_by_their_own_noise():
    data, true = cell(seed=11)
    clean = base_fit(data)
    T = predict(clean.model, data.state)
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_rotvec([0.4, -1.2, 2.0])
    shaken = Rotation.from_rotvec(np.random.default_rng(1).normal(0, 5e-4, (len(data), 3)))
    rotation = (shaken * Rotation.from_matrix(T[:, :3, :3]) * turned).as_matrix()
    fit = base_fit(replace(data, rotation=rotation))
    tool = fit.model.effect("tool_frame")
    assert tool is not None
    np.testing.assert_allclose(Rotation.from_rotvec(tool.vector()[3:]).as_matrix(), turned.as_matrix(), atol=5e-4)
    assert true_error(fit, true) < 0.6 * 3e-5


def test_the_fit_is_written_and_read_back():
    data, _ = cell(seed=11)
    model = recorded_model(base_fit(data))
    before = '# my cell\nrobot = "irb4600_60_205"  # the big one\n'
    text = render_model(model, before)
    assert "# my cell" in text and "# the big one" in text
    again = parse_model(Source("cell.toml", text.encode()))
    np.testing.assert_allclose(predict(again, data.state), predict(model, data.state), atol=1e-12)
    assert again.fit["noise_mm"] == pytest.approx(1e3 * estimate_noise(data, model.robot).sigma, abs=1e-5)


def test_too_few_rows_are_a_finding():
    data, _ = cell(seed=11)
    with pytest.raises(PostprocError) as caught:
        fit_model(Model(base_fit(data).model.robot), data.rows(np.arange(4)), [LIBRARY["link_geometry"].null()])
    assert caught.value.diagnostics[0].code == "DAT020"


@pytest.mark.parametrize(("poses", "said"), [(1, "30 rows of 1 pose"), (3, "90 rows of 3 poses")])
def test_repeats_alone_tell_nothing_of_the_arm(poses, said):
    data, _ = cell(seed=11)
    again = replace(data.rows(np.repeat(np.arange(poses), 30)), pose_id=tuple(map(str, range(30 * poses))))
    noise = np.random.default_rng(1).normal(0, 1e-5, again.position.shape)
    with pytest.raises(PostprocError) as caught:
        base_fit(replace(again, position=again.position + noise))
    assert caught.value.diagnostics[0].code == "DAT020" and said in caught.value.diagnostics[0].message


def test_a_session_is_known_by_its_name_in_other_tables():
    """The step that was fitted to `tuesday` belongs to `tuesday`, first, last or alone in another table."""
    q = poses(40)
    step = np.array([0.2, -0.1, 0.3])
    day = np.where(np.arange(40) < 20, "monday", "tuesday")

    def table(rows):
        where = points(q[rows]) + step * (day[rows] == "tuesday")[:, None]
        cells = [
            f"P{i}," + ",".join(f"{x:.6f}" for x in (*q[i], *p)) + f",{day[i]}"
            for i, p in zip(rows, where, strict=True)
        ]
        text = "\n".join([HEADER + ",session", *cells]) + "\n"
        return read_measurements(Source("s.csv", text.encode()), load_robot("irb4600_60_205"))

    every = np.arange(40)
    keys = ("instrument_frame", "tool_frame")
    effects = [*(effect_library()[key].null() for key in keys), effect_library()["session"].null(session=("tuesday",))]
    fit = fit_model(Model(load_robot("irb4600_60_205"), robot_name="irb4600_60_205"), table(every), effects)
    model = parse_model(Source("m.toml", render_model(recorded_model(fit)).encode()))
    for rows in (every[::-1], every[20:], every[:20]):
        data = table(rows)
        assert predict(model, data.state)[:, :3, 3] == pytest.approx(data.position, abs=2e-6)


def test_an_instrument_that_was_set_up_anew_gets_a_frame_of_its_own():
    """Seen from metres away by another angle, half of the rows say of the arm what they said before."""
    arm = load_robot("irb4600_60_205")
    q = poses(60, seed=9)
    turn, shift = np.array([[0, -1, 0], [0.6, 0, 0.8], [-0.8, 0, 0.6]]), np.array([3200.0, -900.0, 400.0])
    noise = np.random.default_rng(4).normal(0, 0.002, (60, 3))
    true = points(q + np.array([0, 0.02, -0.03, 0.01, 0.02, 0]))

    def read(name, rows, places):
        cells = [f"P{i}," + ",".join(f"{x:.6f}" for x in (*q[i], *places[i])) for i in rows]
        return Source(name, "\n".join([HEADER, *cells]).encode())

    first, near = read("a.csv", range(35), true + noise), read("b.csv", range(35, 60), true + noise)
    far = read("b.csv", range(35, 60), true @ turn.T + shift + noise)
    effects = [LIBRARY[key].null() for key in ("instrument_frame", "tool_frame", "joint_offset")]
    fits = [
        fit_model(Model(arm, robot_name="irb4600_60_205"), read_tables([first, later], arm), effects)
        for later in (near, far)
    ]
    assert fits[0].model.effect("session") is None
    moved = parse_model(Source("m.toml", render_model(recorded_model(fits[1])).encode()))
    assert moved.effect("session").session == ("b",)
    offset = moved.effect("joint_offset").vector()
    assert offset[0] == offset[5] == 0.0
    assert np.degrees(offset[1:5]) == pytest.approx([0.02, -0.03, 0.01, 0.02], abs=2e-3)
    where = predict(moved, fits[1].data.state)[:, :3, 3] * 1e3
    assert where[:35] == pytest.approx(true[:35], abs=0.01)
    assert where[35:] == pytest.approx((true @ turn.T + shift)[35:], abs=0.01)
    assert fits[1].excluded == ()
    # A model of the first table meets the second: its frame is found, and nothing of the arm changes.
    alone = fit_model(Model(arm, robot_name="irb4600_60_205"), read_tables([first], arm), effects).model
    beside = evaluate(alone, read_tables([first, far], arm))
    assert beside.rms == pytest.approx(2e-6, rel=0.3)
    assert (beside.model.effect("joint_offset").vector() == alone.effect("joint_offset").vector()).all()
    assert evaluate(beside.model, read_tables([first, far], arm)).parameters == ()
    later = compare(alone, read_tables([far], arm))
    assert rms(later.error) == pytest.approx(2e-6, rel=0.3) and "these points place it" in later.moved[0].message
    assert compare(alone, read_tables([first], arm)).moved == []


def test_one_pose_measured_often_can_be_compared():
    data, _ = cell(seed=11)
    again = data.rows(np.zeros(30, dtype=int))
    noise = np.random.default_rng(1).normal(0, 1e-5, again.position.shape)
    found = compare(recorded_model(base_fit(data)), replace(again, position=again.position + noise))
    assert found.iso.poses == 1 and 5e-6 < found.fit.noise.sigma < 2e-5


def test_a_joint_that_yields_against_its_load_is_named():
    def lifted(g, arm):
        return Hidden("lifted", "unknown", joint=lambda s, tau: column(1, -2e-6 * tau[:, 1]))

    odd, usual = base_fit(cell(lifted, seed=961)[0]), base_fit(cell(seed=961)[0])
    (found,) = [d for d in fit_values(odd)["diagnostics"] if d["code"] == "DAT026"]
    assert "joint 2 is negative" in found["message"]
    assert "joint 2 is negative" in text_of(odd)
    assert "DAT026" not in [d["code"] for d in fit_values(usual)["diagnostics"]]


def lifted(g, arm):
    return Hidden("lifted", "unknown", joint=lambda s, tau: column(1, -3e-5 * tau[:, 1]))


def test_a_compliance_that_stops_at_its_lower_bound_is_named():
    fit = base_fit(cell(lifted, seed=963, poses=60)[0])
    assert ("joint_compliance", 1) in fit.at_bound
    assert [d.code for d in cautions(fit)] == ["DAT026"]


class Lifted(Effect, reads=("load",)):
    """Joint 2 follows its load. Source: none."""

    again_rad_per_Nm: float = param(unit="rad/(N m)", low=-1e-3, high=1e-3, typical=1e-6)

    def displacement(self, state):
        return Displacement(joint=self.again_rad_per_Nm * state.joint_load * np.eye(6)[1])


def test_what_was_held_beside_a_parameter_goes_on_where_that_stops_at_its_bound():
    before = base_fit(cell(lifted, seed=963, poses=60)[0])
    fit = fit_model(before.model, before.data, [Lifted.null()])
    assert ("joint_compliance", 1) in fit.at_bound and Lifted.key in {key for key, _ in fit.parameters}
    assert fit.rms == pytest.approx(3e-5, rel=0.12) and before.rms > 3e-4
    total = fit.model.effect("joint_compliance").vector()[1] + fit.model.effect(Lifted.key).vector()[0]
    assert total == pytest.approx(-3e-5, rel=0.05)


def test_an_effect_that_does_not_help_is_said_so():
    fit = base_fit(cell(seed=962)[0])
    text = addition_sentence(add_effects(fit.model, fit.data, ["wrist_coupling"]))
    assert text.startswith("Adding `wrist_coupling` does not help: on rows that the fit has not seen, the error is 0.0")
    assert "Keep the model as it was" in text
    better = base_fit(cell(kinds.backlash, seed=962)[0])
    assert " falls from " in addition_sentence(add_effects(better.model, better.data, ["backlash"]))


def test_an_effect_that_hardly_helps_is_said_so():
    def fit(held_out: float) -> SimpleNamespace:
        return SimpleNamespace(
            held_out_rms=held_out,
            rms=held_out,
            parts=SimpleNamespace(level=2.5e-5),
            observed=observations(False, False)[0],
            drafted=False,
        )

    def said(held_out: float, share: float) -> str:
        arm = Model(load_robot("irb4600_60_205"))
        steps = Step("base", fit(143e-6), arm), Step("+ own", fit(held_out), arm, share)
        return addition_sentence(Addition(steps, {}, 2.5e-5))

    text = said(142e-6, 0.008)
    assert text.startswith(
        "Adding `own` hardly helps: on rows that the fit has not seen, the error falls from 0.143 to"
    )
    assert "Keep the model as it was" in text
    text = said(132e-6, 0.09)
    assert text.startswith(
        "On rows that the fit has not seen, the error falls from 0.143 to 0.132 mm per axis; the noise"
    )
    assert "The next `compensate`" in text


def test_what_stays_unexplained_is_the_error_on_other_poses_and_little_where_nothing_is_missing():
    data, true = cell(kinds.backlash, seed=211)
    lacking = base_fit(data)
    assert lacking.unexplained == pytest.approx(true_error(lacking, true), rel=0.25)
    assert lacking.unexplained < lacking.rms * np.sqrt(3 * len(data) / lacking.freedom)
    clean = base_fit(cell(seed=101)[0])
    assert clean.unexplained < 0.4 * clean.noise.sigma


def test_an_effect_whose_channel_was_not_measured_is_said():
    data, _ = cell(seed=962)
    without = replace(data, state=data.state.with_(temperature=None))
    fit = base_fit(without, more=("thermal_joint_drift",))
    (found,) = cautions(fit)
    assert found.code == "DAT021" and "`thermal_joint_drift` reads temperature" in found.message


@pytest.mark.parametrize("together", [True, False])
def test_orientations_weigh_by_their_own_scatter_where_rows_state_that_of_positions(together):
    data, _ = cell(seed=640140, poses=120)
    data = data.rows(np.isin(np.arange(len(data)), np.unique(data.repeats, return_index=True)[1]))
    g, n = np.random.default_rng(7), len(data)
    T, own = predict(base_fit(data).model, data.state), np.array([0.5, 1.0, 2.0])[np.arange(n) % 3]
    turn = 6e-5 * (own if together else np.ones(n))
    rotation = Rotation.from_rotvec(g.normal(0, 1, (n, 3)) * turn[:, None]).as_matrix() @ T[:, :3, :3]
    position = T[:, :3, 3] + g.normal(0, 3e-5, (n, 3)) * own[:, None]
    fit = base_fit(replace(data, position=position, rotation=rotation, sigma=3e-5 * own))
    np.testing.assert_allclose(fit.problem.weights.values[:, 3:6] * turn[:, None], 1.0, rtol=0.15)


def test_orientations_weigh_by_what_is_left_beside_a_pattern():
    """The reflector sits elsewhere in half of the rows: positions are off by many times their noise, axes are not."""
    data, _ = cell(seed=408, noise=0.02, poses=60)
    data = data.rows(np.isin(np.arange(len(data)), np.unique(data.repeats, return_index=True)[1]))
    T, half = predict(base_fit(data).model, data.state), (np.arange(len(data)) % 2)[:, None]
    turned = Rotation.from_rotvec(np.random.default_rng(8).normal(0, 1e-4, (len(data), 3))).as_matrix()
    position = data.position + half * (T[:, :3, :3] @ [1e-3, -1e-3, 5e-4])
    fit = fit_model(base_fit(data).model, replace(data, position=position, rotation=turned @ T[:, :3, :3]), noise=2e-5)
    moves = fit.problem.sensitivity.matrix[:, :, TOOL : TOOL + 3] * half[:, :, None]
    seen = fit_model(fit.model, fit.data, noise=2e-5, terms=Terms(beside=moves))
    assert fit.problem.weights.values[0, 3] > 3e4
    np.testing.assert_allclose(seen.problem.weights.values[:, 3:], 1e4, rtol=0.25)


def test_what_stands_beside_the_model_is_fitted_with_it():
    """Against plain least squares with both side by side, at the place that the fit has found."""
    data, _ = cell(seed=408, noise=0.02, poses=60)
    first = base_fit(data)
    wave = 1e-4 * np.sin(5 * data.state.q[:, :1, None])
    place = first.problem.sensitivity.matrix[:, :, 2:4]
    position = data.position + (wave * place[:, :3])[:, :, 1] - 2 * (wave * place[:, :3])[:, :, 0]
    # What moves nothing, and what is there twice, is left out.
    moves = np.concatenate([wave * place, wave * place[:, :, :1], 0 * wave * place[:, :, :1]], axis=2)
    fit = fit_model(first.model, replace(data, position=position), noise=2e-5, terms=Terms(beside=moves))
    alone = replace(fit.problem, beside=None)
    free = {e.key: np.zeros(len(e.vector()), dtype=bool) for e in fit.model.effects}
    for key, i in fit.parameters:
        free[key][i] = True
    model = np.hstack([alone.slopes(e, free[e.key]) for e in fit.model.effects])
    both = np.hstack([model, alone.whiten(moves)])
    found = np.linalg.lstsq(both / np.maximum(np.linalg.norm(both, axis=0), 1e-300), alone.residual, rcond=1e-9)[0]
    left = alone.residual - both / np.maximum(np.linalg.norm(both, axis=0), 1e-300) @ found
    assert fit.problem.residual == pytest.approx(left, abs=1e-3)
    assert np.abs(found[: model.shape[1]]).max() < 1e-2 < 10 < np.linalg.norm(alone.residual - left)
    assert fit.linear.parameters == len(fit.parameters) + 2
    assert np.abs(fit.linear.nuisance.T @ fit.linear.nuisance - np.eye(fit.linear.parameters)).max() < 1e-6
    assert np.linalg.norm(fit.linear.project(both)) < 1e-6 * np.linalg.norm(both)
    some = fit.problem.some(np.arange(len(data)) % 2 == 0)
    assert some.error.shape == some.beside.shape[:2] and np.sqrt(np.mean(some.residual**2)) < 1.2


def test_a_bad_position_is_set_aside_beside_coarse_orientations():
    """Before their noise is known, orientations of 0.3 mrad weigh ten times as much as positions of 0.03 mm."""
    data, _ = cell(seed=640140, poses=80)
    data = data.rows(np.isin(np.arange(len(data)), np.unique(data.repeats, return_index=True)[1]))
    g, n = np.random.default_rng(11), len(data)
    T = predict(base_fit(data).model, data.state)
    rotation = Rotation.from_rotvec(g.normal(0, 3e-4, (n, 3))).as_matrix() @ T[:, :3, :3]
    position = T[:, :3, 3] + g.normal(0, 3e-5, (n, 3))
    position[17] += np.array([0.6e-3, -0.5e-3, 0.5e-3])
    assert base_fit(replace(data, position=position, rotation=rotation)).excluded == (17,)


def _arm(*effects):
    return Model(load_robot("irb4600_60_205"), effects)


class Seat(Effect, reads=("temperature",)):
    """A tool that turns and shifts in its seat as it warms up."""

    turn_rad: Array = param(unit="rad", shape=3, low=-0.4, high=0.4, typical=4e-3)
    shift_m: Array = param(unit="m", shape=3, low=-0.1, high=0.1, typical=1e-3)

    def displacement(self, state):
        warm = (state.temperature - 22.0) / 4.0
        return Displacement(tool=np.outer(warm, np.concatenate([self.shift_m, self.turn_rad])))


def test_what_others_could_make_up_for_by_a_wild_value_alone_stays_where_it_is():
    """A turn of the last joint makes up for any direction in which the tool shifts, but by tens of degrees."""
    data, _ = cell(seed=401)
    plain = base_fit(data).model
    warm = plain.with_effects(*plain.effects, Seat(turn_rad=[4e-3, 3e-3, 1e-3], shift_m=[1e-3, -1e-3, -1e-4]))
    problem = replace(base_fit(data).problem, model=warm)
    whole = slope(problem, {e.key: np.ones(len(e.vector()), bool) for e in warm.effects}, set(), {})
    assert ("joint_offset", 5) in whole.parameters
    kept = [k for k, name in enumerate(whole.parameters) if name != ("seat", 3)]
    at = replace(
        whole,
        columns=whole.columns[:, kept],
        parameters=tuple(whole.parameters[k] for k in kept),
        unidentifiable=(("seat", 3),),
    )
    null = {e.key: e.null_vector() for e in warm.effects}

    def shift(new, returned):
        return _unidentifiable_at_prior(problem, at, null, new, returned).model.effect("seat").shift_m[0]

    once = set()
    assert shift({"seat"}, once) == 1e-3 and not once
    assert shift(set(), once) == 0.0 and once == {("seat", 3)}
    assert shift(set(), once) == 1e-3


@pytest.mark.parametrize(
    ("stands", "changes", "allowed"),
    [(0.0, 9.0, True), (0.0, 11.0, False), (0.0, -11.0, False), (20.0, 5.0, True), (-20.0, 5.0, False)],
)
def test_others_make_up_for_it_within_ten_ordinary_sizes_or_where_they_become_smaller(stands, changes, allowed):
    model = _arm(JointOffset())
    size = ordinary_sizes(JointOffset(), model.robot)[5]
    model = _arm(JointOffset(offset_rad=[0, 0, 0, 0, 0, stands * size]))
    problem = SimpleNamespace(model=model, slopes=lambda effect, mask: np.ones((1, 1)))
    at = SimpleNamespace(columns=np.ones((1, 1)), parameters=(("joint_offset", 5),))
    first = np.arange(6) == 0
    assert _made_up_for(problem, at, Seat(), first, np.full(6, changes * size)) is allowed


@pytest.mark.parametrize(
    ("faithful", "before", "after"),
    [
        (0.9, 0.0, 0.0),
        (0.2, 0.0, LEAST),
        (0.5, 1.0, 1.0),
        (1.0, 1.0, 0.2),
        (1.0, 5 * FREED, FREED),
        (1.0, 4 * FREED, 0.0),
    ],
)
def test_a_step_that_does_what_was_foretold_sets_the_next_one_free(faithful, before, after):
    """One that does a fifth of it holds the next one back, though it was not held back itself."""
    taken = SimpleNamespace(step=lambda problem: (1.0, set()))
    at = SimpleNamespace(
        damped=lambda damping: taken,
        predicted_cost=lambda problem, step: 3.0,
        moved=lambda problem, step: "there",
        cost=lambda where: 5.0 if where == "here" else 5.0 - 2.0 * faithful,
    )
    trial, fallen, _, damping = advance("here", at, 1e-9, before, 1)
    assert trial == "there" and fallen == pytest.approx(2.0 * faithful) and damping == pytest.approx(after)


def test_what_a_fitted_slack_length_needs_stays_where_it_is():
    """A taut hose: others may make up for its pull, but none of its other parameters tells anything without it."""
    data, _ = cell(seed=401)
    plain = base_fit(data)
    hose = DressPack(stiffness_N_per_m=400.0, slack_m=0.4, from_m=[0.1, 0, 0.2], to_m=[0, 0.1, 0])
    problem = plain.problem.at([*plain.model.effects, hose])
    free = {e.key: np.ones(len(e.vector()), dtype=bool) for e in problem.model.effects}
    whole = slope(problem, free, set(), {})
    kept = [k for k, name in enumerate(whole.parameters) if name != ("dress_pack", 0)]
    names = tuple(whole.parameters[k] for k in kept)
    at = replace(whole, columns=whole.columns[:, kept], parameters=names, unidentifiable=(("dress_pack", 0),))
    null = {e.key: e.null_vector() for e in problem.model.effects}
    assert ("dress_pack", 1) in names
    assert (
        _unidentifiable_at_prior(problem, at, null, set(), set()).model.effect("dress_pack").stiffness_N_per_m == 400.0
    )


def test_lost_motion_of_a_joint_that_came_from_one_side_alone_may_be_there():
    """Nothing in the data contradicts a gap in joint 1: from the other side the arm may be off by a whole one."""
    data, _ = cell(kinds.backlash, seed=402)
    side = data.state.approach.copy()
    side[:, 0] = 1.0
    data = replace(data, state=data.state.with_(approach=side))
    free = np.isin(np.arange(6), [1, 2])
    after = fit_model(base_fit(data).model, data, [Backlash()], terms=Terms({"backlash": free}))
    assert ("backlash", 0) in after.unknown and ("backlash", 3) not in after.unknown
    assert "backlash.half_gap_rad[1]" in fit_values(after)["not_identifiable"]
    model, back = recorded_model(after), data.state.with_(approach=side * [-1, 1, 1, 1, 1, 1])
    wider = predict_sigma(model, back) ** 2 - predict_sigma(model, data.state) ** 2
    lever = np.linalg.norm(data.position[:, :2], axis=1)
    assert wider == pytest.approx((2 * 1e-4 * lever) ** 2 / 3, rel=0.05)


def test_what_only_says_the_same_in_other_axes_is_not_listed_as_not_determined():
    """The pedestal moves with the frame of the instrument, the flange with that of the tool; body 2 tells of its own."""
    data, _ = cell(seed=403, poses=60)
    plain = base_fit(data)
    names = LinkGeometry().names()
    free = np.array([name == "shift_m[4,x]" for name in names])
    after = fit_model(plain.model, data, [LinkGeometry()], terms=Terms({"link_geometry": free}))
    out = [names[i] for key, i in after.unknown if key == "link_geometry"]
    listed = [n.split(".")[1] for n in fit_values(after)["not_identifiable"] if n.startswith("link_geometry")]
    assert {"shift_m[1,x]", "shift_m[7,x]", "turn_rad[1,z]"} <= set(out)
    assert not {"shift_m[1,x]", "shift_m[7,x]", "turn_rad[1,z]"} & set(listed)
    assert set(recorded_model(after).fit["not_identifiable"]) <= set(fit_values(after)["not_identifiable"])


class Guess(Effect, reads=("q",), drafted=True):
    """A law that was drafted. Source: none."""

    size_rad: float = param(unit="rad", low=-1e-2, high=1e-2, typical=1e-4)

    def displacement(self, state):
        return np.outer(self.size_rad * np.sin(state.q[:, 1]), np.eye(6)[3])


class Known(Guess, drafted=False):
    """The same, known. Source: none."""


def test_a_drafted_law_is_less_sure_than_a_known_one():
    """Beside equal parameters, by a chi-square of 2 ln 50 over the numbers that were measured."""
    data, _ = cell(seed=11)
    base = base_fit(data)
    drafted, known = (fit_model(base.model, data, [kind(size_rad=1e-4)], noise=3e-5) for kind in (Guess, Known))
    np.testing.assert_allclose(drafted.covariance, known.covariance, rtol=1e-3)
    assert known.formula_uncertainty == 0.0
    per_axis = np.sqrt(2 * np.log(50) / (3 * len(data))) * 3e-5
    assert drafted.formula_uncertainty == pytest.approx(per_axis, rel=0.15)
    told = [recorded_model(fit).fit["unexplained_mm"] for fit in (known, drafted)]
    assert (
        told[1] == pytest.approx(1e3 * np.hypot(1e-3 * told[0], drafted.formula_uncertainty), rel=1e-3)
        and told[1] > told[0]
    )
