"""The proof: what it claims is what another arm finds, and it finds what is wrong in the written text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from postproc.compensation.correction.deviation import away_from_curves
from postproc.compensation.judgement.doubts import check_corrected
from postproc.compensation.options import Options
from postproc.compensation.reading import read_samples
from postproc.compensation.text.requests import Requester
from postproc.compensation.text.values import TargetValue
from postproc.diagnostics import Source
from postproc.model.arm import Model
from postproc.motion.path.curves import build_curves
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import Pose
from tests.build import arm, codes, convert, independent, module, target, written
from tests.motion.build import chain, line, pose

TEXT = module(
    f"CONST robtarget p1:={target(1350, -500)};\nCONST robtarget p2:={target(1350, -100)};",
    f"MoveJ p1,v200,fine,tT;\nMoveL p2,v50,z1,tT;\nMoveC {target(1330, -50, 720)},{target(1280, -30, 730)},v50,fine,tT;",
)

TEMPLATES = Path(__file__).parents[2] / "templates"


def test_the_claim_is_what_another_arm_finds() -> None:
    found = convert(TEXT)
    report = independent(TEXT, found)
    assert report.violations == []
    assert report.after <= 0.01 and report.before > 1.0
    assert found.report["max_error_after_mm"] == pytest.approx(report.after, abs=3e-4)
    assert found.report["max_error_before_mm"] == pytest.approx(report.before, abs=3e-3)
    for claim, seen in zip(found.report["statements"], report.segments, strict=True):
        assert claim["residual_mm"] == pytest.approx(seen.goal_after, abs=3e-4)
        assert claim["shift_mm"] == pytest.approx(seen.goal_before, rel=0.05)


def tampered(folder: Path, old: str, new: str) -> Path:
    """Templates that write one number of the module wrong."""
    (folder / "module.j2").write_text(
        f"{{% for part in parts %}}{{{{ part | replace('{old}', '{new}') }}}}{{% endfor %}}"
    )
    return folder


@pytest.mark.parametrize("error", [0.05, 1.0])
def test_a_wrong_number_in_the_text_is_found(tmp_path: Path, error: float) -> None:
    """The proof reads the text that is written, not the numbers that were meant."""
    right = convert(TEXT)
    z = next(x for x in written(right).splitlines() if "robtarget p2" in x).split("[[")[1].split("]")[0].split(",")[2]
    wrong = convert(TEXT, template_dir=tampered(tmp_path, z, f"{float(z) + error:.3f}"))
    assert wrong.report["max_error_after_mm"] == pytest.approx(error, abs=0.01)
    assert "CMP006" in codes(wrong) and "CMP006" not in codes(right)
    assert not any("--inertia off" in d.help for d in wrong.diagnostics)  # it is off
    assert f"{wrong.report['max_error_after_mm']:.3f} mm after" in written(wrong)
    assert wrong.report["statements"][1]["residual_mm"] == pytest.approx(error, abs=0.002)
    assert independent(TEXT, wrong).after == pytest.approx(wrong.report["max_error_after_mm"], abs=1e-3)


INLINE = TEXT.replace("MoveL p2", f"MoveL {target(1350, -100)}").replace("MoveJ p1", f"MoveJ {target(1350, -500)}")


@pytest.mark.parametrize(
    ("text", "name", "right", "wrong"),
    [
        (TEXT, "path_point.j2", '{{ point.offset | mm | join(",") }}', '{{ point.offset | mm | join(",") }}+0.3'),
        (TEXT, "line_point.j2", "b:=[x,y,z];", "b:=[x,y,z+0.3];"),
        (TEXT, "arc_point.j2", "b:=s.trans+", "b:=[0,0,0.3]+s.trans+"),
        (
            INLINE,
            "target.j2",
            "target.pose.trans | mm",
            "[target.pose.trans[0], target.pose.trans[1], target.pose.trans[2] + 0.3] | mm",
        ),
    ],
)
def test_a_wrong_added_target_is_found(tmp_path: Path, text: str, name: str, right: str, wrong: str) -> None:
    """On a line and on an arc between names, in the functions that they call, as numbers."""
    shipped = (TEMPLATES / name).read_text()
    assert shipped.count(right) == 1
    (tmp_path / name).write_text(shipped.replace(right, wrong))
    found = convert(text, template_dir=tmp_path, tolerance_m=5e-6)
    assert found.report["added_targets"] > 0
    assert (
        0.29 < found.report["max_error_after_mm"] < 0.34
    )  # a circle that misses two of its points misses more elsewhere
    assert found.report["max_error_after_mm"] == pytest.approx(independent(text, found).after, abs=1e-3)
    assert convert(text, tolerance_m=5e-6).report["max_error_after_mm"] < 0.01


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("MoveL p2,", "MoveL pNowhere,"),  # another name
        ("MoveL p2,v50,z1,tT;", ""),  # a statement is lost
        ("MoveJ p1,v200,fine,tT;", "MoveJ p1,v200,fine,tT; MoveJ p1,v200,fine,tT;"),  # a statement too many
        ("[-1,0,-1,0]", "[1,0,-1,0]"),  # a configuration that the arm does not have there
        ("1350.375", "9350.375"),  # out of reach
    ],
)
def test_a_text_that_cannot_run_as_meant_is_not_written(tmp_path: Path, old: str, new: str) -> None:
    found = convert(TEXT, template_dir=tampered(tmp_path, old, new))
    assert found.exit_code == 1 and not found.outputs
    assert "CMP004" in codes(found)


@pytest.mark.parametrize(("old", "new"), [("one;", "one;one;"), ("two;", "one;"), ("two;", "")])
def test_a_text_whose_calls_run_otherwise_is_not_written(tmp_path: Path, old: str, new: str) -> None:
    """As many statements as planned, but one of them again, instead of another, or where nothing leads any more."""
    more = "".join(
        f"  PROC {name}()\n    MoveL {target(1350, y)},v50,fine,tT;\n  ENDPROC\n"
        for name, y in (("one", -460), ("two", -420))
    )
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\none;\ntwo;", more)
    (tmp_path / "module.j2").write_text(
        f"{{% for part in parts %}}{{{{ part | replace({old!r}, {new!r}) }}}}{{% endfor %}}"
    )
    assert convert(text).exit_code == 0
    found = convert(text, template_dir=tmp_path)
    assert found.exit_code == 1 and not found.outputs
    assert "CMP004" in codes(found)


def test_a_program_read_back_in_parts_is_proved_like_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts meet where nothing changes: not behind another tool, a way that goes on from before, a joint target."""
    places = [f"MoveL {target(1350 - 5 * k, -480 + 30 * k)},v100,z1,tT;" for k in range(10)]
    places[3] = f"IF di1=1 THEN\n{places[3]}\nENDIF"
    places[6] = places[6].replace("tT", "tLong")
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\n" + "\n".join(places))
    whole, sizes = convert(text), list[int]()

    def read(model: Model, events: Sequence[MotionEvent], options: Options) -> Any:
        sizes.append(len(events))
        return read_samples(model, events, options)

    monkeypatch.setattr("postproc.compensation.readback.MOST_EVENTS", 2)
    monkeypatch.setattr("postproc.compensation.readback.read_samples", read)
    parts = convert(text)
    assert len(sizes) >= 4 and max(sizes) < sum(sizes) / 2
    assert parts.report["statements"] == whole.report["statements"]
    for name in ("max_error_before_mm", "max_error_after_mm"):
        assert parts.report[name] == whole.report[name]


