"""What remains without a name as a file: its law is that of the pattern, and with it the error falls to the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.channels.state import State
from postproc.effects.base import Effect
from postproc.effects.conformance.kit import check_effect
from postproc.effects.loading import load_effect_file
from postproc.estimation.channels import channels
from postproc.identification.add import add_effects
from postproc.identification.diagnose import diagnose
from postproc.patterns.curves import BOW, BUMP, KINK, LINE, RISE, STEP, WAVE, settling, sharper
from postproc.patterns.dictionary import each_word, patterns, words
from postproc.patterns.formula import Group, Pattern, block
from postproc.patterns.screening import PatternScreen
from postproc.patterns.signals import Movable, Way, channel_signal, channels_read, text_of
from postproc.render.effect_file import effect_file, nothing_to_draft
from postproc.robot.catalogue import load_robot
from tests.identification.cells import base_fit, cell, hidden_found, law, true_error
from tests.independent import arm as A
from tests.independent import unknown_effects as unknown
from tests.independent.cells import Hidden
from tests.patterns.test_patterns import best, closest

Channels = dict[str, np.ndarray]


def drawn(seed: int, n: int) -> tuple[State, Channels]:
    g = np.random.default_rng(seed)
    q, v, load = g.uniform(-2, 2, (n, 6)), g.normal(0, 1, (n, 6)), g.normal(0, 400, (n, 6))
    side, hot = g.choice([-1.0, 1.0], (n, 6)), g.uniform(15, 40, n)
    T = np.tile(np.eye(4), (n, 7, 1, 1))
    T[:, 6, :3, :3], T[:, 6, :3, 3] = Rotation.random(n, random_state=seed).as_matrix(), g.uniform(-1, 1, (n, 3))
    state = State(
        q=q, v=v, approach=side, joint_load=load, temperature=hot, channels={"cable": g.uniform(0, 1, n)},
        T_base_body=T, robot=load_robot("ur5"), payload_mass=g.choice([3.0, 10.0, 20.0], n),
    )  # fmt: skip
    channels = {
        f"{name}{j + 1}": x[:, j] for name, x in (("q", q), ("v", v), ("dir", side), ("load", load)) for j in range(6)
    }
    found = {"temperature": hot, "cable": state.channels["cable"], "payload": state.payload_mass, "T": T}
    return state, {**channels, **found}  # fmt: skip


TOOL = np.array([0.02, -0.01, 0.35])


def tool_place(channels: Channels) -> np.ndarray:
    flange = channels["T"][:, 6] @ load_robot("ur5").link[6]
    return np.asarray(flange[:, :3, :3] @ TOOL + flange[:, :3, 3])


LAWS: list[tuple[tuple[str, ...], Callable[[Channels], np.ndarray]]] = [
    (("q2",), lambda c: (c["q2"] > 0.4).astype(float)),
    (("q3",), lambda c: np.abs(c["q3"] + 0.3)),
    (("q1",), lambda c: ((c["q1"] > 0.2) & (c["q1"] < 1.5)).astype(float)),
    (("load5",), lambda c: c["load5"] * np.abs(c["load5"]) / 1e6),
    (("v4",), lambda c: np.sign(c["v4"]) * np.maximum(np.abs(c["v4"]) - 0.8, 0)),
    (("temperature",), lambda c: np.tanh((c["temperature"] - 25) / 3)),
    (("cable",), lambda c: np.maximum(c["cable"] - 0.6, 0)),
    (("payload",), lambda c: (c["payload"] == 10).astype(float)),
    (("z",), lambda c: np.maximum(0.1 - tool_place(c)[:, 2], 0)),
    (("q5", "q6", "q4", "q3", "q2"), lambda c: (c["T"][:, 6, 2, 1] < 0.3).astype(float)),
    (("payload", "q5", "q6", "q4"), lambda c: c["payload"] * c["T"][:, 6, 2, 0]),
    (("q2", "q3"), lambda c: (c["q2"] + c["q3"] > 0.2).astype(float)),
    (("q2", "q3"), lambda c: np.sin(3 * (c["q2"] + c["q3"]) + 0.5)),
    (("q4", "q5"), lambda c: np.maximum(c["q4"] - c["q5"] - 1, 0)),
    (("q2", "q3", "q4"), lambda c: np.maximum(c["q2"] + c["q3"] + c["q4"], 0)),
    (("dir2", "load2"), lambda c: c["dir2"] * np.abs(c["load2"])),
    (("v1", "load2"), lambda c: np.sign(c["v1"]) * np.abs(c["load2"])),
    (("q1", "temperature"), lambda c: c["q1"] * c["temperature"]),
    (("q5", "load5"), lambda c: np.cos(c["q5"] - 0.4) * c["load5"]),
    (("q4",), lambda c: np.cos(37 * c["q4"] + 1)),
    (("q1",), lambda c: np.mod(5 * c["q1"] / (2 * np.pi) - 0.2, 1)),
    (("q4", "q6"), lambda c: np.sin(c["q4"] - 0.2) * np.cos(2 * c["q6"] + 0.7)),
]


@pytest.mark.parametrize(("names", "formula"), LAWS, ids=[" ".join(names) for names, _ in LAWS])
def test_the_text_of_a_pattern_holds_in_other_poses(
    names: tuple[str, ...], formula: Callable[[Channels], np.ndarray]
) -> None:
    state, channels = drawn(1, 200)
    position, truth = tool_place(channels), formula(channels)
    some = {name: position[:, 2] if name == "z" else channels[name] for name in names}
    every = patterns(some, state, position).every
    told = closest(best([p for p in every if set(p.channels) == set(names)], truth), truth)
    there, elsewhere = drawn(2, 300)
    said, true = eval(text_of(told.drafts[0]), {"np": np, "state": there}) * 1.0, formula(elsewhere)
    assert np.std(truth) > 0 and abs(np.corrcoef(said, true)[0, 1]) > 0.95
    assert channels_read(text_of(told.drafts[0])) == tuple(dict.fromkeys(channels_read(text_of(told.drafts[0]))))


def test_every_pattern_has_the_values_of_its_text() -> None:
    state, channels = drawn(3, 60)
    docks = {"dock": np.arange(60.0) % 5, **{f"shift={w}": np.arange(60) % 3 == k for k, w in enumerate("abc")}}
    state = state.with_(channels={**state.channels, **docks}, time=np.arange(60.0))
    channels |= {**docks, "time": np.arange(60.0)}
    some = {
        name: channels[name]
        for name in ("q2", "q3", "dir3", "load3", "temperature", "cable", "payload", "time", *docks)
    }
    whole = patterns({**some, "x": tool_place(channels)[:, 0]}, state, tool_place(channels))
    every = [*list(whole.every)[::7], *whole.wide]
    finer = [p for one in every[::9] for p in list(sharper(one))[::19]]
    told = [p for p in (*every, *finer) if p.raw.any() and p.drafts]
    assert len(told) > 0.8 * len(every)
    for pattern in told:
        said = [
            np.asarray(eval(code, {"np": np, "state": state}), dtype=float) for code in map(text_of, pattern.drafts)
        ]
        values = pattern.values if pattern.wide else pattern.values[:, None]
        np.testing.assert_allclose(np.stack(said, axis=1), values, rtol=0, atol=2e-3, err_msg=pattern.text)
    side = next(p for p in whole.every if p.kind == "line" and p.channels == ("dir3",))
    for values, group in whole.grown(side):
        for k in range(0, len(group), 101):
            assert eval(text_of(group[k].drafts[0]), {"np": np, "state": state}) == pytest.approx(
                group[k].values, abs=1e-5
            )
            assert group[k].values == pytest.approx(values[:, k], abs=1e-6)
    before = [p for p in every if "row before" in p.text]
    assert before and not any(p.drafts for p in before)


def test_what_a_law_reads_is_taken_from_its_text() -> None:
    code = 'state.approach[:, 0] * (state.joint_load[:, 1] > 3) + state.channels["arc_V"] * state.payload_mass'
    assert channels_read(code) == ("approach", "load", "arc_V", "payload")
    assert channels_read(channel_signal('arm 5" \\ 7', np.zeros(3)).code) == ('arm 5" \\ 7',)
    assert channels_read("state.T_base_body[:, 6] @ state.robot.link[6] @ state.T_flange_tcp") == ("pose", "robot")


def nest(g, arm) -> Hidden:
    """The reflector's nest shows its two lobes to the beam: its distance is off by where that comes from."""

    def world(s, p):
        turn, beam = arm.forward(s.q, np.eye(4)).flange[:, :3, :3], p / np.linalg.norm(p, axis=1)[:, None]
        seen = np.einsum("nji,nj->ni", turn, beam)
        return 3e-4 * np.cos(2 * np.arctan2(seen[:, 1], seen[:, 0]) - 0.7)[:, None] * beam

    return Hidden("nest", "unknown", channels=("q5", "q6", "q4"), world=world)


