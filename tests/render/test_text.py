"""Numbers and lines in the text: what the controller reads back is the value, and the statement, that was meant."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.rapid.syntax.tokens import tokenize
from postproc.render.templates import axes, mm, quaternion
from postproc.render.text import (
    LINE_WIDTH,
    LONGEST_LINE,
    MM_DECIMALS,
    QUATERNION_DECIMALS,
    broken,
    number_like,
    rapid_number,
)

PLAIN = re.compile(r"(?!-0(\.0*)?$)-?\d+(\.\d+)?")  # without a negative zero
values = st.one_of(st.floats(-5000, 5000), st.floats(-1, 1), st.floats(-1e-4, 1e-4))
originals = st.one_of(
    st.tuples(st.floats(-4000, 4000), st.integers(1, 9)).map(lambda x: f"{x[0]:.{x[1]}f}"),
    st.integers(-4000, 4000).map(str),
    st.tuples(st.floats(-4000, 4000), st.integers(0, 6)).map(lambda x: f"{x[0]:.{x[1]}E}"),
    st.sampled_from(["+5.0", ".5", "-.25", "7.", "0", "-0", "1E3", "-5.0E2", "1e-3"]),
)


@given(originals, values, st.sampled_from([MM_DECIMALS, QUATERNION_DECIMALS]))
def test_a_value_is_kept_in_the_format_of_the_number_before(before: str, value: float, least: int) -> None:
    after = number_like(before, float(before), value, least)
    assert abs(float(after) - value) <= 0.5 * 10.0**-least * (1 + 1e-9)
    fraction, new = before.partition(".")[2], after.partition(".")[2]
    assert after == before or PLAIN.fullmatch(after)
    assert not fraction.isdigit() or len(fraction) < least or len(new) == len(fraction)
    assert number_like(after, float(after), value, least) == after


@given(values, st.integers(0, 9))
def test_short_numbers_have_no_trailing_zeros(value: float, count: int) -> None:
    text = rapid_number(value, count)
    assert PLAIN.fullmatch(text) and ("." not in text or text[-1] not in "0.")
    assert abs(float(text) - value) <= 0.5 * 10.0**-count * (1 + 1e-9) + 1e-15 * abs(value)


EXAMPLES = [
    ("600", 600.0, 3, "600"),
    ("600", 600.4, 3, "600.4"),
    ("600.0", 599.99951, 3, "600.0"),
    ("600.0000", 600.00012, 3, "600.0001"),
    ("9E+09", 9e9, 3, "9E+09"),
    ("-1", -1, 0, "-1"),
    ("-1", 0, 0, "0"),
    ("0.000", -0.0001, 3, "0.000"),
    ("1.5", -0.0001, 3, "0"),
    ("0.00001", -0.000001, 3, "0.00000"),
    ("0x10", 16.0, 3, "0x10"),
    ("-0x10", 16.25, 3, "16.25"),
]


@pytest.mark.parametrize(("before", "value", "least", "after"), EXAMPLES)
def test_examples_of_numbers_in_the_format_of_those_before(before: str, value: float, least: int, after: str) -> None:
    old = float(int(before, 0)) if "x" in before else float(before)
    assert number_like(before, old, value, least) == after


def test_filters_write_lengths_quaternions_and_external_axes() -> None:
    assert mm((1200.00049, -0.0001, 3.14159)) == ["1200", "0", "3.142"]
    assert quaternion((1.0, 0.0, -0.123456789, 1e-9)) == ["1", "0", "-0.1234568", "0"]
    assert axes((9e9, 0.0, 123.4567891, -9e9)) == ["9E9", "0", "123.456789", "-9000000000"]


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