def test_distance_from_lines_and_arcs() -> None:
    """A quarter circle of 100 mm radius, and the line that leads to it: distances by hand."""
    T = [pose(1.0, 0.0, 0.6), pose(1.0, 0.2, 0.6), pose(0.9, 0.3, 0.6)]
    via = pose(1.0 - 0.1 * (1 - np.cos(np.pi / 4)), 0.2 + 0.1 * np.sin(np.pi / 4), 0.6)
    moves = chain(
        {"kind": "joint", "T_work_tcp": T[0]}, line(T[1]), {"kind": "arc", "T_work_tcp": T[2], "T_work_via": via}
    )
    curves = build_curves(arm().robot, tuple(moves))
    center = np.array([0.9, 0.2, 0.6])
    points = np.array(
        [
            [1.003, 0.1, 0.604],  # 5 mm from the line, halfway
            [1.0, -0.03, 0.6],  # before its start
            [*(center + 0.11 * np.array([np.cos(0.5), np.sin(0.5), 0]))],  # 10 mm outside of the circle
            [0.9 + 0.1 * np.cos(1.0), 0.2 + 0.1 * np.sin(1.0), 0.607],  # 7 mm above it
            [0.88, 0.3, 0.6],  # past its end
        ]
    )
    away, u = away_from_curves(curves, np.array([1, 1, 2, 2, 2]), points)
    distance = np.linalg.norm(away, axis=1)
    assert distance == pytest.approx([0.005, 0.03, 0.01, 0.007, 0.02], abs=1e-9)
    assert u == pytest.approx([0.5, 0.0, 0.5 / (np.pi / 2), 1.0 / (np.pi / 2), 1.0], abs=1e-9)


