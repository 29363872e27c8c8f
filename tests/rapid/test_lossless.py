"""Whatever is read is written back byte for byte, and nothing makes the reader fail."""

from __future__ import annotations

import importlib
import pkgutil
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from postproc import rapid
from postproc.diagnostics import Source
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.program.program import read_program
from postproc.rapid.program.signatures import SIGNATURES
from postproc.rapid.syntax.edits import Edit, edited
from postproc.rapid.syntax.spans import literal
from postproc.rapid.syntax.tokens import tokenize
from tests.rapid.build import module, target

PIECES = [
    b"MODULE M", b"ENDMODULE", b"PROC main()", b"ENDPROC", b"FUNC num f(num a\\switch b|switch c)", b"ENDFUNC",
    b"TRAP t", b"ENDTRAP", b"IF a=1 THEN", b"IF a=1 ", b"ELSEIF b THEN", b"ELSE", b"ENDIF", b"FOR i FROM 1 TO 3 DO",
    b"ENDFOR", b"WHILE TRUE DO", b"WHILE n<3 DO", b"ENDWHILE", b"TEST n", b"CASE 1,2:", b"DEFAULT:", b"ENDTEST",
    b"RECORD r", b"ENDRECORD", b"num x;", b"ALIAS num y;", b"VAR num n:=1;", b"PERS num m{2,2}:=[[1,2],[3,4]];",
    b"LOCAL CONST robtarget p:=" + target(1, 2, 3).encode() + b";", b"MoveL p,v100,z10,tool0\\WObj:=wobj0;",
    b"MoveC p,Offs(p,1,n,m{1,2}),v100\\V:=3,fine,tool0;", b"MoveAbsJ *,v1,z0,tool0;", b"SearchL di,p,p,v1,tool0;",
    b"ArcL\\On,p,v1,s,w\\Weave:=e,z1,t;", b"p.trans.x:=n;", b"n:=n+1;", b"Incr n;", b"main;", b'%"main"%;', b"<SMT>",
    b"RETURN n;", b"GOTO l;", b"l:", b"RAISE;", b"ERROR", b"UNDO", b"GripLoad load0;", b"PDispSet [[1,2,3],[1,0,0,0]];",
    b"! comment", b'"text', b'"a;!"', b"\r\n", b"\n", b" ", b"\t", b"\xe9\xff\x80", b"\xef\xbb\xbf", b"\xe3\x80\x80",
    b"%%%", b"[[[", b"]]", b"((", b"{", b"}", b"\\", b":=", b";", b",", b"\x00", b"0x1F", b"9E9", b"1E999", b".5", b"-",
]  # fmt: skip
texts = st.lists(st.one_of(st.sampled_from(PIECES), st.binary(max_size=6)), max_size=60).map(b" ".join)
lines = st.lists(st.sampled_from(PIECES), max_size=60).map(b"\n".join)


@given(st.one_of(st.binary(max_size=400), texts, lines))
@settings(max_examples=400, deadline=None)
def test_tokens_join_to_the_input(data: bytes) -> None:
    assert b"".join(data[start:end] for _, (start, end) in tokenize(data)) == data


@given(st.one_of(texts, lines, st.binary(max_size=200)))
@settings(max_examples=400, deadline=None)
def test_reading_and_walking_never_fail_and_account_for_every_motion(data: bytes) -> None:
    found = read_program(Source("fuzz.mod", b"MODULE M\nPROC main()\n" + data))
    result = walk_program(found)
    assert {s.span for s in found.statements} == {e.statement.span for e in result.events}
    for diagnostic in (*found.diagnostics, *result.diagnostics):
        assert diagnostic.render()
        if diagnostic.span is not None:
            assert 0 <= diagnostic.span[0] <= diagnostic.span[1] <= len(found.sources[0].data)
    for statement in found.statements:
        text = found.sources[0].data[slice(*statement.span)].decode("latin-1")
        assert re.match(r"\w+", text)[0].lower() in SIGNATURES  # type: ignore[index]
        for argument in statement.arguments:
            assert statement.span[0] < argument.whole[0] <= argument.span[0] <= argument.span[1] <= statement.span[1]


@given(st.binary(max_size=60), st.data())
def test_edits_change_their_spans_only(data: bytes, draw: st.DataObject) -> None:
    cuts = sorted(draw.draw(st.lists(st.integers(0, len(data)), max_size=8)))
    spans = list(zip(cuts[::2], cuts[1::2], strict=False))
    edits = [Edit(start, end, b"<%d>" % number) for number, (start, end) in enumerate(spans)]
    result = b"".join(edited(data, draw.draw(st.permutations(edits))))
    rest = result
    for number in range(len(edits)):
        rest = rest.replace(b"<%d>" % number, b"", 1)
    kept = data
    for start, end in reversed(spans):
        kept = kept[:start] + kept[end:]
    assert len(rest) == len(kept)
    assert b"".join(edited(data, [])) == data


def test_overlapping_edits_are_refused() -> None:
    with pytest.raises(ValueError, match="overlaps"):
        edited(b"abcdef", [Edit(0, 3, b""), Edit(2, 4, b"")])
    with pytest.raises(ValueError, match="outside"):
        edited(b"abc", [Edit(2, 9, b"")])


def test_insertions_at_one_place_keep_their_order() -> None:
    assert b"".join(edited(b"ab", [Edit(1, 1, b"1"), Edit(1, 1, b"2"), Edit(1, 2, b"3")])) == b"a123"


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r\r\n"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf", b"%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n"])
@pytest.mark.parametrize("comment", ["", "! Schweißnaht", "! \udcff"])
def test_editing_one_number_changes_that_number_only(end: bytes, mark: bytes, comment: str) -> None:
    text = module(
        f"{comment}\nMoveL {target(1.5, -2.25, 3)},v100,z10,tool0;".encode("latin-1", "replace").decode("latin-1")
    )
    data = mark + text.replace(b"\n", end).rstrip()
    found = read_program(Source("a.mod", data))
    event = walk_program(found).events[0]
    assert event.target_origin.spans is not None
    numbers = literal(data, *event.target_origin.spans.whole)
    assert numbers is not None
    start, stop = numbers.span(2)
    assert data[start:stop] == b"-2.25"
    changed = b"".join(edited(data, [Edit(start, stop, b"-2.361")]))
    assert changed == data.replace(b"-2.25", b"-2.361")
    again = walk_program(read_program(Source("a.mod", changed))).events[0]
    assert again.target is not None
    assert again.target.trans == (1.5, -2.361, 3.0)  # type: ignore[union-attr]
    assert again.target.rot == event.target.rot  # type: ignore[union-attr]


def test_no_group_is_possessive() -> None:
    """Python before 3.11.5 loses its place in ``(?:..)*+`` (cpython gh-106052); atomic groups are used."""
    modules = [importlib.import_module(m.name) for m in pkgutil.walk_packages(rapid.__path__, "postproc.rapid.")]
    patterns = [value for m in modules for value in vars(m).values() if isinstance(value, re.Pattern)]
    assert len(patterns) > 20
    for pattern in patterns:
        text = pattern.pattern if isinstance(pattern.pattern, str) else pattern.pattern.decode("latin-1")
        assert not re.search(r"(?<!\\)\)[*+?]\+", text), text