def soft_tool(g, arm) -> Hidden:
    """A torch on a rubber mount, softer across its axis than along it."""

    def world(s, p):
        turn = arm.forward(s.q, np.eye(4)).flange[:, :3, :3]
        return np.einsum("nij,j,nkj,k->ni", turn, [6e-5, 6e-5, 2e-5], turn, A.G)

    return Hidden("soft_tool", "unknown", channels=("q5", "q6", "q4"), world=world)


def sprung_cart(g, arm) -> Hidden:
    """A cart on disc springs half a metre below: it leans as the arm pulls it, to its stops."""

    def body(s, f, wrench):
        moment = (wrench[:, 0, 3:] + np.cross(arm.link[0][:3, 3], wrench[:, 0, :3])) * [1.0, 1.0, 0.0]
        size = np.linalg.norm(moment, axis=1, keepdims=True)
        tip = 2e-4 * np.tanh(size / 500.0) * moment / size
        xi = np.zeros((len(s), 7, 6))
        xi[:, 0] = np.hstack([np.cross(tip, arm.link[0][:3, 3] + [0.0, 0.0, 0.5]), tip])
        return xi

    return Hidden("sprung_cart", "unknown", channels=("load2",), body=body)


def filled_tank(g, arm) -> Hidden:
    """A tank on the forearm's housing that is fuller the warmer it is."""

    def force(s, f):
        p = f.body[3][:, :3, 3] + f.body[3][:, :3, :3] @ [0.3, 0.05, 0.2]
        return A.Wrenches([A.point_load(3, p, litres(s.temperature)[:, None] * A.G)])

    return Hidden("filled_tank", "unknown", channels=("litres",), force=force)


