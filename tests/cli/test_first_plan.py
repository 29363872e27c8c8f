"""`postproc plan` without a table: the table to fill in, the program, the sheet, and what is refused."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc.compensation.judgement.accuracy import Accuracy
from postproc.identification.planning.standing import can_work, random_postures, working_box
from postproc.model.arm import Model
from postproc.model.file import read_model
from postproc.model.uncertainty.scatter import spring_covariance
from postproc.results.convert.conclusion import touches_help
from postproc.robot.catalogue import load_robot
from tests.cli.conftest import Call
from tests.identification.test_first_plan import TOOL, changes

GAUGE = ("--kind", "gauge", "--load", "40", "--tool", "0,0,300")
HEAD = {
    "gauge": ["gauge", "nx", "ny", "nz", "reading_mm"],
    "tip": ["tip"],
    "plane": ["plane"],
    "distance": ["anchor", "distance_mm"],
    "position": ["x_mm", "y_mm", "z_mm"],
}


@pytest.mark.parametrize("kind", HEAD)
def test_a_plan_is_a_table_a_program_and_a_sheet(kind: str, call: Call, tmp_path: Path):
    table, visit, sheet = (tmp_path / name for name in ("t.csv", "m.mod", "s.html"))
    files = ("-o", table, "--rapid", visit, "--report", sheet)
    planned = call("plan", "irb1600_10_145", "-n", "4", "--kind", kind, "--load", "8", *files)
    assert planned.code == 0 and "is expected to remain" in planned.err and f"`postproc fit {table}" in planned.err
    assert ("The 8 kg hang at the TCP, " if kind == "gauge" else "The 8 kg are bolted to the flange") in planned.err
    assert ("Measure that place to 1 cm" in planned.err) == (kind == "gauge")
    head, *rows = csv.reader(table.read_text("utf-8").splitlines())
    assert head[-len(HEAD[kind]) :] == HEAD[kind] and "payload_kg" in head
    assert len(rows) == (16 if kind == "gauge" else 4)
    assert call("inspect", visit, "--robot", "irb1600_10_145").code == 0
    page = sheet.read_text("utf-8")
    boxes = {"gauge": 4, "position": 3}.get(kind, 1)
    assert page.count('class="box"') == 4 * boxes and page.count("<svg") == 4 and "<script" not in page


def test_the_commands_after_a_plan_state_what_was_planned_for(call: Call, tmp_path: Path):
    model, table = tmp_path / "arm.toml", tmp_path / "t.csv"
    model.write_text('robot = "irb1600_10_145"\n[mounting]\nrpy_deg = [180, 0, 0]\n[tool]\nxyz_mm = [0, 10, 300.5]\n')
    done = call("plan", model, "-n", 1, "--kind", "gauge", "--load", 8, "--noise", 0.02, "-o", table)
    stated = "--mounting 180,0,0 --tool 0,10,300.5 --noise 0.02"
    assert f"`postproc fit {table} --robot irb1600_10_145 {stated} -o MODEL.toml`" in done.err
    assert "where no weight can be hung" in done.err
    words = ["--kind", "gauge", "--load", "8", "--mounting", "0,90,0", "--tool", "0,0,0.3"]
    named = call("plan", "irb1600_10_145", "-n", 1, *words, "-o", table)
    assert "warning[CLI006]: `--tool 0,0,0.3` puts the TCP 0.3 mm from the flange" in named.err
    assert "--robot irb1600_10_145 --mounting 0,90,0 --tool 0,0,0.3" in named.err
    twice = call("plan", model, "-n", 1, "--kind", "gauge", "--load", 8, "--mounting", "180,0,0")
    assert twice.code == 2 and "`--mounting` both say how the base stands" in twice.err


def test_the_document_says_what_remains_and_what_no_load_tells(call: Call):
    said = json.loads(call("plan", "irb4600_60_205", "-n", "5", *GAUGE, "--json").out)
    before, after = (said[f"expected_remaining_fraction_{when}"] for when in ("before", "after"))
    assert said["kind"] == "gauge" and len(said["set_ups"]) == said["poses"] == 5
    assert after[1] < 0.3 * before[1] and 1 in said["joints_never_loaded"]


@pytest.mark.parametrize(("count", "planned"), [(1, "with this set-up"), (2, "with these 2 set-ups")])
def test_one_set_up_or_two_are_a_plan(count: int, planned: str, call: Call, tmp_path: Path):
    done = call("plan", "irb2600_20_165", "-n", count, "--kind", "gauge", "--load", "15", "-o", tmp_path / "t.csv")
    assert done.code == 0 and planned in done.err
    assert len((tmp_path / "t.csv").read_text("utf-8").splitlines()) == 1 + 4 * count


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "without a table nothing says what is to be measured"),
        (("--kind", "gauge"), "a gauge needs a load"),
        (("--kind", "gauge", "--load", "61"), "61 kg are over the rated payload"),
        (("--kind", "tip", "--pull", "50"), "`--pull` is for a gauge"),
        (("--kind", "tip", "--force", "50"), "need a table"),
        (("--kind", "tip", "--region", "5000,0,0,6000,1,1"), "0 set-ups can be measured here"),
    ],
)
def test_what_cannot_be_planned_writes_nothing(words: tuple[str, ...], message: str, call: Call, tmp_path: Path):
    refused = call("plan", "irb4600_60_205", *words, "-o", tmp_path / "t.csv", "--report", tmp_path / "s.html")
    assert refused.code == 2 and message in refused.err and not list(tmp_path.iterdir())


def test_if_one_file_cannot_be_written_none_is(call: Call, tmp_path: Path):
    (tmp_path / "s.html").mkdir()
    refused = call("plan", "irb4600_60_205", *GAUGE, "-o", tmp_path / "t.csv", "--report", tmp_path / "s.html")
    assert refused.code == 2 and not (tmp_path / "t.csv").exists()


@pytest.mark.parametrize(
    ("robot", "load", "seed"),
    [("irb4600_60_205", 40, 0), ("ur10", 8, 2)],
)
def test_twelve_readings_tell_how_an_arm_gives(robot: str, load: int, seed: int, call: Call, tmp_path: Path):
    """Springs off by 0.4 to 2.5, gauge to 0.01 mm: the change by the load at unseen postures within 10 %."""
    g, type_ = np.random.default_rng(seed), load_robot(robot).joint_compliance
    usual = np.full(6, 3e-6) if type_ is None else type_
    real = usual * np.exp(g.uniform(np.log(0.4), np.log(2.5), 6))
    table, model, other, answer = (tmp_path / name for name in ("t.csv", "m.toml", "other.csv", "p.csv"))
    ask = ("--kind", "gauge", "--load", load, "--tool", "0,0,300")
    assert call("plan", robot, "-n", 12, *ask, "-o", table).code == 0
    rows = read(table)
    noted = np.column_stack([np.zeros(24), 1e3 * changes(rows, real, robot)]).ravel() + g.normal(0, 0.01, 48)
    write(table, [row | {"reading_mm": f"{x:.3f}"} for row, x in zip(rows, noted, strict=True)])
    assert call("fit", table, "--robot", robot, "--tool", "0,0,300", "-o", model).code == 0
    arm = Model(load_robot(robot), T_flange_tcp=TOOL)
    anywhere = random_postures(arm.robot, 10_000, np.random.default_rng(99))
    postures = anywhere[can_work(arm, working_box(arm.robot), anywhere)][:20]
    unseen = [
        rows[0]
        | {f"q{j}_deg": f"{x:.6f}" for j, x in enumerate(np.degrees(q), 1)}
        | {"payload_kg": str(mass), "gauge": f"{k}{way}", "nx": way[0], "ny": way[1], "nz": way[2]}
        for k, q in enumerate(postures)
        for way in ("100", "010", "001")
        for mass in (0, load)
    ]
    write(other, unseen)
    assert call("predict", model, other, "-o", answer).code == 0
    expected = np.array([float(row["predicted_mm"]) for row in read(answer)])[1::2]
    true = 1e3 * changes(unseen, real, robot)
    assert np.sqrt(np.mean((expected - true) ** 2) / np.mean(true**2)) < 0.1
    fitted = read_model(model)
    spread = np.sqrt(spring_covariance(fitted)[1, 1])
    springs = fitted.effect("joint_compliance").vector()
    assert spread < 0.1 and abs(np.log(springs[1] / real[1])) < 4 * spread
    touches = call("plan", model, "-n", 1, "--kind", "tip", "--load", load, "-o", tmp_path / "tip.csv")
    assert f"`postproc fit {table} {tmp_path / 'tip.csv'} --robot {robot} --tool 0,0,300" in touches.err
    assert fitted.fit["kinds"] == ["gauge"]


@pytest.mark.parametrize(
    ("kinds", "weights", "said"),
    [(["gauge"], 1e-3, True), (["gauge"], 1e-4, False), (["gauge", "tip"], 1e-3, False), ([], 1e-3, False)],
)
def test_touches_are_asked_for_where_readings_alone_leave_the_weights_of_links_open(kinds, weights, said):
    accuracy = Accuracy(5e-4, 2e-3, 2e-3, (5e-4, 0.0), (0.0, 2e-3), (0.0, 2e-3), by_weights=weights)
    model = Model(load_robot("ur10"), fit={"kinds": kinds})
    assert touches_help(accuracy, model) is said
    assert touches_help(replace(accuracy, beyond=("q2 of 90 deg",)), model) is False


def read(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text("utf-8").splitlines()))


def write(path: Path, rows: list[dict[str, str]]) -> None:
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
