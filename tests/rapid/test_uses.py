"""Where declared data is used."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.rapid.program.references import OTHER_USE, Use, declaration_uses
from tests.rapid.build import program, target


def uses_of(text: str) -> Mapping[str, tuple[Use, ...]]:
    return declaration_uses(program(text))


def test_every_kind_of_use() -> None:
    text = f"""MODULE M
CONST robtarget p:={target(1, 2, 3)};
PERS robtarget found:={target(1, 2, 3)};
CONST robtarget near:=p;
CONST robtarget row{{2}}:=[p,{target(4, 5, 6)}];
PERS wobjdata w:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
VAR num n;
PROC main()
  MoveL p,v5,z0,tool0\\WObj:=w;   ! p in a comment
  MoveC Offs(p,n,0,0),row{{n}},v5,z0,tool0;
  go p;
  n:=p.trans.x;
  TPWrite "p" \\Num:=n;
  SearchL di1,found,p,v5,tool0;
  IF Distance(p.trans,found.trans)>n THEN Stop; ENDIF
ENDPROC
PROC go(robtarget w)
  MoveL w,v5,z0,tool0;
ENDPROC
ENDMODULE
"""
    uses = uses_of(text)
    lines = {None: 0} | {s.key: s.line for s in program(text).statements}
    shown = [(lines[u.statement], u.displaced, u.parameter) for u in uses["m..p"]]
    assert shown == [
        (0, False, ""), (0, False, ""), (9, False, ""), (10, True, ""), (0, False, "m.go.%w"), (0, False, ""),
        (14, False, ""), (0, False, ""),
    ]  # fmt: skip
    assert not {"m..w", "m..n"} & uses.keys()  # they hold no target
    assert uses["m..found"] == (OTHER_USE, OTHER_USE)
    assert [(lines[u.statement], u.displaced) for u in uses["m..row"]] == [(10, False)]
    assert [lines[u.statement] for u in uses["m.go.%w"]] == [18]


def test_the_length_of_an_array_is_not_a_use_of_its_data() -> None:
    text = f"""MODULE M
CONST robtarget row{{2}}:=[{target(1, 2, 3)},{target(4, 5, 6)}];
PROC main()
  FOR i FROM 1 TO Dim (row, 1) DO
    MoveL row{{i}},v5,z0,tool0;
  ENDFOR
  TPWrite "Dim(" \\Num:=row{{1}}.trans.x;
ENDPROC
ENDMODULE
"""
    assert [u.statement is None for u in uses_of(text)["m..row"]] == [False, True]


def test_what_is_read_by_its_name_in_a_text_is_used() -> None:
    text = f"""MODULE M
PERS robtarget p1:={target(1, 2, 3)};
PERS robtarget q1:={target(1, 2, 3)};
PERS num p2:=0;
PROC main()
  VAR robtarget r;
  GetDataVal "p"+ValToStr(n),r;
ENDPROC
ENDMODULE
"""
    uses = uses_of(text)
    assert uses["m..p1"] == (OTHER_USE,)
    assert "m..q1" not in uses and "m..p2" not in uses
