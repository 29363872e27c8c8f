"""Files that are read along and never changed, and data that routines of the program measure."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.convert import compensate_program
from postproc.diagnostics import Source
from postproc.model.file import default_model

E9 = "[9E9,9E9,9E9,9E9,9E9,9E9]"
TOOL = "PERS tooldata t:=[TRUE,[[0,0,350],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];"


def target(x: float, y: float = 0.0, z: float = 900.0) -> str:
    return f"[[{x},{y},{z}],[0,0,1,0],[0,0,0,0],{E9}]"


def convert(*files: tuple[str, str, bool], **options: object) -> Conversion:
    sources = [Source(name, text.encode(), read_only) for name, text, read_only in files]
    return compensate_program(sources, default_model(), Options(**{"tolerance_m": 1e-5, "inertia": False, **options}))  # type: ignore[arg-type]


def numbers(text: bytes, word: bytes) -> list[list[float]]:
    """The position in every statement of the text that starts with a word and names its numbers."""
    found = re.findall(rb"(?m)^\s*" + word + rb"[^;\n]*?\[\[([^]]*)\]", text)
    return [[float(x) for x in row.split(b",")] for row in found]


OWN = f"""MODULE Own
  CONST robtarget mine:={target(1300)};
  PROC rSeam()
    MoveJ there,v100,fine,t;
    MoveL mine,v100,fine,t;
    rBack;
  ENDPROC
ENDMODULE
"""
LENT = f"""MODULE Cell
  {TOOL}
  CONST robtarget there:={target(1250, 100)};
  PROC main()
    MoveJ {target(1200)},v100,fine,t;
    rSeam;
  ENDPROC
  PROC rBack()
    MoveL {target(1200, 50)},v100,fine,t;
    MoveL Offs(mine,0,0,50),v100,fine,t;
  ENDPROC
  PROC rNeverCalled()
    MoveL nowhere,v100,fine,tNowhere;
  ENDPROC
ENDMODULE
"""


@pytest.fixture(scope="module")
def read_only() -> Conversion:
    return convert(("own.mod", OWN, False), ("cell.sys", LENT, True))


def test_only_the_program_is_written_and_judged(read_only: Conversion) -> None:
    assert list(read_only.outputs) == ["own.mod"]
    assert [(o.statement.module, o.status) for o in read_only.outcomes] == [("Own", "compensated")] * 2
    assert not [d for d in read_only.diagnostics if d.code in ("CMP005", "RAP020")]
    assert read_only.report["max_error_after_mm"] < 0.01 < read_only.report["max_error_before_mm"]


def test_a_target_that_a_lent_file_declares_is_displaced_where_it_is_used(read_only: Conversion) -> None:
    text = read_only.outputs["own.mod"]
    (offset,) = re.findall(rb"MoveJ Offs\(there,([-\d.,]+)\),", text)
    whole = convert(("own.mod", OWN, False), ("cell.sys", LENT.replace("MoveL nowhere,v100,fine,tNowhere;", ""), False))
    declared = numbers(whole.outputs["cell.sys"], rb"CONST robtarget there")
    given = numbers(LENT.encode(), rb"CONST robtarget there")
    moved = np.array(given[0]) + [float(number) for number in offset.split(b",")]
    np.testing.assert_allclose(moved, declared[0], atol=0.002)
    assert abs(declared[0][2] - 900) > 0.05


def test_a_target_used_in_a_lent_file_too_is_edited_where_it_serves_as_derived(read_only: Conversion) -> None:
    """`Offs(mine,..)` of the lent routine moves with `mine`, which the program declares."""
    assert numbers(read_only.outputs["own.mod"], rb"CONST robtarget mine") != [[1300.0, 0.0, 900.0]]


MEASURED = f"""MODULE M
  {TOOL}
  PROC main()
    Calibrate;
    MoveJ {target(1200)},v100,fine,t;
    MoveL {target(1300, 150)},v100,fine,t;
  ENDPROC
  PROC Calibrate()
    BEUpdateTcp t;
  ENDPROC
ENDMODULE
"""


def test_a_tool_that_the_program_measures_is_taken_as_it_stands_on_request() -> None:
    refused = convert(("m.mod", MEASURED, False))
    assert not refused.outputs
    (finding,) = [d for d in refused.diagnostics if d.code == "RAP023"]
    assert finding.help.endswith("say `--taught t`")
    assert "BEUpdateTcp" in finding.message or "written" in finding.message
    taken = convert(("m.mod", MEASURED, False), taught=("T",))
    plain = convert(("m.mod", MEASURED.replace("BEUpdateTcp t;", ""), False))
    assert taken.output is not None and plain.output is not None
    assert numbers(taken.output, rb"Move[JL]") == numbers(plain.output, rb"Move[JL]")


MOVED = f"""MODULE M
  {TOOL}
  {TOOL.replace("PERS tooldata t:", "CONST tooldata t0:")}
  PROC main()
    SET
    MoveJ {target(1200)},v100,fine,t;
    MoveL {target(1300, 150)},v100,fine,t;
    MOVE
  ENDPROC
