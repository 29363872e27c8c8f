"""Free patterns: what no library has is called unknown, at the right place, and no named effect stands in for it."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.channels.state import State
from postproc.identification.curves.families import CurveForms, swelling
from postproc.identification.curves.form import Group, block
from postproc.identification.curves.functions import STEP, fixed, of_signal, sharper, waves
from postproc.identification.curves.prior import FRAMES, PLACES, UNNAMED_LOG_PRIOR, odds
from postproc.identification.curves.signal import Signal, channel_signal
from postproc.identification.diagnose import diagnose
from postproc.identification.screen.curves import CurveScreen
from postproc.identification.screen.suspects import by_channel, places
from postproc.model.derivatives.places import BODY, INSTRUMENT, TOOL
from tests.identification.cells import base_fit, cell
from tests.independent import unknown_effects as kinds


@pytest.mark.parametrize(
    ("kind", "channels", "where"),
    [
        (kinds.refraction, {"x", "y"}, "instrument"),
        (kinds.floor_sway, {"time"}, "instrument"),
        (kinds.encoder, {"azimuth"}, "instrument, azimuth"),
    ],
)
def test_what_no_library_has_is_unknown_with_its_channel_and_place(kind, channels, where):
    data, _ = cell(kind, seed=311, noise=0.02, poses=70)
    found = diagnose(base_fit(data).model, data)
    assert found.verdict == "unknown" and not found.missing
    assert found.suspects[0].channel in channels and found.suspects[0].where == where


def state(q):
    T = np.tile(np.eye(4), (len(q), 7, 1, 1))
    return State(q=q, T_flange_tcp=np.eye(4), T_base_body=T)


def test_no_step_where_nothing_was_measured():
    side = np.where(np.arange(200) % 2, 1.0, -1.0)
    q5 = side * np.linspace(0.3, 1.8, 200)
    steps = [p for p in of_two(q5=q5).every if p.kind == "step" and p.text.endswith("deg")]
    assert len(steps) > 10
    for step in [*steps, *(p for p in sharper(steps[0]) if len(p.numbers) == 1)]:
        split = (q5[step.values > 0].min(), q5[step.values == 0].max())
        assert split[0] - split[1] < 0.2


def test_a_sway_is_found_at_its_own_period_and_phase():
    time = np.linspace(0.0, 7200.0, 150)
    truth = np.sin(2 * np.pi * time / 1630.0 + 0.9)
    coarse = [
        p
        for p in curve_forms({"time": time}, state(np.zeros((150, 6))), np.zeros((150, 3))).every
        if p.text.startswith("swaying")
    ]
    fine = best(sharper(best(coarse, truth)), truth)
    assert abs(np.corrcoef(fine.values, truth)[0, 1]) > 0.9
    assert 1500 < float(fine.text.split()[5]) < 1760


def plain(name, values, kind):
    return block(fixed(lambda x: x, kind, kind), Signal((name,), values, "", name, name))


def best(some, truth):
    return max(some, key=lambda p: abs(np.corrcoef(p.values, truth)[0, 1]) if np.ptp(p.values) else 0.0)


def closest(pattern, truth):
    found = [pattern]
    while near := sharper(pattern):
        pattern = best(near, truth)
        found.append(pattern)
    return best(found, truth)


def all_grown(pattern, every):
    blocks = list(every.grown(pattern))
    return np.hstack([values for values, _ in blocks]), [made for _, group in blocks for made in group]


def of_two(**channels):
    n = len(next(iter(channels.values())))
    return curve_forms(channels, state(np.zeros((n, 6))), np.zeros((n, 3)))


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (lambda q, d, t: d * ((q > -0.3) & (q < 0.9)), "dir5 only where q5 is between -1"),
        (lambda q, d, t: d * (np.abs(q - 0.3) > 0.6), "dir5 only where q5 is not between -1"),
        (lambda q, d, t: d * (t > 24.0), "dir5 only where temperature is above 2"),
        (lambda q, d, t: d * np.sign(t - 22.5), "dir5 the other way where temperature is above 2"),
    ],
)
def test_what_another_channel_switches_is_told_with_its_edge(law, said):
    """A pattern that tells half of it leads to where it acts."""
    g = np.random.default_rng(8)
    q5, dir5, temperature = g.uniform(-1.6, 1.7, 240), g.choice([-1.0, 1.0], 240), g.uniform(20.0, 28.0, 240)
    truth = law(q5, dir5, temperature)
    every = of_two(q5=q5, dir5=dir5, temperature=temperature)
    one = closest(best(every.every, truth), truth)
    values, gates = all_grown(one, every)
    for gate, column in zip(gates[::40], values.T[::40], strict=True):
        assert abs(np.corrcoef(gate.values, column)[0, 1]) > 1 - 1e-9
    found = best([one, closest(best(gates, truth), truth)], truth)
    assert found.text.startswith(said) and abs(np.corrcoef(found.values, truth)[0, 1]) > 0.95


def test_what_switches_may_switch_whatever_grows():
    """A clamp that gives under the payload, a rail with nine stations that tips beyond one of them."""
    g = np.random.default_rng(21)
    payload, station, word = g.choice([0.0, 20.0, 60.0], 120), 0.75 * g.integers(0, 9, 120), g.integers(0, 3, 120)
    fixtures = {f"fixture={w}": (word == k).astype(float) for k, w in enumerate("abc")}
    every = of_two(payload=payload, rail_m=station, **fixtures)
    for name, where, there in (("fixture", "where fixture is c", word == 2), ("rail_m", "step near", station > 2.4)):
        some = [p for p in every.every if p.text.startswith(where) and p.channels == (name,)]
        one = best(some, there)
        found = best(all_grown(one, every)[1], payload * there)
        said = where if name == "fixture" else "where rail_m is above 2.62 ± 0.38"
        assert found.text == f"payload only {said}"
        assert found.values == pytest.approx(payload * there / 60.0)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (lambda q: np.maximum(np.abs(q) - 1.0, 0), "growing above 5"),
        (lambda q: np.sign(q) * np.maximum(np.abs(q) - 1.0, 0), "growing above 5"),
        (lambda q: np.tanh(3 * (q - 0.4)), "rising about 2"),
        (lambda q: np.maximum(q - 0.7, 0) ** 2, "growing above 4"),
        (lambda q: np.exp(-0.5 * ((q - 0.9) / 0.15) ** 2), "bump near 51"),
    ],
)
def test_stops_on_both_sides_and_what_levels_off(law, said):
    q = np.random.default_rng(12).uniform(-2.0, 2.1, 220)
    found = closest(best(of_two(q5=q).every, law(q)), law(q))
    assert found.text.startswith(said) and abs(np.corrcoef(found.values, law(q))[0, 1]) > 0.997


def test_friction_that_grows_as_it_warms_is_the_side_of_a_load_where_it_is_warm():
    g = np.random.default_rng(14)
    load, warm = g.uniform(-400.0, 300.0, 180), g.uniform(20.0, 28.0, 180)
    truth = np.sign(load) * np.maximum(warm - 24.0, 0.0)
    every = of_two(load2=load, temperature=warm)
    side = next(p for p in every.every if p.text == "side of load2")
    gates = all_grown(side, every)[1]
    found = closest(best(gates, truth), truth)
    assert found.text.startswith("side of load2 only where temperature is above 2") and found.text.endswith("growing")
    assert abs(np.corrcoef(found.values, truth)[0, 1]) > 0.99


def test_a_column_of_the_table_may_come_again():
    rail = np.random.default_rng(15).uniform(0.0, 5.0, 150)
    truth = np.sin(2 * np.pi * rail / 1.3 + 0.5)
    found = closest(best(of_two(rail_m=rail).every, truth), truth)
    assert found.text.startswith("wave with a period of ") and abs(np.corrcoef(found.values, truth)[0, 1]) > 0.99
    assert float(found.text.split()[5].rstrip(",")) == pytest.approx(1.3, rel=0.02)


def test_a_column_of_words_has_a_value_for_each_of_them():
    word = np.arange(60) % 3
    whole = of_two(**{f"smr={w}": (word == k).astype(float) for k, w in enumerate("abc")})
    every = [*whole.every, *whole.wide]
    assert {p.text for p in every if p.channels == ("smr",)} == {
        "where smr is a", "where smr is b", "where smr is c", "another value at each of a, b and c",
    }  # fmt: skip
    truth = np.array([0.3, -1.0, 2.0])[word]
    [each] = (p for p in every if p.wide)
    inside = np.column_stack([np.ones(60), each.values])
    assert inside @ np.linalg.lstsq(inside, truth, rcond=None)[0] == pytest.approx(truth)
    some = of_two(**{f"smr={w}": (word == k).astype(float) for k, w in enumerate("ab")}).every
    assert "where smr is empty" in {p.text for p in some}
    # Of two words, one tells all.
    assert len([p for p in of_two(**{"on=yes": word == 0, "on=no": word > 0}).every if p.channels == ("on",)]) == 1


def test_what_rose_since_the_row_before_is_told_of_every_channel():
    warm = np.random.default_rng(16).uniform(20.0, 30.0, 90)
    truth = np.sign(np.diff(warm, prepend=warm[0]))
    found = best(of_two(q1=np.linspace(-1, 1, 90), temperature=warm, time=np.arange(90.0)).every, truth)
    assert found.text == "whether it rose or fell since the row before" and found.channels == ("temperature",)


def test_an_instrument_turns_about_its_own_origin():
    data, _ = cell(kinds.elbow_wave, seed=311, noise=0.02, poses=40)
    problem = base_fit(data).problem
    seen = data.position - problem.error[:, :3]
    for k, axis in enumerate(np.eye(3)):
        assert places(problem)["instrument, turned"][:, :3, k] == pytest.approx(np.cross(axis, seen), abs=5e-3)


def test_what_stands_elsewhere_is_shifted_and_turned():
    """With its door open a cell's column leans, and the tracker on it: neither a shift nor a turn alone tells it."""
    data, _ = cell(kinds.elbow_wave, seed=314, noise=0.02, poses=60)
    fit = base_fit(data)
    door, row = np.where(np.arange(len(data)) % 4 < 2, 1.0, 0.0), fit.problem.row
    leans = fit.problem.sensitivity.matrix[:, :, INSTRUMENT : INSTRUMENT + 6] @ [1e-4, -2e-4, 1e-4, 1e-4, 5e-5, -1e-4]
    y = fit.problem.whiten((leans * door[:, None])[:, :, None])[:, 0] + np.random.default_rng(1).normal(size=len(row))
    every = CurveForms([plain("door", door, "level")], slow=frozenset(["door"]))
    found = CurveScreen(fit.problem, replace(fit.linear, residual=y), every).suspects()
    assert found[0].where in FRAMES
    assert replace(fit.linear, residual=y).extended(found[0].columns(fit.problem)).square < 1.2 * len(y)


