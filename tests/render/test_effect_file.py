"""What remains without a name as a file: its law is that of the pattern, and with it the error falls to the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from postproc.effects.conformance import check_effect
from postproc.effects.contract import State
from postproc.effects.registry import load_effect_file
from postproc.identify.add import add_effects
from postproc.identify.diagnose import diagnose
from postproc.render.effect_file import effect_file, nothing_to_draft
from postproc.render.law import find_law
from tests.identify.cells import base_fit, cell, true_error
from tests.independent import unknown_effects as unknown

Channels = dict[str, np.ndarray]


def drawn(seed: int, n: int) -> tuple[State, Channels]:
    g = np.random.default_rng(seed)
    q, v, load = g.uniform(-2, 2, (n, 6)), g.normal(0, 1, (n, 6)), g.normal(0, 400, (n, 6))
    side, hot = g.choice([-1.0, 1.0], (n, 6)), g.uniform(15, 40, n)
    state = State(q=q, v=v, approach=side, joint_load=load, temperature=hot, channels={"cable": g.uniform(0, 1, n)})
    channels = {
        f"{name}{j + 1}": x[:, j] for name, x in (("q", q), ("v", v), ("dir", side), ("load", load)) for j in range(6)
    }
    return state, {**channels, "temperature": hot, "cable": state.channels["cable"]}  # fmt: skip


MEAN = drawn(1, 500)[1]["temperature"].mean()
LAWS: list[tuple[tuple[str, ...], Callable[[Channels], np.ndarray]]] = [
    (("q2",), lambda c: (c["q2"] > 0.4).astype(float)),
    (("q3",), lambda c: np.abs(c["q3"] + 0.3)),
    (("q1",), lambda c: ((c["q1"] > -0.5) & (c["q1"] < 0.7)).astype(float)),
    (("load5",), lambda c: c["load5"] * np.abs(c["load5"]) / 1e6),
    (("temperature",), lambda c: np.exp(-(c["temperature"] - 15) / 8)),
    (("cable",), lambda c: np.maximum(c["cable"] - 0.6, 0)),
    (("q2", "q3"), lambda c: (c["q2"] + c["q3"] > 0.2).astype(float)),
    (("q4", "q5"), lambda c: np.maximum(c["q4"] - c["q5"] - 1, 0)),
    (("q2", "q3", "q4"), lambda c: np.maximum(c["q2"] + c["q3"] + c["q4"], 0)),
    (("dir3", "q3"), lambda c: c["dir3"] * ((c["q3"] > -0.8) & (c["q3"] < 0.45))),
    (("dir2", "load2"), lambda c: c["dir2"] * np.abs(c["load2"])),
    (("v1", "load2"), lambda c: np.sign(c["v1"]) * np.abs(c["load2"])),
    (("q1", "temperature"), lambda c: (c["q1"] - c["q1"].mean()) * (c["temperature"] - c["temperature"].mean())),
    (("q5", "load5"), lambda c: np.cos(c["q5"] - 0.4) * c["load5"]),
    (("q2", "load4"), lambda c: np.cos(24 * c["q2"] - 0.4) * c["load4"]),
    (("q3", "temperature"), lambda c: np.sin(3 * c["q3"]) * (c["temperature"] - MEAN)),
    (("q4",), lambda c: np.cos(37.3 * c["q4"] + 1)),
    (("q4", "q6"), lambda c: np.sin(c["q4"] - 0.2) * np.cos(2 * c["q6"] + 0.7)),
]


@pytest.mark.parametrize(("names", "formula"), LAWS, ids=[" ".join(names) for names, _ in LAWS])
def test_the_law_that_is_found_holds_in_other_poses(
    names: tuple[str, ...], formula: Callable[[Channels], np.ndarray]
) -> None:
    _, channels = drawn(1, 500)
    values = formula(channels)
    law = find_law(names, values, channels)
    assert law is not None
    state, elsewhere = drawn(2, 300)
    inside = {"np": np, "state": state}
    x, by = eval(law.argument, inside), eval(f"1.0{law.factor}", inside)
    said, true = np.interp(x, law.at, law.shape) * by, formula(elsewhere) / np.abs(values).max()
    if names == ("q1", "temperature"):  # the means are those of the rows that were measured
        means = {name: channels[name].mean() for name in names}
        true = np.prod([elsewhere[name] - means[name] for name in names], axis=0) / np.abs(values).max()
    # A step lies somewhere between two measured rows.
    assert np.mean(np.abs(said - true) > 0.03) < 0.03


def test_straight_ends_go_on_and_bent_ones_stop() -> None:
    _, channels = drawn(1, 500)
    q, load = channels["q2"], channels["load2"]
    ramp = find_law(("load2",), np.maximum(load - 29.0, 0.0), channels)
    assert ramp is not None
    beyond = load.max() + 0.5 * np.ptp(load)
    said = np.interp([beyond, 2 * load.min()], ramp.at, ramp.shape) * np.maximum(load - 29.0, 0.0).max()
    assert said == pytest.approx([beyond - 29.0, 0.0], rel=0.03, abs=10.0)
    step = find_law(("q2",), (q > 0.4).astype(float), channels)
    assert step is not None
    assert np.interp([-9.0, 9.0], step.at, step.shape).tolist() == [0.0, 1.0]
    bent = find_law(("q2",), q**4, channels)
    assert bent is not None
    assert np.interp(4.0, bent.at, bent.shape) == pytest.approx(1.0, abs=0.02)


def test_what_is_no_function_of_its_channels_has_no_law() -> None:
    _, channels = drawn(1, 300)
    rose = np.sign(np.diff(channels["load2"], prepend=0.0))
    assert find_law(("load2",), rose, channels) is None
    # Two waves that go together are no product: half of them must not pass for a law.
    assert find_law(("q4", "q6"), np.sin(channels["q4"] + 2 * channels["q6"]), channels) is None
    assert find_law(("q1", "q2"), np.random.default_rng(3).normal(size=300), channels) is None
    assert find_law(("x", "y"), channels["q1"], channels) is None


@pytest.mark.parametrize(("kind", "seed"), [(unknown.angle_step, 401), (unknown.hot_only, 402)])
def test_a_drafted_effect_brings_the_error_down_to_the_noise(
    tmp_path: Path, kind: Callable[..., object], seed: int
) -> None:
    data, true = cell(kind, seed=seed)
    found = diagnose(base_fit(data).model, data)
    key, text = effect_file(found, "Nobody-knows 2", "cell.csv")
    assert (key, found.verdict) == ("nobody_knows", "unknown")
    assert text is not None
    path = tmp_path / "own.py"
    path.write_text(text, encoding="utf-8")
    [effect] = load_effect_file(path)
    assert (effect.key, check_effect(effect)) == (key, [])
    grown = add_effects(found.base.model, data, [*(m.candidate.key for m in found.missing), key], [effect])
    assert true_error(grown.fit, true) < 0.6 * 0.03e-3


def test_a_key_of_the_library_is_not_taken() -> None:
    data, _ = cell(unknown.angle_step, seed=401)
    found = diagnose(base_fit(data).model, data)
    assert effect_file(found, "backlash", "cell.csv")[0] == "own_backlash"
    assert effect_file(found, "77", "cell.csv")[0] == "own"
    beside = replace(found.suspects[0], where="body 4, shifted", place=np.repeat(found.suspects[0].place, 3, axis=2))
    text = effect_file(replace(found, suspects=(beside,)), "own", "cell.csv")[1]
    assert text is not None
    assert "moved[:, :3] = shape[:, None] * self.size_m" in text
    assert "Displacement(body={4: moved})" in text
    # What is no single place of the arm cannot be drafted.
    scale = replace(found.suspects[0], where="instrument, scale")
    assert effect_file(replace(found, suspects=(scale,)), "own", "cell.csv")[1] is None


def test_why_nothing_was_drafted_is_said() -> None:
    none = nothing_to_draft(SimpleNamespace(suspects=()))  # type: ignore[arg-type]
    hard = nothing_to_draft(SimpleNamespace(suspects=("..",)))  # type: ignore[arg-type]
    assert (none.code, hard.code, none.severity) == ("DAT028", "DAT028", "info")
    assert "nothing remains" in none.message
    assert "none of the functions" in hard.message