def litres(temperature: np.ndarray) -> np.ndarray:
    return np.maximum(3.0 * (temperature - 19.0), 0.0)


def drafted(folder: Path, text: str | None) -> type[Effect]:
    """The effect of a file that was drafted."""
    assert text is not None
    path = folder / "own.py"
    path.write_text(text, encoding="utf-8")
    [effect] = load_effect_file(path)
    assert check_effect(effect) == []
    return effect


@pytest.mark.parametrize(
    ("kind", "seed", "poses"),
    [(unknown.angle_step, 401, 120), (nest, 404, 60), (soft_tool, 405, 60)],
)
def test_a_drafted_effect_brings_the_error_down_to_the_noise(
    tmp_path: Path, kind: Callable[..., object], seed: int, poses: int
) -> None:
    data, true = cell(kind, seed=seed, poses=poses)
    found = hidden_found(kind, seed=seed, poses=poses)
    key, text = effect_file(found, "Nobody-knows 2", "cell.csv")
    assert (key, found.verdict, found.missing) == ("nobody_knows", "unknown", ())
    effect = drafted(tmp_path, text)
    assert effect.key == key
    grown = add_effects(found.base.model, data, [key], [effect])
    assert true_error(grown.fit, true) < 0.6 * 0.03e-3


def test_a_footing_that_leans_is_drafted_about_its_own_place(tmp_path: Path) -> None:
    data, true = cell(sprung_cart, seed=407, poses=60)
    fit = base_fit(data)
    state, position = fit.problem.sensitivity.state, fit.problem.equilibrium.T_base_tcp[:, :3, 3]
    first = PatternScreen(fit.problem, fit.linear, patterns(channels(state, position), state, position)).suspects()[0]
    assert first.where == "base, as it leans"
    found = SimpleNamespace(suspects=(first,), beside=(), searched=fit)
    effect = drafted(tmp_path, effect_file(found, "own", "cell.csv")[1])  # type: ignore[arg-type]
    assert true_error(add_effects(fit.model, data, ["own"], [effect]).fit, true) < 0.6 * 0.03e-3


