"""What a search of SmarTac has found holds the error of the arm: what follows it is left, and nobody advises otherwise."""

from __future__ import annotations

import pytest

from tests.compensation.build import convert, module, target, written

DATA = f"""PERS pose peN1:=[[0,0,0],[1,0,0,0]];
    PERS pose peN2:=[[1,2,3],[1,0,0,0]];
    PERS bool bThere:=TRUE;
    VAR robtarget pStop;
    CONST robtarget s1:={target(50, 0, 800)};
    CONST robtarget s2:={target(50, 0)};
    CONST robtarget p1:={target(0, 0)};
    CONST robtarget p2:={target(120, 0)};"""
SEAM = r"""ArcLStart p1,v100,sm,wd,fine,tT\WObj:=wT;
    ArcLEnd p2,v100,sm,wd,fine,tT\WObj:=wT;"""
FIND = r"Search_1D peN1,s1,s2,v200,tT\WObj:=wT;"
HANGS = {
    "displacement": f"{FIND} PDispSet peN1; {SEAM}",
    "with options": rf"Search_1D\NotOff,peN1\SearchStop:=pStop,s1,s2,v200,tT\WObj:=wT\PrePDisp:=peN2; PDispSet peN1; {SEAM}",
    "groove": rf"Search_Groove peN1,s1,s2,10,5,v200,tT\WObj:=wT; PDispSet peN1; {SEAM}",
    "added displacement": f"{FIND} PDispSet peN2; PDispAdd peN1; {SEAM}",
    "through data": f"{FIND} peN2:=peN1; PDispSet peN2; {SEAM}",
    "work object": f"{FIND} wT.oframe:=peN1; {SEAM}",
    "number": f"{FIND} "
    + SEAM.replace("p1,", "Offs(p1,0,0,peN1.trans.z),").replace("p2,", "Offs(p2,0,0,peN1.trans.z),"),
    "place": rf"Search_1D peN2\SearchStop:=pStop,s1,s2,v200,tT\WObj:=wT; {SEAM.replace('p1,', 'pStop,').replace('p2,', 'Offs(pStop,100,0,0),')}",
}


@pytest.mark.parametrize("body", HANGS.values(), ids=HANGS)
def test_what_hangs_on_a_search_is_left_with_that_reason(body: str) -> None:
    done = convert(module(DATA, rf"MoveJ s1,v500,fine,tT\WObj:=wT; MoveJ p1,v500,fine,tT\WObj:=wT;{body} PDispOff;"))
    welds = [o for o in done.outcomes if o.statement.instruction.startswith("Arc")]
    assert [o.status for o in welds] == ["skipped"] * 2
    assert all("is found by a search" in (o.reason or "") for o in welds)
    (search,) = [o for o in done.outcomes if o.statement.signature.results]
    assert (search.status, search.reason) == ("skipped", "where a search stops is known only at run time")
    assert not any("--taught p" in d.help for d in done.diagnostics)


def test_the_targets_of_a_search_stay_where_they_are() -> None:
    """The motion before it has the same target: a displacement is found between places that stay."""
    done = convert(module(DATA, rf"MoveJ s1,v500,fine,tT\WObj:=wT; {FIND} MoveJ s1,v500,fine,tT\WObj:=wT;"))
    assert FIND in written(done)
    assert "CONST robtarget s1:=" + target(50, 0, 800) in written(done)


def test_whether_there_is_a_part_decides_nothing_before_the_program_runs() -> None:
    body = rf"""MoveJ s1,v500,fine,tT\WObj:=wT;
    Search_Part bThere,s1,s2,v200,tT\WObj:=wT;
    IF bThere THEN
    {SEAM}
    ENDIF"""
    done = convert(module(DATA, body))
    welds = [o for o in done.outcomes if o.statement.instruction.startswith("Arc")]
    assert [o.status for o in welds] == ["compensated"] * 2


@pytest.mark.parametrize(("more", "place"), [("PDispAdd peN2;", (2, 4, 6)), ("PDispOff; PDispAdd peN2;", (1, 2, 3))])
def test_displacements_add_up(more: str, place: tuple[int, int, int]) -> None:
    """Without a turn; the displaced path is what counts, so its correction is that of the same path without."""
    x, y, z = place
    displaced = convert(
        module(DATA, rf"PDispSet peN2; {more} MoveL p1,v100,fine,tT\WObj:=wT; MoveL p2,v100,fine,tT\WObj:=wT;")
    )
    plain = DATA.replace(target(0, 0), target(x, y, 700 + z)).replace(target(120, 0), target(120 + x, y, 700 + z))
    alone = convert(module(plain, r"MoveL p1,v100,fine,tT\WObj:=wT; MoveL p2,v100,fine,tT\WObj:=wT;"))
    assert [o.status for o in displaced.outcomes] == ["compensated"] * 2
    assert [o.shift_mm for o in displaced.outcomes] == pytest.approx([o.shift_mm for o in alone.outcomes], abs=1e-3)


def test_a_turned_displacement_that_is_added_is_not_known() -> None:
    turned = DATA.replace("peN2:=[[1,2,3],[1,0,0,0]]", "peN2:=[[1,2,3],[0,0,0,1]]")
    done = convert(module(turned, rf"MoveJ s1,v100,fine,tT\WObj:=wT; PDispAdd peN2; {SEAM}"))
    assert "PDispAdd" in (done.outcomes[1].reason or "")
