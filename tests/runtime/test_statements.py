"""Statements with the function around their targets: all else stays byte for byte."""

from __future__ import annotations

import pytest

from postproc.diagnostics import Source
from postproc.rapid.program.program import Program, read_program
from postproc.rapid.syntax.spans import edited
from postproc.runtime.programs.statements import run_time_edits
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
    text = b"".join(edited(data, run_time_edits(motion) or ())).decode("latin-1")
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
    "statement",
    [
        "MoveAbsJ jHome,v50,fine,tWeld1;",
        "SearchL\\Stop,diFound,pFound,pTo,v10,tWeld1;",
        "MoveL Offs(CRobT(\\Tool:=tWeld1),0,0,10),v50,fine,tWeld1;",
        "MoveL *,v50,fine,tWeld1;",
        "MoveL p,v50,fine,[TRUE,t.tframe,t.tload];",
        "MoveC pVia,Next(),v50,fine,tWeld1;",
        "EGMMoveL id,p,v50,fine,tWeld1;",
    ],
)
def test_what_must_not_be_corrected_stays(statement: str) -> None:
    (motion,) = read(statement).statements
    assert run_time_edits(motion) is None
