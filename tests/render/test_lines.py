"""Long statements are broken where RAPID takes a blank, and say the same."""

from __future__ import annotations

import pytest

from postproc.rapid.syntax.tokens import tokenize
from postproc.render.lines import LINE_WIDTH, LONGEST_LINE, broken

WAY = "(pS{i,2}.trans.x-pE{i,2}.trans.x)"
PART = f"-1.5E-05*{WAY}+0.21*Pow(Distance(pS{{i,2}}.trans,pE{{i,2}}.trans)/1000,2)"
STATEMENT = f"ArcL Offs(pE{{i,2}},{PART},{PART},{PART}),v100,sm1,wd1,z1,tA\\WObj:=wA;"


def words(text: str) -> list[bytes]:
    data = text.encode()
    return [data[slice(*at)] for kind, at in tokenize(data) if kind != "blank"]


@pytest.mark.parametrize("text", [STATEMENT, STATEMENT.replace(PART, f"{PART}-{PART}"), STATEMENT[5:-1]])
@pytest.mark.parametrize(("lead", "step"), [("    ", "      "), ("\t", "\t\t")])
def test_it_says_the_same_on_shorter_lines(text: str, lead: str, step: str) -> None:
    found = broken(text, lead, "\r\n")
    first, *others = found.split("\r\n")
    assert words(found) == words(text) and len(others) > 1
    assert len(first) <= LINE_WIDTH and all(line.startswith(step) for line in others)
    assert all(len(line) <= LINE_WIDTH + len(step) for line in others)


def test_it_breaks_after_commas_and_before_signs_of_sums_alone() -> None:
    first, *others = broken(STATEMENT, "", "\n").split("\n")
    assert [first, *(line[-1] for line in others)] == ["ArcL Offs(pE{i,2},", ",", ",", ",", ";"]
    longer = broken(STATEMENT.replace(PART, f"{PART}+{PART[1:]}"), "", "\n").split("\n")[1:]
    assert [line.lstrip()[:6] for line in longer] == ["+0.21*"] * 6


@pytest.mark.parametrize(
    "text",
    [
        "ArcL p1,v100;",
        STATEMENT[:LONGEST_LINE],
        STATEMENT.replace("v100", '"a,b"'),
        STATEMENT + " ! c",
        STATEMENT + "\n",
    ],
)
def test_what_is_short_or_has_lines_of_its_own_stays(text: str) -> None:
    assert broken(text, "  ", "\n") == text