def test_what_would_be_worse_than_before_is_not_written(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing that the planning gets wrong reaches a file: here every target is written 10 mm too far out."""
    values = Requester.values

    def wrong(self: Requester, asked: Any) -> list[TargetValue]:
        found = values(self, asked)
        return [replace(v, pose=Pose((v.pose.trans[0] + 10.0, *v.pose.trans[1:]), v.pose.rot)) for v in found]

    monkeypatch.setattr(Requester, "values", wrong)
    found = convert(module("", f"MoveJ {target(1300, -500)},v300,fine,tT;\nMoveL {target(1350, -430)},v100,fine,tT;"))
    assert not found.outputs
    assert [d.code for d in found.diagnostics if d.severity == "error"] == ["CMP013"]


@pytest.mark.parametrize("share", [0.3, -0.3])
def test_the_corrected_motion_is_the_programmed_one_with_the_correction_added(share: float) -> None:
    """Joints that travel 30 % farther, or less far, in the same time are faster, or slower, by as much."""
    text = module("", f"MoveJ {target(1150, -500, 960)},v200,fine,tT;\nMoveL {target(1350, -100)},vmax,fine,tT;")
    plan = convert(text).plan
    assert plan is not None
    samples, source = plan.motion.samples, Source("m.mod", text.encode())
    way = samples.q - samples.q[samples.goal[0]]
    plans = [replace(plan, exact=replace(plan.exact, q=samples.q + s * way), transitions=()) for s in (0.0, share)]
    speeds = [check_corrected(arm().robot, other, source)[0].use[0] for other in plans]
    assert speeds[1] == pytest.approx((1 + share) * speeds[0], rel=0.01)


def test_a_program_too_long_to_be_followed_ends_where_it_ended_before() -> None:
    """What is added to it takes no steps, whether targets or the function that they call."""
    data = [*TEXT.splitlines()[8:10], f"CONST robtarget pV:={target(1300, -300)};"]
    idle = "\n".join(f"l{k}:" for k in range(2000))
    loop = f"FOR i FROM 1 TO 60 DO\n{idle}\nwork;\nENDFOR"
    work = "  PROC work()\n    MoveJ p1,v200,fine,tT;\n    MoveL p2,v50,fine,tT;\n    MoveC pV,p1,v50,fine,tT;\n  ENDPROC\n"
    text = module("\n".join(line.strip() for line in data), f"MoveJ p1,v200,fine,tT;\n{loop}", work)
    found = convert(text, tolerance_m=5e-6)
    assert "RAP033" in codes(found) and "CMP004" not in codes(found)
    assert len(found.outcomes) == 4 and "\n    MoveL" in written(found)
    added = written(found).count("Move") - text.count("Move")
    assert added > 0