def test_an_instrument_feels_no_load():
    every = of_two(load3=np.linspace(-1, 1, 90), temperature=np.cos(np.linspace(0, 9, 90)))
    load = next(p for p in every.every if p.channels == ("load3",))
    warm = next(p for p in every.every if p.channels == ("temperature",))
    ways = [every.sensible(p, where) for p in (load, warm) for where in ("joint 2", "instrument, scale")]
    assert ways == [True, False, True, True]
    some = (k for part, _ in every.at("instrument, scale") for k in range(part.start, part.stop))
    apart = [every.every[k] for k in some]
    assert {p.channels for p in apart if p.where is None} == {("temperature",)}


def test_what_the_arm_did_before_is_told():
    """Rows that are repeated keep the row before the first of them."""
    g = np.random.default_rng(13)
    q6 = np.repeat(g.uniform(-2.6, 2.6, 120), 2)
    before = np.repeat(np.concatenate([q6[:1], q6[:-2:2]]), 2)
    wave = closest(best(of_two(q6=q6, time=np.arange(float(len(q6)))).every, np.sin(2 * before)), np.sin(2 * before))
    assert wave.text.startswith("wave 2 times a turn of q6 in the row before") and wave.kind == "before"
    rose = best(of_two(q6=q6, time=np.arange(float(len(q6)))).every, np.sign(q6 - before))
    assert rose.text == "whether it rose or fell since the row before"


