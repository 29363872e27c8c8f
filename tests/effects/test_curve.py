"""The effect `curve`: its functions and places against plain numpy, and its table in a model file."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from postproc.channels.expression import in_order
from postproc.channels.sight import Site
from postproc.diagnostics import Source
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.library.curve import PLACES, ChannelCurve
from postproc.effects.terms import BASES, law_of, symbols
from postproc.model.file import default_model, parse_model, read_model
from postproc.model.rewrite import render_model
from tests.build import refused
from tests.channels.build import PLACE, POINT, SITE, full_state, seen_points, tool_points

STATE = full_state(v=None, a=None)
X = np.array([-2.6, -1.0, -0.31, 0.0, 0.3, 0.9, 2.2, 5.0])


def triangle(x, k, s):
    """1 at multiples of a period from the start, 0 half a period from it, straight between."""
    u = k * x / (2 * np.pi) - s
    return 2 * np.abs(u - np.floor(u) - 0.5)


LAWS = {
    "line": ((0.3,), lambda x: x - 0.3),
    "side": ((), lambda x: (x > 0) * 1.0 - (x < 0)),
    "size": ((), lambda x: np.maximum(x, -x)),
    "root": ((), lambda x: np.maximum(x, -x) ** 0.5),
    "square": ((), lambda x: x**2),
    "inverse": ((), lambda x: np.array([1 / v if v else 0.0 for v in x])),
    "sided_root": ((), lambda x: np.array([np.copysign(abs(v) ** 0.5, v) for v in x])),
    "sided_square": ((), lambda x: np.array([np.copysign(v * v, v) for v in x])),
    "cube": ((0.2, 2.0), lambda x: (x - 0.2) * (x - 0.2) * (x - 0.2) / 8),
    "bow": ((0.3,), lambda x: x * x - 0.6 * x + 0.09),
    "step": ((0.3,), lambda x: np.array([1.0 if v > 0.3 else 0.0 for v in x])),
    "rise": ((0.3, 0.5), lambda x: (np.exp(4 * (x - 0.3)) - 1) / (np.exp(4 * (x - 0.3)) + 1)),
    "kink": ((0.3,), lambda x: np.array([v - 0.3 if v > 0.3 else 0.3 - v for v in x])),
    "above": ((0.3,), lambda x: np.array([v - 0.3 if v > 0.3 else 0.0 for v in x])),
    "below": ((0.3,), lambda x: np.array([0.3 - v if v < 0.3 else 0.0 for v in x])),
    "above_squared": ((0.3,), lambda x: np.array([(v - 0.3) ** 2 if v > 0.3 else 0.0 for v in x])),
    "below_squared": ((0.3,), lambda x: np.array([(v - 0.3) ** 2 if v < 0.3 else 0.0 for v in x])),
    "sided_above": ((0.3,), lambda x: np.array([v - 0.3 if v > 0.3 else v + 0.3 if v < -0.3 else 0.0 for v in x])),
    "sided_below": ((1.0,), lambda x: np.array([1 - v if 0 < v < 1 else -1 - v if -1 < v < 0 else 0.0 for v in x])),
    "window": ((-1.0, 0.5), lambda x: np.array([1.0 if -1 < v < 0.5 else 0.0 for v in x])),
    "bump": ((0.3, 0.5), lambda x: np.exp(-2 * (x - 0.3) ** 2)),
    "level": ((0.1, 0.25), lambda x: np.array([1.0 if 0.15 < v < 0.35 else 0.0 for v in x])),
    "either_level": ((0.1, 0.25, -1.05), lambda x: np.isin(x, [0.3, -1.0]) * 1.0),
    "spline": ((-1.0, 0.25, 2.0), lambda x: np.interp(x, [-1.0, 0.25, 2.0], [0.0, 1.0, 0.0])),
    "levelling": ((0.5,), lambda x: (np.exp(4 * x) - 1) / (np.exp(4 * x) + 1)),
    "settling": ((-1.0, 2.0), lambda x: np.exp(-0.5) * np.exp(-x / 2)),
    "logarithm": ((-1.0, 2.0), lambda x: np.array([np.log(1 + (v + 1) / 2) if v > -1 else 0.0 for v in x])),
    "harmonic": ((3.0, 0.4), lambda x: np.cos(3 * x) * np.cos(0.4) + np.sin(3 * x) * np.sin(0.4)),
    "folded": ((3.0, 0.1), lambda x: np.sqrt(0.5 + 0.5 * np.cos(3 * x - 0.2 * np.pi))),
    "halved": ((3.0, 0.1), lambda x: 0.5 * (np.cos(3 * x - 0.2 * np.pi) + np.abs(np.cos(3 * x - 0.2 * np.pi)))),
    "triangular": ((3.0, 0.1), lambda x: triangle(x, 3.0, 0.1)),
    "saw_tooth": ((3.0, 0.1), lambda x: np.angle(-np.exp(1j * (3 * x - 0.2 * np.pi))) / np.pi),
    "pulse": ((3.0, 0.1, 0.3), lambda x: (np.angle(-np.exp(1j * (3 * x - 0.2 * np.pi))) < -0.4 * np.pi) * 1.0),
}
"""By name: numbers, and the function written another way."""


@pytest.mark.parametrize("name", sorted(BASES))
def test_a_function_has_the_values_of_its_formula(name):
    numbers, expected = LAWS[name]
    assert_allclose(law_of(name)(X, *numbers) * 1.0, expected(X), atol=1e-12)
    assert len(BASES[name].numbers) == len(numbers)


@pytest.mark.parametrize(
    ("gate", "of_g"), [("only", lambda g: g), ("except", lambda g: 1 - g), ("reversed", lambda g: 1 - 2 * g)]
)
def test_a_gate_acts_on_one_side_or_turns_it_round(gate, of_g):
    assert_allclose(law_of(f"{gate} step")(X, 0.3), of_g(LAWS["step"][1](X)))


def test_many_waves_at_once_are_exact_to_single_precision():
    orders, phases = np.arange(1.0, 129.0)[:, None], np.linspace(0, 3, 128)[:, None]
    every = law_of("harmonic")(np.linspace(-6, 3, 500), orders, phases)
    assert_allclose(every, np.cos(orders * np.linspace(-6, 3, 500) - phases), atol=5e-7)


def curve(place, channels="q2 * temperature", basis="harmonic * line", numbers=(2.0, 0.3, 20.0), largest=4.0, **sizes):
    return ChannelCurve(
        place=(place,), channels=(channels,), basis=(basis,), numbers=numbers, largest=(largest,),
        point_m=POINT, instrument_m_rad=PLACE, **sizes,
    )  # fmt: skip


F = np.cos(2 * STATE.q[:, 1] - 0.3) * (STATE.temperature - 20) / 4
SHIFT, TURN = np.array([1e-4, -2e-4, 3e-4]), np.array([2e-4, 1e-4, -4e-4])
PUSH, PULL = np.split(STATE.body_load[:, 0], 2, axis=1)
LEAN = PULL + np.cross([0, 0, 0.5], PUSH)
TIP = LEAN[:, :2] / np.linalg.norm(LEAN[:, :2], axis=1, keepdims=True)
SEEN = seen_points(tool_points(STATE)[1])
FAR, LEVEL = np.linalg.norm(SEEN, axis=1), np.linalg.norm(SEEN[:, :2], axis=1)


def rows(factor, *parts):
    """(n, 6) of a factor (n,) times parts (3,) or (n, 3)."""
    return np.hstack([factor[:, None] * part for part in parts])


NOTHING = np.zeros((len(STATE), 3))
ROUND = np.stack([-SEEN[:, 1], SEEN[:, 0], 0 * FAR], axis=1)
UP = np.stack([-SEEN[:, 0] * SEEN[:, 2] / LEVEL, -SEEN[:, 1] * SEEN[:, 2] / LEVEL, LEVEL], axis=1)
BOTH = {"shift_m": SHIFT, "turn_rad": TURN}
MOVED = {
    "base": ({"turn_rad": TURN}, rows(F, NOTHING, TURN)),
    "base, shifted and turned": (BOTH, rows(F, SHIFT, TURN)),
    "base, as it leans": (
        {"turn_rad": [3e-4], "shift_m": [2e-4]},
        rows(F, 2e-4 * np.column_stack([TIP[:, 1], -TIP[:, 0], 0 * F]), 3e-4 * np.column_stack([TIP, 0 * F])),
    ),
    **{f"body {b}": ({"turn_rad": TURN}, rows(F, NOTHING, TURN)) for b in range(1, 6)},
    **{f"body {b}, shifted": ({"shift_m": SHIFT}, rows(F, SHIFT, NOTHING)) for b in range(1, 6)},
    "tool": ({"shift_m": SHIFT}, rows(F, SHIFT, NOTHING)),
    "tool, shifted and turned": (BOTH, rows(F, SHIFT, TURN)),
    "instrument": ({"shift_m": SHIFT}, rows(F, SHIFT, NOTHING)),
    "instrument, turned": ({"turn_rad": TURN}, rows(F, NOTHING, TURN)),
    "instrument, shifted and turned": (BOTH, rows(F, SHIFT, TURN)),
    "instrument, azimuth": ({"turn_rad": [3e-4]}, rows(3e-4 * F, ROUND, NOTHING)),
    "instrument, elevation": ({"turn_rad": [3e-4]}, rows(3e-4 * F, UP, NOTHING)),
    "instrument, distance": ({"shift_m": [3e-4]}, rows(3e-4 * F, SEEN / FAR[:, None], NOTHING)),
    "instrument, scale": ({"share": [3e-5]}, rows(3e-5 * F, SEEN, NOTHING)),
}
"""By place: amplitudes, and how the base, a body, the tool or the instrument moves."""


@pytest.mark.parametrize("place", sorted(MOVED))
def test_a_place_moves_with_the_product_of_its_functions(place):
    sizes, expected = MOVED[place]
    moved = displacement_of(curve(place, **sizes), STATE)
    part = place.partition(",")[0]
    found = moved.body.get(int(part[5:]) if part.startswith("body") else 0, getattr(moved, part, None))
    assert_allclose(found, expected, atol=1e-15)


def test_every_place_is_moved_or_loaded_here():
    assert {p for p in PLACES if not p.startswith("joint") and "weight" not in p} == set(MOVED)


@pytest.mark.parametrize("joint", range(1, 7))
def test_a_joint_turns_with_the_product_of_its_functions(joint):
    one = curve(f"joint {joint}", turn_rad=[3e-4])
    expected = np.zeros((len(STATE), 6))
    expected[:, joint - 1] = 3e-4 * F
    assert_allclose(displacement_of(one, STATE).joint, expected, atol=1e-15)
    basis = one.joint_basis(STATE)
    assert basis.joint.tolist() == [joint - 1] and basis.values[:, 0] == pytest.approx(F)


@pytest.mark.parametrize(
    ("place", "body"), [("body 2, under a weight", 2), ("body 3, under a weight", 3), ("tool, under a weight", 6)]
)
def test_a_weight_pulls_its_body_down_where_its_centre_is(place, body):
    moment = np.array([0.3, -0.2, 0.5])
    one = curve(place, mass_kg=[4.0], moment_kgm=moment)
    pull = 4.0 * F[:, None] * STATE.gravity
    frame = STATE.T_base_body[:, body]
    centre = frame[:, :3, :3] @ (moment / 4.0) + frame[:, :3, 3]
    assert_allclose(load_of(one, STATE).body[body], np.hstack([pull, np.cross(centre, pull)]), atol=1e-12)
    assert not displacement_of(one, STATE).body and one.joint_basis(STATE) is None


def two_terms() -> ChannelCurve:
    first = curve("instrument", "seen_elevation", "only window", (0.1, 0.4), 1.0, gap=(0.02, 0.03), shift_m=SHIFT)
    return first.plus(curve("joint 2", "lag(temperature, 10 min)", "line", (0.0,), 5.0, turn_rad=[2e-4]))


def test_terms_add_up():
    both = two_terms()
    seen = in_order([c for t in both.terms for c, *_ in t.factors], STATE, SITE)
    moved = displacement_of(both, seen)
    up = np.arcsin(SEEN[:, 2] / FAR)
    assert_allclose(moved.instrument[:, :3], np.outer((up > 0.1) & (up < 0.4), SHIFT))
    assert_allclose(moved.joint[:, 1], 2e-4 * seen.channels["lag(temperature, 10 min)"] / 5.0)
    assert both.joint_basis(seen) is None and both.site == Site(POINT, PLACE)
    assert set(both.reads) == {"pose", "robot", "temperature", "time", "lag(temperature, 10 min)"}


@pytest.mark.parametrize("place", sorted({p for p in PLACES if p[:4] in ("join", "base", "tool", "inst", "body")}))
def test_the_slope_is_that_of_central_differences(place):
    """Linear in every amplitude, of displacement and load, and null without any."""
    null = curve(place)
    assert null.is_null and len(null.vector()) == sum(count for _, count in PLACES[place])

    def answer(x):
        effect = null.with_vector(x)
        moved, load = displacement_of(effect, STATE), load_of(effect, STATE)
        parts = [moved.joint, moved.tool, moved.instrument, *moved.body.values(), *load.body.values()]
        return sum((p for p in parts if p is not None), np.zeros((len(STATE), 6)))

    assert not answer(null.vector()).any()
    x, step = null.scale() * np.arange(1.0, len(null.vector()) + 1), np.diag(null.scale())
    slope = np.stack([(answer(x + s) - answer(x - s)) / 2 for s in step], axis=2)
    assert all(np.any(slope[:, :, k]) for k in range(len(x)))
    assert_allclose(slope.sum(axis=2), answer(null.scale()), atol=1e-12)


def test_an_edge_may_lie_at_either_of_the_values_beside_it():
    pairs = list(two_terms().undecided())
    ends = [[one.numbers for one in pair] for pair in pairs]
    assert_allclose(ends, [[(0.09, 0.4, 0.0), (0.11, 0.4, 0.0)], [(0.1, 0.385, 0.0), (0.1, 0.415, 0.0)]])
    assert not list(curve("joint 2").undecided())


def test_a_curve_comes_back_from_a_model_file(tmp_path):
    model, both = default_model(), two_terms()
    file = tmp_path / "model.toml"
    file.write_text(render_model(replace(model, effects=(*model.effects, both))))
    again = read_model(file).effect("curve")
    assert isinstance(again, ChannelCurve) and again.to_file() == both.to_file()
    assert set(both.to_file()) == {*both.structures(), "turn_rad", "shift_m"}
    seen = in_order([c for t in both.terms for c, *_ in t.factors], STATE, SITE)
    assert_allclose(displacement_of(again, seen).instrument, displacement_of(both, seen).instrument, atol=1e-10)
    plain = curve("joint 2", "q2", "line", (1 / 3,), 1.0, turn_rad=[1e-4 / 3]).to_file()
    assert set(plain) == {"place", "channels", "basis", "numbers", "largest", "turn_rad"}
    assert plain["numbers"] == [0.3333333] and plain["turn_rad"] == [3.333333e-5]


TABLE = {
    "place": ["joint 2"], "channels": ["q2 * temperature"], "basis": ["step * line"],
    "numbers": [0.3, 20.0], "largest": [4.0], "turn_rad": [1e-4],
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "code", "said"),
    [
        ({"size": 1.0}, "EFF021", "`curve` has no parameter `size`"),
        ({"largest": [1.0, 2.0]}, "EFF022",
         "`place`, `channels`, `basis` and `largest` of `curve` have different lengths"),
        ({"basis": ["step"]}, "EFF022", "`step` has not one function for each channel of `q2 * temperature`"),
        ({"numbers": [0.3]}, "EFF022", "`numbers` of `curve` has 1 numbers"),
        ({"gap": [0.1]}, "EFF022", "`gap` of `curve` has another length than `numbers`"),
        ({"turn_rad": [1e-4, 1e-4]}, "EFF022", "`turn_rad` of `curve` has 2 numbers"),
        ({"place": "joint 2"}, "EFF023", "`place` of `curve` is not a list of words"),
        ({"numbers": ["a", "b"]}, "EFF023", "`numbers` of `curve` is not a list of numbers"),
        ({"place": ["joint 7"]}, "EFF023", "`joint 7` is no place"),
        ({"channels": ["q2 * log(q1)"]}, "EFF023",
         "`log(q1)` is no channel: `log` is no function: "
         "abs, lag, creep, play, before, rise, azimuth, seen_azimuth, lean"),
        ({"basis": ["steep * line"]}, "EFF023", "`steep` is no function"),
        ({"basis": ["where step * line"]}, "EFF023", "`where step` is no function"),
        ({"largest": [0.0]}, "EFF024", "`largest` of `curve` is 0"),
        ({"gap": [-0.1, 0.0]}, "EFF024", "`gap` of `curve` is -0.1"),
        ({"turn_rad": [0.5]}, "EFF024", "`turn_rad` of `curve` is 0.5 rad"),
    ],
)  # fmt: skip
def test_a_wrong_table_says_what_is_wrong(changes, code, said):
    lines = "".join(f"{name} = {value!r}\n".replace("'", '"') for name, value in {**TABLE, **changes}.items())
    text = f'robot = "irb4600_60_205"\n[effects.curve]\n{lines}'
    assert tomllib.loads(text)
    (found,) = refused(lambda: parse_model(Source("model.toml", text.encode())))
    assert (found.code, found.message) == (code, said)


@pytest.mark.parametrize(
    ("one", "said"),
    [
        (curve("joint 2", turn_rad=[4.8e-4]), "delta q2 = 0.12 mrad cos(2 q2 - 0.3) (temperature - 20 degC)"),
        (curve("tool", "q5", "except step", (np.radians(20),), 1.0, shift_m=SHIFT),
         "shift of tool = (0.1, -0.2, 0.3) mm (1 - [q5 > 20 deg])"),
        (curve("instrument, scale", "rail_m", "bump", (1.5, 0.2), 0.5, share=[1e-5]),
         "scale of instrument, scale = 20 ppm exp(-((rail_m - 1.5) / 0.2)^2 / 2)"),
        (curve("tool, under a weight", "level", "line", (0.0,), 2.0, mass_kg=[3.0]),
         "mass of tool, under a weight = 1.5 kg level"),
    ],
)  # fmt: skip
def test_a_curve_is_written_in_symbols(one, said):
    assert next(iter(one.symbols())) == said


def test_every_function_has_its_symbols():
    for name, (numbers, _) in LAWS.items():
        text = symbols(f"only {name}", "q2", [f"n{k}" for k in range(len(numbers))])
        assert "q2" in text and all(f"n{k}" in text for k in range(len(numbers))) and "{" not in text
