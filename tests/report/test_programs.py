"""Pages of programs say the main thing first: of one, with what is drawn of it, of a batch, and of two folders."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from postproc.batch.document import batch_document
from postproc.batch.values import Batch, TaskOutcome
from postproc.compensation.conversion import Conversion
from postproc.compensation.judgement.accuracy import Accuracy
from postproc.compensation.judgement.figures import PathFigures, PlaceFigures
from postproc.compensation.options import Options
from postproc.diagnostics import Finding, Source
from postproc.files import resource
from postproc.model.file import default_model
from postproc.rapid.diff.compare import compare_programs
from postproc.report.page import render_certificate, render_page
from postproc.results.certificate import Verdict, program_certificate
from postproc.results.convert.conversion import conversion_document, conversion_values
from postproc.results.convert.difference import difference_document
from postproc.results.convert.requirement import missed
from postproc.runtime.passes import correct_program
from postproc.tasks.task import Task
from tests.cells.test_paths import FORCE, Case, converted, positioner, track
from tests.rapid.build import module, program, target
from tests.report.build import (
    LONG_NAME,
    carried,
    chain,
    figures,
    folders_page,
    main_place,
    numbers,
    program_page,
    seam,
    seam_under_force,
    tables,
)

Columns = dict[str, np.ndarray]


def columns(path: dict[str, Any], part: str) -> Columns:
    """Numbers of the places or of the moves that a page carries."""
    return {name: numbers(column) for name, column in path[part].items()}


@pytest.fixture(scope="module")
def path() -> dict[str, Any]:
    return dict(carried(program_page(seam()), "path"))


def test_the_first_screen_has_the_deviation_before_and_after() -> None:
    made, r = {"model": "cell.toml", "force on the TCP [N]": "0,0,-50"}, seam_under_force().report
    page = render_page(conversion_document("a<b>.mod", seam_under_force(), made))
    (weld, *_), digits = r["figures"], 3  # at 0.01 mm
    before, after = (f"{weld[f'{when}_mm']:.{digits}f} mm" for when in ("before", "after"))
    on_arm = "{:.3f} to {:.3f} mm".format(*weld["expected_on_arm_mm"])
    assert (
        f"The tolerance of 0.01 mm is kept in the model; on the arm {on_arm} are expected while the arc burns." in page
    )
    assert list(figures(page).values()) == [on_arm, before, after]
    rows = {row[0]: row[1] for row in tables(page)["how this was made"]["rows"]}
    assert {**made, "arm": r["robot"]}.items() <= rows.items()
    assert "a&lt;b&gt;.mod" in page
    assert f"Arm <code>{r['robot']}</code>" in page and f"tolerance {r['tolerance_mm']:g} mm" in page
    assert carried(page) == json.loads(json.dumps(r))


PLACE = PlaceFigures("path", 5e-4, 4e-6, 1e-5)
SENTENCES = [
    ({}, ["The tolerance of 0.01 mm is kept in the model; what the arm does is not known."]),
    (
        {"figures": PathFigures((replace(PLACE, after=6e-5),), after=6e-5)},
        ["The tolerance of 0.01 mm is not kept: 0.060 mm remain in the model."],
    ),
    (
        {"unproved": 3, "unmeasured": 1},
        [
            "That the tolerance of 0.01 mm is kept is not proved; what the arm does is not known.",
            "Not in these figures: 1 line or arc with unknown ends and other runs of 3 statements.",
        ],
    ),
]


def rejudged(conversion: Conversion, **others: Any) -> Conversion:
    """A conversion of which other things are known, with the document of these."""
    assert conversion.judged is not None
    changed = replace(conversion, judged=replace(conversion.judged, **others))
    return replace(changed, report=conversion_values(changed))


@pytest.mark.parametrize(("others", "sentences"), SENTENCES)
def test_the_sentences_say_what_is_kept_and_what_is_in_no_figure(others: dict[str, Any], sentences: list[str]) -> None:
    known = {"seams": (), "figures": PathFigures((PLACE,)), "scatter": None, **others}
    document = conversion_document("a.mod", rejudged(seam_under_force(), **known))
    lines, kinds = document.sentence.split("\n"), [figure.kind for figure in document.figures]
    assert kinds == ["", "before", "beyond" if "0.060 mm remain" in lines[0] else "after"]
    assert (
        ('<header class="lost">' in render_page(document))
        == (document.tone == "error")
        == ("in the model;" not in lines[0])
    )
    unfitted = (
        "The model was not fitted to measurements of this arm: how near the torch comes is not known (`postproc fit`)."
    )
    assert lines == [*sentences, unfitted] and max(map(len, lines)) <= 120


def test_names_in_a_page_are_text() -> None:
    hostile = {"routine": "r<1>", "reason": "loop </script> index", "residual_mm": np.nan}
    page = program_page(seam_under_force(), statements=[{**seam_under_force().report["statements"][0], **hostile}])
    assert "r<1>" not in page and "loop </script>" not in page
    [statement] = carried(page)["statements"]
    assert (statement["reason"], statement["residual_mm"]) == ("loop </script> index", None)


def test_a_refused_program_says_so() -> None:
    refused = correct_program(Source("x.mod", b"hello"), default_model(), Options())
    page = program_page(refused)
    assert "no program was written" in page
    findings = tables(page)["findings"]
    code = [column["title"] for column in findings["columns"]].index("code")
    assert [row[code] for row in findings["rows"]] == ["RAP011"]
    assert Verdict.NOT_KEPT.value in render_certificate(program_certificate("x.mod", refused))


def test_the_path_has_the_largest_deviations_the_time_and_the_targets(path: dict[str, Any]) -> None:
    places, moves = columns(path, "places"), columns(path, "moves")
    move = places["move"].astype(int)
    for when in ("before", "after"):
        size = np.linalg.norm(places[when], axis=1)[moves["welding"][move] == 1]
        assert size.max() == pytest.approx(seam().report[f"max_arc_error_{when}_mm"], abs=2e-4)
    t = places["t"]
    assert (np.diff(t) >= -1e-3).all() and t[-1] == pytest.approx(seam().report["cycle_time_before_s"], rel=0.02)
    # The place of the last run of a statement is its target: those of two lie apart as their numbers in the program.
    text = resource("samples", "hull_seam.mod").read_text()
    ends, targets = [], []
    for name in ("pSeam20", "pSeam50"):
        ends.append(places["p"][np.flatnonzero(moves["statement"][move] == path["targets"].index(name))[-1]])
        targets.append(np.array(re.findall(rf"{name}:=\[\[([^\]]*)\]", text)[0].split(","), float))
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(1e-3 * np.linalg.norm(targets[1] - targets[0]), abs=1e-6)


def test_the_deviation_is_measured_across_the_path(path: dict[str, Any]) -> None:
    """At targets as between them: no step where a line ends, whatever points along it."""
    places, moves = columns(path, "places"), columns(path, "moves")
    lines = np.flatnonzero((moves["welding"] == 1) & (moves["space"] == 1))
    assert len(lines)
    for i in lines:
        rows = np.flatnonzero(places["move"] == i)
        line, away = places["p"][rows[-1]] - places["p"][rows[0]], places["before"][rows]
        assert np.abs(away @ (line / np.linalg.norm(line))).max() < 2e-4
        assert np.abs(np.diff(np.linalg.norm(away, axis=1))).max() < 0.02


def test_torques_are_those_of_an_independent_arm(path: dict[str, Any]) -> None:
    """Standing still at the start, the motors carry the weights: tau = sum of m g . d p / d q, from plain differences."""
    places, robot = columns(path, "places"), default_model().robot
    still = int(np.flatnonzero(places["speed"].max(axis=1) < 0.05)[0])
    text = resource("samples", "hull_seam.mod").read_text()
    tool = re.findall(r"tTorch:=\[TRUE,\[\[.*?\],\[.*?\]\],\[([\d.]+),\[(.*?)\]", text)[0]
    mass = [*robot.mass[1:], float(tool[0])]
    center = [*robot.center[1:], 1e-3 * np.array(tool[1].split(","), float)]

    def energy(q: np.ndarray) -> float:
        frames = chain(robot.link, robot.axis, q)
        return 9.81 * sum(m * (T @ [*c, 1.0])[2] for m, c, T in zip(mass, center, frames, strict=True))

    q, eps = places["q"][still], 1e-5 * np.eye(6)
    expected = np.array([(energy(q + e) - energy(q - e)) / 2e-5 for e in eps])
    assert places["torque"][still] == pytest.approx(expected, abs=1.5)


@pytest.mark.parametrize("case", [track(0.0, 250.0, 400.0), positioner(0.0, 40.0, 60.0)], ids=["track", "positioner"])
def test_the_tool_of_the_drawn_arm_is_on_the_path_of_a_moving_cell(case: Case) -> None:
    """What the page's script does: the chain of the arm, its tool, then the base in the frame of the work."""
    path = carried(program_page(converted(case, force=FORCE)), "path")
    places, arm = columns(path, "places"), path["arm"]
    base = numbers(path["base"]).reshape(-1, 3, 4)
    tool = np.array(arm["tools"])[numbers(arm["tool"]).astype(int)[places["move"].astype(int)]]
    assert np.ptp(base, axis=0).max() > 0.2  # it moves
    for i in range(0, len(base), 7):
        tip = chain(arm["link"], arm["axis"], places["q"][i])[-1] @ tool[i][:, 3]
        assert base[i] @ tip == pytest.approx(places["p"][i], abs=1e-3)