def test_what_is_dragged_along_is_told_by_how_far():
    """A slide with 30 deg of play to either side keeps its place until an end takes it along."""
    q2 = np.repeat(np.random.default_rng(15).uniform(-1.0, 1.2, 80), 2)
    reach, place, slack = np.radians(30.0), 0.0, []
    for angle in q2 - q2[0]:
        place = min(max(place, angle - reach), angle + reach)
        slack.append(angle - place)
    found = closest(best(of_two(q2=q2, time=np.arange(float(len(q2)))).every, np.array(slack)), np.array(slack))
    assert found.text.startswith("dragged along by q2, and slipping after ")
    assert found.numbers[0] == pytest.approx(reach, rel=0.1) and not found.drafts
    assert abs(np.corrcoef(found.values, slack)[0, 1]) > 0.99


def test_what_follows_a_channel_late_is_told_by_its_lag():
    """Warmth behind that of the hall by 2400 s, integrated in small steps."""
    g = np.random.default_rng(16)
    fine = np.arange(0.0, 20000.0, 5.0)
    hall = 20 + np.array([0.0, 8.0, -3.0, 9.0, 2.0, 11.0, -4.0])[(fine // 3000).astype(int)]
    warm = [hall[0]]
    for air in hall[1:]:
        warm.append(warm[-1] + 5.0 / 2400.0 * (air - warm[-1]))
    row = np.sort(g.choice(len(fine), 150, replace=False))
    late = np.array(warm)[row] - 20.0
    every = of_two(time=fine[row], temperature=hall[row]).every
    found = closest(best([p for p in every if p.kind == "late"], late), late)
    assert found.text.startswith("following temperature with a lag of 2") and found.channels == ("temperature",)
    assert abs(np.corrcoef(found.values, late)[0, 1]) > 0.99 and not found.drafts


def test_the_size_of_an_angle_may_come_again_along_a_column():
    g = np.random.default_rng(17)
    q2, rail = g.uniform(-0.8, 1.1, 200), g.uniform(0.0, 10.0, 200)
    truth = q2 * np.cos(2 * np.pi * rail / 3.3 - 0.4)
    found = closest(best(of_two(q2=q2, rail=rail).every, truth), truth)
    assert found.text.startswith("q2 times a wave of rail, with a period of 3.3")
    assert abs(np.corrcoef(found.values, truth)[0, 1]) > 0.995


def test_a_loose_seat_follows_gravity_along_an_axis_of_the_tool():
    g = np.random.default_rng(14)
    turned = Rotation.random(150, random_state=3).as_matrix()
    T = np.tile(np.eye(4), (150, 7, 1, 1))
    T[:, 6, :3, :3] = turned
    at = State(q=g.uniform(-1, 1, (150, 6)), T_flange_tcp=np.eye(4), T_base_body=T)
    truth = 1.0 * (turned[:, 2, 1] * -9.80665 > 2.0)  # gravity along y of the flange
    every = curve_forms({}, at, np.zeros((150, 3)))
    found = closest(best([p for p in every.every if p.where == "tool"], truth), truth)
    assert found.text.startswith("step near ") and found.text.endswith("m/s^2 of gravity along y of the tool")
    assert abs(np.corrcoef(found.values, truth)[0, 1]) > 0.99


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (lambda q: np.sin(5 * q + 0.4), "wave 5 times"),
        (lambda q: np.sin(31 * q + 0.4), "wave 31 times"),
        (lambda q: np.maximum(np.sin(7 * q + 2), 0), "halved wave 7"),
        (lambda q: np.abs(np.sin(2 * q)), "folded wave 4"),
        (lambda q: np.sign(np.sin(4 * q + 0.5)), "pulses 4"),
        (lambda q: 1.0 * (np.mod(5 * q / (2 * np.pi) - 0.2, 1) < 0.22), "pulses 5"),
        (lambda q: np.mod(10 * q / (2 * np.pi) + 0.3, 1.0), "saw tooth 10"),
        (lambda q: np.abs(np.mod(12.7 * q / (2 * np.pi) + 0.3, 1.0) - 0.5), "triangular wave 12.7"),
    ],
)
def test_what_comes_again_is_told_with_its_period(law, said):
    q = np.random.default_rng(9).uniform(-2.6, 2.7, 260)
    found = closest(best(of_two(q4=q).every, law(q)), law(q))
    assert found.text.startswith(said) and abs(np.corrcoef(found.values, law(q))[0, 1]) > 0.96


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (lambda x: np.exp(-x / 400), "settling within 4"),
        (lambda x: np.log1p(x / 60), "growing with the logarithm, bent at "),
        (lambda x: (x - 700) ** 2, "growing to either side of "),
        (lambda x: np.sqrt(x), "growing with the root of picks"),
        (lambda x: 1.0 * (np.abs(x - 700) < 25), "only between "),
        (lambda x: np.exp(-0.5 * ((x - 700) / 30) ** 2), "bump near "),
    ],
)
def test_what_a_column_of_the_table_does_is_told(law, said):
    picks = np.random.default_rng(19).uniform(0, 3000, 200)
    found = closest(best(of_two(picks=picks).every, law(picks)), law(picks))
    assert found.text.startswith(said) and abs(np.corrcoef(found.values, law(picks))[0, 1]) > 0.99


