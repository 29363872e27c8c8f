"""A random function that measured rows tell something of: its posterior, its table, and a model that holds near rows alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.cli.output import write_model
from postproc.compensation.correction.inverse import command, reached
from postproc.diagnostics import PostprocError, Source
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.file import default_model, parse_model, read_model
from postproc.model.rewrite import render_model
from postproc.model.uncertainty.field import COORDINATES, Field
from postproc.model.uncertainty.prediction import Uncertainty, predict_sigma, uncertainty_table
from postproc.robot.kinematics import forward
from tests.model.arms import with_more

G = np.random.default_rng(7)
LENGTHS = np.array([1.0, 0.5, 2.0, 3.0, 1.5, 9.0, 40.0, 3.0])
NAMES = (*COORDINATES[:7], "dir2")
ROWS = np.column_stack([G.uniform(-1.5, 1.5, (60, 6)), G.choice([0.0, 40.0], 60), G.choice([-1.0, 1.0], 60)])
FIELD = Field(NAMES, LENGTHS, ROWS, 0.02)


def states(x: np.ndarray) -> State:
    side = np.zeros((len(x), 6))
    side[:, 1] = x[:, 7]
    return State(x[:, :6], payload_mass=x[:, 6], approach=side)


def told(x: np.ndarray, field: Field = FIELD) -> np.ndarray:
    """What rows tell of the variance, one pose and one pair of rows after another."""

    def k(a: np.ndarray, b: np.ndarray) -> float:
        return float(np.exp(-0.5 * sum(((p - q) / length) ** 2 for p, q, length in zip(a, b, LENGTHS, strict=True))))

    inner = np.array([[k(a, b) for b in ROWS] for a in ROWS]) + field.noise * np.eye(len(ROWS))
    return np.array([np.array([k(p, b) for b in ROWS]) @ np.linalg.solve(inner, [k(p, b) for b in ROWS]) for p in x])


def test_rows_tell_of_the_function_as_the_normal_equations_say():
    x = ROWS[:12] + G.normal(0, 0.4, (12, 8))
    np.testing.assert_allclose(FIELD.known(states(x)), told(x), atol=1e-9)


def test_rows_tell_all_at_themselves_and_nothing_far_away():
    assert replace(FIELD, noise=0.0).known(states(ROWS)) == pytest.approx(1.0, abs=1e-6)
    away = ROWS.copy()
    away[:, 0] += 9.0
    assert FIELD.known(states(away)).max() < 1e-9


def test_what_a_state_does_not_have_counts_as_zero():
    bare = State(ROWS[:5, :6])
    plain = np.column_stack([ROWS[:5, :6], np.zeros((5, 2))])
    np.testing.assert_allclose(FIELD.known(bare), told(plain), atol=1e-9)


def test_a_field_comes_back_from_its_table():
    again = Field.of_table(FIELD.table())
    assert again.names == NAMES and again.noise == FIELD.noise
    np.testing.assert_allclose(again.rows, ROWS, atol=6e-4 * LENGTHS.max())
    np.testing.assert_allclose(again.known(states(ROWS)), FIELD.known(states(ROWS)), atol=1e-3)
    with pytest.raises(ValueError, match="not that of rows"):
        Field.of_table({**FIELD.table(), "rows": "eJwBAAD"})


ARM = default_model()
NEAR, SURE = JointOffset(offset_rad=[0, 8e-4, 0, 0, 0, 0]), JointOffset(offset_rad=[0, 1e-4, 0, 0, 0, 0])


def local(table: dict | None = None) -> str:
    """The text of a model file whose joint offsets hold near the rows of `FIELD` alone."""
    known = Uncertainty((("joint_offset", 1),), np.array([[1e-12]]), 1e-5, beyond=3e-5, measured=FIELD)
    model = with_more(ARM, NEAR)
    fit = {
        **uncertainty_table(model, known),
        "local": ["joint_compliance"],
        "surest": {"joint_offset": SURE.vector().tolist()},
    }
    return render_model(replace(model, fit={**fit, **(table or {})}))


def offset(model: Model) -> float:
    """Of joint 2 [rad]."""
    effect = model.effect("joint_offset")
    assert effect is not None
    return float(effect.vector()[1])


def test_a_law_that_holds_near_rows_alone_is_left_out_by_degrees():
    model = parse_model(Source("m.toml", local().encode()))
    state = model.with_arm(states(ROWS + np.linspace(0, 4, 60)[:, None] * np.eye(8)[0])).with_(
        T_flange_tcp=np.eye(4), payload_center=np.zeros((60, 3))
    )
    assert model.measured is not None
    share = model.measured.known(state)[:, None]
    assert share.max() > 0.9 and share.min() < 0.1
    whole, surest = model.with_effects(*model.effects), model.surest
    assert surest is not None and surest.effect("joint_compliance") is None
    assert [offset(m) for m in (surest, model)] == [1e-4, 8e-4]
    near, far = (predict(m, state)[:, :3, 3] for m in (whole, surest))
    np.testing.assert_allclose(predict(model, state)[:, :3, 3], far + share * (near - far), atol=1e-7)
    wanted = forward(model.robot, state.q)
    done = command(model, state, wanted)
    np.testing.assert_allclose(reached(model, state.with_(q=done.q))[:, :3, 3], wanted[:, :3, 3], atol=2e-7)


def test_the_deviation_grows_where_no_row_is_near():
    model = parse_model(Source("m.toml", local().encode()))
    at, away = ROWS[:20], ROWS[:20] + 9.0 * np.eye(8)[5]
    for x in (at, away):
        state = states(x)
        turn = predict_sigma(replace(model, fit={**model.fit, "unexplained_mm": 0.0, "beyond_mm": 0.0}), state)
        expected = np.sqrt(turn**2 + 1e-5**2 + 3e-5**2 * (1 - FIELD.known(state)))
        np.testing.assert_allclose(predict_sigma(model, state), expected, rtol=1e-3)


def test_a_model_that_holds_near_rows_alone_comes_back_from_its_file(tmp_path):
    model = parse_model(Source("m.toml", local().encode()))
    path = tmp_path / "again.toml"
    write_model(path, model)
    again = read_model(path)
    assert again.surest is not None and offset(again.surest) == 1e-4
    assert again.fit["local"] == ["joint_compliance"]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"surest": {"joint_offset": [1.0]}}, "`joint_offset`: has other parameters"),
        ({"local": ["jiont_offset"]}, "`jiont_offset`: there is no such effect"),
        ({"measured": {**FIELD.table(), "rows": "AAAA"}}, "not that of rows with these lengths"),
        ({"measured": {**FIELD.table(), "lengths": {"q9": 1.0}}}, "q9"),
    ],
)
def test_a_table_that_no_fit_writes_is_refused(table, said):
    with pytest.raises(PostprocError, match=said) as found:
        parse_model(Source("m.toml", local(table).encode()))
    assert found.value.diagnostics[0].code == "MOD002" and found.value.diagnostics[0].span is not None
