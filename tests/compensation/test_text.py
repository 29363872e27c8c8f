"""Which text is changed, and how: numbers keep their format, bytes stay, displacements of an operator go on to displace."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.build import convert, events, independent, lines_of, places, written
from tests.compensation.build import small

TWO_LINES = "MoveJ p1,v200,fine,tT; MoveL @{1350,-380},v50,fine,tT;"


def test_numbers_keep_the_format_of_their_neighbours() -> None:
    """More decimals than needed are kept, fewer are extended to three, no blank moves."""
    declared = (
        "CONST robtarget p1 := [ [1350.00,-5.0E2 , 700.123450],[0.300294,-0.01573800,0.95241,0.049914], "
        "[-1,0,-1,0],[9E+09,9E+09,9E9,9E9,9E9,9E9] ]; ! seam start"
    )
    line = next(x for x in lines_of(written(convert(small(TWO_LINES, data=declared)))) if "p1 :=" in x)
    assert re.fullmatch(
        r"CONST robtarget p1 := \[ \[\d+\.\d{3},-\d+\.\d{1,3} , \d+\.\d{6}\],\[0\.3\d{0,6},-0\.01\d{6},0\.95\d{1,5},0\.05\d{0,5}\], "
        r"\[-1,0,-1,0\],\[9E\+09,9E\+09,9E9,9E9,9E9,9E9\] \]; ! seam start",
        line,
    ), line


@pytest.mark.parametrize("newline", ["\r\n", "\n"])
def test_bytes_that_need_no_change_are_kept(newline: str) -> None:
    text = small(
        'TPWrite "größer \\ als"; MoveJ p1,v200,fine,tT; MoveL   p2 ,v50,fine,tT ;  ! blanks   kept',
        "p1 1350 -500, p2 1350 -380",
        'VAR string s:="Naht für Ä"; ! Blechstärke\t5 mm',
    ).replace("\n", newline)
    out = convert(text).output
    assert out is not None
    assert out.count(b"\n") - text.count("\n") == sum(x.startswith("! ") for x in lines_of(out.decode("latin-1")))
    assert out.count(b"\r") == out.count(b"\r\n") == (out.count(b"\n") if newline == "\r\n" else 0)
    before, after = ([x for x in of.splitlines(True) if b"robtarget" not in x] for of in (text.encode("latin-1"), out))
    assert [x for x in after if not x.lstrip().startswith(b"! ")] == before


def test_blanks_between_a_sign_and_its_digits() -> None:
    plain = small("MoveJ @{1300,-500},v200,fine,tT; MoveL @{1350,-300},v50,fine,tT;")
    blank = plain.replace("[1300,-500,", "[--1300,- 500,").replace("-0.015738", "-\n  0.015738", 1)
    assert blank != plain
    assert places(written(convert(blank))) == places(written(convert(plain)))


@pytest.mark.parametrize(
    "displaced",
    [
        "Offs(last,0,side,0)",
        "Offs(last,by.x,by.y,by.z+1)",
        "Offs(RelTool(last,0,0,-3\\Rz:=2),0,side,0)",
        "RelTool(Offs(last,0,side,0),0,0,-3)",
        "RelTool(last,0,turned,-3\\Rx:=2)",
    ],
)
def test_what_an_operator_sets_goes_on_to_displace(displaced: str) -> None:
    """Numbers in its place would take the PERS data's effect away; targets that are added move along."""
    text = small(
        f"MoveJ @{{1270,-380,760}},v200,fine,tT; MoveL {displaced.replace('last', 'first')},v50,fine,tT;"
        f"MoveL {displaced},v50,fine,tT;",
        "first 1250 -600, last 1250 -20",
        "PERS num side:=2; PERS pos by:=[0,1,0.5]; PERS num turned:=1;",
    )
    conversion = convert(text)
    assert independent(text, conversion).violations == []
    assert conversion.report["added_targets"] > 0

    def targets(of: str, *values: str) -> np.ndarray:
        """Places after the first, with these values of the data."""
        for old, new in zip(("side:=2;", "by:=[0,1,0.5];", "turned:=1;"), values, strict=False):
            of = of.replace(old, old.split("=")[0] + "=" + new + ";")
        return np.array([e.target.trans for e in events(of)[1:]])  # type: ignore[union-attr]

    reset = ("9", "[3,-4,5]", "4")
    wanted = targets(text, *reset)[-1] - targets(text)[-1]
    moved = targets(written(conversion), *reset) - targets(written(conversion))
    shares = moved @ wanted / (wanted @ wanted)  # on the way to the first target the displacement grows
    assert moved == pytest.approx(np.outer(shares, wanted), abs=0.01)
    begun = 1 + int(np.argmax(shares > 0.999))
    assert (np.diff(shares[:begun]) > 0.1).all() and shares[begun:] == pytest.approx(1.0, abs=0.002)
