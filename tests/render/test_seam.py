"""Modules from seam points: the frames against plain formulas, the rows that are wrong, the command."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from postproc.cli.app import build
from postproc.cli.run import run
from postproc.diagnostics import PostprocError, Source
from postproc.rapid.data.records import RobTarget
from postproc.rapid.execution.walk import walk
from postproc.rapid.motions.units import flange_matrix
from postproc.rapid.program.program import read_program
from postproc.render.seam import SeamOptions, seam_module
from postproc.render.seampoints import read_seam_points
from postproc.robot.catalogue import load_robot
from postproc.robot.configuration import confdata
from postproc.robot.inverse import joint_solution
from postproc.robot.kinematics import forward
from tests.build import refused
from tests.independent.rapid import matrix_quaternion, quaternion_matrix
from tests.rapid.build import program

ROBOT = load_robot("irb4600_60_205")
TOOL = "tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]]"
WOBJ = 'wJig:=[FALSE,TRUE,"",[[1300,-200,700],[0.9659258,0,0,0.2588190]],[[0,0,0],[1,0,0,0]]]'
HEAD = "x_mm,y_mm,z_mm,tx,ty,tz,nx,ny,nz"
SPEEDS, QUATERNIONS = f"{HEAD},speed_mm_s", "x_mm,y_mm,z_mm,qw,qx,qy,qz"
ROWS = ["0,0,0,0,1,0,0,0,1", "1,40,0.5,0.05,1,0,0,0.1,1", "4,90,1,0.1,2,0,0,0.1,2", "8,140,0,0.1,1,0,0,0,1"]


def table(*rows: str, head: str = HEAD, mark: str = "\n") -> Source:
    return Source("points.csv", mark.join([head, *rows]).encode())


def with_speeds(*speeds: float) -> Source:
    return table(*(f"{row},{speed}" for row, speed in zip(ROWS, speeds, strict=True)), head=SPEEDS)


def module(source: Source, cell: bytes = b"", **options: object) -> tuple[Source, tuple[str, ...]]:
    """The module of a table and its notes, with the tool and the work object of the tests unless others are given."""
    chosen = SeamOptions(**{"tool": TOOL, "wobj": WOBJ, **options})  # type: ignore[arg-type]
    sides = [Source("cell.sys", cell, True)] if cell else []
    text, notes = seam_module(read_seam_points(source), ROBOT, np.eye(4), chosen, sides)
    return Source("Seam.mod", text), notes


def test_the_torch_points_against_the_normal_and_along_the_seam() -> None:
    points = read_seam_points(table(*ROWS))
    for row, R in zip(ROWS, points.rotation, strict=True):
        t, n = np.array(row.split(",")[3:6], float), np.array(row.split(",")[6:], float)
        assert np.allclose(R[:, 2], -n / np.linalg.norm(n))
        assert R[:, 0] @ t > 0.9 * np.linalg.norm(t) and abs(R[:, 0] @ n) < 1e-12
        assert np.allclose(R @ R.T, np.eye(3)) and np.linalg.det(R) == pytest.approx(1)


LAYOUTS = {
    "commas": f"{QUATERNIONS}\n1000.5,2,3,0.5,0.5,-0.5,0.5\n1,3,3,0,1,0,0",
    "semicolons": f"{QUATERNIONS}\r\n# a note\r\n\r\n1000.5,2,3,0.5,0.5,-0.5,0.5\r\n1,3,3,0,1,0,0".replace(",", ";"),
    "a German spreadsheet": f"Seam 7\n{QUATERNIONS.upper().replace(',', ';')}\n1.000,5;2;3;0,5;0,5;-0,5;0,5\n1;3;3;0;1;0;0",
}


@pytest.mark.parametrize("text", LAYOUTS.values(), ids=LAYOUTS)
def test_points_and_quaternions_are_read_as_they_stand(text: str) -> None:
    points = read_seam_points(Source("points.csv", text.encode()))
    assert points.place_mm.tolist() == [[1000.5, 2, 3], [1, 3, 3]] and points.speed_mm_s is None
    assert np.allclose(points.rotation[0], quaternion_matrix(np.array([0.5, 0.5, -0.5, 0.5])))


def third_row(row: str) -> Source:
    return table(f"{ROWS[0]},8", row, f"{ROWS[3]},8", head=SPEEDS)


METRES = table(*(f"{0.001 * i:g},{0.05 * i:g},0,0,1,0,0,0,1" for i in range(12)))
REFUSED = [
    (third_row("x,50,0,0,1,0,0,0,1,8"), "SEA002", "row 3, column `x_mm`: `x` is not a number"),
    (third_row("0,nan,0,0,1,0,0,0,1,8"), "SEA002", "row 3, column `y_mm`: `nan` is not a number"),
    (third_row("0,50,0,0,inf,0,0,0,1,8"), "SEA002", "row 3, column `ty`: `inf` is not a number"),
    (third_row("0,5e7,0,0,1,0,0,0,1,8"), "SEA002", "row 3, column `y_mm`: `5e7` is too large"),
    (third_row("0,50,0,0,,0,0,0,1,8"), "SEA002", "row 3, column `ty`: nothing stands here"),
    (third_row("0,50,0,0,0,0,0,0,1,8"), "SEA003", "row 3, column `tx`: the tangent has no length"),
    (third_row("0,50,0,0,1,0,0,0,0,8"), "SEA003", "row 3, column `nx`: the normal has no length"),
    (third_row("0,50,0,0,1,0,0,1,0.01,8"), "SEA003", "row 3, column `nx`: the normal stands 0.6 deg from the tangent"),
    (third_row("0,0.05,0,0,1,0,0,0,1,8"), "SEA004", "row 3, column `x_mm`: only 0.050 mm from the point before"),
    (third_row("0,50,0,0,1,0,0,0,1,-2"), "SEA005", "row 3, column `speed_mm_s`: -2 mm/s is not a welding speed"),
    (third_row("0,50,0,0,1,0,0,0,1,0"), "SEA005", "row 3, column `speed_mm_s`: 0 mm/s is not a welding speed"),
    (third_row("0,50,0,0,1,0,0,0,1"), "SEA001", "row 3 has 9 cells where the header has 10"),
    (table("1,2,3,1,0,0,0", "1,5,3,1,1,0,0", head=QUATERNIONS), "SEA003", "the quaternion has length 1.4142, not 1"),
    (METRES, "SEA004", "row 3, column `x_mm`: only 0.050 mm from the point before"),
    (table("1,2,3", head="x_mm,y_mm,z_mm"), "SEA001", "the table lacks the orientation"),
    (table(*(f"{row},1" for row in ROWS), head=f"{HEAD},x_mm"), "SEA001", "column `x_mm` stands twice in the header"),
    (table(ROWS[0]), "SEA006", "a seam needs two points or more"),
    (Source("points.csv", b""), "SEA001", "there are no rows in this file"),
    (Source("points.csv", b"\x00\xff\xfe,,\n\xff"), "SEA001", "this file is no text"),
]


@pytest.mark.parametrize(("source", "code", "message"), REFUSED)
def test_a_wrong_table_is_refused_with_the_place(source: Source, code: str, message: str) -> None:
    [finding] = refused(lambda: read_seam_points(source))
    assert finding.code == code and message in finding.message and finding.help
    assert "row 3" not in finding.message or finding.place.startswith("points.csv:3:")
    assert ("metres" in finding.help) == (source is METRES)


NUMBERS = ["0", "1", "-50", "1e9", "1,5", '"3"', "1e400", "1e300", "-1e7", "0x10", "1_0"]
CELLS = st.sampled_from([*NUMBERS, "nan", "inf", "-inf", "", " ", "x", "\u00e9"])


@settings(max_examples=150)
@given(
    head=st.sampled_from([HEAD, SPEEDS, QUATERNIONS.replace(",", ";"), "x_mm", HEAD.upper(), f"{HEAD},x_mm"]),
    rows=st.lists(st.lists(CELLS, min_size=5, max_size=11), max_size=6),
    mark=st.sampled_from(["\n", "\r\n", "\r", "\n\n"]),
    codec=st.sampled_from(["utf-8", "utf-8-sig", "latin-1", "utf-16"]),
)
def test_any_table_is_read_or_refused(head: str, rows: list[list[str]], mark: str, codec: str) -> None:
    text = mark.join([head, *((";" if ";" in head else ",").join(row) for row in rows)])
    try:
        points = read_seam_points(Source("points.csv", text.encode(codec)))
    except PostprocError as error:
        assert all(d.code.startswith("SEA") and d.render() for d in error.diagnostics)
    else:
        assert np.isfinite(points.place_mm).all() and np.isfinite(points.rotation).all()


@settings(max_examples=100)
@given(st.binary(max_size=200))
def test_any_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(PostprocError):
        read_seam_points(Source("points.csv", data))


BACK, TURN = "the seam turns back here, by {} deg", "the torch turns by {} deg from the point before"
DOUBTS = [
    (ROWS, []),
    ([*ROWS[:2], "4,400,1,0,1,0,0,0,1", *ROWS[2:]], [f"row 4: {BACK.format(180)}", f"row 5: {BACK.format(175)}"]),
    ([*ROWS[:2], "4,90,1,-0.1,-2,0,0,0.1,2", ROWS[3]], [f"row 4: {TURN.format(180)}", f"row 5: {TURN.format(177)}"]),
]


@pytest.mark.parametrize(("rows", "messages"), DOUBTS, ids=["smooth", "an outlier", "a tangent with a wrong sign"])
def test_rows_that_are_hardly_meant_are_named(rows: list[str], messages: list[str]) -> None:
    doubts = read_seam_points(table(*rows)).doubts()
    assert [d.message for d in doubts] == messages
    assert {(d.code, d.severity) for d in doubts} <= {("SEA010", "warning")}


def test_the_module_visits_the_points_in_one_configuration() -> None:
    source, notes = module(table(*ROWS), clearance_mm=30.0)
    events = walk(program(source.data))
    assert not program(source.data).diagnostics and not any(e.diagnostics for e in events)
    assert [e.statement.instruction for e in events] == ["MoveJ", "ArcLStart", "ArcL", "ArcL", "ArcLEnd", "MoveL"]
    points = read_seam_points(table(*ROWS))
    targets = [e.target for e in events if isinstance(e.target, RobTarget)]
    ends = points.place_mm[[0, -1]] - 30 * points.rotation[[0, -1]][:, :, 2]
    assert np.allclose([t.trans for t in targets], [ends[0], *points.place_mm, ends[1]], atol=1e-3)
    solved = joint_solution(ROBOT, np.stack([flange_matrix(e) for e in events]), np.array([t.robconf for t in targets]))
    assert not solved.failures and np.abs(np.diff(solved.q, axis=0)).max() < 0.5
    assert [note.partition(":")[0] for note in notes] == ["seam data", "weld data"]


CELL = b"MODULE Cell\n PERS welddata wdCell:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nENDMODULE\n"
ROOT = "wdRoot:=[7,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]]"
NEAR, FARTHER = (table(ROWS[0], f"{x},0,0,0,1,0,0,0,1", *ROWS[1:]) for x in (1.9, 2.1))
MODULES = [  # the table, the weld data, and the zone and the weld data that the module has
    (NEAR, ROOT, "z0", ["wdRoot:=[7"]),
    (FARTHER, ROOT, "z1", ["wdRoot:=[7"]),
    (FARTHER, "wdCell", "z1", []),
    (FARTHER, None, "z1", ["wd1:=[8"]),
    (with_speeds(8, 8, 5.5, 8), ROOT, "z1", ["wdRoot_1:=[5.5", "wdRoot_2:=[8"]),
    (with_speeds(6, 6, 6, 6), ROOT, "z1", ["wdRoot:=[6"]),
    (with_speeds(6, 6, 5.5, 6), "wdCell", "z1", ["wdCell_1:=[5.5", "wdCell_2:=[6"]),
    (with_speeds(6, 6, 6, 6), "wdCell", "z1", ["wdCell_1:=[6"]),
]


@pytest.mark.parametrize(("source", "weld", "zone", "declared"), MODULES)
def test_zones_are_smaller_than_the_shortest_gap_and_each_speed_has_its_weld_data(
    source: Source, weld: str | None, zone: str, declared: list[str]
) -> None:
    text, _ = module(source, CELL, weld=weld)
    read = read_program([text, Source("cell.sys", CELL, True)])
    events = [event for event in walk(read) if event.weld is not None]
    assert not read.diagnostics and set(re.findall(r",(z\d+),tTorch", text.data.decode())) == {"z10", zone}
    assert re.findall(r"welddata (\w+:=\[[\d.]+),", text.data.decode()) == declared
    speeds = read_seam_points(source).speed_mm_s
    assert speeds is None or [e.weld.speed for e in events if e.weld] == speeds.tolist()


ALL = table(*ROWS)
FAR = table(*ROWS[:3], "9000,0,0,0,1,0,0,0,1")
TURNING = table(*(f"0,{10 * i},0,{np.cos(i):.3f},{np.sin(i):.3f},0,0,0,1" for i in range(14)))
STRAIGHT = "tStraight:=[TRUE,[[0,0,300],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]]"
CANNOT = [
    (ALL, {"tool": "9x:=[TRUE]"}, "SEA007", "`9x:=[TRUE]` is not a tooldata"),
    (ALL, {"tool": "tTorch:=TRUE"}, "SEA007", "`tTorch:=TRUE` is not a tooldata"),
    (ALL, {"wobj": "n" * 33 + ":=[1]"}, "SEA007", "is not a wobjdata"),
    (ALL, {"tool": None}, "SEA007", "no tool is given, and the model has none"),
    (with_speeds(6, 6, 6, 6), {"weld": "wdElsewhere"}, "SEA007", "the table gives speeds, and the value of"),
    (with_speeds(6, 6, 5, 6), {"weld": f"{'w' * 31}:=[9,0]"}, "SEA007", f"the name `{'w' * 31}` leaves no room"),
    (ALL, {"wobj": "wobj0"}, "SEA008", "row 2: `irb4600_60_205` cannot reach the approach in front of it"),
    (FAR, {}, "SEA008", "row 5: `irb4600_60_205` cannot reach it"),
    (TURNING, {"tool": STRAIGHT}, "SEA009", "no configuration of `irb4600_60_205` holds for the whole seam"),
    (ALL, {"wobj": "wUnknown"}, "RAP020", "`wUnknown`"),
    (ALL, {"tool": "tNope"}, "RAP020", "`tNope`"),
]


@pytest.mark.parametrize(("source", "options", "code", "message"), CANNOT)
def test_data_or_points_that_cannot_be_used(source: Source, options: dict[str, str], code: str, message: str) -> None:
    finding = refused(lambda: module(source, CELL, **options))[0]
    assert finding.code == code and message in finding.message and finding.help
    if code == "RAP020":  # the module is not written: the finding has no place in it
        assert finding.place == "" and "--with" in finding.help


@pytest.mark.parametrize("q5", [60.0, 100.0, -60.0, -100.0])
@pytest.mark.parametrize(("q4", "q6"), [(30.0, 20.0), (-80.0, 80.0), (10.0, -60.0)])
def test_of_two_wrists_the_one_with_less_turn_of_axes_4_and_6_is_taken(q4: float, q5: float, q6: float) -> None:
    way = np.radians([[x, 10.0, 10.0, q4, q5, q6] for x in (1.0, 2.0, 3.0)])
    poses = forward(ROBOT, way)
    rows = np.hstack([1e3 * poses[:, :3, 3], [matrix_quaternion(pose[:3, :3]) for pose in poses]])
    source = table(*(",".join(map(str, row)) for row in rows), head=QUATERNIONS)
    text, _ = module(source, tool="tFlange:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]]", wobj="wobj0")
    targets = [event.target for event in walk(program(text.data))]
    confs = [target.robconf for target in targets if isinstance(target, RobTarget)]
    assert confs[1:-1] == [tuple(conf) for conf in confdata(ROBOT, way).tolist()]


def test_the_command_writes_a_compensated_module(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "points.csv").write_bytes(table(*ROWS).data)
    words = ["--robot", ROBOT.name, "--tool", TOOL, "--wobj", WOBJ, "--json"]
    assert run(build(), ["seam", f"{tmp_path}/points.csv", "-o", f"{tmp_path}/Hull_12.mod", *words]) == 0
    captured, text = capsys.readouterr(), (tmp_path / "Hull_12.mod").read_text()
    assert [s["status"] for s in json.loads(captured.out)["statements"]] == ["compensated"] * 6
    assert "by default, weld data" in captured.err
    assert text.startswith("MODULE Hull_12\n") and ": compensated for irb4600_60_205" in text


def test_the_command_writes_nothing_if_a_row_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "points.csv").write_bytes(table(*ROWS[:2], "bad,0,0,0,1,0,0,0,1").data)
    assert run(build(), ["seam", f"{tmp_path}/points.csv", "-o", f"{tmp_path}/s.mod", "--robot", ROBOT.name]) == 2
    assert "SEA002" in capsys.readouterr().err and not (tmp_path / "s.mod").exists()
