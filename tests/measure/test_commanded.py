"""What was commanded row by row: from poses of the flange, from the program that was run; and in which order."""

from __future__ import annotations

import io
import tomllib
from datetime import datetime, timedelta

import numpy as np
import openpyxl
import pytest
from scipy.spatial.transform import Rotation

from postproc.diagnostics import Source
from postproc.measure.read.table import read_measurements
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import read_program
from postproc.robot.configuration import confdata
from tests.build import refused
from tests.measure.tables import ARM, columns, flanges, lines, measured, points, poses, read, source, table

TARGET = "CONST robtarget p:=[[1000,0,1200],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];"
TOOL = "PERS tooldata tProbe:=[TRUE,[[0,0,200],[1,0,0,0]],[2,[0,0,90],[1,0,0,0],0,0,0]];"
FRAME = 'PERS wobjdata wJig:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'


def test_commanded_poses_become_joints():
    q = poses(20, seed=5)
    R, p = flanges(q)
    wxyz = Rotation.from_matrix(R).as_quat()[:, [3, 0, 1, 2]]
    numbers = np.hstack([1e3 * p, wxyz, confdata(ARM, np.radians(q)), points(q)])
    header = "cmd_x_mm,cmd_y_mm,cmd_z_mm,cmd_qw,cmd_qx,cmd_qy,cmd_qz,cf1,cf4,cf6,cfx,x_mm,y_mm,z_mm"
    data = read([header, *(",".join(map(str, row)) for row in numbers)])
    np.testing.assert_allclose(np.degrees(data.state.q), q, atol=1e-6)


def targets(*names: str) -> Source:
    return source(["target,x_mm,y_mm,z_mm", *(f"{name},1,2,3" for name in names)])


def test_targets_come_from_the_program_that_was_run(samples):
    module = Source("paper_case.mod", (samples / "paper_case.mod").read_bytes())
    arguments = [e.statement.argument("to") for e in walk(read_program(module)) if e.target is not None]
    names = list(dict.fromkeys(a.text for a in arguments if a is not None and a.text.isidentifier()))
    data = read_measurements(targets(*names), ARM, program=module)
    assert data.tool_known and len(data) == len(names) and np.isfinite(data.state.q).all()
    (lost,) = refused(lambda: read_measurements(targets("pNowhere"), ARM, program=module))
    assert (lost.code, lost.message) == ("DAT012", "the program does not move to `pNowhere`")
    (alone,) = refused(lambda: read_measurements(targets(names[0]), ARM))
    assert alone.message == "column `target` names robtargets, and the program that was run is not given"
    both = columns(*measured(), target=names[:1] * 40)
    assert "the angles are taken" in read_measurements(source(lines(both)), ARM, program=module).diagnostics[0].message


def test_a_tool_that_no_file_declares_is_no_tool0():
    module = f"MODULE M\n {TARGET}\n PROC main()\n  MoveJ p,v200,fine,tProbe\\WObj:=wJig;\n ENDPROC\nENDMODULE\n"
    program, row = Source("M.mod", module.encode()), targets("p")
    findings = refused(lambda: read_measurements(row, ARM, program=program))
    assert [d.code for d in findings] == ["RAP020", "RAP020"]
    assert any("`tProbe`" in d.message for d in findings) and "--with" in findings[0].help
    data = Source("user.sys", f"MODULE user\n {TOOL}\n {FRAME}\nENDMODULE\n".encode(), read_only=True)
    known = read_measurements(row, ARM, program=[program, data], measured=False)
    np.testing.assert_allclose(known.state.T_flange_tcp[0, :3, 3], [0, 0, 0.2])


def test_a_workbook_is_read_like_its_text():
    book, start = openpyxl.Workbook(), datetime(2026, 3, 12, 14, 2, 7)
    book.active.append(["cell 4"])
    sheet = book.create_sheet("data")
    for i, line in enumerate(table()):
        name, *cells = line.split(",")
        sheet.append(
            [name, *(map(float, cells) if i else cells), start + timedelta(seconds=30 * i) if i else "Timestamp"]
        )
    out = io.BytesIO()
    book.save(out)
    data = read_measurements(Source("cell.xlsx", out.getvalue()), ARM)
    np.testing.assert_allclose(data.position, read(table()).position)
    np.testing.assert_allclose(np.diff(data.state.time), 30.0)
    assert any("sheet `data` is read, the fullest of 2" in d.message for d in data.diagnostics)


@pytest.mark.parametrize("names", ["pose,A1,A2,A3,A4,A5,A6,X,Y,Z", "id,j1,j2,j3,j4,j5,j6,tcp_x_mm,tcp_y_mm,tcp_z_mm"])
def test_the_map_that_a_terminal_shows_can_be_copied_and_reads_the_table(names):
    rows = source([names, *table()[1:]])
    shown = refused(lambda: read_measurements(rows, ARM))[0].render().partition("with the lines:\n")[2]
    assert tomllib.loads(shown)["columns"]["q6_deg"] in names
    data = read_measurements(rows, ARM, column_map=Source("map.toml", shown.encode()))
    np.testing.assert_array_equal(data.position, read(table()).position)


def numbers_of_rows(rows: list[str]) -> list[float] | None:
    channels = read(rows, rows_in_order=True).state.channels
    return channels["row"].tolist() if "row" in channels else None


def test_the_row_stands_in_for_a_time_where_the_user_says_that_rows_are_in_order():
    """Names that rise tell which rows were left out; other names do not, and times make numbers needless."""
    rows = table(12)
    some = [rows[0], *rows[4:7], *rows[9:]]
    assert numbers_of_rows(some) == [3, 4, 5, 8, 9, 10, 11]
    for other in ([rows[0], *rows[:4:-1]], [rows[0], "Q" + rows[1], *rows[2:]], [rows[0], rows[1], *rows[1:]]):
        assert numbers_of_rows(other) == list(range(1, len(other)))
    assert "row" not in read(rows).state.channels
    assert numbers_of_rows([f"{rows[0]},time_s", *(f"{row},{60 * (i % 5)}" for i, row in enumerate(rows[1:]))]) is None


@pytest.mark.parametrize("more", [{}, {"time_s": 60 * np.arange(30)}, {"session": list("ab" * 15)}], ids=list)
def test_sorted_and_shuffled_rows_come_in_one_order(more):
    head, *rows = lines(columns(*measured(30), **more))
    first = read([head, *rows]).in_order
    shuffled = [rows[i] for i in np.random.default_rng(5).permutation(30)]
    for other in (shuffled, sorted(rows, key=lambda row: float(row.split(",")[4]))):
        data = read([head, *other]).in_order
        np.testing.assert_array_equal(data.position, first.position)
        assert data.pose_id == first.pose_id and data.row != first.row
    assert "time_s" not in more or first.row == tuple(range(1, 31))
