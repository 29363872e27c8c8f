"""Fitted numbers, places and probabilities as people read them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from postproc import text as text_of
from postproc.diagnostics import joined
from postproc.effects.library.frames.session import Session
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.solve import Terms
from postproc.identification.compare import compare
from postproc.identification.diagnosis import Diagnosis
from postproc.identification.screen.candidate import Candidate
from postproc.measure.observations import observations
from postproc.results.improve.diagnosis import brief_ranking, suspect_table, verdict_figures
from postproc.results.improve.fit import effect_values, fit_values
from postproc.results.improve.sentences import doubts, headline, of_little_worth
from postproc.results.wording import fitted_values, grouped, in_words, p_text, parameter_rows, parameters_text, place
from tests.identification.cells import base_fit, cell

POSITIONS = observations(rotation=False, joint=False)[0]


@pytest.mark.parametrize(
    ("label", "said"),
    [
        ("body 2 and 3", "bodies 2 and 3"),
        ("joint 2, order 6; joint 2, order 7; joint 3, order 4", "joint 2, orders 6 and 7; joint 3, order 4"),
        ("joint 2; joint 3", "joints 2 and 3"),
        ("body 5; body 2; body 3", "bodies 2, 3 and 5"),
        ("joint 2", "joint 2"),
        ("joint 2; body 3", "joint 2; body 3"),
        ("joint 1, order 3; joint 2, order 8", "joint 1, order 3; joint 2, order 8"),
        ("", ""),
    ],
)
def test_places_of_one_kind_are_one_phrase(label: str, said: str) -> None:
    assert place(label) == said


def test_words_are_joined_as_people_write_them() -> None:
    assert [joined(["a"]), joined(["a", "b"]), joined(["a", "b", "c"], "or")] == ["a", "a and b", "a, b or c"]


def test_entries_of_an_array_stand_together() -> None:
    names = ["turn[x]", "turn[z]", "shift[body 2, z]", "shift[body 3, x]", "mass"]
    assert grouped(names) == "turn[x z], shift[body 2, z; body 3, x], mass"
    assert grouped([]) == ""


@pytest.mark.parametrize(("p", "said"), [(0.371, "0.37"), (6.2e-125, "6e-125"), (0.0, "< 1e-300"), (1.0, "1.00")])
def test_a_probability_never_reads_zero(p: float, said: str) -> None:
    assert p_text(p) == said


def test_values_are_told_in_shop_units_with_the_digits_that_are_known() -> None:
    data, _ = cell(seed=101)
    fit = fit_model(base_fit(data).model, data, [ArmLoad(body=(3,))])
    sigma = fit.sigma
    rows = parameter_rows(fit, "tool_frame", 12)
    shift = fit.model.effect("tool_frame").vector()[0]
    key, name, told, unit = rows[0]
    value, plus, deviation = told.split()
    assert (key, name, plus, unit) == ("tool_frame", "shift[x]", "±", "mm")
    assert abs(float(value) - 1e3 * shift) <= 0.5 * 10 ** -len(value.partition(".")[2])
    assert float(deviation) == pytest.approx(1e3 * sigma["tool_frame", 0], rel=0.05)
    assert len(value.partition(".")[2]) == len(deviation.partition(".")[2])
    assert len(deviation.replace(".", "").lstrip("0")) == 2
    assert parameter_rows(fit, "joint_compliance", 12)[1][1::2] == ("compliance[2]", "µrad/(N m)")
    assert [v[0] for v in fitted_values(fit, "arm_load")][:2] == ["mass[body 3]", "moment[body 3, x]"]
    assert [row[1] for row in parameter_rows(fit, "joint_offset", 2)] == ["4 numbers, in the model file"]
    assert list(fitted_values(fit, "backlash")) == []


def test_what_has_no_unit_above_the_line_is_told_in_millionths() -> None:
    data, _ = cell(seed=101)
    fit = fit_model(base_fit(data).model, data, [LinkCompliance(body=(3,))])
    [(name, value, sigma, unit), *_] = fitted_values(fit, "link_compliance")
    assert (name, unit) == ("bending[body 3]", "1e-6/(N m^2)")
    assert value == pytest.approx(1e6 * fit.model.effect("link_compliance").vector()[0])
    assert sigma == pytest.approx(1e6 * fit.sigma["link_compliance", 0])


def test_a_gear_error_is_named_by_its_joint_and_order() -> None:
    data, _ = cell(seed=101)
    fit = fit_model(base_fit(data).model, data, [TransmissionError(joint=(2, 3), order=(1.0, 12.0))])
    names = [name for name, *_ in fitted_values(fit, "transmission_error")]
    assert "sine[joint 3, order 12]" in names
    assert "cosine[joint 2, order 1]" in names
    assert fit_values(fit)["structure"] == {"transmission_error": {"joint": [2, 3], "order": [1.0, 12.0]}}


def test_bodies_and_sessions_are_named_as_elsewhere() -> None:
    data, _ = cell(seed=101)
    second = np.arange(len(data)) % 2
    data = replace(data, state=replace(data.state, session=second, session_names=("mon", "tue")))
    moved = fit_model(base_fit(data).model, data, [LinkGeometry(), Session(session=("tue",))])
    assert "shift[session tue, x]" in [name for name, *_ in fitted_values(moved, "session")]
    shown = [name for name, *_ in fitted_values(moved, "link_geometry")]
    held = parameters_text(moved, moved.unidentifiable)
    assert "tool_frame turn[x y z]" in held
    for key, i in moved.unidentifiable:
        if key == "link_geometry":  # shift_m (7, 3), then turn_rad (7, 3)
            part, body, axis = ("shift", "turn")[i // 21], i % 21 // 3, "xyz"[i % 3]
            assert re.search(rf"link_geometry {part}\[[^\]]*body {body}, {axis}", held)
            assert f"{part}[body {body}, {axis}]" not in shown


def test_deviations_in_json_are_standard_deviations() -> None:
    data, _ = cell(seed=101)
    fit = base_fit(data)
    told = effect_values(fit, "joint_offset")["parameters"]["offset_rad"]
    assert told[1] == [fit.model.effect("joint_offset").vector()[1], fit.sigma["joint_offset", 1]]
    assert told[0][1] is None  # joint 1 turns with the instrument's frame
    assert np.shape(effect_values(fit, "instrument_frame")["parameters"]["shift_m"]) == (3, 2)


def test_a_map_of_a_joint_is_told_by_its_size() -> None:
    data, _ = cell(seed=101)
    fit = fit_model(
        base_fit(data).model, data, [JointErrorMap(joint=(2,), order=8)], terms=Terms(strength={"joint_error_map": 1.0})
    )
    assert re.fullmatch(r"1\d numbers, in the model file", parameter_rows(fit, "joint_error_map", 12)[0][1])


def _missing(key: str, label: str = "", **fields: Any) -> Candidate:
    """An effect that a model lacks, as far as sentences tell of it."""
    effect = effect_library()[key].null()
    return Candidate(key, effect, effect.amplitudes(), label, 9.0, 9.0, 1, 0.0, 9.0, 1e-9, **fields)


def _found(verdict: str, missing: Sequence[Candidate] = (), **fields: Any) -> Any:
    """A diagnosis, as far as sentences tell of it."""
    state = SimpleNamespace(channels={}, approach=None, payload_mass=None)
    model = SimpleNamespace(effect=lambda key: None, effects=())
    data = SimpleNamespace(state=state, sides_from="")
    fit = SimpleNamespace(held_out_rms=1e-4, observed=POSITIONS, model=model, data=data)
    usual = {
        "exceeds_noise": False,
        "untold": False,
        "misleading": False,
        "regions": None,
        "remaining": (),
        "floor": None,
    }
    fits = {name: fit for name in ("base", "final", "screened", "searched")}
    return SimpleNamespace(**{**usual, **fits, "further": (), "verdict": verdict, "missing": list(missing), **fields})


def _suspect(channel: str, where: str, pattern: str, share: float) -> Any:
    return SimpleNamespace(channel=channel, channels=(channel,), where=where, pattern=pattern, share=share)


@pytest.mark.parametrize(
    ("channel", "temperature", "known", "told"),
    [
        ("time", None, {}, "`cycle` (how many restarts, tool changes and set-ups there were)."),
        ("temperature", 1, {"cycle": 1}, "`temperature2_C` (a second temperature, at the instrument)."),
        ("row", 1, {"cycle": 1, "temperature2_C": 1}, ""),
        ("q2", 1, {}, ""),
    ],
)
def test_what_follows_time_or_one_temperature_has_its_column_to_record(channel, temperature, known, told):
    found = _found("unknown", remaining=[_suspect(channel, "instrument, scale", "growing", 0.95)])
    found.base.data.state = SimpleNamespace(channels=known, temperature=temperature, approach=1, payload_mass=1)
    text = headline(found)
    assert (
        (f"A column may hold the cause, and is tried if it is there: {told}" in text)
        if told
        else "A column" not in text
    )


@pytest.mark.parametrize(
    ("rivals", "named", "doubt", "figure"),
    [
        (
            ("payload_error", "dress_pack"),
            "`arm_load` (body 3) or, as far as this data can tell, `payload_error` or `dress_pack`; and `backlash`",
            "Beside `arm_load` this data would not show `session`.",
            "arm_load or payload_error or dress_pack",
        ),
        (
            ("payload_error", "dress_pack", "gear_step", "bearing_tilt"),
            "`arm_load` (body 3) or, as far as this data can tell, one of 4 others; and `backlash`",
            "As far as this data can tell, `arm_load` may be `payload_error`, `dress_pack`, `gear_step` or "
            "`bearing_tilt` as well.",
            "arm_load or others",
        ),
    ],
)  # fmt: skip
def test_what_a_name_could_as_well_be_is_told_from_what_it_hides(rivals, named, doubt, figure):
    load = _missing("arm_load", "body 3", rivals=rivals, unseen=("session",))
    assert load.not_separable == (*rivals, "session")
    found = _found("missing", [load, _missing("backlash")])
    assert headline(found).split(". ")[0] == f"The model lacks {named}"
    assert next(doubts(found)) == doubt
    told = {"effect": "arm_load", "not_separable_from": load.not_separable, "not_seen_beside": load.unseen}
    (shown,) = verdict_figures({"verdict": "missing", "missing": [told]})
    assert (shown.label, shown.text) == ("missing", figure)


def test_channels_that_show_the_same_pattern_stand_in_one_line():
    told = [("q2", "joint 2", 0.6), ("load2", "joint 2", 0.5), ("load3", "joint 2", 0.6), ("q5", "tool", 0.004)]
    suspects = [SimpleNamespace(channel=c, where=w, pattern="step", share=s) for c, w, s in told]
    assert suspect_table(suspects).rows == [
        ("joint 2", "q2 and load3", "step", "60 %"),
        ("joint 2", "load2", "step", "50 %"),
        ("tool", "q5", "step", "less than 1 %"),
    ]


def test_a_users_own_effect_stands_in_the_ranking_however_little_it_does():
    chances = {"backlash": 1e-9, "arm_load": 0.2, "session": 0.3, "payload_error": 0.4, "gear_step": 0.6}
    ranked = [SimpleNamespace(key=key, p_value=p) for key, p in chances.items()]
    assert [ranked[i].key for i in brief_ranking(ranked)] == ["backlash", "arm_load", "session", "gear_step"]


@pytest.mark.parametrize("helps", [True, False, None])
def test_a_pattern_that_parts_left_out_do_not_confirm_is_no_law_to_add(helps):
    after = np.full((4, 3), 0.9e-4)
    regions = None if helps is None else SimpleNamespace(before=np.full((4, 3), 1e-4), after=after, helps=helps)
    remaining = [_suspect("q2", "base", "growing", 0.95)]
    misleads = Diagnosis.misleading.fget(SimpleNamespace(regions=regions, remaining=remaining))
    assert misleads is not bool(helps)
    text = headline(_found("unknown", remaining=remaining, misleading=misleads, regions=regions))
    assert ("Measure more before you add it" in text, "`postproc add` adds it" in text) == (helps is False, bool(helps))
    assert ("left out it takes the error from 0.100 to 0.090" in text) == (regions is not None)
    assert ("do not confirm it" in text) == (regions is None)
    weak = _found("unknown", remaining=[_suspect("q2", "base", "growing", 0.4)])
    assert "Record `dir1` to `dir6` and `payload_kg` first" in headline(weak)
    weak.base.data.state = SimpleNamespace(channels={}, approach=1, payload_mass=1)
    weak.base.data.sides_from = "the times"
    assert "Record `dir1` to `dir6` first" in headline(weak)
    weak.final.model.effects = (SimpleNamespace(reads=("approach",), is_null=False),)
    assert "Record" not in headline(weak)
    weak.base.data.sides_from = ""
    assert "Record" not in headline(weak)


def test_a_name_beside_what_remains_is_told_by_the_error_of_both():
    """The figure of the pattern is that of parts of the joint space which its choice has not seen."""
    line = _missing("transmission_error", "joint 1, order 5", held_out_after=0.99e-4)
    regions = SimpleNamespace(before=np.full((4, 3), 1.2e-4), after=np.full((4, 3), 5.7e-5), helps=True)
    found = _found("unknown", [line], remaining=[_suspect("operator", "tool", "step", 0.9)], regions=regions)
    text = headline(found)
    assert "With it, the error on rows the fit has not seen is 0.100 mm per axis, without 0.100;" in text
    assert "in parts of the joint space left out it takes the error from 0.120 to 0.057." in text
    assert "worth next to nothing" not in text
    found.verdict = "missing"
    assert of_little_worth(found) == ["transmission_error"]


def test_a_mean_of_nothing_has_no_sign():
    fit = base_fit(cell(seed=401)[0])
    found = compare(fit.model, fit.data)
    text = text_of(replace(found, error=np.full_like(found.error, [1e-3, 0.0, -1e-9])))
    assert re.search(r"^  z +0\.0+ +0\.0+$", text, re.MULTILINE)


@pytest.mark.parametrize(
    ("key", "name", "said"),
    [
        ("joint_compliance", "compliance_rad_per_Nm[1]", "the compliance of joint 1"),
        ("backlash", "half_gap[2]", "the half gap of joint 2"),
        ("arm_load", "mass[body 3]", "the mass of body 3"),
        ("tool_frame", "shift_m[x]", "tool_frame shift[x]"),
        ("payload_error", "mass_kg", "payload_error mass"),
        ("transmission_error", "sine_rad[1]", "transmission_error sine[1]"),  # the first wave, not joint 1
    ],
)
def test_a_parameter_of_a_joint_is_named_in_words(key, name, said):
    assert in_words(effect_library()[key], name) == said