def test_what_only_a_few_rows_show_is_no_switch():
    q = np.linspace(-1, 1, 100)
    every = of_two(dir1=np.sign(np.cos(40 * q)), q2=q)
    side = next(p for p in every.every if p.kind == "line" and p.channels == ("dir1",))
    finer = [p for switch in all_grown(side, every)[1][::7] for p in sharper(switch)]
    assert len(finer) > 100
    changed = [np.count_nonzero(np.abs(p.values - side.values) > 0.5) for p in finer]
    assert min(changed) >= 6


def test_pulses_are_told_by_the_ends_of_one():
    q = np.random.default_rng(10).uniform(-1.5, 1.5, 400)
    truth = 1.0 * (np.mod(q - 0.31, 0.9) < 0.25)
    found = closest(best(of_two(q2=q).every, truth), truth)
    low, high = (np.radians(float(x)) for x in re.findall(r"(-?[\d.]+) deg", found.text)[-2:])
    assert np.mod(low - 0.31 + 0.1, 0.9) - 0.1 == pytest.approx(0.0, abs=0.02)
    assert high - low == pytest.approx(0.25, abs=0.03)


def test_an_edge_is_told_as_closely_as_the_rows_lie():
    """No closer than the rows on both sides of it, and those edges that do as well."""
    q = channel_signal("q1", np.radians([-40.0, -20.0, -15.0, 15.0, 19.0, 45.0, 50.0]))
    zero, first, second = block(STEP, q, np.radians([[0.0], [17.0], [32.0]]))
    assert first.told() == "step near 17.0 ± 2.0 deg"
    assert first.told([second]) == "step near 30 ± 15 deg"
    assert zero.told() == "step near 0 ± 15 deg"