def fitted(within_mm: float, *beyond: str) -> dict[str, Any]:
    interval = (1e-4 * within_mm, 1e-3 * within_mm)
    accuracy = Accuracy(
        0.5 * interval[1], interval[1], interval[1], (interval[1], 0.0), interval, interval, beyond=beyond
    )
    return {"accuracy": accuracy, "scatter": None}


NOT_MEASURED = {"kept": False, "before_mm": None, "after_mm": None}
VERDICTS = [
    ({}, {}, Verdict.NOT_SHOWN),
    (fitted(0.005), {}, Verdict.KEPT),
    (fitted(0.05), {}, Verdict.NOT_SHOWN),
    (fitted(0.005, "joint 3 reaches 54.4 deg, measured from -166.3 to 48.2"), {}, Verdict.NOT_SHOWN),
    (fitted(0.005), {"kept": False}, Verdict.NOT_KEPT),
    (fitted(0.005), NOT_MEASURED, Verdict.NOT_KEPT),
    (fitted(0.005), {"left": 1}, Verdict.NOT_KEPT),
    ({**fitted(0.005), "unproved": 1}, {}, Verdict.NOT_KEPT),
    ({**fitted(0.005), "lines": 1, "unmeasured": 1}, {}, Verdict.NOT_KEPT),
]


