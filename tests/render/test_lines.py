"""Long statements are broken where RAPID takes a blank, and say the same."""

from __future__ import annotations

import pytest

from postproc.rapid.syntax.tokens import tokenize
from postproc.render.lines import LINE_WIDTH, LONGEST_LINE, broken

WAY = "(pS{i,2}.trans.x-pE{i,2}.trans.x)"
PART = f"-1.5E-05*{WAY}+0.21*Pow(Distance(pS{{i,2}}.trans,pE{{i,2}}.trans)/1000,2)"
STATEMENT = f"ArcL Offs(pE{{i,2}},{PART},{PART},{PART}),v100,sm1,wd1,z1,tA\\WObj:=wA;"
LONGER = STATEMENT.replace(PART, f"{PART}+{PART[1:]}")


def tokens(text: str) -> list[bytes]:
    data = text.encode()
    return [data[slice(*span)] for kind, span in tokenize(data) if kind != "blank"]


@pytest.mark.parametrize("text", [STATEMENT, STATEMENT.replace(PART, f"{PART}-{PART}"), STATEMENT[5:-1]])
@pytest.mark.parametrize(("lead", "step"), [("    ", "      "), ("\t", "\t\t")])
def test_a_broken_statement_says_the_same_on_shorter_lines(text: str, lead: str, step: str) -> None:
    result = broken(text, lead, "\r\n")
    first, *others = result.split("\r\n")
    assert tokens(result) == tokens(text) and others and len(first) <= LINE_WIDTH
    assert all(line.startswith(step) and len(line) <= LINE_WIDTH + len(step) for line in others)


def test_lines_end_with_commas_or_begin_with_signs_of_sums() -> None:
    first, *others = broken(STATEMENT, "", "\n").split("\n")
    assert [first, *(line[-1] for line in others)] == ["ArcL Offs(pE{i,2},", ",", ",", ",", ";"]
    assert [line.lstrip()[:6] for line in broken(LONGER, "", "\n").split("\n")[1:]] == ["+0.21*"] * 6


KEPT = ["ArcL p1,v100;", STATEMENT[:LONGEST_LINE], STATEMENT.replace("v100", '"a,b"')]
KEPT += [f"{STATEMENT} ! c", f"{STATEMENT}\n"]


@pytest.mark.parametrize("text", KEPT)
def test_a_statement_stays_that_is_short_or_has_a_string_a_comment_or_line_breaks(text: str) -> None:
    assert broken(text, "  ", "\n") == text