def test_the_best_pattern_is_tried_everywhere_else(monkeypatch):
    """Where it was found, its edge stays as wide as the edges that do as well: tried alone it would have but its own."""
    data, _ = cell(kinds.elbow_wave, seed=313, noise=0.02, poses=60)
    fit = base_fit(data)
    time, row = np.random.default_rng(3).permutation(np.linspace(0.0, 7200.0, len(data))), fit.problem.row
    moved = fit.problem.whiten(fit.problem.sensitivity.matrix[:, :, 3:4])[:, 0] * 2e-4 * (time > 3500)[row]
    y, added = moved + np.random.default_rng(5).normal(size=len(row)), list[str]()
    own = CurveScreen._tested
    monkeypatch.setattr(CurveScreen, "_tested", lambda self, where, form: added.append(where) or own(self, where, form))
    found = CurveScreen(fit.problem, replace(fit.linear, residual=y), of_two(time=time)).suspects()
    assert (found[0].where, found[0].pattern) == ("joint 4", "step near 3427 ± 130 s")
    assert {"joint 3", "joint 5", "base", "tool"} <= set(added) and "joint 4" not in added


def test_a_tool_that_turns_is_seen_where_orientations_are_measured():
    """With a heavy payload the flange turns in its seat: its point moves a little, its axes turn."""
    data, _ = cell(kinds.elbow_wave, seed=314, noise=0.02, poses=60)
    assert "tool, shifted and turned" not in places(base_fit(data).problem)
    turned = replace(data, rotation=base_fit(data).problem.equilibrium.T_base_tcp[:, :3, :3])
    fit = base_fit(turned)
    heavy, row = np.where(np.arange(len(data)) % 3 == 0, 1.0, 0.0), fit.problem.row
    moved = fit.problem.sensitivity.matrix[:, :, TOOL : TOOL + 6] @ [0, 3e-5, 0, 4e-4, 0, -3e-4]
    y = fit.problem.whiten((moved * heavy[:, None])[:, :, None])[:, 0] + np.random.default_rng(1).normal(size=len(row))
    left = replace(fit.linear, residual=y)
    found = CurveScreen(
        fit.problem, left, CurveForms([plain("payload", heavy, "level")], slow=frozenset(["payload"]))
    ).suspects()
    assert found[0].where == "tool, shifted and turned" and found[0].evidence > 0
    assert left.extended(found[0].columns(fit.problem)).square < 1.2 * len(y)