@pytest.mark.parametrize(("others", "weld", "verdict"), VERDICTS)
def test_a_certificate_says_whether_the_tolerance_is_kept(
    others: dict[str, Any], weld: dict[str, Any], verdict: Verdict
) -> None:
    assert seam().judged is not None
    (first,) = seam().judged.seams
    left = weld.get("left", 0)
    outcomes = (*(replace(o, status="skipped") for o in first.outcomes[:left]), *first.outcomes[left:])
    changed = replace(first, outcomes=outcomes, **{key: value for key, value in weld.items() if key != "left"})
    page = render_certificate(program_certificate("hull_seam.mod", rejudged(seam(), seams=(changed,), **others)))
    assert [each for each in Verdict if each.value in page] == [verdict]
    assert ("The stiffness of this arm is not measured" in page) == (not others)
    assert ("fitted model itself may be off by up to" in page) == (bool(others) and "lines" not in others)
    assert f"{0 if weld else 1} of 1 seams keep 0.01 mm." in page
    row = re.search(r"<td[^>]*>rShellSeam</td>.*?</tr>", page, re.DOTALL)
    assert row and (">not kept<" if weld else ">kept<") in row[0]
    assert page.count("name, date, signature") == 3 and "<script" not in page


def test_a_certificate_names_every_file_by_its_hash_and_the_rows_of_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {"rows": 98, "set_aside": ["cell.csv:7", "cell.csv:9"], "held_out_blocks": 10, "held_out_rms_mm": 0.031,
             "data": "cell.csv", "data_sha256": "ab" * 32, "version": "0.1.0", "each": "reading"}  # fmt: skip
    model = replace(default_model(), fit=table)
    conversion = replace(seam(), model=model)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    files = [Source("a folder/cell.toml", b"robot")]
    page = render_certificate(program_certificate("hull_seam.mod", conversion, {}, files))
    assert page == render_certificate(program_certificate("hull_seam.mod", conversion, {}, files))
    facts = dict(re.findall(r"<dt>(.*?)</dt><dd[^>]*>(.*?)</dd>", page))
    assert facts["date"] == "1970-01-02" and facts["cell.toml, SHA-256"] == sha256(b"robot").hexdigest()
    assert facts["fitted to cell.csv, SHA-256"] == "ab" * 32 and facts["rows fitted"] == "98"
    assert facts["rows left out of the fit"] == "2, far from everything else: cell.csv:7 and cell.csv:9"
    assert (
        facts["rows held out"].startswith("every row once: 10 blocks")
        and "0.031 mm per reading" in facts["rows held out"]
    )
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "172800")
    other = render_certificate(program_certificate("hull_seam.mod", conversion, {}, files))
    assert other.replace("1970-01-03", "1970-01-02") == page != other


