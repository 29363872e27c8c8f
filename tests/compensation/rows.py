"""What a conversion makes of a small program, as a row of a corpus.

The first line of a row has the largest deviation [mm] before and after, the number of added targets, and what became of
each motion statement in the order of the text: the place in the text that carries its correction, ``left``,
``unchanged`` or ``run_time``, what remains at its target where that is 0.01 mm or more, `conf` where its confdata
changed, and the reason. Lines with ``>`` are those that are written otherwise (``#`` is any number), and the data whose
numbers changed. `messages` are shown without their numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from difflib import SequenceMatcher
from itertools import groupby
from typing import Any

import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.text.values import StatementOutcome
from postproc.diagnostics import Diagnostic, Source
from postproc.model.file import default_model
from tests.build import convert, lines_of
from tests.compensation.build import broken_lines
from tests.corpus import Case

NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:E[-+]?\d+)?")
TARGET = re.compile(r"\[\[#,#,#\],\[#,#,#,#\],\[#,#,#,#\],\[#,#,#,#,#,#\]\]")
MEASURED = re.compile(r"~\d+\.\d+")


def without_numbers(text: str) -> str:
    """The text with `#` for every number with its sign, and `@` for every target."""
    text = NUMBER.sub("#", text)
    text = re.sub(r"(?<=[\w)}#])[-+]#", "+#", text)
    return TARGET.sub("@", re.sub(r"(?<![\w)}])-#", "#", text))


def length(mm: float | None) -> str:
    if mm is None:
        return "nothing"
    return "<0.01" if mm < 0.01 else f"~{mm:.3f}"


def statement(outcome: StatementOutcome) -> str:
    """What became of a motion statement."""
    words = [str(outcome.edited) if outcome.status == "compensated" else outcome.status.replace("skipped", "left")]
    whole = math.hypot(outcome.residual_mm or 0.0, outcome.along_mm or 0.0)
    words += [length(whole)] if whole >= 0.01 else []
    words += ["conf"] if outcome.conf_changed else []
    words += [f"({without_numbers(outcome.reason)[:44]})"] if outcome.reason else []
    return " ".join(words)


def finding(diagnostic: Diagnostic, messages: bool) -> str:
    """Code, place and, where it is shown, the begin of the message and of the help."""
    text = ""
    if diagnostic.source is not None and diagnostic.span is not None:
        text = diagnostic.source.data[slice(*diagnostic.span)].decode("latin-1")
    place = f" {without_numbers(text.splitlines()[0]).split(',v')[0][:40]}" if text else ""
    told = f": {diagnostic.message[:60]}" + (f" help: {diagnostic.help[:90]}" if diagnostic.help else "")
    return f"{diagnostic.severity[0]} {diagnostic.code}{place}" + (without_numbers(told) if messages else "")


def changes(text: str, output: str) -> list[str]:
    """Data whose numbers changed, and lines that are not those of the program but for their numbers."""
    functions = re.compile(r"\n *! postproc: (?:(?!\n *ENDFUNC).)*\n *LOCAL FUNC .*?\n *ENDFUNC", re.S)
    old, new = (
        [line for line in lines_of(functions.sub("", each)) if line and not line.startswith("!")]
        for each in (text, output)
    )
    before, after = list(map(without_numbers, old)), list(map(without_numbers, new))
    data, lines = [], []
    for word, i, i_end, j, j_end in SequenceMatcher(None, before, after, autojunk=False).get_opcodes():
        if word == "equal":
            for x, y in zip(old[i:i_end], new[j:j_end], strict=True):
                declared = re.match(r"(?:CONST|PERS|VAR) \w+ (\w+)", y) if x != y else None
                parts = [a != b for a, b in zip(x.split("[["), y.split("[["), strict=True)][1:]
                if declared:
                    data.append(declared[1] + (f" {sum(parts)}/{len(parts)}" if len(parts) > 1 else ""))
        else:
            lines += [f"gone {line}" for line in before[i:i_end]] if word == "delete" else after[j:j_end]
    each = (re.sub(r"(?<=,)(#[^,()]+),\1,\1(?=[,)\\])", r"\1 each", line) for line in lines)
    return [", ".join(data)] * bool(data) + counted(each)


def counted(texts: Iterable[str]) -> list[str]:
    """The texts, those that follow each other once with their number."""
    groups = [(text, len(list(same))) for text, same in groupby(texts)]
    return [f"{count} {text}" if count > 1 else text for text, count in groups]


def row(case: Case, found: Conversion) -> list[str]:
    """The lines of the row of a converted program."""
    told = [d for d in found.diagnostics if d.severity != "info"]
    findings = [f"! {text}" for text in counted(finding(d, "messages" in case.facets) for d in told)]
    if found.output is None:
        return ["= refused", *findings]
    before, after, added = (found.report[k] for k in ("max_error_before_mm", "max_error_after_mm", "added_targets"))
    head = f"{length(before)} to {length(after)}" + (f" +{added}" if added else "")
    head += f" unproved {unproved}" if (unproved := found.report["unproved_statements"]) else ""
    outcomes = " | ".join(counted(map(statement, found.outcomes)))
    lines = changes(case.text, found.output.decode("latin-1"))
    return [f"= {head}: {outcomes}", *findings, *(f"> {line}" for line in lines)]


def converted(case: Case, **usual: Any) -> Conversion:
    """The conversion of a program with its options, and with others that are usual in its file."""
    options = {**usual, **case.options}
    robot = options.pop("robot", None)
    lent = (
        [Source("lent.mod", f"MODULE Lent\n{broken_lines(case.lent)}ENDMODULE\n".encode(), True)] if case.lent else []
    )
    return convert(case.text, default_model(robot) if robot else None, lent, **options)


def assert_row(case: Case, found: Conversion) -> None:
    """The row of a conversion is the expected one, its deviations within 2 % or three micrometres."""
    actual, expected = (" ".join(" ".join(lines).split()) for lines in (row(case, found), case.expected.splitlines()))
    assert MEASURED.sub("~", actual) == MEASURED.sub("~", expected), case.text
    measured, stated = ([float(x[1:]) for x in MEASURED.findall(text)] for text in (actual, expected))
    assert measured == pytest.approx(stated, abs=0.003, rel=0.02)
