"""A backup of two synchronised welding tasks whose targets a third task writes goes through the function for run time."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from postproc.compensation.text.marks import MODULE_MARKER
from tests.batch.build import AXES, module, tree, write
from tests.cli.conftest import Call
from tests.runtime.build import target
from tests.runtime.loading import Loaded, statements_through

FRAME = "[[0,0,0],[1,0,0,0]]"
RECORD = "RECORD targetdata\n    robtarget position;\n    num cpm;\n  ENDRECORD\n"
WELDING = r"""MODULE Weld{n}
  {record}
  PERS targetdata Welds{n}{{40}};
  PERS wobjdata wobjWeldLine{n};
  PERS tooldata tWeld{n};
  TASK PERS welddata wd1:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  TASK PERS seamdata sm1:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS tasks taskGroup{{2}}:=[["T_ROB1"],["T_ROB2"]];
  VAR syncident sync1;
  LOCAL VAR num nSteps:=4;
  VAR robtarget pTaught;
  PROC main()
    MoveL RelTool(Welds{n}{{1}}.position,0,0,-10),v100,z5,tWeld{n}\WObj:=wobjWeldLine{n};
    SyncMoveOn sync1,taskGroup; ! both arms, target by target
    ArcLStart Welds{n}{{1}}.position\ID:=10,v10,sm1,wd1,fine,tWeld{n}\WObj:=wobjWeldLine{n};
    ArcL  Offs(Welds{n}{{2}}.position,-0.3,0,0) \ID:=20, v10,sm1,wd1,z0,tWeld{n}\WObj:=wobjWeldLine{n};
    ArcC Welds{n}{{3}}.position,Welds{n}{{4}}.position\ID:=30,v10,sm1,wd1,z0,tWeld{n}\WObj:=wobjWeldLine{n};
    ArcLEnd Welds{n}{{5}}.position\ID:=40,v10,sm1,wd1,fine,tWeld{n}\WObj:=wobjWeldLine{n};
    SyncMoveOff sync1;
    weldAlone nSteps;
    pTaught:=CRobT(\Tool:=tWeld{n}\WObj:=wobjWeldLine{n});
    MoveL Offs(pTaught,0,0,50),v100,fine,tWeld{n}\WObj:=wobjWeldLine{n};
    MoveAbsJ [[0,0,0,0,30,0],{axes}],v100,fine,tWeld{n};
  ENDPROC

  LOCAL PROC weldAlone(num nLast\switch Fast)
    ArcLStart Welds{n}{{1}}.position,v10,sm1,wd1,fine,tWeld{n}\WObj:=wobjWeldLine{n};
    FOR i FROM 2 TO nLast-1 DO
      IF Welds{n}{{i}}.cpm>0 ArcL Welds{n}{{i}}.position,v10,sm1,wd1,z1,tWeld{n}\WObj:=wobjWeldLine{n};
    ENDFOR
    ArcLEnd Welds{n}{{nLast}}.position,v10,sm1,wd1,fine,tWeld{n}\WObj:=wobjWeldLine{n};
  ENDPROC
