"""What no library has: no named effect stands beside it, and its joint or body and its channel are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.estimation.channels import channels
from postproc.identification.diagnose import diagnose
from postproc.patterns.curves import of_channel, sharper
from postproc.patterns.dictionary import patterns
from postproc.patterns.formula import Group
from postproc.patterns.screening import PatternScreen
from postproc.patterns.signals import channel_signal
from postproc.patterns.suspects import Suspect, by_channel
from tests.identification.cells import base_fit, cell, law
from tests.independent import library_effects as library
from tests.independent.cells import Hidden, column


def marked_encoder(g, arm) -> Hidden:
    """Interpolation of an encoder: a saw tooth on each of ten marks a turn."""
    return Hidden(
        "marked_encoder",
        "unknown",
        channels=("q4",),
        joint=lambda s, tau: column(3, 3e-4 * (np.mod(10 * s.q[:, 3] / (2 * np.pi) + 0.3, 1.0) - 0.5)),
    )


def gap_when_cold(g, arm) -> Hidden:
    """Lost motion of joint 2 that closes when the gear is warm."""
    return Hidden(
        "gap_when_cold",
        "unknown",
        channels=("dir2", "temperature"),
        joint=lambda s, tau: column(1, -1.5e-4 * s.approach[:, 1] * (s.temperature < np.median(s.temperature))),
    )


def worn_sector(g, arm) -> Hidden:
    """Lost motion of joint 3, but only where its gear is worn."""
    return Hidden(
        "worn_sector",
        "unknown",
        channels=("dir3", "q3"),
        joint=lambda s, tau: column(2, -2e-4 * s.approach[:, 2] * ((s.q[:, 2] > -0.7) & (s.q[:, 2] < 0.2))),
    )


def square_wave(g, arm) -> Hidden:
    """Joint 3 jumps to and fro four times a turn."""
    return Hidden(
        "square_wave",
        "unknown",
        channels=("q3",),
        joint=lambda s, tau: column(2, 1e-4 * np.sign(np.sin(4 * s.q[:, 2]))),
    )


def loose_casting(g, arm) -> Hidden:
    """The forearm's housing gives way sideways where joint 3 passes -10 deg."""

    def body(s, frames, wrench):
        xi = np.zeros((len(s), 7, 6))
        xi[:, 3, 3:] = np.outer(s.q[:, 2] > np.radians(-10.0), [1e-4, 0.0, 2e-4])
        return xi

    return Hidden("loose_casting", "unknown", channels=("q3",), body=body)


@pytest.mark.parametrize(
    ("kind", "channels", "where"),
    [
        (marked_encoder, {"q4"}, "joint 4"),
        (gap_when_cold, {"dir2", "temperature"}, "joint 2"),
        (loose_casting, {"q3"}, "body 3"),
        (worn_sector, {"dir3", "q3"}, "joint 3"),
    ],
)
def test_a_name_that_explains_half_of_it_does_not_stand_beside_a_pattern(kind, channels, where):
    data, _ = cell(kind, seed=431, noise=0.02, poses=90)
    found = diagnose(base_fit(data).model, data)
    assert found.verdict == "unknown" and found.missing == ()
    assert found.suspects[0].channel in channels and found.suspects[0].where == where


def test_a_name_stays_beside_a_pattern_of_another_channel():
    data, _ = cell(library.thermal_joint_drift, square_wave, seed=431, noise=0.02, poses=90)
    found = diagnose(base_fit(data).model, data)
    assert found.verdict == "unknown" and [m.key for m in found.missing] == ["thermal_joint_drift"]
    assert (found.suspects[0].channel, found.suspects[0].where) == ("q3", "joint 3")


def loaded_ripple(g, arm) -> Hidden:
    """A gear of joint 3 that ripples by its load, with no whole number a turn."""
    law = lambda s, tau: column(2, 4e-7 * tau[:, 2] * np.cos(3.5 * s.q[:, 2] + 0.3))  # noqa: E731
    return Hidden("loaded_ripple", "unknown", channels=("q3", "load3"), joint=law)


@pytest.mark.parametrize("seed", [431, 433])
def test_a_law_is_told_at_its_own_joint_where_the_casting_beside_it_looks_better_at_first(seed):
    data, _ = cell(loaded_ripple, seed=seed, noise=0.03, poses=90)
    fit = base_fit(data)
    state, position = fit.problem.sensitivity.state, fit.problem.equilibrium.T_base_tcp[:, :3, 3]
    first = PatternScreen(fit.problem, fit.linear, patterns(channels(state, position), state, position)).suspects()[0]
    assert (first.where, set(first.channels)) == ("joint 3", {"q3", "load3"}) and first.share > 0.99


def dragged_slide(g, arm) -> Hidden:
    """Joint 2 drags a slide along that has half a radian of play to either side, from row to row."""

    def joint(s, tau):
        place, found = 0.0, [0.0]
        for step in np.diff(s.q[:, 1]) / 0.5:
            place = min(max(place + step, -1.0), 1.0)
            found.append(place)
        return column(1, 2e-4 * np.array(found))

    return Hidden("dragged_slide", "unknown", channels=("q2",), joint=joint)


def test_what_hangs_behind_from_row_to_row_is_told_of_its_joint():
    """No function of the pose tells more than a third of it."""
    data, _ = cell(dragged_slide, seed=2, noise=0.02, poses=100)
    first = diagnose(base_fit(data).model, data).suspects[0]
    assert (first.channel, first.where) == ("q2", "joint 2") and first.share > 0.95
    assert first.pattern.startswith("dragged along by q2, and slipping after 28.")


