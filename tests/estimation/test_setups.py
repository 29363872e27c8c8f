"""Fits and predictions of tables without a tracker, on arms in plain numpy, and what cannot have been read."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from postproc.diagnostics import PostprocError, Source
from postproc.effects.registry import effect_library
from postproc.estimation.contradictions import contradictions
from postproc.estimation.findings import implausible
from postproc.estimation.fitted import Fit
from postproc.estimation.recorded import expected_remaining, recorded_model, silent
from postproc.identification.add import fit_effects
from postproc.identification.compare import compare
from postproc.identification.diagnosis import shortage
from postproc.identification.predict import Prediction, predict_rows
from postproc.measure.checks.setups import LoadChanges, find_strays
from postproc.measure.measurements import Measurements
from postproc.measure.read.cells import read_cells
from postproc.measure.read.layout import read_column_map
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.model.arm import Model
from postproc.model.doubts import contradicted
from postproc.model.file import parse_model
from postproc.model.uncertainty.prediction import derivatives, read_uncertainty
from postproc.results.improve.comparison import comparison_document
from postproc.results.improve.fit import known_of
from postproc.robot.catalogue import load_robot
from postproc.robot.pose import transform
from tests.bench.shop.arms import ROBOTS, Shop, shop
from tests.bench.shop.judge import asked_gauges, unseen_rows
from tests.bench.shop.refit import PRIOR, placed, refit, rms, tcp
from tests.bench.shop.sets import Rows, csv_of, gauges, joined, real_tcp, table, tips
from tests.independent import arm as A

ROBOT, SEED = "irb1600_10_145", 3
BASE = ("tool_frame", "joint_offset", "joint_compliance")
AS_DRAWN = np.concatenate([PRIOR[:15], np.full(30, 1e-9)])
"""What is known before of zeros, springs and TCP, and of links that are those of the drawing."""


@cache
def an_arm() -> Shop:
    """An arm whose springs and zeros are off, and whose links are those of the drawing."""
    return shop(ROBOT, SEED, geometry=False)


def read(rows: Rows, s: Shop, measured: bool = True, text: str = "", **more: Any) -> Measurements:
    """What the product reads of the rows, or of a text of them."""
    terms, source = Reading(tool=transform(s.tool), **more), Source("t.csv", (text or csv_of(rows)).encode())
    return read_measurements(source, load_robot(s.robot), None, None, measured, terms=terms)


def fitted(rows: Rows, s: Shop, effects: tuple[str, ...] = BASE) -> Fit:
    """The fit of the rows, with the tool stated."""
    model = Model(load_robot(s.robot), T_flange_tcp=transform(s.tool), robot_name=s.robot)
    return fit_effects(model, read(rows, s), [effect_library()[key] for key in effects])


def predicted(model: Model, rows: Rows, s: Shop) -> Prediction:
    """What a model says of rows that nobody has read."""
    return predict_rows(model, read(rows, s, measured=False))


def test_a_short_table_lacks_set_ups_of_a_gauge_or_touches_of_a_tip() -> None:
    """A set-up of a gauge has two readings and a zero; a tip three unknowns, and each touch three numbers."""
    s, g = an_arm(), np.random.default_rng(SEED)
    tables = [(gauges(g, s, 3), 3, 1, "set-ups"), (tips(g, s, each=5), 3 * 5 - 3, 3, "touches")]
    for rows, numbers, each, item in tables:
        fit = fitted(rows, s, ("joint_offset", "joint_compliance"))
        known = sum(key != "setup" for key, _ in fit.parameters)
        lacking = shortage(fit)
        assert lacking is not None and lacking.parameters == known and lacking.item.startswith(item)
        assert lacking.count == -(-(3 * known - numbers) // each) > 0


def test_twelve_gauge_readings_tell_the_change_under_load_anywhere() -> None:
    s = an_arm()
    fit = fitted(gauges(np.random.default_rng(SEED), s), s)
    asked = unseen_rows(s, SEED)
    true = np.diff(real_tcp(s, asked.states).reshape(-1, 2, 3), axis=1)[:, 0]
    found = predicted(recorded_model(fit), asked_gauges(asked), s)
    assert found.reading is not None
    moved = np.diff(found.reading.reshape(3, -1, 2), axis=2)[:, :, 0].T
    assert rms(moved - true) < 0.1 * rms(true)
    inside = np.abs(moved - true) < 1.96 * found.sigma.reshape(3, -1, 2)[:, :, 1].T
    assert inside.mean() >= 0.88
    assert silent(fit) == ["tool_frame", "joint_offset"]  # of which a change under load shows nothing


def test_the_share_that_remains_falls_by_readings_which_have_no_axes() -> None:
    s = an_arm()
    fit = fitted(gauges(np.random.default_rng(SEED), s), s, ("joint_compliance",))
    both = expected_remaining(fit)
    assert both is not None
    _, (before, after) = both
    assert after[1] < 0.5 * before[1]
    model = recorded_model(fit)
    assert model.fit["each"] == "reading"
    found = comparison_document("t", compare(model, fit.data))
    assert found.sentence.startswith("A reading is") and "iso9283" not in found.values
    assert found.values["per_reading_mm"].keys() == {"reading"}


@pytest.mark.parametrize("kind", ["tip", "distance+b", "between"])
def test_a_table_tells_what_a_refit_of_the_true_law_would(kind: str) -> None:
    s = an_arm()
    rows, asked = table(kind, s, SEED), unseen_rows(s, SEED)
    text = csv_of(rows).encode()
    layout = Source("map.toml", b'anchor_offset = "free"\n') if rows.offset_free else None
    data = read_measurements(Source("t.csv", text), load_robot(s.robot), None, layout)
    model = Model(load_robot(s.robot), T_flange_tcp=transform(s.tool), robot_name=s.robot)
    fit = fit_effects(model, data, [effect_library()[key] for key in BASE])
    true = real_tcp(s, asked.states)
    found = predicted(recorded_model(fit), asked, s)
    off, best = rms(placed(found.position, true) - true), tcp(refit(s, rows, AS_DRAWN).cell, asked.states)
    assert off < 1.4 * rms(placed(best, true) - true)
    assert np.mean(np.abs(found.position - true) < 1.96 * found.sigma[:, None]) > 0.88


def test_a_tip_turns_with_joint_1_which_predictions_count_and_work_does_not() -> None:
    s = an_arm()
    model = recorded_model(fitted(tips(np.random.default_rng(SEED), s), s))
    assert model.fit["base"] == ["joint_offset.offset_rad[1]"]
    known = read_uncertainty(model)
    assert known is not None
    names = known.all_parameters
    state = read(unseen_rows(s, SEED), s, measured=False).state
    seen, work = (derivatives(model, state, names, instrument)[0] for instrument in (True, False))
    one = names.index(("joint_offset", 0))
    assert np.abs(seen[:, :, one]).max() > 0.3
    assert not work[:, :, one].any()
    others = [k for k in range(len(names)) if k != one]
    np.testing.assert_array_equal(seen[:, :, others], work[:, :, others])


def test_more_parameters_than_a_tip_can_tell_do_not_take_up_its_noise() -> None:
    s = an_arm()
    fit = fitted(tips(np.random.default_rng(SEED), s), s, (*BASE, "link_geometry"))
    assert 0.5 < fit.variance < 2.0  # in units of the stated noise, which is the true one


def test_a_model_knows_a_tip_by_its_name_and_rows_place_another_gauge() -> None:
    s = an_arm()
    rows = joined([tips(np.random.default_rng(SEED), s), gauges(np.random.default_rng(SEED + 1), s)])
    model = recorded_model(fitted(rows, s))
    setups = model.effect("setup")
    assert setups is not None
    assert "tip S1" in vars(setups)["point"]
    known = predicted(model, rows, s)
    assert known.reading is not None
    gauge = rows.kind == "gauge"
    np.testing.assert_allclose(known.reading[gauge], rows.reading[gauge], atol=1e-4)
    other = replace(rows, name=np.array([f"other {name}" for name in rows.name], object))
    placed_anew = predicted(model, other, s)
    assert placed_anew.reading is not None
    np.testing.assert_allclose(placed_anew.reading[gauge], rows.reading[gauge], atol=1e-4)
    assert np.isnan(placed_anew.reading[~gauge]).all()


def spoiled(name: str) -> Rows:
    """Rows that were not read as they say."""
    s, g = an_arm(), np.random.default_rng(SEED)
    rows = gauges(g, s) if name != "two tips" else joined([tips(g, s, 2, 12)])
    reading, normal = rows.reading.copy(), rows.normal.copy()
    first = int(np.argmax(np.abs(np.diff(reading)[::2])))  # the set-up that changes most
    if name == "hundredths":
        reading *= 100
    if name == "all turned":
        normal *= -1
    if name == "one turned":
        normal[2 * first : 2 * first + 2] *= -1
    if name == "a turn of the dial":
        reading[2 * first + 1] += 1e-3
    if name == "a turn of a dial from the other side":
        reading[2 * first + 1] += 1e-3
        reading, normal = -reading, -normal
    if name == "two tips":
        return replace(rows, name=np.array(["S1"] * len(rows), object))
    return replace(rows, reading=reading, normal=normal)


@pytest.mark.parametrize(
    ("name", "code", "said"),
    [
        ("hundredths", "DAT009", "times what `irb1600_10_145` gives"),
        ("all turned", "DAT041", "read against the load"),
        ("two tips", "DAT041", "touch no common point"),
    ],
)
def test_what_cannot_have_been_read_is_refused(name: str, code: str, said: str) -> None:
    with pytest.raises(PostprocError) as refused:
        read(spoiled(name), an_arm())
    (finding,) = (d for d in refused.value.diagnostics if d.severity == "error")
    assert finding.code == code
    assert said in finding.message


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("one turned", "against the load"),
        ("a turn of the dial", "often 1 mm"),
        ("a turn of a dial from the other side", "often 1 mm"),
    ],
)
def test_a_reading_that_contradicts_the_others_is_not_used(name: str, said: str) -> None:
    data = read(spoiled(name), an_arm())
    (finding,) = (d for d in data.diagnostics if d.code == "DAT041")
    assert said in finding.message
    assert len(data.wrong) == 1
    clean = fitted(gauges(np.random.default_rng(SEED), an_arm()), an_arm(), ("joint_compliance",))
    fit = fitted(spoiled(name), an_arm(), ("joint_compliance",))
    np.testing.assert_allclose(fit.model.effects[-1].vector(), clean.model.effects[-1].vector(), rtol=0.5)


def repeated(rows: Rows, times: int) -> Rows:
    """The same set-ups of a gauge, each read so often without and with its load, to 0.01 mm."""
    index = np.tile(np.arange(len(rows)).reshape(-1, 2), (1, times)).ravel()
    some = {name: getattr(rows, name)[index] for name in ("kind", "name", "normal", "place", "sigma", "label")}
    noise = np.random.default_rng(SEED).normal(0, 1e-5, len(index)).round(5)
    return replace(rows, states=rows.states.take(index), reading=rows.reading[index] + noise, **some)


@pytest.mark.parametrize("times", [2, 3, 6])
def test_a_slip_that_suits_springs_is_seen_where_readings_are_repeated(times: int) -> None:
    """Of two readings nobody knows which is wrong, of three the one that differs."""
    s = an_arm()
    rows = repeated(gauges(np.random.default_rng(SEED), s, 6), times)
    assert not [d for d in read(rows, s).diagnostics if d.code in ("DAT041", "DAT042")]
    for k in range(1, len(rows), 2 * times):
        spoilt = rows.reading.copy()
        spoilt[k] += 2e-4
        data = read(replace(rows, reading=spoilt), s)
        (finding,) = (d for d in data.diagnostics if d.code in ("DAT041", "DAT042"))
        assert f"`gauge {rows.name[k]}` reads" in finding.message and "was misread" in finding.message
        assert data.wrong == ({(0, k + 1), (0, k + 3)} if times == 2 else {(0, k + 1)})


def test_where_the_zeros_are_left_blank_a_zero_is_asked_for() -> None:
    s = an_arm()
    rows = repeated(gauges(np.random.default_rng(SEED), s, 6), 2)
    some, every = rows.reading.copy(), rows.reading.copy()
    some[[4, 6]] = every[::2] = np.nan
    found = [d for d in read(replace(rows, reading=some), s).diagnostics if d.severity == "warning"]
    assert [d.code for d in found] == ["DAT005", "DAT041"] and found[1].message.startswith("`gauge D2` was read in one")
    assert all("write 0" in str(d.help) for d in found)
    with pytest.raises(PostprocError) as refused:
        read(replace(rows, reading=every), s)
    assert [d.code for d in refused.value.diagnostics if d.severity == "error"] == ["DAT041"]


def test_of_readings_under_load_that_nothing_checks_that_is_said() -> None:
    s = an_arm()
    once = gauges(np.random.default_rng(SEED), s, 6)
    (finding,) = (d for d in read(once, s).diagnostics if d.code in ("DAT041", "DAT042"))
    assert finding.code == "DAT042" and "6 set-ups" in finding.message
    partly = joined(
        [repeated(once, 2), replace(gauges(np.random.default_rng(0), s, 1), name=np.array(["N", "N"], object))]
    )
    (finding,) = (d for d in read(partly, s).diagnostics if d.code == "DAT042")
    assert finding.message.startswith("`gauge N` was read once")


@pytest.mark.parametrize("robot", ROBOTS[:2])
@pytest.mark.parametrize("count", [6, 12])
def test_gauges_that_agree_give_no_finding(robot: str, count: int) -> None:
    for seed in range(4):
        s = shop(robot, seed)
        found = read(gauges(np.random.default_rng(seed), s, count), s).diagnostics
        assert not [d for d in found if d.code in ("DAT041", "DAT009")]


ROTATED = '[[external_axes]]\naxis = "a"\nkind = "rotary"\ncarries = "robot"\nquat = [0.5, 0.5, 0.5, 0.5]\n'


@pytest.mark.parametrize("way", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), None], ids=["ceiling", "wall", "turning"])
def test_a_weight_pulls_along_gravity_however_the_base_stands(way: tuple[float, ...] | None) -> None:
    """On a turning base, about the world's x by 30 degrees more at each set-up, gravity is that of the row."""
    s, g, turn = an_arm(), np.random.default_rng(SEED), np.repeat(np.arange(30.0, 210.0, 30.0), 2)
    down = np.array(way or np.swapaxes(A.rotation(np.array([1.0, 0, 0]), np.radians(turn)), 1, 2) @ [0.0, 0, -1])
    rows = gauges(g, replace(s, cell=replace(s.cell, gravity=9.81 * down)), 6)
    header, *lines = csv_of(rows).splitlines()
    turning = [f"{header},eax_a", *(f"{line},{x:g}" for line, x in zip(lines, turn, strict=True))]
    station = parse_model(Source("m.toml", f'robot = "{ROBOT}"\n{ROTATED}'.encode())).station
    told: dict[str, Any] = {"gravity": 9.81 * down} if way else {"station": station, "text": "\n".join(turning)}
    data = read(rows, s, **told)
    assert [d.code for d in data.diagnostics if d.severity == "warning"] == ["DAT042"] and not data.wrong
    with suppress(PostprocError):  # of an arm on the floor they contradict themselves
        assert "DAT041" in {d.code for d in read(rows, s).diagnostics}