ENDMODULE
"""
THROUGH = {"movel": 1, "arclstart": 2, "arcl": 2, "arcc": 1, "arclend": 2}


def backup(folder: Path) -> Path:
    """RAPID/TASK1 and TASK2 weld, TASK3 tells them where; each task has system modules of the same names."""
    tool = "[TRUE,[[0,0,350],[1,0,0,0]],[3,[0,0,120],[1,0,0,0],0,0,0]]"
    data, steps = RECORD + "  VAR robtarget pSeen;\n", []
    for n in (1, 2):
        text = WELDING.format(n=n, record=RECORD, axes=AXES).replace("\n", "\r\n")
        user = module("user(SYSMODULE)", "PERS num nShared:=1;")
        write(folder / f"RAPID/TASK{n}", {f"PROGMOD/Weld{n}.mod": text, "SYSMOD/user.sys": user})
        data += f"  PERS targetdata Welds{n}{{40}}:=[{','.join([f'[{target(0, 0)},0]'] * 40)}];\n"
        data += (
            f'  PERS wobjdata wobjWeldLine{n}:=[FALSE,TRUE,"",{FRAME},{FRAME}];\n  PERS tooldata tWeld{n}:={tool};\n'
        )
        steps.append(f"Welds{n}{{1}}.position:=pSeen;")
    return write(folder, {"RAPID/TASK3/PROGMOD/Eye.mod": module("Eye", data, *steps)})


def texts(task: Path) -> list[str]:
    return [p.read_text("latin-1") for p in sorted(task.rglob("*")) if p.suffix.lower() in (".mod", ".sys")]


def without_the_function(text: str) -> str:
    """A text with each call of the function as its first argument, by counting brackets, and no comments of postproc."""
    while (call := re.search(r"ppCorrected(Circ)?\(", text)) is not None:
        depth, first, at = 0, None, call.end()
        while depth >= 0:
            depth += (text[at] in "([{") - (text[at] in ")]}")
            if depth == 0 and text[at] == "," and first is None:
                first = at
            at += 1
        text = text[: call.start()] + text[call.end() : first] + text[at:]
    lines = text.splitlines(keepends=True)
    begin = next(i for i, line in enumerate(lines) if "! postproc " in line)
    end = next(i for i, line in enumerate(lines) if "prevent compensating twice" in line)
    return "".join(lines[:begin] + lines[end + 1 :])


def test_every_arc_of_every_task_goes_through_the_function_and_nothing_else_changes(tmp_path: Path, call: Call) -> None:
    source, out = backup(tmp_path / "backup"), tmp_path / "out"
    words = ("batch", source, "-o", out, "--workers", "1", "--json")
    done = call(*words, "--run-time", "where-needed")
    assert "on the controller" in done.err
    tasks = json.loads(done.out)["tasks"]
    statuses = {"RAPID/TASK1": "compensated", "RAPID/TASK2": "compensated", "RAPID/TASK3": "unchanged"}
    assert {task["name"]: task["status"] for task in tasks} == statuses
    for n in (1, 2):
        task = out / f"RAPID/TASK{n}"
        assert MODULE_MARKER in (task / "SYSMOD/ppModel.sys").read_text()
        assert statements_through(texts(task)) == THROUGH
        assert statements_through(texts(task), "ppcorrectedcirc") == {"arcc": 1}
        assert tasks[n - 1]["statements"] == {"compensated": 0, "run_time": 8, "unchanged": 1, "skipped": 1}
        before, after = (folder / f"RAPID/TASK{n}/PROGMOD/Weld{n}.mod" for folder in (source, out))
        assert without_the_function(after.read_bytes().decode()) == before.read_bytes().decode()
        assert Loaded(texts(task)).faults() == Loaded(texts(source / f"RAPID/TASK{n}")).faults()
    added = {name for name in tree(out) if not name.startswith(".postproc")} - tree(source).keys()
    assert added == {f"RAPID/TASK{n}/SYSMOD/ppModel.sys" for n in (1, 2)}
    again = call(*words, "--run-time", "where-needed")
    assert all(task["cached"] for task in json.loads(again.out)["tasks"])
    assert call(*words).code == 1 and not list(out.rglob("ppModel.sys"))


@pytest.mark.parametrize(
    ("statement", "fault"),
    [
        ("MoveL ppCorrected(p,tVar),v5,fine,tVar;", "PERS data"),
        ("MoveL ppCorrected(x,tOk),v5,fine,tOk;", "is robtarget"),
        ("MoveL ppCorrected(p),v5,fine,tOk;", "lacks `t`"),
        (r"MoveL ppCorrected(p,tOk\Welds),v5,fine,tOk;", "no argument"),
        ("MoveL ppCorrectd(p,tOk),v5,fine,tOk;", "no function"),
        (r"MoveL ppCorrected(p,tOk\Weld),v5,fine,tOk;", ""),
    ],
)
def test_the_loader_sees_what_is_wrong(statement: str, fault: str) -> None:
    """The independent reader of these tests finds faults of each kind."""
    function = "FUNC robtarget ppCorrected(robtarget p,PERS tooldata t\\switch Weld)\n    RETURN p;\n  ENDFUNC"
    data = "VAR tooldata tVar;\n  PERS tooldata tOk;\n  VAR robtarget p;\n  VAR num x;"
    loaded = [module("M", data, statement), module("ppModel", function)]
    faults = "".join(Loaded(loaded).faults())
    assert fault in faults and bool(fault) == bool(faults)
    assert "given twice" in "".join(Loaded([*loaded, module("other", function)]).faults())
