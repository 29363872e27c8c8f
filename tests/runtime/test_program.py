"""Programs with the function in them: which statements get it, which must not, and what else is written."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc import text as text_of
from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.convert import compensate_program
from postproc.diagnostics import Source
from postproc.model.file import default_model
from tests.runtime.loading import Loaded
from tests.worlds.product import ARM, FORCE

NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
HEAD = """MODULE Line
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata sm:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wd:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS loaddata lPart:=[12,[0,0,60],[1,0,0,0],0,0,0];
  VAR robtarget pSeen;
  VAR num nSeen;
"""


def target(x: float, y: float, z: float = 50.0) -> str:
    return f"[[{x},{y},{z}],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],{NO_AXES}]"


def program(body: str, data: str = "", more: str = "") -> str:
    points = f"  CONST robtarget p1:={target(120, 150)};\n  CONST robtarget p2:={target(320, 150)};\n{data}"
    return f"{HEAD}{points}  PROC main()\n{body}\n  ENDPROC\n{more}ENDMODULE\n"


def move(goal: str, word: str = "MoveL") -> str:
    return f"    {word} {goal},v200,fine,tTorch\\WObj:=wPlate;\n"


def weld(goal: str, word: str) -> str:
    return f"    {word} {goal},v200,sm,wd,fine,tTorch\\WObj:=wPlate;\n"


@cache
def converted(text: str, run_time: str = "where-needed", read_only: str = "", **options: object) -> Conversion:
    sources = [Source("line.mod", text.encode("latin-1"))]
    sources += [Source("lent.sys", read_only.encode("latin-1"), read_only=True)] if read_only else []
    chosen = Options(tolerance_m=1e-5, force=FORCE, inertia=False, run_time=run_time, **options)  # type: ignore[arg-type]
    return compensate_program(sources, default_model(ARM), chosen)


def written(found: Conversion) -> str:
    assert found.output is not None, [d.message for d in found.diagnostics]
    return found.output.decode("latin-1")


def statuses(found: Conversion) -> list[str]:
    return [o.status for o in found.outcomes]


def why(found: Conversion) -> list[str | None]:
    return [o.reason for o in found.outcomes]


def codes(found: Conversion) -> list[str]:
    return [d.code for d in found.diagnostics]


def lines_with(found: Conversion, word: str) -> list[str]:
    return [line.strip() for line in written(found).splitlines() if word in line and not line.strip().startswith("!")]


def test_what_numbers_correct_stays_with_numbers_and_the_rest_goes_through_the_function() -> None:
    found = converted(program(move("p1", "MoveJ") + move("Offs(pSeen,0,0,40)") + move("p2")))
    assert statuses(found) == ["compensated", "run_time", "compensated"]
    assert lines_with(found, "ppCorrected") == [
        "MoveL ppCorrected(Offs(pSeen,0,0,40),tTorch\\WObj:=wPlate),v200,fine,tTorch\\WObj:=wPlate;"
    ]
    task = Loaded([written(found), (found.module or b"").decode()])
    assert task.faults() == []
    (row,) = [r for r in found.report["statements"] if r["status"] == "run_time"]
    assert (row["edited"], row["shift_mm"]) == ("function", None)
    assert found.report["run_time"]["statements"] == 1
    assert "1 at run time" in text_of(found)


def test_off_says_how_many_statements_it_would_reach() -> None:
    text = program(move("p1", "MoveJ") + weld("pSeen", "ArcLStart") + weld("Offs(pSeen,9,0,0)", "ArcLEnd") + move("p2"))
    found = converted(text, "off")
    assert found.module is None
    assert "ppCorrected" not in written(found)
    (said,) = [d for d in found.diagnostics if d.code == "RUN007"]
    assert said.message == "2 motion statements (2 of them weld) could be corrected on the controller"
    assert "`--run-time where-needed`" in said.help
    assert "RUN007" not in codes(converted(program(move("p1", "MoveJ") + move("p2")), "off"))


def test_all_sends_known_targets_through_the_function_too_and_proves_them() -> None:
    text = program(move("p1", "MoveJ") + weld("p1", "ArcLStart") + weld("p2", "ArcLEnd") + move("Offs(p2,0,0,80)"))
    found = converted(text, "all")
    assert set(statuses(found)) == {"run_time"}
    told = found.report["run_time"]
    assert told["known_targets"] >= 3
    assert 0 < told["max_known_error_mm"] < 0.001
    # Ends alone are corrected: what is left in the middle of 200 mm is what the proof finds.
    assert found.report["max_arc_error_after_mm"] < 0.1 * found.report["max_arc_error_before_mm"]
    assert found.report["max_arc_error_after_mm"] > 10 * told["max_known_error_mm"]
    assert "targets that are known it is off by up to 0.000" in written(found)
    stripped = [line for line in written(found).splitlines() if not line.strip().startswith("! ")]
    assert len(stripped) == len(text.splitlines())


FROM_THE_ARM = {
    "a variable": ("    pSeen@:=CRobT(\\Tool:=tTorch\\WObj:=wPlate);\n" + move("pSeen@"), ""),
    "another name": ("    pOld@:=CRobT();\n    pSeen@:=Offs(pOld@,0,0,9);\n" + move("pSeen@"), ""),
    "a number of it": ("    pOld@:=CRobT();\n    nSeen@:=pOld@.trans.z;\n" + move("Offs(p1,0,0,nSeen@)"), ""),
    "a function": (move("Here()"), "  FUNC robtarget Here()\n    RETURN Offs(CRobT(),0,0,5);\n  ENDFUNC\n"),
    "a parameter": ("    pSeen@:=CRobT();\n    go pSeen@;\n", "  PROC go(robtarget p)\n" + move("p") + "  ENDPROC\n"),
    "an argument by reference": (
        "    look pSeen@;\n" + move("pSeen@"), "  PROC look(INOUT robtarget p)\n    p:=CRobT();\n  ENDPROC\n",
    ),
    "a search": (
        move("p1") + "    SearchL\\Stop,diTouch,pSeen@,p2,v10,tTorch\\WObj:=wPlate;\n" + move("Offs(pSeen@,0,0,9)"), "",
    ),
    "data by name": ("    pOld@:=CRobT();\n    SetDataVal \"pSe\"+\"en@\",pOld@;\n" + move("pSeen@"), ""),
    "what was corrected": ("    pSeen@:=CalcRobT(jSeen,tTorch);\n" + move("pSeen@"), ""),
    "the work object": (
        "    wSeen.oframe.trans:=CPos();\n    MoveL pSeen@,v200,fine,tTorch\\WObj:=wSeen;\n", "",
    ),
    "the displacement": ("    PDispOn p1,tTorch\\WObj:=wPlate;\n" + move("Offs(p2,0,0,nSeen@)") + "    PDispOff;\n", ""),
}  # fmt: skip
TAUGHT = (
    "  VAR jointtarget jSeen;\n" + '  PERS wobjdata wSeen:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
)


@pytest.mark.parametrize("mode", ["where-needed", "all"])
def test_where_the_arm_stood_is_never_corrected(mode: str) -> None:
    """However the position is handed on: it holds the error of the arm, and once more corrected would double it."""
    data, more = TAUGHT, "".join(routines for _, routines in FROM_THE_ARM.values())
    for k, (body, _) in enumerate([*FROM_THE_ARM.values(), (move("Offs(pSeen@,0,0,9)"), "")]):
        data += f"  VAR robtarget pSeen{k};\n  VAR robtarget pOld{k};\n  VAR num nSeen{k};\n"
        more += f"  PROC r{k}()\n{body.replace('@', str(k))}  ENDPROC\n"
    calls = "".join(f"    r{k};\n" for k in range(len(FROM_THE_ARM) + 1))
    found = converted(program(move("p1", "MoveJ") + calls, data, more), mode)
    last = {o.statement.routine: o for o in found.outcomes}
    last[f"r{[*FROM_THE_ARM].index('a parameter')}"] = last.pop("go")
    told = [(name, last[f"r{k}"].status) for k, name in enumerate(FROM_THE_ARM)]
    assert told == [(name, "skipped") for name in FROM_THE_ARM]
    assert last[f"r{len(FROM_THE_ARM)}"].status == "run_time", "what a sensor tells goes through the function"
    for k in range(len(FROM_THE_ARM)):
        goal = last[f"r{k}"].statement.argument("to")
        assert goal is not None and f"ppCorrected({goal.text}," not in written(found)


def test_a_name_that_is_used_again_for_another_place_is_left_with_the_reason() -> None:
    """One name for both: which of the two it holds is not known where it is used."""
    body = (
        "    pSeen:=CRobT();\n"
        + move("Offs(pSeen,0,0,9)")
        + "    pSeen:=p1;\n    pSeen.trans.x:=GInput(giSeen);\n"
        + move("pSeen")
    )
    found = converted(program(move("p1", "MoveJ") + body))
    assert statuses(found) == ["compensated", "skipped", "skipped"]


def test_data_that_known_and_unknown_statements_share_is_corrected_once() -> None:
    """Numbers of a point are not changed where a statement that goes through the function derives its target from it."""
    shared = program(
        move("p1", "MoveJ") + move("p2") + "    nSeen:=GInput(giSeen);\n" + move("Offs(p2,nSeen,0,0)") + move("p1")
    )
    found = converted(shared)
    assert statuses(found) == ["compensated", "compensated", "run_time", "compensated"]
    assert f"CONST robtarget p2:={target(320, 150)};" in written(found)
    assert lines_with(found, "MoveL Offs(p2")
    alone = converted(program(move("p1", "MoveJ") + move("p2") + move("pSeen") + move("p1")))
    assert f"CONST robtarget p2:={target(320, 150)};" not in written(alone)


def test_elements_that_are_corrected_by_numbers_do_not_go_through_the_function() -> None:
    """A pallet whose index an input gives: its elements hold the correction only where nothing else displaces them."""
    data = f"  CONST robtarget pPlace{{2}}:=[{target(100, 100)},{target(300, 100)}];\n"
    known = move("p1", "MoveJ") + "    nSeen:=GInput(giPlace);\n" + move("pPlace{nSeen}")
    assert statuses(converted(program(known, data))) == ["compensated", "compensated"]
    mixed = known + "    nSeen:=AInput(aiHigh);\n" + move("Offs(pPlace{1},0,0,nSeen)")
    found = converted(program(mixed, data))
    assert statuses(found)[-1] == "run_time"
    assert data in written(found)


def test_a_routine_that_gets_known_and_unknown_targets_goes_through_as_a_whole() -> None:
    more = "  PROC go(robtarget p)\n" + move("p") + move("Offs(p,0,0,60)") + "  ENDPROC\n"
    found = converted(
        program(
            move("p1", "MoveJ") + "    go p1;\n    go p2;\n    pSeen.trans.x:=GInput(giSeen);\n    go pSeen;\n",
            "",
            more,
        )
    )
    assert statuses(found) == ["compensated", "run_time", "run_time"]
    for name, x in (("p1", 120), ("p2", 320)):
        assert f"CONST robtarget {name}:={target(x, 150)};" in written(found)


@pytest.mark.parametrize("mode", ["off", "where-needed", "all"])
def test_what_was_corrected_before_is_refused(mode: str) -> None:
    first = converted(program(move("p1", "MoveJ") + move("pSeen")))
    again = converted(written(first), mode)
    assert again.outputs == {}
    assert codes(again) == ["CMP001"]
    by_hand = program(move("p1", "MoveJ") + move("ppCorrected(pSeen,tTorch\\WObj:=wPlate)"))
    assert codes(converted(by_hand, mode)) == ["CMP001"]
    assert "ppCorrected" in program(move("p1") + "    ! ppCorrected(pSeen,tTorch)\n")
    assert "CMP001" not in codes(converted(program(move("p1", "MoveJ") + "    ! ppCorrected(pSeen,tTorch)\n"), mode))
    module = (first.module or b"").decode()
    assert codes(converted(program(move("p1", "MoveJ") + move("pSeen")), mode, read_only=module)) == ["CMP001"]


def test_grip_load_tells_the_function_what_is_held() -> None:
    body = (
        move("p1", "MoveJ") + "    GripLoad lPart;\n" + move("p2") + "    IF nSeen>0 GripLoad load0;\n" + move("pSeen")
    )
    found = converted(program(body), "all")
    text = [line.strip() for line in written(found).splitlines()]
    at = text.index("GripLoad lPart;")
    assert text[at + 1] == "ppPayload:=lPart;"
    assert text[text.index("PROC main()") + 1] == "ppPayload:=load0;"  # a cycle that was broken off left it held
    assert b"VAR loaddata ppPayload" in (found.module or b"") and b"PERS loaddata ppPayload" not in (
        found.module or b""
    )
    assert "IF nSeen>0 THEN GripLoad load0; ppPayload:=load0; ENDIF" in text
    assert found.report["run_time"]["loads"] == 2
    assert Loaded([written(found), (found.module or b"").decode()]).faults() == []
    # The proof runs the module with that payload: without it the arm would droop by tenths of a millimetre more.
    residual = {o.statement.line: o.residual_mm for o in found.outcomes}
    assert max(r for r in residual.values() if r is not None) < 0.002
    assert "GripLoad" not in written(converted(program(move("p1", "MoveJ") + move("pSeen"))))


@pytest.mark.parametrize("load", ["load0", "lPart"])
def test_the_module_is_proved_with_the_load_that_the_call_hands_over(load: str, tmp_path: Path) -> None:
    """A module that takes `load0` for a load of 1 g is found out: tenths of a millimetre."""
    body = move("p1", "MoveJ") + move("p2").replace("\\WObj", f"\\TLoad:={load}\\WObj") + move("pSeen")
    residual = [o.residual_mm for o in converted(program(body), "all").outcomes if o.residual_mm is not None]
    assert residual and max(residual) < 0.002
    shipped = (Path(__file__).parents[2] / "templates" / "runtime_module.j2").read_text()
    own = "NOT (TLoad.mass>=0 AND TLoad.mass<={{ no_mass }})"
    assert own in shipped
    (tmp_path / "runtime_module.j2").write_text(shipped.replace(own, "TRUE"))
    wrong = converted(program(body), "all", template_dir=tmp_path)
    after = max((o.residual_mm or 0.0 for o in wrong.outcomes), default=0.0)
    assert (after > 0.02 or not wrong.outputs) == (load == "load0")


def test_grip_load_in_a_file_that_stays_as_it_is_is_said() -> None:
    read_only = "MODULE Hand\n  PROC take()\n    GripLoad lPart;\n  ENDPROC\nENDMODULE\n"
    found = converted(program(move("p1", "MoveJ") + "    take;\n" + move("pSeen")), read_only=read_only)
    (said,) = [d for d in found.diagnostics if d.code == "RUN010"]
    assert said.help == "write `ppPayload:=lPart;` behind it"


@pytest.mark.parametrize("data", ["  VAR bool ppOn;\n", "  FUNC num Distance(pos a,pos b)\n    RETURN 1;\n  ENDFUNC\n"])
def test_names_that_mean_something_else_are_refused(data: str) -> None:
    body, more = move("p1", "MoveJ") + move("pSeen"), data if "FUNC" in data else ""
    found = converted(program(body, "" if more else data, more))
    assert found.outputs == {}
    assert "RUN008" in codes(found)
    name = "Distance" if more else "ppOn"
    assert f"`{name}` is a name that the module for run time uses, too" in [d.message for d in found.diagnostics]


@pytest.mark.parametrize("name", ["n", "k", "r", "ppSolved", "ppNear", "again"])
def test_names_that_the_module_declares_itself_mean_its_own_there(name: str) -> None:
    """Loop variables, parameters, labels and LOCAL names of the module hide what the program calls alike."""
    body = move("p1", "MoveJ") + move("pSeen")
    found = converted(program(body, f"  PERS num {name}:=5;\n"))
    assert found.outputs and "RUN008" not in codes(found)
    module = (found.module or b"").decode()
    assert Loaded([written(found), module]).faults() == []


def test_external_axes_that_nobody_describes_are_an_error_at_run_time_too() -> None:
    axes = "[250,9E9,9E9,9E9,9E9,9E9]"
    data = f"  PERS robtarget pCam:={target(200, 200).replace(NO_AXES, axes)};\n"
    text = program(move("p1", "MoveJ") + move("pCam") + move("p2"), data)
    for mode in ("off", "where-needed", "all"):
        found = converted(text, mode)
        assert found.outputs == {} and "MOT008" in codes(found), (mode, codes(found))


def test_a_value_in_the_file_that_no_arm_reaches_is_none() -> None:
    """PERS data that a camera writes: what was saved is nothing to be corrected by numbers, nor a reason to refuse."""
    data = "  PERS robtarget pCam:=[[9000,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
    text = program(move("p1", "MoveJ") + move("pCam") + move("p2"), data)
    assert converted(text, "off").outputs == {}
    found = converted(text)
    assert statuses(found) == ["compensated", "run_time", "compensated"]
    (said,) = [d for d in found.diagnostics if d.code == "RUN009"]
    assert said.message == "what stands in the files for the targets of 1 motion statement cannot be run"
    fixed = text.replace("PERS robtarget", "CONST robtarget")
    assert converted(fixed).outputs == {}
    assert statuses(converted(fixed, "all")) == ["run_time"] * 3


def test_data_that_another_task_gives_its_value_is_not_known() -> None:
    text = program(move("p1", "MoveJ") + move("pCam") + move("p2"), "  PERS robtarget pCam;\n")
    other = f"MODULE Eye\n  PERS robtarget pCam:={target(200, 200)};\nENDMODULE\n"
    found = converted(text, read_only=other)
    assert statuses(found) == ["compensated", "run_time", "compensated"]
    assert (
        why(found)[1] == "the target is data that other tasks share: its value in the files is the one of the last run"
    )
    assert statuses(converted(text, "off", read_only=other))[1] == "compensated"


def test_the_scope_holds_for_the_function_too() -> None:
    text = program(
        move("p1", "MoveJ") + weld("p1", "ArcLStart") + weld("pSeen", "ArcLEnd") + move("Offs(pSeen,0,0,50)")
    )
    assert statuses(converted(text, scope="welds"))[2:] == ["run_time", "skipped"]


def test_the_same_program_gives_the_same_bytes() -> None:
    text = program(move("p1", "MoveJ") + move("pSeen"))
    once = converted(text)
    converted.cache_clear()
    again = converted(text)
    assert (once.outputs, once.module) == (again.outputs, again.module)
    assert np.isfinite(again.report["run_time"]["max_region_error_mm"])
