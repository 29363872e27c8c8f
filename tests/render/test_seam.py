"""Modules from seam points: the frames against plain formulas, the rows that are wrong, the command."""

from __future__ import annotations

import json
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
from postproc.render.seam import SeamOptions, seam_configuration, seam_module
from postproc.render.seampoints import read_seam_points
from postproc.robot.catalogue import load_robot
from postproc.robot.configuration import confdata
from postproc.robot.inverse import joint_solution
from postproc.robot.kinematics import forward
from tests.build import refused

TOOL = "tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]]"
WOBJ = 'wJig:=[FALSE,TRUE,"",[[1300,-200,700],[0.9659258,0,0,0.2588190]],[[0,0,0],[1,0,0,0]]]'
HEAD = "x_mm,y_mm,z_mm,tx,ty,tz,nx,ny,nz"
ROWS = ["0,0,0,0,1,0,0,0,1", "1,40,0.5,0.05,1,0,0,0.1,1", "4,90,1,0.1,2,0,0,0.1,2", "8,140,0,0.1,1,0,0,0,1"]


def table(*rows: str, head: str = HEAD, mark: str = "\n") -> Source:
    return Source("points.csv", mark.join([head, *rows]).encode())


def quaternion_matrix(w: float, x: float, y: float, z: float) -> np.ndarray:
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_the_torch_points_against_the_normal_and_along_the_seam() -> None:
    points = read_seam_points(table(*ROWS))
    for row, R in zip(ROWS, points.rotation, strict=True):
        t, n = np.array(row.split(",")[3:6], float), np.array(row.split(",")[6:], float)
        assert np.allclose(R[:, 2], -n / np.linalg.norm(n))
        assert R[:, 0] @ t > 0.9 * np.linalg.norm(t) and abs(R[:, 0] @ n) < 1e-12
        assert np.allclose(R @ R.T, np.eye(3)) and np.linalg.det(R) == pytest.approx(1)


@pytest.mark.parametrize("mark", ["\n", "\r\n", "\n\n# a note\n"])
def test_quaternions_are_taken_as_they_are(mark: str) -> None:
    head = "x_mm;y_mm;z_mm;qw;qx;qy;qz"
    points = read_seam_points(table("1;2;3;0.5;0.5;-0.5;0.5", "1;3;3;0;1;0;0", head=head, mark=mark))
    assert np.allclose(points.rotation[0], quaternion_matrix(0.5, 0.5, -0.5, 0.5))
    assert points.place_mm.tolist() == [[1, 2, 3], [1, 3, 3]] and points.speed_mm_s is None


def test_tables_of_a_german_spreadsheet() -> None:
    head, rows = HEAD.replace(",", ";").upper(), [row.replace(",", ";").replace(".", ",") for row in ROWS]
    points, same = read_seam_points(table("1.000,5;0;0;0;1;0;0;0;1", *rows, head=f"Seam 7\n{head}")), table(*ROWS)
    assert points.place_mm[0].tolist() == [1000.5, 0, 0]
    assert points.place_mm[1:].tolist() == read_seam_points(same).place_mm.tolist()


@pytest.mark.parametrize(
    ("row", "code", "message"),
    [
        ("x,50,0,0,1,0,0,0,1,8", "SEA002", "row 3, column `x_mm`: `x` is not a number"),
        ("0,nan,0,0,1,0,0,0,1,8", "SEA002", "row 3, column `y_mm`: `nan` is not a number"),
        ("0,50,0,0,inf,0,0,0,1,8", "SEA002", "row 3, column `ty`: `inf` is not a number"),
        ("0,5e7,0,0,1,0,0,0,1,8", "SEA002", "row 3, column `y_mm`: `5e7` is too large"),
        ("0,50,0,0,,0,0,0,1,8", "SEA002", "row 3, column `ty`: nothing stands here"),
        ("0,0.05,0,0,1,0,0,0,1,8", "SEA004", "only 0.050 mm from the point before"),
        ("0,50,0,0,0,0,0,0,1,8", "SEA003", "row 3, column `tx`: the tangent has no length"),
        ("0,50,0,0,1,0,0,0,0,8", "SEA003", "row 3, column `nx`: the normal has no length"),
        ("0,50,0,0,1,0,0,1,0.01,8", "SEA003", "row 3, column `nx`: the normal stands 0.6 deg from the tangent"),
        ("0,50,0,0,1,0,0,0,1,-2", "SEA005", "row 3, column `speed_mm_s`: -2 mm/s is not a welding speed"),
        ("0,50,0,0,1,0,0,0,1", "SEA001", "row 3 has 9 cells where the header has 10"),
    ],
)
def test_wrong_cells_are_named(row: str, code: str, message: str) -> None:
    source = table(f"{ROWS[0]},8", row, f"{ROWS[3]},8", head=f"{HEAD},speed_mm_s")
    (found,) = refused(lambda: read_seam_points(source))
    assert found.code == code and message in found.message
    assert found.place.startswith("points.csv:3:")


