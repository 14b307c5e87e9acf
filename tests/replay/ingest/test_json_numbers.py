"""Decimal numbers in JSON: bit for bit the double that Python reads, or a clear rejection."""

import struct

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from wmr_replay.ingest.decoding.json_numbers import decimal, integer


def read(text, function=decimal, after=",  "):
    data = np.frombuffer((text + after).encode(), np.uint8)
    words = np.ndarray((max(len(data) - 7, 0),), "<u8", data, strides=(1,))
    return function(data, words, 0, len(data))


def same(a, b):
    return struct.pack("<d", a) == struct.pack("<d", b)


mantissas = st.integers(0, 10**19 - 1).map(str)
spelled = st.builds(
    lambda sign, whole, part, power: sign + whole + part + power,
    st.sampled_from(["", "-"]),
    st.one_of(st.just("0"), mantissas),
    st.one_of(st.just(""), st.text("0123456789", min_size=1, max_size=20).map(lambda t: "." + t)),
    st.one_of(st.just(""), st.integers(-400, 400).map(lambda k: f"e{k}"), st.sampled_from(["E+05", "e-07"])),
)
halfway = st.builds(
    lambda k, up, more: str(((2 * k + 1) << up) + more),
    *(st.integers(2**52, 2**53 - 1), st.integers(0, 9), st.integers(-1, 1)),
)


@settings(deadline=None)
@given(st.one_of(st.floats(allow_nan=False, allow_infinity=False).map(repr), spelled, halfway))
@example("9007199254740993")
@example("0.000000000000000000000001234567890123456789")
@example("1.7976931348623157e308")
@example("2.2250738585072014e-308")
@example("-0.0")
def test_what_is_read_is_the_nearest_double(text):
    value, end = read(text)
    if end >= 0:
        assert end == len(text)
        assert same(value, float(text))


@settings(deadline=None)
@given(st.floats(1e-300, 1e300).flatmap(lambda x: st.sampled_from([x, -x])))
def test_usual_numbers_are_never_refused(x):
    value, end = read(repr(x))
    assert end == len(repr(x))
    assert same(value, x)


@pytest.mark.parametrize("text", ["", "-", "+1", "01", "1.", ".5", "1e", "1e+", "nan", "null", "--1", '"1"'])
def test_what_is_no_json_number_is_refused(text):
    assert read(text)[1] == -1


@pytest.mark.parametrize("text", ["1e400", "-1e999999", "5e-324", "123456789012345678901"])
def test_numbers_beyond_the_normal_doubles_or_19_digits_are_refused(text):
    assert read(text)[1] == -1


@settings(deadline=None)
@given(st.integers(-(10**18) + 1, 10**18 - 1))
def test_whole_numbers_are_exact(n):
    assert read(str(n), integer) == (n, len(str(n)))


def test_a_whole_number_ends_where_its_digits_end():
    assert read("12.5", integer) == (12, 2)
    assert read("-", integer)[1] == read("1" * 19, integer)[1] == -1


def test_a_number_may_end_with_the_data():
    assert read("2.5", after="") == (2.5, 3)
    assert read("12345678", after="") == (12345678.0, 8)