def test_a_tool_that_turns_follows_the_arm_as_well():
    """A changer with play turns by the side from which the last joint came."""
    data, _ = cell(kinds.elbow_wave, seed=314, noise=0.02, poses=60)
    fit = base_fit(replace(data, rotation=base_fit(data).problem.equilibrium.T_base_tcp[:, :3, :3]))
    side, row = np.where(np.arange(len(data)) % 3 == 0, 1.0, -1.0), fit.problem.row
    moved = fit.problem.sensitivity.matrix[:, :, TOOL : TOOL + 6] @ [0, 3e-5, 0, 4e-4, 0, -3e-4]
    y = fit.problem.whiten((moved * side[:, None])[:, :, None])[:, 0] + np.random.default_rng(1).normal(size=len(row))
    left = replace(fit.linear, residual=y)
    found = CurveScreen(fit.problem, left, of_two(dir6=side, time=np.linspace(0, 1, len(side)))).suspects()
    assert (found[0].where, found[0].channel) == ("tool, shifted and turned", "dir6")
    assert left.extended(found[0].columns(fit.problem)).square < 1.2 * len(y)


def test_what_is_in_a_tank_weighs_as_much_as_there_is_of_it():
    """A column of the table may be a mass, counted from zero; a temperature is none."""
    g = np.random.default_rng(4)
    every = of_two(level=g.uniform(20, 60, 90), temperature=g.uniform(20, 30, 90))
    [weight] = (p for p in every.every if p.where == "weight")
    assert weight.channels == ("level",) and weight.factors[0][0].law(0.0) == 0.0
    slow = next(p for p in every.every if p.channels == ("level",) and p.where is None)
    ways = [every.sensible(p, w) for p in (weight, slow) for w in ("body 3", "tool, under a weight")]
    assert ways == [False, True, True, True]
    load = of_two(load3=g.normal(size=90)).every[0]
    assert not every.sensible(load, "tool, under a weight")


def test_a_kind_of_which_there_are_few_is_cheap():
    """Every kind is as likely, and in it every one of its kind: the odds of all patterns together are one."""
    every = of_two(q1=np.linspace(-1, 1, 90), load1=np.cos(np.linspace(0, 9, 90)))
    at = {None: PLACES, "joint": 6}
    each = [odds(p, every.kinds) for p in every.every]
    np.testing.assert_allclose(2 * np.log(each) + UNNAMED_LOG_PRIOR, every.prices)
    assert sum(at.get(p.where, 1) / o for p, o in zip(every.every, each, strict=True)) == pytest.approx(1.0)
    line = next(o for p, o in zip(every.every, each, strict=True) if p.kind == "line")
    product = next(o for p, o in zip(every.every, each, strict=True) if p.kind == "swelling wave")
    assert product > 5 * line


def test_a_pattern_that_cannot_be_moved_is_told_as_it_is():
    data, _ = cell(kinds.elbow_wave, seed=311, noise=0.02, poses=40)
    fit = base_fit(data)
    side = np.where(np.arange(len(data)) % 2 == 0, 1.0, -1.0)
    turned = fit.problem.whiten(fit.problem.sensitivity.matrix[:, :, 1:2])[:, 0] * 3e-4 * side[fit.problem.row]
    y = turned + np.random.default_rng(1).normal(size=len(turned))
    still = plain("q2", side, "side")
    found = CurveScreen(fit.problem, replace(fit.linear, residual=y), CurveForms([still])).suspects()
    assert found[0].evidence > 0 and (found[0].where, found[0].pattern) == ("joint 2", "side")


@pytest.mark.parametrize("body", [4, 5])
def test_a_body_that_shifts_is_told_beside_what_it_is_off_everywhere(body):
    """The end of a body sits elsewhere by the side of a load, and by as much everywhere: the constant tells nothing."""
    data, _ = cell(kinds.elbow_wave, seed=312, noise=0.02, poses=60)
    fit = base_fit(data)
    J = fit.problem.whiten(fit.problem.sensitivity.matrix[:, :, BODY + 6 * body : BODY + 6 * body + 3])
    side = np.where(np.arange(len(data)) % 3 == 0, 1.0, 0.0)
    row = fit.problem.row
    y = (
        J @ [3e-4, -2e-4, 2e-4]
        + (J * side[row, None]) @ [4e-4, 3e-4, -3e-4]
        + np.random.default_rng(1).normal(size=len(row))
    )
    found = CurveScreen(fit.problem, replace(fit.linear, residual=y), CurveForms([plain("x", side, "side")])).suspects()
    assert found[0].where == f"body {body}, shifted"
    after = replace(fit.linear, residual=y).extended(found[0].columns(fit.problem))
    assert after.square < 1.3 * len(y)


