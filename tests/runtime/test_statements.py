"""Statements with the function around their targets: all else stays byte for byte."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.rapid.program.program import Program, read_program
from postproc.rapid.syntax.edits import edited
from postproc.runtime.programs.statements import LeftAlone, run_time_edits
from postproc.runtime.written import write_module
from tests.independent import arm as A
from tests.runtime.arms import CENTER, TOOL, springs
from tests.worlds.parser import parse

FRAME = "[[0,0,0],[1,0,0,0]]"
HEAD = f"""
    PERS tooldata tWeld1:=[TRUE,{FRAME},[1,[0,0,10],[1,0,0,0],0,0,0]];
    TASK PERS wobjdata wobjWeldLine1:=[FALSE,TRUE,"",{FRAME},{FRAME}];
"""


def read(statement: str) -> Program:
    text = f"MODULE m\r\n{HEAD}\r\n  PROC main()\r\n    {statement} ! kept\r\n  ENDPROC\r\nENDMODULE"
    return read_program(Source("m.mod", text.encode("latin-1")))


def corrected(statement: str) -> str:
    program = read(statement)
    (motion,) = program.statements
    data = motion.source.data
    text = b"".join(edited(data, run_time_edits(motion))).decode("latin-1")
    before, after = data.decode("latin-1").split(statement)
    assert text.startswith(before)
    assert text.endswith(after)
    parse(text)
    return text[len(before) : len(text) - len(after)]


@pytest.mark.parametrize(
    ("statement", "wanted"),
    [
        (
            "ArcL Welds1{2}.position,v100,seam1,wd{i}\\Weave:=wv, z1 , tWeld1\\WObj:=wobjWeldLine1\\Track:=trk;",
            "ArcL ppCorrected(Welds1{2}.position,tWeld1\\WObj:=wobjWeldLine1\\Weld),"
            "v100,seam1,wd{i}\\Weave:=wv, z1 , tWeld1\\WObj:=wobjWeldLine1\\Track:=trk;",
        ),
        (
            "ArcLStart Welds1{1}.position,v100,seam1,wd1,fine,tWeld1\\WObj:=wobjWeldLine1;",
            "ArcLStart ppCorrected(Welds1{1}.position,tWeld1\\WObj:=wobjWeldLine1\\Weld),"
            "v100,seam1,wd1,fine,tWeld1\\WObj:=wobjWeldLine1;",
        ),
        (
            "movel  Offs(pPallet{nRow,nCol},0,0,h) ,v50,fine,tWeld1;",
            "movel  ppCorrected(Offs(pPallet{nRow,nCol},0,0,h),tWeld1) ,v50,fine,tWeld1;",
        ),
        (
            "MoveJ pIn,v50,z10,Tool\\WObj?WObj\\TLoad:=lBoth;",
            "MoveJ ppCorrected(pIn,Tool\\WObj?WObj\\TLoad:=lBoth),v50,z10,Tool\\WObj?WObj\\TLoad:=lBoth;",
        ),
        (
            "ArcC Welds1{3}.position,Offs(Welds1{4}.position,0,0,1),v10,sm,wd,z1,tWeld1\\WObj:=wobjWeldLine1;",
            "ArcC ppCorrectedCirc(Welds1{3}.position,Offs(Welds1{4}.position,0,0,1),tWeld1\\WObj:=wobjWeldLine1\\Weld),"
            "ppCorrected(Offs(Welds1{4}.position,0,0,1),tWeld1\\WObj:=wobjWeldLine1\\Weld),"
            "v10,sm,wd,z1,tWeld1\\WObj:=wobjWeldLine1;",
        ),
        ("MoveL FromSocket(),v50,fine,tWeld1;", "MoveL ppCorrected(FromSocket(),tWeld1),v50,fine,tWeld1;"),
        ("MoveL p\\ID:=10,v50,fine,tWeld1;", "MoveL ppCorrected(p,tWeld1)\\ID:=10,v50,fine,tWeld1;"),
    ],
)
def test_the_target_goes_through_the_function(statement: str, wanted: str) -> None:
    assert corrected(statement) == wanted
    assert corrected(wanted) == wanted


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("MoveAbsJ jHome,v50,fine,tWeld1;", "not a place in a work object"),
        ("SearchL\\Stop,diFound,pFound,pTo,v10,tWeld1;", "known only at run time"),
        ("MoveL Offs(CRobT(\\Tool:=tWeld1),0,0,10),v50,fine,tWeld1;", "where the arm stands"),
        ("MoveL *,v50,fine,tWeld1;", "without a name"),
        ("MoveL p,v50,fine,[TRUE,t.tframe,t.tload];", "no name of data"),
        ("MoveC pVia,Next(),v50,fine,tWeld1;", "worked out twice"),
        ("EGMMoveL id,p,v50,fine,tWeld1;", "sensor"),
    ],
)
def test_what_must_not_be_corrected_stays(statement: str, reason: str) -> None:
    (motion,) = read(statement).statements
    with pytest.raises(LeftAlone, match=reason):
        run_time_edits(motion)


SEAMS = """MODULE Welding
    RECORD torch
        robtarget position;
        num speed;
    ENDRECORD
    PERS torch Welds1{3};
    VAR robtarget pPallet;
    CONST num nPitch:=40;
    PROC weldAll()
        VAR num i;
        ArcLStart Welds1{1}.position,v100,seam1,wd1,fine,tUsed\\WObj:=wUsed;
        ArcL Welds1{2}.position,v100,seam1,wd1,z1,tUsed\\WObj:=wUsed;
        ArcLEnd Welds1{3}.position,v100,seam1,wd1,fine,tUsed\\WObj:=wUsed;
        FOR i FROM 0 TO 2 DO
            MoveL Offs(pPallet,i*nPitch,0,0),v100,fine,tUsed\\WObj:=wUsed;
        ENDFOR
    ENDPROC
