"""Bytes that are not edited stay as they are; that nothing makes the reader fail is held by ``tests/fuzz``."""

from __future__ import annotations

import importlib
import pkgutil
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc import rapid
from postproc.diagnostics import Source
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.program.program import read_program
from postproc.rapid.syntax.spans import Edit, edited, literal
from tests.rapid.build import module, target


@given(st.binary(max_size=60), st.data())
def test_edits_change_their_spans_only(data: bytes, draw: st.DataObject) -> None:
    cuts = sorted(draw.draw(st.lists(st.integers(0, len(data)), max_size=8, unique=True)))
    spans = list(zip(cuts[::2], cuts[1::2], strict=False))
    edits = [Edit(start, end, b"<%d>" % number) for number, (start, end) in enumerate(spans)]
    expected, at = b"", 0
    for edit in edits:
        expected, at = expected + data[at : edit.start] + edit.text, edit.end
    assert b"".join(edited(data, draw.draw(st.permutations(edits)))) == expected + data[at:]


@pytest.mark.parametrize(("edits", "said"), [([(0, 3), (2, 4)], "overlaps"), ([(2, 9)], "outside")])
def test_edits_that_overlap_or_lie_outside_are_refused(edits: list[tuple[int, int]], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        edited(b"abcdef", [Edit(start, end, b"") for start, end in edits])


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
    numbers = literal(data, *event.target_origin.spans.span)
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