FIGURES = {
    "tolerance_mm": 0.01,
    "added_targets": 1,
    "cycle_time_s": 9.0,
    "statements": {"compensated": 3, "skipped": 2},
}
ERROR = Finding("RAP007", "error", "PROC `main`", "b<1>.mod", 3, help="x")
FAR = [Finding("CMP006", "warning", f"{x} mm off", "b<1>.mod", 3, help="x", size=x) for x in (0.1, 0.92)]
OTHERS = [Finding("MOT012", "info", "x"), Finding("CMP005", "warning", "left")]


def test_the_page_of_a_batch_puts_failures_and_the_farthest_first() -> None:
    near, far = ({**FIGURES, "max_error_after_mm": after, **main_place(2.0, after)} for after in (0.01, 0.2))
    measured = {**near, **main_place(2.0, 0.01, (0.02, 0.08)), "expected_on_arm_mm": [0.02, 0.08]}
    doubt = {**near, "unproved_statements": 71}
    outcomes = (
        TaskOutcome(Task("a.mod", ()), "compensated", True, doubt, (*OTHERS, *FAR)),
        TaskOutcome(Task("b<1>.mod", ()), "failed", False, {}, (ERROR,)),
        TaskOutcome(Task("c.mod", ()), "compensated", False, far, (FAR[0],)),
    )
    page = render_page(batch_document("cell", Batch(outcomes, 0, ()), pages={"a.mod": "out/report/a #1.html"}))
    text = "2 of 3 programs are corrected, 6 of 10 motion statements in them; 1 failed and has no output."
    assert text in page and "Farthest off is <code>c.mod</code>: on the arm not known, in the model 0.20 mm." in page
    assert figures(page) == {
        "programs corrected": "2",
        "failed": "1",
        "worst on the arm": "not known",
        "worst before": "2.00 mm",
        "worst after": "0.20 mm",
        "targets added": "2",
        "done before": "1",
    }
    errors, warnings, programs = (tables(page)[name] for name in ("errors", "warnings", "programs"))
    assert [row[3:5] for row in errors["rows"]] == [["RAP007", "PROC main"]]
    assert [row[5] for row in warnings["rows"]] == ["CMP006", "CMP005"]
    assert warnings["rows"][0][:2] == [3, 2] and "0.92 mm off" in warnings["rows"][0]
    unproved = [column["title"] for column in programs["columns"]].index("unproved")
    assert [(row[0], row[unproved], row[-1]) for row in programs["rows"]] == [
        ("b<1>.mod", None, None),
        ("c.mod", None, None),
        ("a.mod", 71, "out/report/a%20%231.html"),
    ]
    assert programs["rows"][2][1] == "compensated, as before" and "also run where they cannot be followed" in page
    drawn = carried(page, "programs")["drawn"]  # in the order of the table
    assert [d and (d["before"], d["after"], d["tolerance"], d["fitted"]) for d in drawn] == [
        None,
        (2.0, 0.2, 0.1, False),
        (2.0, 0.01, 0.1, False),
    ]
    assert "not fitted to measurements of this arm" in page
    page = render_page(batch_document("cell", Batch((replace(outcomes[0], figures=measured),), 0, ())))
    assert carried(page, "programs")["drawn"][0].items() >= {"on_arm": [0.02, 0.08], "fitted": True}.items()
    assert "not fitted to measurements of this arm" not in page