def test_a_weight_that_follows_a_column_is_drafted_as_a_load(tmp_path: Path) -> None:
    data, true = (
        replace(rows, state=rows.state.with_(channels={"litres": litres(rows.state.temperature)}))
        for rows in cell(filled_tank, seed=408, poses=60)
    )
    found = diagnose(base_fit(data).model, data)
    assert (found.verdict, found.missing) == ("unknown", ())
    assert [(s.channel, s.where) for s in found.suspects[:1]] == [("litres", "body 3, under a weight")]
    effect = drafted(tmp_path, effect_file(found, "own", "cell.csv")[1])
    assert set(effect.parameters()) == {"size_kg", "size_kgm"}
    grown = add_effects(found.base.model, data, ["own"], [effect])
    assert true_error(grown.fit, true) < 0.6 * 0.03e-3


MOVED: list[tuple[str, str, tuple[str, ...], Callable[..., np.ndarray]]] = [
    ("temperature", "growing to either side of 20", ("knot_K",), lambda x, k: (x - k) ** 2),
    ("temperature", "rising about", ("knot_K", "width_K"), lambda x, k, w: np.tanh((x - k) / w)),
    ("cable", "growing with the logarithm", ("width",), lambda x, w: np.log1p(np.maximum(x - X.min(), 0) / w)),
    ("q3", "kink near", ("knot_rad",), lambda x, k: np.abs(x - k)),
    ("load4", "bump near", ("knot_Nm", "width_Nm"), lambda x, k, w: np.exp(-0.5 * ((x - k) / w) ** 2)),
    ("q2", "wave 2.5 times a turn", ("order", "phase_rad"), lambda x, n, p: np.cos(n * x - p)),
    ("q2", "wave 2 times a turn", ("phase_rad",), lambda x, p: np.cos(2 * x - p)),
]
X = np.linspace(16.0, 30.0, 60)


def test_a_number_that_may_move_has_the_unit_and_the_room_that_its_channel_gives() -> None:
    """A knot within what was measured (or where it stands), a width by ten, an order by half a wave over all of it."""
    hot = channel_signal("temperature", X)
    assert Movable(20.0, "knot", hot).way == Way("knot", "20", "K", "16", "30", "1.4")
    assert Movable(12.0, "knot", hot).way == Way("knot", "12", "K", "12", "30", "1.4")
    assert Movable(33.0, "knot", hot).way == Way("knot", "33", "K", "16", "33", "1.4")
    assert Movable(2.0, "width", hot).way == Way("width", "2", "K", "0.2", "20", "0.6")
    turned = channel_signal("q2", np.linspace(-0.5, 0.5, 60) * np.pi)
    assert Movable(2.5, "order", turned).way == Way("order", "2.5", "1", "1.5", "3.5", "0.3")
    assert Movable(0.0, "phase", turned).way == Way("phase", "0", "rad", "-3.141593", "3.141593", "0.3")
    assert Movable(0.4, "knot", channel_signal("cable", X)).way.unit == "1"


def bent(channel: str, form: str, rows: int) -> Pattern:
    """A pattern of a channel whose values are X, over and over in so many rows."""
    signal = channel_signal(channel, np.resize(X, rows))
    every = {
        "growing to": (BOW, 20.2),
        "rising": (RISE, 24.0, 2.0),
        "growing with": (settling(signal)[1], 3.0),
        "kink": (KINK, 21.0),
        "bump": (BUMP, 22.0, 1.5),
        "wave 2.5": (WAVE, 2.5, 0.4),
        "wave 2 ": (WAVE, 2.0, 0.4),
    }
    curve, *numbers = next(made for start, made in every.items() if form.startswith(start))
    return block(curve, signal, [numbers])[0]