@pytest.mark.parametrize(
    ("source", "code"),
    [
        (Source("points.csv", b""), "SEA001"),
        (table("1,2,3", head="x_mm,y_mm,z_mm"), "SEA001"),
        (table(*(f"{row},1" for row in ROWS), head=HEAD + ",x_mm"), "SEA001"),
        (table("1,2,3,1,0,0,0", "1,5,3,1,1,0,0", head="x_mm,y_mm,z_mm,qw,qx,qy,qz"), "SEA003"),
        (table(ROWS[0]), "SEA006"),
        (Source("points.csv", b"\x00\xff\xfe,,\n\xff"), "SEA001"),
    ],
)
def test_tables_that_are_none(source: Source, code: str) -> None:
    assert code in [d.code for d in refused(lambda: read_seam_points(source))]


def module(*rows: str, head: str = HEAD, cell: bytes = b"", **options: object) -> tuple[Source, list[str]]:
    said = SeamOptions(**{"tool": TOOL, "wobj": WOBJ, **options})  # type: ignore[arg-type]
    points, sides = read_seam_points(table(*rows, head=head)), [Source("cell.sys", cell, True)] if cell else []
    text, notes = seam_module(points, load_robot("irb4600_60_205"), np.eye(4), said, sides)
    return Source("Seam.mod", text), list(notes)


def test_the_module_visits_the_points_and_every_confdata_is_right() -> None:
    source, notes = module(*ROWS, clearance_mm=30.0)
    program = read_program(source)
    events = walk(program)
    assert not program.diagnostics and not any(e.diagnostics for e in events)
    assert [e.statement.instruction for e in events] == ["MoveJ", "ArcLStart", "ArcL", "ArcL", "ArcLEnd", "MoveL"]
    points = read_seam_points(table(*ROWS))
    targets = [e.target for e in events if isinstance(e.target, RobTarget)]
    assert np.allclose([t.trans for t in targets[1:-1]], points.place_mm, atol=1e-3)
    for event, near in ((events[0], 0), (events[-1], -1)):
        assert isinstance(event.target, RobTarget)
        assert np.allclose(event.target.trans, points.place_mm[near] - 30 * points.rotation[near][:, 2], atol=1e-3)
    robot = load_robot("irb4600_60_205")
    solved = joint_solution(robot, np.stack([flange_matrix(e) for e in events]), np.array([t.robconf for t in targets]))
    assert not solved.failures
    assert np.abs(np.diff(solved.q, axis=0)).max() < 0.5  # one configuration, no turns on the way
    assert notes == [n for n in notes if "seam data" in n or "weld data" in n]


@pytest.mark.parametrize(("x", "zone"), [("1.9", "z0"), ("2.1", "z1")])
def test_zones_are_smaller_than_the_shortest_gap(x: str, zone: str) -> None:
    first, *rest = ROWS
    near = ",".join([f"{float(first.split(',')[0]) + float(x)}", *first.split(",")[1:]])
    source, _ = module(first, near, *rest)
    assert {e.statement.argument("zone").text for e in walk(read_program(source))[2:5]} == {zone}  # type: ignore[union-attr]


def test_each_speed_has_its_weld_data() -> None:
    rows = [f"{row},{speed}" for row, speed in zip(ROWS, (8, 8, 5.5, 8), strict=True)]
    source, _ = module(*rows, head=f"{HEAD},speed_mm_s", weld="wdRoot:=[7,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]]")
    assert b"wdRoot_1:=[5.5,0,[0,0,26," in source.data and b"wdRoot_2:=[8,0,[0,0,26," in source.data
    speeds = [e.weld.speed for e in walk(read_program(source)) if e.weld is not None]
    assert speeds == [8, 8, 5.5, 8]


@pytest.mark.parametrize("speeds", [(6, 6, 5.5, 6), (6, 6, 6, 6)])
def test_weld_data_of_the_cell_serves_for_speeds_of_the_table(speeds: tuple[float, ...]) -> None:
    cell = b"MODULE Cell\n PERS welddata wdCell:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nENDMODULE\n"
    rows = [f"{row},{speed}" for row, speed in zip(ROWS, speeds, strict=True)]
    source, _ = module(*rows, head=f"{HEAD},speed_mm_s", weld="wdCell", cell=cell)
    assert b"wdCell_1:=[" in source.data and b" wdCell:=[" not in source.data
    program = read_program([source, Source("cell.sys", cell, True)])
    assert [e.weld.speed for e in walk(program) if e.weld is not None] == list(speeds)
    assert not program.diagnostics
    with pytest.raises(PostprocError, match="SEA007"):
        module(*rows, head=f"{HEAD},speed_mm_s", weld="wdElsewhere", cell=cell)


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"tool": "9x:=[TRUE]"}, "SEA007"),
        ({"tool": "tTorch:=TRUE"}, "SEA007"),
        ({"wobj": "n" * 33 + ":=[1]"}, "SEA007"),
        ({"tool": None}, "SEA007"),
        ({"wobj": "wobj0"}, "SEA008"),
        ({"wobj": "wUnknown"}, "RAP020"),
    ],
)
def test_data_that_cannot_be_used(options: dict[str, str | None], code: str) -> None:
    assert refused(lambda: module(*ROWS, **options))[0].code == code