ENDMODULE
"""
AWAY, AGAIN = "t.tframe.trans:=[40,0,350];", "t.tframe.trans.x:=t.tframe.trans.x+4;"


@pytest.mark.parametrize("move", [AWAY, AGAIN, "t.tframe.rot:=[0.924,0,0.383,0];"])
def test_data_that_the_program_moves_is_not_taught(move: str) -> None:
    """What is stated to be taught must not be moved by the program."""
    text = MOVED.replace("MOVE", move)
    stated = convert(("m.mod", text.replace("SET", ""), False), taught=("t",))
    assert not stated.outputs and "RAP035" in {d.code for d in stated.diagnostics}
    assert convert(("m.mod", text.replace("SET", "t:=t0;"), False)).outputs
    measured = text.replace("SET", "").replace(move, "t.tframe.trans:=[2,0,352];")
    assert convert(("m.mod", measured, False), taught=("t",)).outputs


def test_a_taught_target_is_corrected_around_its_name() -> None:
    """The routine that teaches it sets it again: numbers in its declaration would be lost."""
    text = f"MODULE M\n  {TOOL}\n  PERS robtarget pTeach:={target(1250, 80)};\n  PROC main()\n    rTeach;\n"
    text += f"    MoveJ {target(1200)},v100,fine,t;\n    MoveL pTeach,v100,fine,t;\n  ENDPROC\n"
    text += "  PROC rTeach()\n    pTeach:=CRobT(\\Tool:=t);\n  ENDPROC\nENDMODULE\n"
    (finding,) = [d for d in convert(("m.mod", text, False)).diagnostics if d.code == "RAP023"]
    assert "target `pTeach`" in finding.message and (finding.help or "").endswith("say `--taught pTeach`")
    (left,) = [d for d in convert(("m.mod", text, False)).diagnostics if d.code == "CMP005"]
    assert left.help == finding.help
    found = convert(("m.mod", text, False), taught=("pTeach",))
    assert found.output is not None and f"PERS robtarget pTeach:={target(1250, 80)};".encode() in found.output
    assert re.search(rb"MoveL Offs\(pTeach,[-\d.]+,[-\d.]+,[-\d.]+\),v100,fine,t;", found.output)
    assert [o.status for o in found.outcomes] == ["compensated"] * 2 and found.report["max_error_after_mm"] < 0.01


def test_taught_data_that_is_not_there_is_said() -> None:
    found = convert(("m.mod", MEASURED, False), taught=("t", "tt"))
    assert [d.message for d in found.diagnostics if d.code == "RAP034"] == [
        "`tt`, which is to be taught, is declared in none of the files"
    ]


def test_data_without_a_value_has_that_of_another_task() -> None:
    own = MEASURED.replace("BEUpdateTcp t;", "").replace(TOOL, TOOL.split(":=")[0] + ";")
    assert "RAP020" in {d.code for d in convert(("m.mod", own, False)).diagnostics}
    other = f"MODULE Other\n  {TOOL}\n  PERS num n:=1;\nENDMODULE\n"
    found = convert(("m.mod", own, False), ("other.mod", other, True))
    assert found.outputs and not [d for d in found.diagnostics if d.code in ("RAP012", "RAP020")]


def test_a_way_that_begins_at_a_target_that_is_only_lent_says_so() -> None:
    own = f"MODULE Own\nPROC main()\nrTo;\nMoveL {target(1300)},v100,fine,t;\nENDPROC\nENDMODULE\n"
    read_only = f"MODULE Cell\n{TOOL}\nPROC rTo()\nMoveJ {target(1290)},v100,fine,t;\nENDPROC\nENDMODULE\n"
    found = convert(("own.mod", own, False), ("cell.sys", read_only, True))
    (told,) = [d for d in found.diagnostics if d.code == "CMP006"]
    assert told.help.startswith("the arm comes from a target of a file that is only read along")
    both = convert(("own.mod", own, False), ("cell.sys", read_only, False))
    assert "CMP006" not in [d.code for d in both.diagnostics]


LIBRARY = f"""MODULE Lib
  {TOOL}
  PROC rWeld(robtarget s,robtarget e)
    MoveJ Offs(s,0,0,50),v100,fine,t;
    MoveL s,v100,fine,t;
    MoveL e,v100,fine,t;
  ENDPROC
