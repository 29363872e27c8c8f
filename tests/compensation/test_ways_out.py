"""Every refusal names the action that is the way out."""

from __future__ import annotations

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.convert import compensate_program
from postproc.diagnostics import Diagnostic, Source
from postproc.model.file import default_model

HEAD = """MODULE Out
  PERS tooldata tT:=[TRUE,[[0,0,300],[1,0,0,0]],[5,[0,0,150],[1,0,0,0],0,0,0]];
  CONST robtarget pA:=[[1500,100,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pB:=[[1500,-100,900],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pFar:=[[4500,100,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
"""


def converted(body: str, **chosen: object) -> Conversion:
    source = Source("out.mod", (HEAD + body + "ENDMODULE\n").encode())
    options = Options(force=(0.0, 0.0, -200.0), inertia=False, **chosen)  # type: ignore[arg-type]
    return compensate_program(source, default_model("irb4600_60_205"), options)


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