def test_data_that_nobody_declares_is_no_place_in_a_module_that_is_not_written() -> None:
    (found,) = refused(lambda: module(*ROWS, tool="tNope"))
    assert found.place == "" and "`tNope`" in found.message and "--with" in found.help


def test_points_out_of_reach_are_named() -> None:
    messages = [d.message for d in refused(lambda: module(*ROWS[:3], "9000,0,0,0,1,0,0,0,1"))]
    assert messages[0] == "row 5: `irb4600_60_205` cannot reach it"


def test_the_command_writes_a_compensated_module(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "points.csv").write_bytes(table(*ROWS).data)
    arguments = [
        "seam",
        f"{tmp_path}/points.csv",
        "-o",
        f"{tmp_path}/Hull_12.mod",
        "--robot",
        "irb4600_60_205",
        "--tool",
        TOOL,
        "--wobj",
        WOBJ,
    ]
    assert run(build(), [*arguments, "--json"]) == 0
    said = capsys.readouterr()
    document = json.loads(said.out)
    assert [s["status"] for s in document["statements"]] == ["compensated"] * 6
    assert "by default, weld data" in said.err
    text = (tmp_path / "Hull_12.mod").read_text()
    assert text.startswith("MODULE Hull_12\n") and ": compensated for irb4600_60_205" in text
    assert len(walk(read_program(Source("x.mod", text.encode())))) >= 6


def test_the_command_writes_nothing_if_a_row_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "points.csv").write_bytes(table(*ROWS[:2], "bad,0,0,0,1,0,0,0,1").data)
    assert (
        run(build(), ["seam", f"{tmp_path}/points.csv", "-o", f"{tmp_path}/Seam.mod", "--robot", "irb4600_60_205"]) == 2
    )
    assert "SEA002" in capsys.readouterr().err
    assert not (tmp_path / "Seam.mod").exists()


CELL = st.sampled_from(
    [
        "0",
        "1",
        "-50",
        "1e9",
        "nan",
        "inf",
        "-inf",
        "",
        " ",
        "x",
        "1,5",
        '"3"',
        "\u00e9",
        "1e400",
        "1e300",
        "-1e7",
        "0x10",
        "1_0",
    ]
)


@settings(max_examples=150)
@given(
    head=st.sampled_from(
        [HEAD, "x_mm;y_mm;z_mm;qw;qx;qy;qz", f"{HEAD},speed_mm_s", "x_mm", HEAD.upper(), HEAD + ",x_mm"]
    ),
    rows=st.lists(st.lists(CELL, min_size=5, max_size=11), max_size=6),
    mark=st.sampled_from(["\n", "\r\n", "\r", "\n\n"]),
    codec=st.sampled_from(["utf-8", "utf-8-sig", "latin-1", "utf-16"]),
)
def test_any_table_is_read_or_refused(head: str, rows: list[list[str]], mark: str, codec: str) -> None:
    text = mark.join([head, *(";".join(row) if ";" in head else ",".join(row) for row in rows)])
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


def test_metres_are_called_by_name() -> None:
    near = [",".join([f"{0.001 * i:g}", f"{0.05 * i:g}", "0", "0", "1", "0", "0", "0", "1"]) for i in range(12)]
    small = refused(lambda: read_seam_points(table(*near)))
    assert len(small) == 1 and "metres" in small[0].help


def test_rows_that_are_hardly_meant_are_named() -> None:
    assert read_seam_points(table(*ROWS)).doubts() == []
    strayed = [*ROWS[:2], "4,400,1,0,1,0,0,0,1", *ROWS[2:]]
    found = read_seam_points(table(*strayed)).doubts()
    assert [(d.code, d.severity) for d in found] == [("SEA010", "warning")] * 2
    assert [d.message.split(",")[0] for d in found] == [
        "row 4: the seam turns back here",
        "row 5: the seam turns back here",
    ]
    turned = [*ROWS[:2], "4,90,1,-0.1,-2,0,0,0.1,2", ROWS[3]]
    assert [d.message[:5] for d in read_seam_points(table(*turned)).doubts()] == ["row 4", "row 5"]


@pytest.mark.parametrize("q5", [60.0, 100.0, -60.0, -100.0])
@pytest.mark.parametrize(("q4", "q6"), [(30.0, 20.0), (-80.0, 80.0), (10.0, -60.0)])
def test_of_two_wrists_the_one_with_less_turn_of_axes_4_and_6_is_taken(q4: float, q5: float, q6: float) -> None:
    robot = load_robot("irb4600_60_205")
    way = np.radians([[x, 10.0, 10.0, q4, q5, q6] for x in (0.0, 1.0, 2.0)])
    conf = seam_configuration(robot, forward(robot, way))
    assert conf is not None and conf.tolist() == confdata(robot, way).tolist()
