"""The cost of reading grows with the length of the text, whatever stands in it: no regular expression runs away."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from postproc import rapid
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.function_effects import _calls_of
from postproc.rapid.program.references import declaration_uses
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.patterns import up_to
from tests.cost import grows_by, seconds
from tests.rapid.build import module, program, target

MODULES = [importlib.import_module(m.name) for m in pkgutil.walk_packages(rapid.__path__, "postproc.rapid.")]
CODE = "\n".join(path.read_text("utf-8") for path in Path(rapid.__path__[0]).rglob("*.py"))
PATTERNS = {
    name: value for m in MODULES for name, value in vars(m).items() if isinstance(value, re.Pattern)
} | {"_calls_of": _calls_of({b"fone", b"ftwo"}), "up_to": up_to(b"THEN")}  # fmt: skip
PIECES = ["a", " ", "!", '"', "(", "[", "a ", "a(", "1,", "PERS "]


def assert_linear(run: Callable[[int], object], little: float) -> None:
    """The cost at 40 kB is little, or below 15 times that at 4 kB."""
    assert seconds(lambda: run(40_000)) < little or grows_by(lambda: run(4_000), lambda: run(40_000), 15, little / 15)


def uses(name: str) -> bool:
    """Whether a pattern is searched for, not only matched at a place."""
    return name in ("_calls_of",) or bool(re.search(rf"\b{name}\.(?:search|finditer|findall|sub|split)\(", CODE))


@pytest.mark.parametrize("name", sorted(PATTERNS))
def test_ten_times_the_text_costs_about_ten_times_as_much(name: str) -> None:
    pattern = PATTERNS[name]
    assert pattern is not None
    for piece in PIECES:

        def run(size: int, piece: str = piece) -> None:
            long = piece * (size // len(piece))
            data = long if isinstance(pattern.pattern, str) else long.encode("latin-1")
            pattern.match(data)
            if uses(name):
                list(pattern.finditer(data))

        assert_linear(run, 0.1)


PLACES: dict[str, str] = {
    "comment": "! {0}\nMoveL p,v5,z0,tool0;", "string": 'TPWrite "{0}"; MoveL p,v5,z0,tool0;',
    "call": "{0}; MoveL p,v5,z0,tool0;", "argument": "MoveL Offs(p,0,0,{0}),v5,z0,tool0;", "assigned": "n:={0}; MoveL p,v5,z0,tool0;",
    "condition": "IF {0} THEN MoveL p,v5,z0,tool0; ENDIF", "by name": 'SetDataVal "{0}",n; CallByVar "{0}",1; MoveL p,v5,z0,tool0;',
    "late": '%"{0}"+n%; MoveL p,v5,z0,tool0;',
}  # fmt: skip


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("piece", ["a", "a(", "(", "a."])
def test_reading_and_following_is_linear_in_one_long_word(place: str, piece: str) -> None:
    data = f"CONST robtarget p:={target(1, 2, 3)}; VAR num n;"

    def run(size: int) -> None:
        text = program(module(PLACES[place].format(piece * (size // len(piece))), data))
        walk(text)
        declaration_uses(text, WriteEffects(text))

    assert_linear(run, 0.3)


def test_a_word_of_a_megabyte_in_a_comment_is_read_in_seconds() -> None:
    """B6."""
    data = f"CONST robtarget p:={target(1, 2, 3)};"
    text = module(f"! {'a' * 1_000_000}\nMoveL p,v5,z0,tool0;", data)
    assert seconds(lambda: walk(program(text))) < 3.0
    assert len(walk(program(text))) == 1