@pytest.mark.parametrize(("channel", "form", "names", "law"), MOVED, ids=[form for _, form, *_ in MOVED])
def test_what_forms_a_law_is_a_parameter_of_its_draft(
    tmp_path: Path, channel: str, form: str, names: tuple[str, ...], law: Callable[..., np.ndarray]
) -> None:
    found = hidden_found(unknown.angle_step, seed=401)
    pattern = bent(channel, form, len(found.suspects[0].values))
    assert pattern.text.startswith(form)
    first = replace(found.suspects[0], where="joint 2", form=pattern, channel=channel)
    # The same law at another place has the same numbers.
    also = replace(first, where="tool", place=np.repeat(first.place, 3, axis=2))
    text = effect_file(replace(found, suspects=(first,), beside=(also,)), "own", "cell.csv")[1]
    effect = drafted(tmp_path, text)
    assert set(effect.parameters()) == {"size_rad", "size2_m", *names}
    null = effect.null()
    numbers = 1.05 * null.vector()[~null.amplitudes()]
    moved = null.with_vector(np.concatenate([[1e-3, 0.0, 0.0, 0.0], numbers])).displacement(
        State(
            q=np.outer(X, np.ones(6)), joint_load=np.outer(X, np.ones(6)), temperature=X, channels={"cable": X}
        )
    )  # fmt: skip
    largest = np.abs(law(X, *null.vector()[~null.amplitudes()])).max()
    assert moved.joint[:, 1] == pytest.approx(1e-3 * law(X, *numbers) / largest, rel=2e-3, abs=1e-6)


