"""Numbers as text, read back by a parser of its own."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aerosid.notation import finite, finite_throughout, listed, number, p_value, plain, si_unit, with_deviation

FINITE = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e30, max_value=1e30, allow_subnormal=False)


def read(text: str) -> float:
    """The number that a person reads in the text."""
    text = text.replace("−", "-").translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-"))
    mantissa, _, power = text.partition("·10")
    return float(f"{mantissa}e{power or 0}")


@given(FINITE, st.integers(1, 8))
def test_a_number_keeps_its_digits_and_has_no_exponent_of_a_computer(value: float, digits: int) -> None:
    text = number(value, digits)
    assert not re.search(r"[eE]", text)
    assert "-" not in text
    assert read(text) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits), abs=1e-300)
    assert len(re.sub(r"·.*|[^0-9]", "", text).lstrip("0").rstrip("0") or "0") <= digits


@given(FINITE)
def test_what_someone_has_set_is_written_without_trailing_zeros(value: float) -> None:
    text = plain(value)
    assert read(text) == pytest.approx(value, rel=5.1e-6, abs=1e-300)
    assert not re.search(r"\.\d*0(?:·|$)", text)


@given(FINITE, st.floats(1e-12, 1e12))
def test_a_standard_error_is_written_without_an_exponent_of_a_computer(value: float, error: float) -> None:
    assert not re.search(r"\d[eE]", with_deviation(value, error))


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (10300.0, 3, "10300"),
        (10349.0, 3, "10300"),
        (123456.0, 3, "1.23·10⁵"),
        (0.000123, 3, "0.000123"),
        (0.0000123, 3, "1.23·10⁻⁵"),
        (9.996, 3, "10.0"),
        (-5.0, 2, "−5.0"),
        (0.0, 3, "0"),
        (math.nan, 3, "–"),
    ],
)
def test_numbers_as_engineers_write_them(value: float, digits: int, text: str) -> None:
    assert number(value, digits) == text


def test_units_probabilities_and_lists() -> None:
    assert si_unit("kg/m^3") == "kg/m³"
    assert si_unit("1") == ""
    assert p_value(1e-40) == "< 10⁻¹²"
    assert p_value(None) == p_value(float("nan"))
    assert [listed(items) for items in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == ["", "a", "a and b", "a, b and c"]


def test_a_document_holds_no_number_that_json_cannot() -> None:
    assert finite(math.pi) == math.pi
    assert finite(math.pi, 3) == 3.14
    assert finite(math.inf) is None
    document = {"a": [math.nan, 1, "nan"], 2: (1.0 / 3.0, {"b": -math.inf})}
    assert finite_throughout(document, 2) == {"a": [None, 1, "nan"], "2": [0.33, {"b": None}]}