ENDMODULE
"""


def test_the_lines_of_a_library_that_run_on_the_targets_of_the_program_are_in_the_figures() -> None:
    part = f"MODULE Part\n  CONST robtarget a:={target(1200)};\n  CONST robtarget b:={target(1250, 40)};\n"
    part += f"  PROC main()\n    MoveJ {target(1200, 50)},v100,fine,t;\n    rWeld a,b;\n    rWeld b,a;\n  ENDPROC\nENDMODULE\n"
    found = convert(("part.mod", part, False), ("lib.sys", LIBRARY, True), force=(0.0, 0.0, -200.0))
    assert found.report["measured_statements"] == 2
    assert found.report["max_error_before_mm"] > 0.3 and found.report["max_error_after_mm"] < 0.05
    assert not [d for d in found.diagnostics if d.code == "CMP017"]


def test_what_stays_off_on_a_line_of_a_library_is_told_there() -> None:
    part = f"MODULE Part\n  CONST robtarget a:={target(1150, 10)};\n  CONST robtarget b:={target(1100, 650)};\n"
    part += f"  PROC main()\n    MoveJ {target(1200, 50)},v100,fine,t;\n    rWeld a,b;\n  ENDPROC\nENDMODULE\n"
    found = convert(("part.mod", part, False), ("lib.sys", LIBRARY, True), force=(0.0, 0.0, -200.0))
    told = {d.place: d for d in found.diagnostics if d.code == "CMP006"}["lib.sys:6:5"]
    assert "read along: convert both together" in (told.help or "")
    assert f"{found.report['max_error_after_mm']:.3f} mm off" in told.message
    both = convert(("part.mod", part, False), ("lib.sys", LIBRARY, False), force=(0.0, 0.0, -200.0))
    assert both.report["max_error_after_mm"] <= 0.01


def test_where_the_program_measures_its_tool_the_way_out_is_told() -> None:
    text = f"MODULE M\n  {TOOL}\n  PROC main()\n    BECheckTcp t;\n    MoveL {target(1200)},v100,fine,t;\n  ENDPROC\nENDMODULE\n"
    (stop,) = [d for d in convert(("m.mod", text, False)).diagnostics if d.code == "CMP003"]
    assert "`--taught t`" in stop.help


def test_a_lent_file_that_was_compensated_before_is_found_out() -> None:
    """Its targets hold the correction already: statements that use them would be corrected twice."""
    own = f"MODULE Own\nPROC main()\nMoveJ {target(1290)},v100,fine,t;\nMoveL shared,v100,fine,t;\nENDPROC\nENDMODULE\n"
    data = f"CONST robtarget shared:={target(1300)};\nPROC r()\nMoveL shared,v100,fine,t;\nENDPROC\n"
    library = f"MODULE Lib\n{TOOL}\n{data}ENDMODULE\n"
    once = convert(("lib.mod", library, False)).outputs["lib.mod"].decode()
    assert convert(("own.mod", own, False), ("lib.mod", library, True)).outputs
    found = convert(("own.mod", own, False), ("lib.mod", once, True))
    ((code, path, help),) = [(d.code, d.source.path, d.help) for d in found.diagnostics if d.source is not None]
    assert (code, path, help, found.exit_code) == ("CMP001", "lib.mod", "lend the original", 1)


def test_data_that_only_the_last_run_has_set_is_assumed_and_kept() -> None:
    """A bead beside the last: the correction goes around what the last run left, whatever that is."""
    bead = "MoveL p,v100,fine,t;\np.trans.y:=p.trans.y+6;\n"
    head = f"MODULE M\n{TOOL}\nPERS robtarget p:={target(1300)};\nCONST robtarget p0:={target(1300)};\nPROC main()\n"
    start = f"MoveJ {target(1290)},v100,fine,t;\n"
    found = convert(("m.mod", f"{head}{start}{bead}ENDPROC\nENDMODULE\n", False))
    assert (
        b"MoveL Offs(p," in found.outputs["m.mod"]
        and f"PERS robtarget p:={target(1300)};".encode() in found.outputs["m.mod"]
    )
    followed = convert(("m.mod", f"{head}{start}p:=p0;\n{bead}{bead}ENDPROC\nENDMODULE\n", False))
    assert followed.outputs and not [d for d in followed.diagnostics if d.code == "CMP005"]
