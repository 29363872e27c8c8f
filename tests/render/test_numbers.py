"""Numbers in the text: what the controller reads back is the value that was meant."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.render.numbers import MM_DECIMALS, QUATERNION_DECIMALS, number_like, rapid_number
from postproc.render.templates import axes, mm, quaternion

PLAIN = re.compile(r"-?\d+(\.\d+)?")
values = st.one_of(st.floats(-5000, 5000), st.floats(-1, 1), st.floats(-1e-4, 1e-4))
written_before = st.one_of(
    st.integers(-4000, 4000).map(str),
    st.tuples(st.floats(-4000, 4000), st.integers(1, 9)).map(lambda x: f"{x[0]:.{x[1]}f}"),
    st.tuples(st.floats(-4000, 4000), st.integers(0, 6)).map(lambda x: f"{x[0]:.{x[1]}E}"),
    st.sampled_from(["+5.0", ".5", "-.25", "7.", "0", "-0", "1E3", "-5.0E2", "1e-3"]),
)


@given(written_before, values, st.sampled_from([MM_DECIMALS, QUATERNION_DECIMALS]))
def test_the_value_is_kept_in_any_neighbourhood(before: str, value: float, decimals: int) -> None:
    after = number_like(before, float(before), value, decimals)
    assert abs(float(after) - value) <= 0.5 * 10.0**-decimals * (1 + 1e-9)
    if after != before:
        assert PLAIN.fullmatch(after)


@given(written_before, values)
def test_writing_twice_changes_nothing(before: str, value: float) -> None:
    once = number_like(before, float(before), value, MM_DECIMALS)
    assert number_like(once, float(once), value, MM_DECIMALS) == once


@given(st.floats(-4000, 4000), st.integers(3, 9), values)
def test_as_many_decimals_as_were_there(old: float, count: int, value: float) -> None:
    before = f"{old:.{count}f}"
    after = number_like(before, float(before), value, MM_DECIMALS)
    assert len(after.partition(".")[2]) == count


@given(values, st.integers(0, 9))
def test_short_numbers(value: float, decimals: int) -> None:
    text = rapid_number(value, decimals)
    assert PLAIN.fullmatch(text)
    assert abs(float(text) - value) <= 0.5 * 10.0**-decimals * (1 + 1e-9) + 1e-15 * abs(value)
    assert text != "-0" and (("." not in text) or text[-1] not in "0.")


@pytest.mark.parametrize(
    ("before", "value", "after"),
    [
        ("600", 600.0, "600"),
        ("600", 600.4, "600.4"),
        ("600.0", 599.99951, "600.0"),
        ("600.0000", 600.00012, "600.0001"),
        ("9E+09", 9e9, "9E+09"),
        ("-1", -1, "-1"),
        ("-1", 0, "0"),
        ("0.000", -0.0001, "0.000"),
        ("1.5", -0.0001, "0"),
        ("0.00001", -0.000001, "0.00000"),
        ("0x10", 16.0, "0x10"),
        ("-0x10", 16.25, "16.25"),
    ],
)
def test_examples(before: str, value: float, after: str) -> None:
    there = float(int(before, 0)) if "x" in before else float(before)
    assert number_like(before, there, value, MM_DECIMALS if value % 1 else 0 if before == "-1" else 3) == after


def test_filters() -> None:
    assert mm((1200.00049, -0.0001, 3.14159)) == ["1200", "0", "3.142"]
    assert quaternion((1.0, 0.0, -0.123456789, 1e-9)) == ["1", "0", "-0.1234568", "0"]
    assert axes((9e9, 0.0, 123.4567891, -9e9)) == ["9E9", "0", "123.456789", "-9000000000"]


@given(st.floats(-4000, 4000), st.integers(0, 9), st.floats(-0.002, 0.002))
def test_no_negative_zero(old: float, count: int, value: float) -> None:
    before = f"{old + 1e4:.{count}f}"
    assert not re.fullmatch(r"-0(\.0*)?", number_like(before, float(before), value, MM_DECIMALS))
