"""Every refusal names the action that is the way out."""

from __future__ import annotations

import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.compensation.reading import IN_SEAM, OUT_OF_REACH
from postproc.diagnostics import Diagnostic, Source
from postproc.model.file import default_model
from postproc.runtime.passes import correct_program

HEAD = """MODULE Out
  PERS tooldata tT:=[TRUE,[[0,0,300],[1,0,0,0]],[5,[0,0,150],[1,0,0,0],0,0,0]];
  CONST robtarget pA:=[[1500,100,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pB:=[[1500,-100,900],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pFar:=[[4500,100,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
"""


def converted(body: str, **chosen: object) -> Conversion:
    source = Source("out.mod", (HEAD + body + "ENDMODULE\n").encode())
    options = Options(force=(0.0, 0.0, -200.0), inertia=False, **chosen)  # type: ignore[arg-type]
    return correct_program(source, default_model("irb4600_60_205"), options)


def errors(found: Conversion) -> list[Diagnostic]:
    return [d for d in found.diagnostics if d.severity == "error"]


ONE_BAD = (
    "  PROC main()\n    MoveJ pA,v100,fine,tT;\n    MoveL pFar,v100,fine,tT;\n    MoveJ pB,v100,fine,tT;\n  ENDPROC\n"
)


def test_one_bad_target_is_told_with_what_corrects_the_rest() -> None:
    (stop,) = errors(converted(ONE_BAD))
    assert stop.help.endswith("or correct all but such statements: `--allow-partial`")
    found = converted(ONE_BAD, allow_partial=True)
    assert found.exit_code == 0 and [o.status for o in found.outcomes] == ["compensated", "skipped", "compensated"]
    assert "RUN007" not in {d.code for d in found.diagnostics}, "nor does the function correct it"


def test_where_nothing_would_be_left_the_rest_is_not_offered() -> None:
    found = errors(converted("  PROC main()\n    MoveJ pFar,v100,fine,tT;\n  ENDPROC\n"))
    assert found and not any("--allow-partial" in d.help for d in found)


def test_targets_of_the_run_alone_are_told_with_the_function_that_corrects_them() -> None:
    body = "  PROC main()\n    VAR num n;\n    n:=GInput(giX);\n    MoveJ Offs(pA,n,0,0),v100,fine,tT;\n  ENDPROC\n"
    (stop,) = errors(converted(body))
    assert stop.code == "CMP003" and "`--run-time where-needed` corrects 1 of its motion statements" in stop.help
    assert stop.place.startswith("out.mod:9:")
    assert converted(body, run_time="where-needed").exit_code == 0


def test_where_the_arm_reaches_nothing_that_is_the_cause() -> None:
    body = "  PROC rNever()\n    MoveJ pFar,v100,fine,tT;\n  ENDPROC\n  PROC main()\n    WaitTime 1;\n  ENDPROC\n"
    stop = errors(converted(body))[-1]
    assert stop.code == "CMP003" and "cannot reach" in stop.message and stop.place.startswith("out.mod:7:")
    warned = [d for d in converted(body).diagnostics if d.severity == "warning"]
    assert all("it is left as it is: nothing leads here" in d.message for d in warned if d.place == stop.place)


MORE = """  CONST robtarget pMid:=[[1500,0,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pFlip:=[[1576.58,212.87,620.69],[0.2235147,0.0669765,0.9675635,0.0968308],[0,2,-2,1],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS seamdata sm:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wd:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
"""
STUCK = "MoveJ pFar,v100,fine,tT;"  # out of reach: found before any way is looked at
WELD = "ArcLStart pA,v100,sm,wd,fine,tT;\n    ArcL pMid,v100,sm,wd,z1,tT;\n    ArcLEnd pB,v100,sm,wd,fine,tT;"


def statuses(found: Conversion) -> list[str]:
    return [o.status for o in found.outcomes]


@pytest.mark.parametrize("way", ["MoveL pFlip,v100,fine,tT;", "MoveJ pB,v100,fine,tT;\n    MoveL pFlip,v100,fine,tT;"])
def test_errors_that_show_one_after_the_other_are_all_left(way: str) -> None:
    """A target out of reach hides that a way in the air cannot be followed; both are left, and the weld is corrected."""
    body = f"{MORE}  PROC main()\n    MoveJ pA,v100,fine,tT;\n    {WELD}\n    {way}\n    MoveJ pB,v100,fine,tT;\n    {STUCK}\n  ENDPROC\n"
    found = converted(body, allow_partial=True)
    assert errors(found) == [] and found.exit_code == 0
    codes = [d.code for d in found.diagnostics if d.severity == "warning"]
    assert "KIN001" in codes and "MOT004" in codes
    welds = [o.status for o in found.outcomes if o.statement.instruction.startswith("Arc")]
    assert welds == ["compensated"] * 3
    assert {o.reason for o in found.outcomes if o.status == "skipped"} == {OUT_OF_REACH}


def test_a_seam_of_which_a_statement_cannot_be_run_stays_whole() -> None:
    """Corrected in part the torch would step aside within the seam; the other seam is corrected."""
    broken = WELD.replace("ArcL pMid", "ArcL pFar")
    body = f"{MORE}  PROC main()\n    MoveJ pA,v100,fine,tT;\n    {broken}\n    MoveJ pA,v100,fine,tT;\n    {WELD}\n  ENDPROC\n"
    found = converted(body, allow_partial=True)
    assert errors(found) == []
    assert statuses(found) == ["compensated", *["skipped"] * 3, "compensated", *["compensated"] * 3]
    assert [o.reason for o in found.outcomes[1:4]] == [IN_SEAM.reason, OUT_OF_REACH, IN_SEAM.reason]
    assert not [d for d in found.diagnostics if d.code == "CMP020"]