def test_a_channel_that_goes_with_the_first_one_is_told_beside_it():
    """A hall that warms up all the time: temperature or time, this data cannot say."""
    data, _ = cell(kinds.elbow_wave, seed=313, noise=0.02, poses=60)
    fit = base_fit(data)
    time, row = np.linspace(0.0, 7200.0, len(data)), fit.problem.row
    warm, other = 20.0 + np.sqrt(time), np.random.default_rng(2).normal(size=len(data))
    turned = fit.problem.whiten(fit.problem.sensitivity.matrix[:, :, 3:4])[:, 0] * 4e-4 * ((warm - 20.0) / 50.0)[row]
    y = turned + np.random.default_rng(1).normal(size=len(row))
    lines = [plain(n, v, "line") for n, v in (("temperature", warm), ("time", time), ("x", other))]
    shown = by_channel(CurveScreen(fit.problem, replace(fit.linear, residual=y), CurveForms(lines)).suspects())
    assert [(s.channel, s.where) for s in shown[:2]] == [("temperature", "joint 4"), ("time", "joint 4")]
    assert shown[1].pattern.endswith("time goes with temperature here") and "x" not in {s.channel for s in shown}


def test_pulses_are_on_between_the_edges_that_they_name():
    angle = np.linspace(-3.0, 3.0, 500)
    [*_, wave] = (p for p in sharper(waves(channel_signal("q2", angle), [5.0])[0]) if p.numbers[0] == 5.0)
    pulses = [p for p in sharper(wave) if p.text.startswith("pulses 5 times")]
    assert len(pulses) > 100
    for pulse in pulses[::9]:
        on, off = (np.radians(float(x)) for x in re.findall(r"(-?[\d.]+) deg", pulse.text))
        inside = np.mod(angle - on, 2 * np.pi / 5) < off - on
        assert np.mean((pulse.values > 0.5) == inside) > 0.97


def test_friction_grows_with_the_size_of_the_load_and_turns_with_the_side():
    side, load = np.tile([1.0, -1.0, 1.0], 20), np.linspace(-400.0, 300.0, 60)
    found = {p.text: p.values for p in of_two(dir3=side, load3=load).every}
    values = found["side of dir3 times size of load3"]
    assert np.corrcoef(values, side * np.abs(load))[0, 1] > 0.999


def test_many_waves_at_once_are_as_exact_as_single_precision_is():
    every = waves(channel_signal("q2", np.linspace(-6.0, 3.0, 500), ""), range(1, 129))
    together = Group([every]).values
    for k in range(0, len(every), 31):
        np.testing.assert_allclose(together[:, k], every[k].values, atol=5e-7)


def test_a_law_that_begins_with_the_first_row_is_finite_before_it():
    row = Signal(("row",), np.linspace(25.0, 90.0, 60), 'state.channels["row"]', "row", "row")
    [settling] = (some for some in of_signal(row) if some.like.kind == "settling")
    logs = [p for p in sharper(settling[0]) if "logarithm" in p.text]
    before = np.linspace(-500.0, 500.0, 41)
    assert logs and all(np.isfinite(p.factors[0][0].law(before, *p.numbers)).all() for p in logs)


def test_waves_of_an_angle_on_a_grid_are_those_that_its_places_tell_apart():
    """In places 60 degrees apart a wave that comes 5 times a turn is one that comes once, turned back."""
    grid = np.radians(np.random.default_rng(7).choice([-60.0, 0.0, 60.0], 60))
    angle, level = channel_signal("q4", grid), channel_signal("level", np.linspace(0, 1, 60), "channels")
    every = Group([waves(angle, range(1, 13)), *swelling(angle, level, range(1, 13))])
    said = [p.text for p in every]
    times = {int(found[1]) for form in said if (found := re.search(r"(\d+) times a turn", form))}
    assert times == {1, 2, 3}