def test_a_batch_states_the_largest_figures_of_all_its_programs() -> None:
    """The farthest on the arm need not be the one that does not keep its tolerance; shares are the range of all."""
    outcomes = []
    for name, high, share, kept in (("far.mod", 3.9, 1.0, "not_shown"), ("lost.mod", 2.9, 1.3, "not_kept")):
        at = {**main_place(2.0, 0.2, (0.1, high)), "expected_on_arm_mm": [0.1, high], "verdict": kept}
        shares = {"expected_remaining_fraction": [0.05 / share, share], "verdict_sentence": "It is not kept."}
        told = Finding("CMP027", "warning", f"up to {share:g}", size=share)
        outcomes.append(TaskOutcome(Task(name, ()), "compensated", False, {**FIGURES, **at, **shares}, (told,)))
    guess = {**outcomes[0].figures, "expected_accuracy": {"beyond_range": ["joint 3 reaches 40 deg"]}}
    outcomes.append(TaskOutcome(Task("near.mod", ()), "compensated", False, guess, ()))
    document = batch_document("cell", Batch(tuple(outcomes), 0, ()))
    lines = document.sentence.splitlines()
    assert lines[1:3] == [
        "`lost.mod`: It is not kept.",
        "Farthest off is `far.mod`: on the arm 0.10 to 3.90 mm, in the model 0.20 mm. "
        "In 1 program it is a guess, outside the measured range.",
    ]
    assert "4 to 130 % of its own deflection remain" in lines[3]
    page = render_page(document)
    assert figures(page)["worst on the arm"] == "0.10 to 3.90 mm"
    (warning,) = tables(page)["warnings"]["rows"]
    assert warning[:2] == [2, 2] and "up to 1.3" in warning
    assert "0.10 to 3.90, a guess" in [row[2] for row in tables(page)["programs"]["rows"]]
    said = missed("arm", {"near.mod": {**guess, "welds": [], "unproved_statements": 0}})
    assert said and "`near.mod`, of which what is expected is a guess (joint 3 reaches 40 deg); line " in said


def test_the_page_of_two_folders_puts_files_that_differ_first() -> None:
    page = folders_page()
    assert [row[:3] for row in tables(page)["files"]["rows"]] == [
        [f"RAPID/{LONG_NAME}.mod", "changed", 250],
        ["gone.mod", "removed", None],
        ["a.mod", "equal", None],
    ]
    assert sum(len(file["differences"]) for file in carried(page)["files"]) == 250
    assert figures(page)["files that differ"] == "2" and "data-differences" in page and "vendor" not in page


CURVE = "MoveL {},v100,fine,t; MoveC {},{},v100,fine,t; MoveL {},v100,fine,t;"
PLACES = [(400, 0, 300), (500, 100, 300), (600, 0, 300), (900, 0, 300)]
TOOL = "PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[2,[0,0,50],[1,0,0,0],0,0,0]];"


def test_two_paths_lie_over_each_other_as_far_apart_as_they_are() -> None:
    """All targets 0.5 mm higher: so is the arc between them; a target added on a line is not off."""
    first = module(CURVE.format(*(target(*p) for p in PLACES)), TOOL)
    higher = [target(x, y, z + 0.5) for x, y, z in PLACES]
    middle = f"MoveL {target(750, 0, 300.5)},v100,fine,t; MoveL {higher[-1]}"
    second = module(CURVE.format(*higher).replace(f"MoveL {higher[-1]}", middle), TOOL)
    a, b = (program(text.decode(), name) for text, name in ((first, "x.mod"), (second, "x.mod")))
    difference = compare_programs(a, b, 0.001)
    page = render_page(difference_document("a/x.mod", "b/x.mod", difference, (a, b)))
    paths = carried(page, "differences")
    p, away = numbers(paths["b"]["p"]), numbers(paths["b"]["away"])
    arc = p[np.array(paths["b"]["stop"]) == paths["b"]["stop"][1]]
    assert len(arc) == 64 and np.linalg.norm(arc[:, :2] - [0.5, 0.0], axis=1) == pytest.approx(0.1)
    assert away == pytest.approx(np.tile([0.0, 0.0, 5e-4], (len(p), 1)), abs=2e-6)
    assert "postproc diff a/x.mod b/x.mod" in page
    texts = [(d["text_a"], d["text_b"]) for d in carried(page)["differences"]]
    assert any(old.endswith("v100,fine,t;") and new and old != new for old, new in texts)
    assert sum(not old for old, _ in texts) == 1
