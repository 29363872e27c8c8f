"""A backup of two synchronised welding tasks whose targets a third task writes, and the command line around it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from postproc.compensation.text.marks import MODULE_MARKER
from postproc.diagnostics import PostprocError
from tests.cli.conftest import Call
from tests.runtime.build import NO_AXES, move, program, target
from tests.runtime.loading import Loaded, statements_through

FRAME = "[[0,0,0],[1,0,0,0]]"
SHARED = "  PERS targetdata Welds{n}{{40}};\n  PERS wobjdata wobjWeldLine{n};\n  PERS tooldata tWeld{n};\n"
RECORD = "  RECORD targetdata\n    robtarget position;\n    num cpm;\n  ENDRECORD\n"
WELDING = """MODULE Weld{n}
{record}{shared}  TASK PERS welddata wd1:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  TASK PERS seamdata sm1:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS tasks taskGroup{{2}}:=[["T_ROB1"],["T_ROB2"]];
  VAR syncident sync1;
  LOCAL VAR num nSteps:=4;
  VAR robtarget pTaught;
  PROC main()
    AccSet 30,30;
    weldTogether;
    weldAlone nSteps;
    Retract;
  ENDPROC

  PROC weldTogether() ! both arms, target by target
    MoveL RelTool(Welds{n}{{1}}.position,0,0,-10),v100,z5,tWeld{n}\\WObj:=wobjWeldLine{n};
    SyncMoveOn sync1,taskGroup;
    ArcLStart Welds{n}{{1}}.position\\ID:=10,v10,sm1,wd1,fine,tWeld{n}\\WObj:=wobjWeldLine{n};
    ArcL  Offs(Welds{n}{{2}}.position,-0.3,0,0) \\ID:=20, v10,sm1,wd1,z0,tWeld{n}\\WObj:=wobjWeldLine{n};
    ArcC Welds{n}{{3}}.position,Welds{n}{{4}}.position\\ID:=30,v10,sm1,wd1,z0,tWeld{n}\\WObj:=wobjWeldLine{n};
    ArcLEnd Welds{n}{{5}}.position\\ID:=40,v10,sm1,wd1,fine,tWeld{n}\\WObj:=wobjWeldLine{n};
    SyncMoveOff sync1;
  ENDPROC

  LOCAL PROC weldAlone(num nLast\\switch Fast)
    ArcLStart Welds{n}{{1}}.position,v10,sm1,wd1,fine,tWeld{n}\\WObj:=wobjWeldLine{n};
    FOR i FROM 2 TO nLast-1 DO
      IF Welds{n}{{i}}.cpm>0 ArcL Welds{n}{{i}}.position,v10,sm1,wd1,z1,tWeld{n}\\WObj:=wobjWeldLine{n};
    ENDFOR
    ArcLEnd Welds{n}{{nLast}}.position,v10,sm1,wd1,fine,tWeld{n}\\WObj:=wobjWeldLine{n};
  ENDPROC

  LOCAL PROC Retract()
    pTaught:=CRobT(\\Tool:=tWeld{n}\\WObj:=wobjWeldLine{n});
    MoveL Offs(pTaught,0,0,50),v100,fine,tWeld{n}\\WObj:=wobjWeldLine{n};
    MoveAbsJ [[0,0,0,0,30,0],{axes}],v100,fine,tWeld{n};
  ENDPROC
