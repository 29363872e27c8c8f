"""Which text is changed: numbers in place, an inline target, or nothing, with the reason; through the whole conversion."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.build import (
    convert,
    events,
    independent,
    lines_of,
    module,
    places,
    target,
    written,
)

A, B, C = target(1350, -500), target(1350, -380), target(1270, -380, 760)


def test_numbers_keep_the_format_of_their_neighbours() -> None:
    """More decimals than needed are kept, fewer are extended to three, no blank moves."""
    text = module(
        "CONST robtarget p1 := [ [1350.00,-5.0E2 , 700.123450],[0.300294,-0.01573800,0.95241,0.049914], "
        "[-1,0,-1,0],[9E+09,9E+09,9E9,9E9,9E9,9E9] ]; ! seam start",
        f"MoveJ p1,v200,fine,tT;\nMoveL {B},v50,fine,tT;",
    )
    line = next(x for x in lines_of(written(convert(text))) if "p1 :=" in x)
    assert re.fullmatch(
        r"CONST robtarget p1 := \[ \[\d+\.\d{3},-\d+\.\d{1,3} , \d+\.\d{6}\],\[0\.3\d{0,6},-0\.01\d{6},0\.95\d{1,5},0\.05\d{0,5}\], "
        r"\[-1,0,-1,0\],\[9E\+09,9E\+09,9E9,9E9,9E9,9E9\] \]; ! seam start",
        line,
    ), line


@pytest.mark.parametrize("newline", ["\r\n", "\n"])
def test_bytes_that_need_no_change_are_kept(newline: str) -> None:
    text = module(
        f'CONST robtarget p1:={A}; ! Blechstärke\t5 mm\nVAR string s:="Naht für Ä";\nCONST robtarget p2:={B};',
        'TPWrite "größer \\ als";\nMoveJ p1,v200,fine,tT;\nMoveL   p2 ,v50,fine,tT ;  ! blanks   kept',
    ).replace("\n", newline)
    out = convert(text).output
    assert out is not None
    assert out.count(b"\n") - text.count("\n") == sum(x.startswith("! ") for x in lines_of(out.decode("latin-1")))
    assert (b"\r" in out) == (newline == "\r\n")
    assert out.count(b"\r\n") == (out.count(b"\n") if newline == "\r\n" else 0)
    kept = [x for x in text.encode("latin-1").splitlines(keepends=True) if b"robtarget" not in x]
    rest = [x for x in out.splitlines(keepends=True) if b"robtarget" not in x and not x.lstrip().startswith(b"! ")]
    assert rest == kept


def test_blanks_between_a_sign_and_its_digits() -> None:
    there = target(1300, -500).replace("-500", "- 500").replace("1300", "--1300").replace("-0.015738", "-\n  0.015738")
    found = convert(module("", f"MoveJ {there},v200,fine,tT;\nMoveL {target(1350, -300)},v50,fine,tT;"))
    plain = convert(module("", f"MoveJ {target(1300, -500)},v200,fine,tT;\nMoveL {target(1350, -300)},v50,fine,tT;"))
    assert places(written(found)) == places(written(plain))


TUNED = f"""  CONST robtarget first:={target(1250, -600)};
  CONST robtarget last:={target(1250, -20)};
  PERS num side:=2;
  PERS pos by:=[0,1,0.5];
  PERS num turned:=1;
"""


@pytest.mark.parametrize(
    ("displaced", "name"),
    [
        ("Offs(last,0,side,0)", "side"),
        ("Offs(last,by.x,by.y,by.z+1)", "by"),
        ("Offs(RelTool(last,0,0,-3\\Rz:=2),0,side,0)", "side"),
        ("RelTool(Offs(last,0,side,0),0,0,-3)", "side"),
        ("RelTool(last,0,turned,-3\\Rx:=2)", "turned"),
    ],
)
def test_what_an_operator_sets_goes_on_to_displace(displaced: str, name: str) -> None:
    """Numbers in its place would take the PERS data's effect away; targets that are added move along."""
    moves = f"MoveJ {C},v200,fine,tT;\nMoveL {displaced.replace('last', 'first')},v50,fine,tT;\nMoveL {displaced},v50,fine,tT;"
    found = convert(module(TUNED, moves))
    text = written(found)
    assert independent(module(TUNED, moves), found).violations == []
    assert found.report["added_targets"] > 0

    def reset(of: str) -> str:
        return (
            of.replace("side:=2;", "side:=9;")
            .replace("by:=[0,1,0.5];", "by:=[3,-4,5];")
            .replace("turned:=1;", "turned:=4;")
        )

    before, after = (events(of)[1:] for of in (text, reset(text)))
    plain = [events(of)[-1].target for of in (module(TUNED, moves), reset(module(TUNED, moves)))]
    wanted = np.subtract(plain[1].trans, plain[0].trans)
    moved = np.array([np.subtract(b.target.trans, a.target.trans) for a, b in zip(before, after, strict=True)])
    shares = moved @ wanted / (wanted @ wanted)  # on the way to the first target the displacement grows
    assert moved == pytest.approx(np.outer(shares, wanted), abs=0.01)
    begun = 1 + next(i for i, share in enumerate(shares) if share > 0.999)
    assert (np.diff(shares[:begun]) > 0.1).all() and shares[begun:] == pytest.approx(1.0, abs=0.002)
