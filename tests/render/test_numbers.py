"""Numbers in the text: what the controller reads back is the value that was meant."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.render.numbers import MM_DECIMALS, QUATERNION_DECIMALS, number_like, rapid_number
from postproc.render.templates import axes, mm, quaternion

PLAIN = re.compile(r"(?!-0(\.0*)?$)-?\d+(\.\d+)?")  # without a negative zero
values = st.one_of(st.floats(-5000, 5000), st.floats(-1, 1), st.floats(-1e-4, 1e-4))
decimals = st.tuples(st.floats(-4000, 4000), st.integers(1, 9)).map(lambda x: f"{x[0] + 0.0:.{x[1]}f}")
originals = st.one_of(
    decimals,
    st.integers(-4000, 4000).map(str),
    st.tuples(st.floats(-4000, 4000), st.integers(0, 6)).map(lambda x: f"{x[0]:.{x[1]}E}"),
    st.sampled_from(["+5.0", ".5", "-.25", "7.", "0", "-0", "1E3", "-5.0E2", "1e-3"]),
)


@given(originals, values, st.sampled_from([MM_DECIMALS, QUATERNION_DECIMALS]))
def test_a_value_is_kept_in_the_format_of_the_number_before(before: str, value: float, least: int) -> None:
    after = number_like(before, float(before), value, least)
    assert abs(float(after) - value) <= 0.5 * 10.0**-least * (1 + 1e-9)
    assert after == before or PLAIN.fullmatch(after)
    assert number_like(after, float(after), value, least) == after


@given(decimals, values)
def test_as_many_decimals_are_written_as_were_before(before: str, value: float) -> None:
    count = len(before.partition(".")[2])
    after = number_like(before, float(before), value, 1)
    assert len(after.partition(".")[2]) == count


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
