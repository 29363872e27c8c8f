"""The proof: what it claims is what another arm finds, and it finds what is wrong in the written text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from postproc.compensation.judgement.doubts import check_corrected
from postproc.compensation.options import Options
from postproc.compensation.reading import read_samples
from postproc.diagnostics import Source
from postproc.model.arm import Model
from postproc.rapid.data.events import MotionEvent
from tests.build import arm, codes, convert, independent, target, written
from tests.compensation.build import PROCESS, brief, effect, model, small

ROOT = Path(__file__).resolve().parents[2]
ARC = small(
    "MoveJ p1,v200,fine,tT; MoveL p2,v50,z1,tT; MoveC @{1330,-50,720},@{1280,-30,730},v50,fine,tT;",
    "p1 1350 -500, p2 1350 -100",
)
INLINE = ARC.replace("MoveL p2", f"MoveL {target(1350, -100)}").replace("MoveJ p1", f"MoveJ {target(1350, -500)}")
CALLS = small(
    "MoveJ @{1350,-500},v200,fine,tT; one; two;",
    more="PROC one() MoveL @{1350,-460},v50,fine,tT; ENDPROC\nPROC two() MoveL @{1350,-420},v50,fine,tT; ENDPROC",
)


def tampered(folder: Path, old: str, new: str) -> Path:
    """Templates that write something of the module wrong."""
    replaced = f"{{{{ part | replace({old!r}, {new!r}) }}}}"
    (folder / "module.j2").write_text(f"{{% for part in parts %}}{replaced}{{% endfor %}}")
    return folder


@pytest.mark.parametrize("error", [0.05, 1.0, 10.0])
def test_a_wrong_number_in_the_text_is_found(tmp_path: Path, error: float) -> None:
    """The proof reads the text that is written; worse than before it is not written at all."""
    right = written(convert(ARC))
    z = next(x for x in right.splitlines() if "robtarget p2" in x).split("[[")[1].split("]")[0].split(",")[2]
    wrong = convert(ARC, template_dir=tampered(tmp_path, z, f"{float(z) + error:.3f}"))
    if error > 1.0:
        assert not wrong.outputs
        assert [d.code for d in wrong.diagnostics if d.severity == "error"] == ["CMP013"]
        return
    after = wrong.report["max_error_after_mm"]
    assert after == pytest.approx(error, abs=0.01) == pytest.approx(independent(ARC, wrong).after, abs=1e-3)
    assert "CMP006" in codes(wrong) and "CMP006" not in codes(convert(ARC))
    assert not any("--inertia off" in d.help for d in wrong.diagnostics)  # it is off
    (row,) = [line.split() for line in written(wrong).splitlines() if line.startswith("  ! lines and arcs")]
    assert row[5] == f"{after:.3f}"
    assert wrong.report["statements"][1]["residual_mm"] == pytest.approx(error, abs=0.002)


def test_what_remains_at_a_target_is_stated_as_the_arc_sees_it(tmp_path: Path) -> None:
    """The torch comes from above onto a seam along y: where it starts, y lies along the seam, and z across it."""
    seam = small(
        f"MoveJ @{{1350,-480,860}},v200,fine,tT; ArcLStart p1,{PROCESS},fine,tT; ArcLEnd p2,{PROCESS},fine,tT;",
        "p1 1350 -480, p2 1350 -200",
    )
    row = next(line for line in written(convert(seam)).splitlines() if "robtarget p1" in line)
    x, y, z = row.split("[[")[1].split("]")[0].split(",")
    moved = f"{x},{float(y) + 0.03:.3f},{float(z) - 0.04:.3f}"
    wrong = convert(seam, template_dir=tampered(tmp_path, f"{x},{y},{z}", moved))
    above, start, end = wrong.report["statements"]
    assert (start["residual_mm"], start["along_mm"]) == pytest.approx((0.04, 0.03), abs=0.002)
    assert above["residual_mm"] < 0.002 and above["along_mm"] is None
    assert max(end["residual_mm"], end["along_mm"]) < 0.002


@pytest.mark.parametrize(
    ("text", "name", "right", "wrong"),
    [
        (ARC, "path_point.j2", '{{ point.offset | mm | join(",") }}', '{{ point.offset | mm | join(",") }}+0.3'),
        (ARC, "line_point.j2", "b:=[x,y,z];", "b:=[x,y,z+0.3];"),
        (ARC, "arc_point.j2", "b:=s.trans+", "b:=[0,0,0.3]+s.trans+"),
        (INLINE, "target.j2", "target.pose.trans | mm", "(target.pose.trans[:2] + (target.pose.trans[2] + 0.3,)) | mm"),
    ],
    ids=brief,
)
def test_a_wrong_added_target_is_found(tmp_path: Path, text: str, name: str, right: str, wrong: str) -> None:
    """On a line and on an arc between names, in the functions that they call, as numbers."""
    shipped = (ROOT / "templates" / name).read_text()
    assert shipped.count(right) == 1
    (tmp_path / name).write_text(shipped.replace(right, wrong))
    conversion = convert(text, template_dir=tmp_path, tolerance_m=5e-6)
    after = conversion.report["max_error_after_mm"]
    assert conversion.report["added_targets"] > 0
    assert 0.29 < after < 0.34  # a circle that misses two of its points misses more elsewhere
    assert after == pytest.approx(independent(text, conversion).after, abs=1e-3)
    assert convert(text, tolerance_m=5e-6).report["max_error_after_mm"] < 0.01


@pytest.mark.parametrize(
    ("text", "old", "new"),
    [
        (ARC, "MoveL p2,", "MoveL pNowhere,"),  # another name
        (ARC, "MoveL p2,v50,z1,tT;", ""),  # a statement is lost
        (ARC, "MoveJ p1,v200,fine,tT;", "MoveJ p1,v200,fine,tT; MoveJ p1,v200,fine,tT;"),  # a statement too many
        (ARC, "[-1,0,-1,0]", "[1,0,-1,0]"),  # a configuration that the arm does not have there
        (ARC, "1350.375", "9350.375"),  # out of reach
        (CALLS, "one;", "one;one;"),
        (CALLS, "two;", "one;"),
        (CALLS, "two;", ""),
    ],
    ids=brief,
)
def test_a_text_that_cannot_run_as_meant_is_not_written(tmp_path: Path, text: str, old: str, new: str) -> None:
    conversion = convert(text, template_dir=tampered(tmp_path, old, new))
    assert conversion.exit_code == 1 and not conversion.outputs
    assert "CMP004" in codes(conversion) and "CMP004" not in codes(convert(text))


def test_a_program_read_back_in_parts_is_proved_like_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts meet where nothing changes: not behind another tool, a way that goes on from before, a joint target."""
    steps = [f"MoveL @{{{1350 - 5 * k},{-480 + 30 * k}}},v100,z1,{'tLong' if k == 6 else 'tT'};" for k in range(10)]
    steps[3] = f"IF di1=1 THEN\n{steps[3]}\nENDIF"
    text = small("MoveJ @{1350,-500},v200,fine,tT;\n" + "\n".join(steps))
    at_once, sizes = convert(text), list[int]()

    def read(of: Model, events: Sequence[MotionEvent], options: Options) -> Any:
        sizes.append(len(events))
        return read_samples(of, events, options)

    monkeypatch.setattr("postproc.compensation.readback.MOST_EVENTS", 2)
    monkeypatch.setattr("postproc.compensation.readback.read_samples", read)
    parts = convert(text)
    assert len(sizes) >= 4 and max(sizes) < sum(sizes) / 2
    for name in ("statements", "max_error_before_mm", "max_error_after_mm"):
        assert parts.report[name] == at_once.report[name]