def test_one_bad_reading_is_no_law():
    """A row 15 standard deviations off is named as a row; nothing is said to step, bend or be loose for its sake."""
    data, _ = cell(seed=432, noise=0.03, poses=70)
    position = data.position.copy()
    position[11] += np.array([0.3e-3, -0.25e-3, 0.25e-3])
    found = diagnose(base_fit(data).model, replace(data, position=position))
    assert (found.verdict, found.suspects) == ("complete", ())
    assert any(d.code in ("DAT013", "DAT025") and "row 12 " in d.message for d in found.diagnostics)


def suspect(where, worth, form, channel="", share=None):
    share = worth / 100 if share is None else share
    return Suspect(where, np.zeros((1, 3, 1)), form, worth, worth, 0.0, channel or form.channels[0], share)


def test_a_place_that_explains_as_much_is_told_too():
    """A shift of the tool across its axis and a turn of joint 6 are the same for positions alone."""
    side = law("dir1", np.ones(1))
    at = [("joint 6", 90.0), ("joint 6", 80.0), ("tool", 78.0), ("base", 30.0)]
    ranked = [suspect(where, worth, side, share=0.9) for where, worth in at]
    assert [s.where for s in by_channel(ranked)] == ["joint 6", "tool"]


def test_a_second_structure_comes_before_other_dresses_of_the_first():
    def at_2(names, worth):
        return suspect("joint 2", worth, law(names, np.ones(1)))

    ranked = [at_2("load2", 70.0), at_2("time", 50.0), at_2("x", 45.0)]
    shown = by_channel([*ranked, at_2("z", 35.0)], [at_2("q5 q6", 20.0)])
    assert [s.channel for s in shown] == ["load2", "q5", "time", "x"]
    assert shown[1].share == pytest.approx(0.2)
    more = replace(at_2("load2 q1", 60.0), channel="q1")
    assert "q1" not in {s.channel for s in by_channel([ranked[0], more])}
    # What is worth more with a further channel than without it stays.
    both = [at_2("time q6", 50.0), at_2("q6 time", 45.0)]
    assert [s.channel for s in by_channel([ranked[0], *both, at_2("x", 44.0), at_2("time", 42.0)])] == [
        "load2", "time", "q6", "x",
    ]  # fmt: skip


def test_a_second_part_of_the_same_channel_is_listed():
    """The draft has both."""
    first, wave = (suspect("joint 2", 50.0, law("q2", np.ones(1), text)) for text in "ab")
    assert [s.form for s in by_channel([first], [wave])] == [first.form, wave.form]
    # .. after what else the first follows, and after a part elsewhere.
    load, third = replace(first, channel="load2"), suspect("joint 4", 50.0, law("q2", np.ones(1), "c"))
    shown = by_channel([first, load], [wave, third])
    assert [(s.form, s.channel) for s in shown] == [
        (first.form, "q2"), (third.form, "q2"), (first.form, "load2"), (wave.form, "q2"),
    ]  # fmt: skip


def test_what_a_pose_tells_is_listed_where_it_does_not_tell_the_first():
    """Only that can be drafted, though it leaves more."""
    late, line = law("temperature", np.ones(1), "late"), law("time", np.ones(1), code="state.time")
    ranked = [suspect("joint 2", 500.0, late, share=1.0)]
    ranked += [suspect(w, e, line, share=s) for w, s, e in (("body 1", 0.99, 480.0), ("joint 2", 0.6, 60.0))]
    assert by_channel(ranked)[1] is ranked[2]


def best(patterns, truth):
    return max(patterns, key=lambda p: abs(np.corrcoef(p.values, truth)[0, 1]) if np.ptp(p.values) else 0.0)


@pytest.mark.parametrize(
    ("law", "first"),
    [
        (lambda q: 1.0 * ((q > 0.02) & (q < 1.11)), "only"),
        (lambda q: np.exp(-0.5 * ((q + 0.4) / 0.07) ** 2), "bump"),
        (lambda q: np.maximum(-0.6 - q, 0.0), "growing"),
    ],
)
def test_shapes_are_met_after_sharpening_twice(law, first):
    q = np.random.default_rng(5).uniform(-1.5, 1.6, 240)
    truth = law(q)
    shape = best(Group(of_channel(channel_signal("q1", q))), truth)
    for _ in range(2):
        shape = best([shape, *sharper(shape)], truth)
    assert shape.text.split(" ")[0] == first
    assert abs(np.corrcoef(shape.values, truth)[0, 1]) > 0.98


def test_a_threshold_of_speed_is_one_of_its_size():
    v = np.random.default_rng(6).normal(0.0, 0.6, 200)
    found = best(Group(of_channel(channel_signal("v4", v))), (np.abs(v) > 0.5).astype(float))
    assert found.text.startswith("step near 2") and found.text.endswith("of |v4|")


def test_two_named_effects_are_not_traded_for_patterns():
    """Both leave structure of one joint each without the other: what is independent is counted where nothing is left."""
    data, _ = cell(library.backlash, library.arm_load, seed=77, noise=0.03, poses=80)
    found = diagnose(base_fit(data).model, data)
    assert found.verdict == "missing"
    assert {m.key for m in found.missing} == {"backlash", "arm_load"}
