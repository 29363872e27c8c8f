"""Several reflectors on one tool, and some beside the arm, seen on the independent arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from postproc.diagnostics import Diagnostic, Source
from postproc.effects.registry import effect_library
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.identification.diagnose import diagnose
from postproc.identification.predict import predict_rows
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.together import together
from postproc.model.arm import Model
from postproc.robot.catalogue import load_robot
from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent.cells import DEG, Cell, States, draw_cell, draw_states, measure
from tests.independent.inverse import inverse

ROBOT = load_robot("irb4600_60_205")
BASE = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")
POINTS = {"left": (0.02, -0.11, 0.35), "right": (0.02, 0.13, 0.34), "top": (-0.14, 0.01, 0.42)}
FLOOR = np.array([1.7, -0.9, 0.1])


def arm(seed: int, kinds: tuple[str, ...] = ()) -> Cell:
    g = np.random.default_rng(seed)
    return draw_cell(g, A.ARMS["irb4600_60_205"](), tuple(getattr(K, kind)(g, A.irb4600()) for kind in kinds))


def seen(cell: Cell, s: States, names: np.ndarray, points: Mapping[str, tuple[float, ...]] = POINTS) -> np.ndarray:
    """(n, 3) places of the reflector of each row [m]; those that stand beside the arm at `FLOOR`."""
    places = np.tile(FLOOR, (len(s), 1))
    for name, point in points.items():
        places = np.where((names == name)[:, None], measure(replace(cell, tool=A.shift(*point)), s), places)
    return places


def table(s: States, names: np.ndarray, places: np.ndarray, first: int = 0, session: str = "") -> str:
    """A table of these rows: poses are labelled, so that rows of one pose and reflector are repeats."""
    joints = ",".join(f"q{j}_deg" for j in range(1, 7))
    head = f"pose_id,{joints},x_mm,y_mm,z_mm,payload_kg,payload_x_mm,payload_y_mm,payload_z_mm,time_s,reflector"
    lines = [head + (",session" if session else "")]
    for i in range(len(s)):
        cells = [
            f"P{first + i // len(POINTS)}",
            *(f"{x:.5f}" for x in s.q[i] / DEG),
            *(f"{x:.4f}" for x in 1e3 * places[i]),
        ]
        cells += [f"{s.mass[i]:g}", *(f"{1e3 * x:g}" for x in s.center[i]), f"{s.time[i]:.1f}", str(names[i])]
        lines.append(",".join([*cells, *([session] if session else [])]))
    return "\n".join(lines)


def rows(seed: int, poses: int, each: tuple[str, ...] = (*POINTS,)) -> tuple[States, np.ndarray]:
    """States of poses, each with one row for every reflector, and the reflector of each row."""
    s = draw_states(np.random.default_rng(seed), poses, A.irb4600(), False, False)
    return s.take(np.repeat(np.arange(poses), len(each))), np.tile(np.array(each), poses)


def read(text: str, column_map: str = "") -> Measurements:
    layout = Source("map.toml", column_map.encode()) if column_map else None
    return read_measurements(Source("rows.csv", text.encode()), ROBOT, column_map=layout)


def fitted(data: Measurements, keys: tuple[str, ...] = BASE) -> Fit:
    library = effect_library()
    return fit_model(Model(ROBOT, robot_name=ROBOT.name, effects=tuple(library[k].null() for k in keys)), data)


def said(data: Measurements) -> list[Diagnostic]:
    return [d for d in data.diagnostics if d.severity != "info"]


def test_each_reflector_gets_its_point_on_the_tool():
    cell, (s, names) = arm(1), rows(1, 60)
    g = np.random.default_rng(2)
    data = read(table(s, names, seen(cell, s, names) + g.normal(0, 2e-5, (len(s), 3))))
    assert said(data) == [] and data.state.reflector_names == tuple(POINTS)
    fit = fitted(data)
    effect = fit.model.effect("reflector")
    assert effect.first == ("left",) and effect.reflector == ("right", "top")
    beside = [np.subtract(POINTS[name], POINTS["left"]) for name in effect.reflector]
    # The zero of joint 6 turns them all about its axis: their distances are told better.
    assert effect.shift_m == pytest.approx(np.array(beside), abs=3e-4)
    assert np.linalg.norm(effect.shift_m, axis=1) == pytest.approx(np.linalg.norm(beside, axis=1), abs=1.5e-5)
    assert np.linalg.norm(np.diff(effect.shift_m, axis=0)) == pytest.approx(
        np.linalg.norm(np.diff(beside, axis=0)), abs=1.5e-5
    )
    assert fit.model.effect("tool_frame").vector()[:3] == pytest.approx(POINTS["left"], abs=3e-4)
    assert fit.rms == pytest.approx(2e-5, rel=0.15) and fit.held_out_rms < 2.5e-5
    assert [name for name, _ in fit.unidentifiable if name == "reflector"] == []
    lines = [line.rpartition(",")[0] for line in table(s, names, seen(cell, s, names)).splitlines()]
    unnamed = read("\n".join([lines[0], *lines[1::3]]))
    assert evaluate(fit.model, unnamed).rms < 2e-5 and predict_rows(fit.model, unnamed).diagnostics == ()
    other, names = rows(5, 20, ("top", "left"))
    again = evaluate(fit.model, read(table(other, names, seen(cell, other, names))))
    assert again.rms < 2e-5 and again.model.effect("reflector").reflector == ("right", "top")


def test_poses_of_other_reflectors_and_sessions_place_each_other():
    """One session has the first reflector, the next one only others, of which one stood in the first, from elsewhere."""
    cell = arm(3)
    moved = replace(cell, instrument=A.transform(A.rotation_vector(np.array([0.1, 0.2, 1.0])), np.array([1.0, 2, 0.3])))
    tables = []
    for k, (one, each) in enumerate([(cell, ("left", "right")), (moved, ("right", "top"))]):
        s, names = rows(10 + k, 40, each)
        places = seen(one, s, names) + np.random.default_rng(k).normal(0, 2e-5, (len(s), 3))
        tables.append(read_measurements(Source(f"{k}.csv", table(s, names, places, 100 * k).encode()), ROBOT))
    both = together(tables, ROBOT)
    assert both.state.reflector_names == ("left", "right", "top") and said(both) == []
    fit = fitted(both)
    assert fit.rms < 2.5e-5 and fit.model.effect("session").session == ("1",)
    apart = fit.model.effect("reflector").shift_m
    assert fit.model.effect("reflector").reflector == ("left", "top")
    assert np.linalg.norm(apart[1] - apart[0]) == pytest.approx(
        np.linalg.norm(np.subtract(POINTS["top"], POINTS["left"])), abs=2e-5
    )


def test_a_row_of_another_reflector_than_it_says_is_named():
    cell, (s, names) = arm(4), rows(4, 40)
    wrong = names.copy()
    wrong[30:32] = wrong[[31, 30]]
    data = read(table(s, wrong, seen(cell, s, names)))
    assert [(d.code, d.severity) for d in said(data)] == [("DAT007", "warning")] * 2
    assert data.usable.sum() == len(data) - 2 and not data.usable[30:32].any()


def with_floor(seed: int, drift_m: float, noise_m: float = 2e-5) -> tuple[States, np.ndarray, np.ndarray]:
    """Twelve poses in which a reflector on the floor is read as well, from an instrument that drifts along x."""
    s, names = rows(seed, 48)
    names[::12] = "floor"
    places = seen(arm(seed), s, names) + np.random.default_rng(seed).normal(0, noise_m, (len(s), 3))
    return s, names, places + np.outer(np.linspace(0, drift_m, len(s)), [1, 0, 0])


@pytest.mark.parametrize(("drift_m", "moves"), [(0.0, False), (2e-4, True)])
def test_a_reflector_that_stands_beside_the_arm_watches_the_instrument(drift_m, moves):
    data = read(table(*with_floor(6, drift_m)))
    (finding,) = (d for d in data.diagnostics if d.code == "DAT040")
    assert data.references == {"floor"} and (finding.severity == "warning") == moves
    assert "reflector `floor` stands beside the arm: its 12 readings lie within" in finding.message
    assert ("the instrument moved" if moves else "the instrument stood still") in finding.message
    assert not data.usable[::12].any() and data.usable.sum() == len(data) - 12
    assert [d.code for d in said(data)] == (["DAT040"] if moves else [])
    assert "floor" not in fitted(data).model.effect("reflector").reflector


def test_a_reflector_beside_the_arm_disturbs_no_prediction():
    s, names, places = with_floor(6, 0.0)
    model = fitted(read(table(s, names, places))).model
    asked = read_measurements(Source("rows.csv", table(s, names, places).encode()), ROBOT, measured=False)
    assert asked.references == {"floor"} and said(asked) == []
    for place in (False, True):
        found = predict_rows(model, asked, place=place)
        off = np.linalg.norm(found.position - asked.position, axis=1)[names != "floor"]
        assert off.max() < 2e-4 and [d.code for d in found.diagnostics if d.severity != "info"] == []


def test_the_map_names_what_the_rows_do_not_show():
    """Where the arm always stands in one pose when the reflector on the floor is read, nothing shows that it stands still."""
    s, names, places = with_floor(7, 0.0)
    text = table(s.take(np.where(names == "floor", 0, np.arange(len(s)))), names, places)
    assert read(text).references == frozenset()
    assert read(text, 'references = ["floor"]').references == {"floor"}


def test_a_tip_that_is_held_in_a_hole_is_on_the_arm():
    g, cell = np.random.default_rng(8), arm(8)
    tcp = A.transform(
        A.rotation_vector(np.array([0, np.pi, 0]) + g.uniform(-0.5, 0.5, (40, 3))), np.array([1.3, 0.2, 0.6])
    )
    q = inverse(cell.arm, tcp @ A.shift(*-np.array(POINTS["left"])))[:, 0]
    s, names = rows(8, 60 + len(q), ("left",))
    names[:60], s = "top", replace(s, q=np.vstack([s.q[:60], q]))
    places = seen(cell, s, names)
    assert np.isfinite(q).all() and np.ptp(places[60:], axis=0).max() < 3e-3
    data = read(table(s, names, places))
    assert data.references == frozenset() and not [d for d in data.diagnostics if d.code == "DAT040"]
    assert "left" in fitted(data).model.effect("reflector").reflector + fitted(data).model.effect("reflector").first


def test_what_the_arm_lacks_is_found_with_several_reflectors():
    cell, (s, names) = arm(9, ("transmission_error",)), rows(9, 60)
    data = read(table(s, names, seen(cell, s, names) + np.random.default_rng(1).normal(0, 2e-5, (len(s), 3))))
    found = diagnose(fitted(data).model, data)
    assert [m.key for m in found.missing] == ["transmission_error"] and found.final.held_out_rms < 3e-5
    assert "reflector" not in {c.key for c in found.candidates}


def test_a_prediction_says_which_reflectors_it_does_not_know():
    cell, (s, names) = arm(1), rows(1, 40, ("left", "right"))
    model = fitted(read(table(s, names, seen(cell, s, names)))).model
    other, each = rows(2, 20)
    data = read(table(other, each, seen(cell, other, each)))
    off = np.linalg.norm(predict_rows(model, data).position - data.position, axis=1)
    assert off[each != "top"].max() < 1e-5 < 0.1 < off[each == "top"].min()
    (finding,) = (d for d in predict_rows(model, data).diagnostics if d.code == "DAT021")
    assert (
        finding.message
        == "the model does not know where `top` is on the tool: its rows are predicted as those of `left`"
    )
    placed = predict_rows(model, data, place=True)
    assert np.linalg.norm(placed.position - data.position, axis=1).max() < 1e-5
    assert not [d for d in placed.diagnostics if d.code == "DAT021"]