def swapped(reading: float) -> float:
    """A reading with its hundredths and tenths in the wrong order."""
    whole, hundredths = divmod(round(1e5 * abs(reading)), 100)
    return float(np.copysign(1e-3 * whole + 1e-4 * (hundredths % 10) + 1e-5 * (hundredths // 10), reading))


@pytest.mark.parametrize("robot", ROBOTS[:2])
@pytest.mark.parametrize(
    "wrong", [lambda r: r + 1e-3, lambda r: r - 1e-3, swapped, lambda r: r / 10, lambda r: 10 * r],
    ids=["a turn more", "a turn less", "swapped digits", "a tenth", "tenfold"],
)  # fmt: skip
def test_one_misread_reading_of_six_set_ups_is_named(robot: str, wrong: Callable[[float], float]) -> None:
    s = shop(robot, SEED, geometry=False)
    rows, judged = gauges(np.random.default_rng(SEED), s, 6), 0
    for k in range(1, len(rows), 2):
        spoilt = rows.reading.copy()
        spoilt[k] = wrong(spoilt[k])
        if abs(spoilt[k] - rows.reading[k]) < 4e-4:
            continue
        data, judged = read(replace(rows, reading=spoilt), s), judged + 1
        (finding,) = (d for d in data.diagnostics if d.code == "DAT041")
        assert f"`gauge {rows.name[k]}`" in finding.message and (0, k + 1) in data.wrong
    assert judged


def test_where_either_of_two_set_ups_may_be_misread_both_are_named() -> None:
    s = an_arm()
    rows = gauges(np.random.default_rng(SEED), s, 6)
    source = Source("t.csv", csv_of(rows).encode())
    data, cells = read(rows, s), read_cells(source, read_column_map(None), [])
    # Two changes show joint 1 alone and contradict each other, four agree on joint 2.
    by_joint = np.zeros((6, 6))
    by_joint[:2, 0] = by_joint[2:, 1] = 1e-3
    changes = LoadChanges(np.arange(1, 12, 2), np.array([1.2e-3, 2.2e-3, 1e-3, 1e-3, 1e-3, 1e-3]), by_joint)
    ((finding, wrong),) = find_strays(changes, data, cells)
    assert wrong.tolist() == [3, 1]
    assert finding.message.endswith("; or `gauge D1` was misread")
    assert finding.help is not None and "`gauge D2` and `gauge D1`" in finding.help


def test_set_ups_of_which_several_are_misread_contradict_each_other() -> None:
    s = an_arm()
    rows = gauges(np.random.default_rng(SEED), s, 6)
    spoilt = rows.reading.copy()
    spoilt[1::2] += np.array([0.0, 2.0, 0.0, -0.8, 0.0, 2.0]) * (spoilt[1::2] - spoilt[::2])
    rows = replace(rows, reading=spoilt)
    data, fit = read(rows, s), fitted(rows, s, ("joint_compliance",))
    (finding,) = (d for d in data.diagnostics if d.code == "DAT041")
    assert "contradict each other" in finding.message and not data.wrong
    far = 1e3 * np.linalg.norm(s.center - s.tool)
    assert str(finding.help).startswith(f"the loads hang {far:.0f} mm from the TCP: is `--tool` right, in mm?")
    assert expected_remaining(fit) is None and "(DAT041" in known_of(fit)[0]
    model = recorded_model(fit)
    assert finding.message in model.fit["contradicted"] and not model.measured_springs
    assert read_uncertainty(model) is None and finding.message in contradicted(model)[0].message


@pytest.mark.parametrize(("joint", "factor"), [(1, 30.0), (2, 1 / 30)])
def test_a_spring_that_no_arm_has_is_named_and_nothing_promised(joint: int, factor: float) -> None:
    """Of a type whose spring is another by a factor, rows of the arm tell that this one is unlike it."""
    s, robot = an_arm(), load_robot(ROBOT)
    rows, usual = gauges(np.random.default_rng(SEED), s), np.array(robot.joint_compliance)
    usual[joint] *= factor
    model = Model(replace(robot, joint_compliance=usual), T_flange_tcp=transform(s.tool), robot_name=ROBOT)
    fit = fit_effects(model, read(rows, s), [effect_library()["joint_compliance"]])
    (finding,) = contradictions(fit)
    assert finding.code == "DAT026" and f"(joint {joint + 1}, of the type " in finding.message
    assert expected_remaining(fit) is None
    assert not contradictions(fitted(rows, s, ("joint_compliance",)))


def test_a_tool_far_off_that_gauges_hardly_tell_from_springs_is_to_be_stated() -> None:
    s = shop(ROBOT, SEED + 1, geometry=False)
    rows = gauges(np.random.default_rng(SEED + 1), s, 6)
    stated, springs = fitted(rows, s), [effect_library()[key] for key in BASE]
    assert not implausible(stated)
    free = fit_effects(Model(load_robot(s.robot), robot_name=s.robot), read(rows, s), springs)
    found = [d for d in implausible(free) if d.message.startswith("`tool_frame.shift_m")]
    assert found and all("`--tool X,Y,Z`" in str(d.help) for d in found)


@pytest.mark.parametrize("name", ["clean", "a turn of the dial"])
def test_a_pull_with_a_spring_balance_is_a_load_as_a_weight_is(name: str) -> None:
    # The same readings, with the weight stated as a force at the flange.
    header, *lines = csv_of(spoiled(name)).splitlines()
    mass, columns = header.split(",").index("payload_kg"), header.replace("payload_kg,", "fx_N,fy_N,fz_N,")
    pulled = [
        [*row[:mass], "0", "0", f"{-9.81 * float(row[mass]):.3f}", *row[mass + 1 :]]
        for row in (line.split(",") for line in lines)
    ]
    keep = [k for k, column in enumerate(columns.split(",")) if not column.startswith("payload")]
    text = "\n".join(",".join(row[k] for k in keep) for row in (columns.split(","), *pulled))
    data = read_measurements(Source("t.csv", text.encode()), load_robot(ROBOT))
    assert len(data.wrong) == len([d for d in data.diagnostics if d.code == "DAT041"]) == (name != "clean")