def square_of_warmth(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """The tool's holder bows with the square of how far it is from the temperature at which it was made."""

    def world(s, p):
        turn = arm.forward(s.q, np.eye(4)).flange[:, :3, :3]
        return 2e-5 * (s.temperature[:, None] - 28.43) ** 2 * (turn @ [0.3, -0.8, 0.5])

    return Hidden("square_of_warmth", "unknown", channels=("temperature",), world=world)


def test_a_knot_is_fitted_with_its_law(tmp_path: Path) -> None:
    data, true = cell(square_of_warmth, seed=411, poses=60)
    found = hidden_found(square_of_warmth, seed=411, poses=60)
    effect = drafted(tmp_path, effect_file(found, "own", "cell.csv")[1])
    grown = add_effects(found.base.model, data, ["own"], [effect])
    fitted = grown.fit.model.effect("own")
    assert fitted is not None and fitted.knot_K == pytest.approx(28.43, abs=0.05)
    assert true_error(grown.fit, true) < 0.4 * 0.03e-3


def test_a_key_of_the_library_is_not_taken() -> None:
    found = hidden_found(unknown.angle_step, seed=401)
    assert effect_file(found, "backlash", "cell.csv")[0] == "own_backlash"
    assert effect_file(found, "77", "cell.csv")[0] == "own"
    beside = replace(found.suspects[0], where="body 4, shifted", place=np.repeat(found.suspects[0].place, 3, axis=2))
    text = effect_file(replace(found, suspects=(beside,)), "own", "cell.csv")[1]
    assert text is not None
    assert "body_4[:, :3] += np.outer(shape, self.size_m)" in text
    assert "always_m: Array" in text
    assert "Displacement(body={4: body_4})" in text


def test_what_was_found_beside_the_first_pattern_is_drafted_with_it(tmp_path: Path) -> None:
    found = hidden_found(unknown.angle_step, seed=401)
    first = found.suspects[0]
    cosine = law("q6", first.values, code="np.cos(2 * state.q[:, 5])")
    wave = replace(first, where="tool", place=np.repeat(first.place, 3, axis=2), form=cosine, channel="q6")
    warm = law("temperature", first.values, code="state.temperature > 21")
    more = replace(first, where="joint 5", form=warm, channel="temperature")
    never = replace(more, form=law("temperature", first.values))
    text = effect_file(replace(found, beside=(wave, more, never)), "own", "cell.csv")[1]
    effect = drafted(tmp_path, text)
    assert set(effect.parameters()) == {"size_rad", "size2_m", "size3_rad"} and set(effect.reads) == {
        "q",
        "temperature",
    }
    q = np.zeros((2, 6))
    q[1, 5] = np.pi / 4
    moved = effect.null().with_vector(np.array([0.0, 1e-3, 0.0, 0.0, 2e-3])).displacement(
        State(q=q, temperature=np.array([20.0, 25.0]))
    )  # fmt: skip
    assert moved.tool[:, 0] == pytest.approx([1e-3, 0.0], abs=1e-12)
    assert moved.joint[:, 4] == pytest.approx([0.0, 2e-3])


def test_where_no_pose_tells_the_first_what_tells_most_of_its_place_is_drafted() -> None:
    """Not what was found beside it and is little alone."""
    found = hidden_found(unknown.angle_step, seed=401)
    values = found.suspects[0].values
    first = replace(found.suspects[0], form=law("temperature", values, "following temperature with a lag"))
    little = replace(first, share=0.01, form=law("time", values, code="np.cos(state.time)"))
    most = replace(first, share=0.9, form=law("temperature", values, code="state.temperature"))
    text = effect_file(replace(found, suspects=(first, little, most), beside=(little,)), "own", "cell.csv")[1]
    assert text is not None
    assert "state.temperature" in text and "np.cos(state.time)" not in text


def test_a_column_with_quotes_in_its_name_is_drafted(tmp_path: Path) -> None:
    found = hidden_found(unknown.angle_step, seed=401)
    name = 'hose 5" \\ 7'
    [own] = block(LINE, channel_signal(name, np.arange(9.0)))
    own = replace(own, factors=((LINE, channel_signal(name, found.suspects[0].values)),))
    size = replace(found.suspects[0], channel=name, form=own)
    text = effect_file(replace(found, suspects=(size,), beside=()), "own", 'a """b""".csv')[1]
    effect = drafted(tmp_path, text)
    assert effect.reads == (name,) and name in str(effect.__doc__)


def test_each_level_of_a_column_is_drafted_with_a_size_of_its_own(tmp_path: Path) -> None:
    found = hidden_found(unknown.angle_step, seed=401)
    word = {f"dock={w}": (np.arange(len(found.suspects[0].values)) % 3 == k) * 1.0 for k, w in enumerate("abc")}
    [each] = each_word(words({n: channel_signal(n, x) for n, x in word.items()})["dock"])
    docks = replace(found.suspects[0], form=each, channel="dock")
    text = effect_file(replace(found, suspects=(docks,), beside=()), "own", "cell.csv")[1]
    effect = drafted(tmp_path, text)
    assert set(effect.parameters()) == {"size_a_rad", "size_b_rad"} and effect.reads == ("dock=b", "dock=c")
    moved = effect.null().with_vector(np.array([1e-3, 2e-3])).displacement(
        State(q=np.zeros((3, 6)), channels={name: x[:3] for name, x in word.items()})
    )  # fmt: skip
    assert np.abs(moved.joint).max(axis=1) == pytest.approx([0.0, 1e-3, 2e-3])


def test_why_nothing_was_drafted_is_said() -> None:
    none = nothing_to_draft(SimpleNamespace(suspects=()))  # type: ignore[arg-type]
    assert (none.code, none.severity) == ("DAT028", "info")
    assert "nothing remains" in none.message
    one = SimpleNamespace(where="joint 2", pattern="step in the row before", place=np.zeros((1, 1, 1)))
    assert "`step in the row before` is nothing" in nothing_to_draft(SimpleNamespace(suspects=(one,))).message  # type: ignore[arg-type]


def test_a_block_has_the_values_of_its_patterns() -> None:
    state, channels = drawn(4, 60)
    some = {name: channels[name] for name in ("q2", "q3", "v4", "load3", "temperature", "cable")}
    every = patterns({**some, "x": tool_place(channels)[:, 0]}, state, tool_place(channels)).every.blocks[::5]
    finer = [b for some in every[::7] for b in sharper(some[0]).blocks]
    for part in (*every, *finer):
        alone = [p.values for p in list(part)[::13]]
        np.testing.assert_allclose(Group([part]).values.T[::13], alone, atol=2e-6, err_msg=part[0].text)


def test_an_edge_is_a_number_with_the_measured_values_beside_it():
    """No fit moves it: anywhere between them the rows are on the same sides of it."""
    q2 = channel_signal("q2", np.array([0.9, -0.4, 0.1, 0.5, 0.1]))
    drafts = next(iter(block(STEP, q2, [(0.31,)]))).drafts
    (way,) = [part for part in drafts[0] if isinstance(part, Way)]
    assert (way.kind, way.value, way.unit) == ("edge", "0.31", "rad")
    assert 0.1 < float(way.low) < 0.1 + 1e-3 and 0.5 - 1e-3 < float(way.high) < 0.5