@pytest.mark.parametrize("share", [0.3, -0.3])
def test_the_corrected_motion_is_the_programmed_one_with_the_correction_added(share: float) -> None:
    """Joints that travel 30 % farther, or less far, in the same time are faster, or slower, by as much."""
    text = small("MoveJ @{1150,-500,960},v200,fine,tT; MoveL @{1350,-100},vmax,fine,tT;")
    plan = convert(text).plan
    assert plan is not None
    samples, source = plan.motion.samples, Source("m.mod", text.encode())
    travel = samples.q - samples.q[samples.goal[0]]
    plans = [replace(plan, exact=replace(plan.exact, q=samples.q + s * travel), transitions=()) for s in (0.0, share)]
    speeds = [check_corrected(arm().robot, other, source)[0].use[0] for other in plans]
    assert speeds[1] == pytest.approx((1 + share) * speeds[0], rel=0.01)


def test_a_program_too_long_to_be_followed_ends_where_it_ended_before() -> None:
    """What is added to it takes no steps, whether targets or the function that they call."""
    idle = "\n".join(f"l{k}:" for k in range(2000))
    text = small(
        f"MoveJ p1,v200,fine,tT;\nFOR i FROM 1 TO 60 DO\n{idle}\nwork;\nENDFOR",
        "p1 1350 -500, p2 1350 -100, pV 1300 -300",
        more="PROC work() MoveJ p1,v200,fine,tT; MoveL p2,v50,fine,tT; MoveC pV,p1,v50,fine,tT; ENDPROC",
    )
    conversion = convert(text, tolerance_m=5e-6)
    assert "RAP033" in codes(conversion) and "CMP004" not in codes(conversion)
    assert len(conversion.outcomes) == 4
    assert written(conversion).count("Move") > text.count("Move")


RIGID = model(effect("joint_compliance", "compliance_rad_per_Nm = [0, 0, 0, 0, 0, 0]"))
NOTHING_TO_CORRECT = (
    "samples/corner_arc.mod", "samples/hull_seam.mod", "samples/panel_300.mod",
    *(f"tests/worlds/programs/{name}.mod" for name in (
        "handed_targets", "line_from_home", "moved_step_by_step", "own_movement", "palletizer", "record_of_targets",
        "target_function", "trap_writes_target",
    )),
)  # fmt: skip


@pytest.mark.parametrize("name", NOTHING_TO_CORRECT)
def test_an_arm_that_does_not_bend_gets_the_program_as_it_is(name: str) -> None:
    """Offsets of zero were written around what runs several times, and quaternions of circle points with another sign."""
    data = (ROOT / name).read_bytes()
    conversion = convert(data, RIGID, force=(0.0, 0.0, 0.0), air_tolerance_m=2e-4)
    assert conversion.report["statements"]
    assert conversion.output == data