ENDMODULE
"""
ARM = ("--robot", "irb4600_60_205", "--run-time", "where-needed")
ARCS = {"arclstart": 2, "arcl": 2, "arcc": 1, "arclend": 2}


def backup(folder: Path) -> Path:
    """RAPID/TASK1 and TASK2 weld, TASK3 tells them where; each task has system modules of the same names."""
    for n in (1, 2):
        task = folder / "RAPID" / f"TASK{n}"
        (task / "PROGMOD").mkdir(parents=True)
        (task / "SYSMOD").mkdir()
        text = WELDING.format(n=n, record=RECORD, shared=SHARED.format(n=n), axes=NO_AXES)
        (task / "PROGMOD" / f"Weld{n}.mod").write_bytes(text.replace("\n", "\r\n").encode())
        (task / "SYSMOD" / "user.sys").write_text("MODULE user(SYSMODULE)\n  PERS num nShared:=1;\nENDMODULE\n")
    eye = folder / "RAPID" / "TASK3" / "PROGMOD"
    eye.mkdir(parents=True)
    tool = "[TRUE,[[0,0,350],[1,0,0,0]],[3,[0,0,120],[1,0,0,0],0,0,0]]"
    data = "".join(
        f"  PERS targetdata Welds{n}{{40}}:=[{','.join([f'[{target(0, 0, 0)},0]'] * 40)}];\n"
        f'  PERS wobjdata wobjWeldLine{n}:=[FALSE,TRUE,"",{FRAME},{FRAME}];\n  PERS tooldata tWeld{n}:={tool};\n'
        for n in (1, 2)
    )
    steps = "".join(f"    Welds{n}{{1}}.position:=pSeen;\n" for n in (1, 2))
    (eye / "Eye.mod").write_text(
        f"MODULE Eye\n{RECORD}{data}  VAR robtarget pSeen;\n  PROC main()\n{steps}  ENDPROC\nENDMODULE\n"
    )
    (folder / "SYSPAR").mkdir()
    return folder


def texts(task: Path) -> list[str]:
    return [p.read_text("latin-1") for p in sorted(task.rglob("*")) if p.suffix.lower() in (".mod", ".sys")]


def without_the_function(text: str) -> str:
    """A text with each call of the function as its first argument, by counting brackets, and no comments of postproc."""
    while (found := re.search(r"ppCorrected(Circ)?\(", text)) is not None:
        depth, first, at = 0, None, found.end()
        while depth >= 0:
            depth += text[at] in "([{"
            depth -= text[at] in ")]}"
            if depth == 0 and text[at] == "," and first is None:
                first = at
            at += 1
        text = text[: found.start()] + text[found.end() : first] + text[at:]
    lines = text.splitlines(keepends=True)
    begin = next(i for i, line in enumerate(lines) if "! postproc " in line)
    end = next(i for i, line in enumerate(lines) if "prevent compensating twice" in line)
    return "".join(lines[:begin] + lines[end + 1 :])


def test_every_arc_of_every_task_goes_through_the_function_and_nothing_else_changes(tmp_path: Path, call: Call) -> None:
    source, out = backup(tmp_path / "backup"), tmp_path / "out"
    done = call("batch", source, *ARM, "-o", out, "--workers", "1", "--json")
    document = json.loads(done.out)
    assert [(t["name"], t["status"]) for t in document["tasks"]] == [
        ("RAPID/TASK1", "compensated"), ("RAPID/TASK2", "compensated"), ("RAPID/TASK3", "unchanged"),
    ]  # fmt: skip
    for n, told in zip((1, 2), document["tasks"], strict=False):
        task = out / "RAPID" / f"TASK{n}"
        module = task / "SYSMOD" / "ppModel.sys"
        assert MODULE_MARKER in module.read_text()
        assert statements_through(texts(task)) == {"movel": 1, **ARCS}
        assert statements_through(texts(task), "ppcorrectedcirc") == {"arcc": 1}
        assert told["statements"] == {"compensated": 0, "run_time": 8, "unchanged": 1, "skipped": 1}
        before, after = (folder / "RAPID" / f"TASK{n}" / "PROGMOD" / f"Weld{n}.mod" for folder in (source, out))
        assert without_the_function(after.read_bytes().decode()) == before.read_bytes().decode()
        assert Loaded(texts(task)).faults() == Loaded(texts(source / "RAPID" / f"TASK{n}")).faults()
    names = {p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file() and ".postproc" not in p.parts}
    given = {p.relative_to(source).as_posix() for p in source.rglob("*") if p.is_file()}
    assert names - given == {"RAPID/TASK1/SYSMOD/ppModel.sys", "RAPID/TASK2/SYSMOD/ppModel.sys"}
    assert "on the controller" in done.err
    again = call("batch", source, *ARM, "-o", out, "--workers", "1", "--json")
    assert all(t["cached"] for t in json.loads(again.out)["tasks"])
    off = call("batch", source, "--robot", "irb4600_60_205", "-o", out, "--workers", "1", "--json")
    assert off.code == 1
    assert not list(out.rglob("ppModel.sys"))


def test_the_loader_sees_what_is_wrong() -> None:
    """The independent reader of these tests finds faults of each kind."""
    module = "MODULE ppModel\n  FUNC robtarget ppCorrected(robtarget p,PERS tooldata t\\switch Weld)\n    RETURN p;\n  ENDFUNC\nENDMODULE\n"
    head = "MODULE M\n  VAR tooldata tVar;\n  PERS tooldata tOk;\n  VAR robtarget p;\n  VAR num x;\n  PROC main()\n    {}\n  ENDPROC\nENDMODULE\n"
    wrong = {
        "MoveL ppCorrected(p,tVar),v5,fine,tVar;": "PERS data",
        "MoveL ppCorrected(x,tOk),v5,fine,tOk;": "is robtarget",
        "MoveL ppCorrected(p),v5,fine,tOk;": "lacks `t`",
        "MoveL ppCorrected(p,tOk\\Welds),v5,fine,tOk;": "no argument",
        "MoveL ppCorrectd(p,tOk),v5,fine,tOk;": "no function",
    }
    for statement, fault in wrong.items():
        assert fault in "".join(Loaded([head.format(statement), module]).faults()), statement
    assert Loaded([head.format("MoveL ppCorrected(p,tOk\\Weld),v5,fine,tOk;"), module]).faults() == []
    assert "given twice" in "".join(Loaded([module, module.replace("MODULE ppModel", "MODULE other")]).faults())


TEXT = program(move("p1", "MoveJ") + move("pSeen"))


def test_the_module_stands_beside_the_output(tmp_path: Path, call: Call) -> None:
    source, out = tmp_path / "line.mod", tmp_path / "out" / "line.mod"
    source.write_text(TEXT)
    done = call("compensate", source, *ARM, "-o", out)
    assert done.code == 0
    assert {p.name for p in out.parent.iterdir()} == {"line.mod", "ppModel.sys"}
    assert call("compensate", source, *ARM, "-o", out, "--check").code == 0
    (out.parent / "ppModel.sys").write_text(MODULE_MARKER)
    assert call("compensate", source, *ARM, "-o", out, "--check").code == 1
    named = tmp_path / "cell" / "ppLine.sys"
    assert call("compensate", source, *ARM, "-o", out, "--run-time-module", named).code == 0
    assert named.read_text().startswith("MODULE ppLine(SYSMODULE)")
    checked = call("runtime", "check", named, "--robot", "irb4600_60_205")
    assert checked.code == 0


def test_nothing_is_written_where_not_all_can_be(
    tmp_path: Path,
    call: Call,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = tmp_path / "line.mod"
    source.write_text(TEXT)
    out = call("compensate", source, *ARM)
    assert (out.code, "CLI007" in out.err) == (2, True)
    (tmp_path / "ppModel.sys").write_text("MODULE mine\nENDMODULE\n")
    taken = call("compensate", source, *ARM, "-o", tmp_path / "o.mod")
    assert (taken.code, "no module that postproc wrote" in taken.err) == (2, True)
    assert (tmp_path / "ppModel.sys").read_text() == "MODULE mine\nENDMODULE\n"
    (tmp_path / "ppModel.sys").unlink()
    same = call("compensate", source, *ARM, "-o", tmp_path / "o.mod", "--run-time-module", tmp_path / "o.mod")
    assert same.code == 2
    _failing(monkeypatch, lambda path: path is not None and path.name == "o.mod")
    failed = call("compensate", source, *ARM, "-o", tmp_path / "o.mod")
    assert failed.code != 0
    assert {p.name for p in tmp_path.iterdir()} == {"line.mod"}


def _failing(monkeypatch: pytest.MonkeyPatch, wrong: Callable[[Path | None], bool]) -> None:
    """Writing one of the files fails, as on a full disk."""
    from postproc.cli import output

    plain = output.write

    def write(path: Path | None, data: bytes | str) -> None:
        if wrong(path):
            raise PostprocError.of("CLI008", f"cannot write `{path}`", help="make space")
        plain(path, data)

    monkeypatch.setattr(output, "write", write)


def test_modules_of_a_folder_do_not_share_a_file(tmp_path: Path, call: Call) -> None:
    folder, out = tmp_path / "in", tmp_path / "out"
    folder.mkdir()
    for name in ("a", "b"):
        (folder / f"{name}.mod").write_text(TEXT)
    assert call("batch", folder, *ARM, "-o", out, "--workers", "1").code == 0
    assert {p.name for p in out.glob("*.sys")} == {"a_ppModel.sys", "b_ppModel.sys"}
    (folder / "a_ppModel.sys").write_text("MODULE mine\nENDMODULE\n")
    assert "BAT015" in call("batch", folder, *ARM, "-o", tmp_path / "other", "--workers", "1").err