ENDMODULE
"""


def test_a_program_whose_targets_another_task_writes_runs_with_the_module() -> None:
    """The real TCP comes to each goal of the original; the motions are the same ones, in the same order."""
    program = read_program(Source("w.mod", SEAMS.encode()))
    edits = [edit for motion in program.statements for edit in run_time_edits(motion)]
    text = b"".join(edited(SEAMS.encode(), edits)).decode()
    assert text.count("ppCorrected(") == 4
    assert text.replace("\\WObj:=wUsed\\Weld)", ")").count("tUsed") == SEAMS.count("tUsed") + 4
    real = springs()
    module = write_module(real.model, real.conditions()).text.decode()
    poses = [[20.0, 30, -20, 40, 60, 10], [22.0, 31, -20, 40, 60, 10], [24.0, 32, -20, 40, 60, 10]]
    went = []
    for source in (SEAMS, text):
        task = real.controller((module + source).encode())
        for i, q in enumerate(np.radians(poses)):
            target = task.target(q, TOOL)
            task.get("Welds1")[i][0][:] = target
            task.set("pPallet", target)
        task.run("weldAll")
        went.append([e for e in task.task.events if e.motion])
    before, after = went
    assert [e.name for e in before] == [e.name for e in after]
    assert len(before) == 6
    load = A.Load(real.mass, CENTER)
    for a, b in zip(before, after, strict=True):
        flange = b.values["goal"].copy()
        flange[:3, 3] *= 1e-3
        commanded = task.kinematics.solved(flange @ np.linalg.inv(TOOL), b.values["conf"])
        assert np.linalg.norm(1e3 * real.place(commanded, load)[:3, 3] - a.values["goal"][:3, 3]) < 0.005
        assert np.linalg.norm(b.values["goal"][:3, 3] - a.values["goal"][:3, 3]) > 0.05
