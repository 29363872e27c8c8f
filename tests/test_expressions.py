"""Every regular expression of the package costs what its text is long, also where it does not match."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from re import _compiler, _parser  # type: ignore[attr-defined]
from re import _constants as op  # type: ignore[attr-defined]
from typing import Any

import pytest

from tests.cost import within
from tests.fuzz.checks import limited

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "postproc"
CALLS = {"compile", "search", "match", "fullmatch", "findall", "finditer", "sub", "split"}
SIZES = 500, 4_000
MOST = 1e6
"""Passes of an empty loop. A text of 4,000 characters takes at most 7e4 where the cost is linear, and 1e7 where it is
their square; 500 take 6e6 where it is their cube."""


Expression = tuple[re.Pattern[Any], str]
"""What is looked for, and how: from every place on (`search`), or from one (`match`, `fullmatch`)."""


def expressions() -> dict[str, Expression]:
    """All that are compiled in modules, and all that stand in calls, by their text."""
    found: dict[str, Expression] = {}
    texts = {path: path.read_text("utf-8") for path in sorted(PACKAGE.rglob("*.py"))}
    used: dict[str, set[str]] = {}
    for text in texts.values():
        for name, call in re.findall(r"(?<!\w)(\w+)(?:\[\w+\])?\.(\w+)\(", text):
            used.setdefault(name, set()).update({call} & CALLS)
    for path, text in texts.items():
        if "import re" not in text:
            continue
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        every: list[Expression] = []
        for own, value in vars(importlib.import_module(name)).items():
            for p in value.values() if isinstance(value, dict) else (value,):
                if isinstance(p, re.Pattern):
                    calls = used.get(own, set())
                    every.append((p, min(calls) if calls and calls <= {"match", "fullmatch"} else "search"))
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in CALLS:
                called = isinstance(node.func.value, ast.Name) and node.func.value.id == "re"
                if called and node.func.attr != "compile" and node.args and isinstance(node.args[0], ast.Constant):
                    how = node.func.attr if "match" in node.func.attr else "search"
                    every.append((re.compile(node.args[0].value), how))
        found |= {f"{name.removeprefix('postproc.')}: {str(p.pattern)[:60]!r}": (p, how) for p, how in every}
    return found


LETTERS = (*b" a1.,\t{[('\"_A-x/\\\n!:;<>", *range(1, 256), 0x2019)
REPEATS = (op.MAX_REPEAT, op.MIN_REPEAT, op.POSSESSIVE_REPEAT)


def parts(kind: Any, value: Any) -> Sequence[Any]:
    """The expressions that a part of an expression consists of."""
    if kind is op.BRANCH:
        return value[1]
    if kind is op.SUBPATTERN:
        return (value[-1],)
    return (value,) if kind is op.ATOMIC_GROUP else (value[2],) if kind in REPEATS else ()


def letter(node: Any) -> str:
    """A character that a class, or all but one character, matches."""
    one = _compiler.compile(_parser.SubPattern(_parser.State(), [node]))
    return next(chr(code) for code in LETTERS if one.match(chr(code)))


def example(parsed: Any, most: int = 1) -> str:
    """A text that an expression matches, but for what it looks ahead and back at."""
    out = ""
    for kind, value in parsed:
        if kind is op.LITERAL:
            out += chr(value)
        elif kind in (op.NOT_LITERAL, op.IN):
            out += letter((kind, value))
        elif kind is op.ANY:
            out += "a"
        elif inner := parts(kind, value):
            times = min(max(value[0], most), value[1]) if kind in REPEATS else 1
            out += example(inner[0], most) * times
    return out


def repeated(parsed: Any, before: str = "") -> Iterator[tuple[str, str]]:
    """What stands before each part that repeats without end, and what is repeated, in all of its alternatives."""
    for i, (kind, value) in enumerate(parsed):
        here = before + example(parsed[:i], 0)
        if kind in REPEATS and value[1] > 100:
            every = [example(value[2])]
            every += [example(branch) for deeper, of in value[2] if deeper is op.BRANCH for branch in parts(deeper, of)]
            yield from ((here, text) for text in every if text)
        for inner in parts(kind, value):
            yield from repeated(inner, here)


def adversarial(pattern: re.Pattern[Any], size: int) -> Iterator[str | bytes]:
    """Long texts in which nothing, or all but the end, fits."""
    for before, pump in dict.fromkeys(repeated(_parser.parse(pattern.pattern, pattern.flags))):
        for head, many, tail in (
            (before, pump, "\x01"),
            (before, pump, "\n"),
            ("", before + pump, "\x01"),
            ("", before or pump, "\x01"),
        ):
            text = head + many * (size // max(1, len(many))) + tail
            yield text if isinstance(pattern.pattern, str) else text.encode("latin-1", "replace")


def use(expression: Expression, text: Any) -> None:
    pattern, how = expression
    if how == "search":
        for _ in pattern.finditer(text):
            pass
    else:
        getattr(pattern, how)(text)


def slow_text(expression: Expression) -> str | bytes | None:
    """The beginning of the first adversarial text that takes more than `MOST` passes of a loop; None if there is none."""
    for size in SIZES:
        for text in adversarial(expression[0], size):
            with limited(20.0):
                if not within(partial(use, expression, text), MOST):
                    return text[:40]
    return None


def test_no_text_takes_long() -> None:
    assert {name: slow for name, expression in expressions().items() if (slow := slow_text(expression))} == {}


@pytest.mark.parametrize("pattern", [r"([A-Za-z]\w*)\s*:=", r"<Module>\s*([^<]*?)\s*</Module>", r"\d+[.,]?\d*\s*x"])
def test_a_cost_that_grows_with_the_square_or_the_cube_is_seen(pattern: str) -> None:
    assert slow_text((re.compile(pattern), "search"))
