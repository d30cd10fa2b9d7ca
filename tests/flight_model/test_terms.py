"""The grammar of terms, and their values and slopes against Python's own parser and central differences."""

from __future__ import annotations

import pickle
import re

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from oracles.terms import term_by_tree
from strategies import NAMES, term_texts

from aerosid.errors import AircraftError
from aerosid.flight_model.terms import (
    INPUT_COLUMNS,
    VARIABLES,
    Term,
    build_table,
    fill_values,
    input_columns,
    parse_term,
    pass_slopes,
    value_count,
)

values = st.dictionaries(st.sampled_from(NAMES), st.floats(-3.0, 3.0), min_size=len(NAMES), max_size=len(NAMES))


def _evaluate(term: Term, given: dict[str, float]) -> tuple[float, dict[str, float]]:
    columns = input_columns([term])
    # Rows of other terms around it, which share their products with it: none may take the other's.
    entries = [("C_X", parse_term("alpha^2*q_hat")), ("C_m", term), ("C_Z", parse_term("alpha^4"))]
    table = build_table(entries, columns)
    numbers = np.zeros(value_count(table, len(columns)))
    names = (*VARIABLES, *columns)
    numbers[: len(names)] = [given.get(name, 0.0) for name in names]
    products = int(table.reach[1])
    fill_values(table, products, numbers)
    slopes = np.zeros((numbers.size, 1))
    slopes[table.value[1]] = 1.0
    pass_slopes(table, products, numbers, slopes)
    return float(numbers[table.value[1]]), dict(zip(names, slopes[: len(names), 0], strict=True))


@given(term_texts())
def test_printed_term_reads_back_as_the_same_term(text: str) -> None:
    term = parse_term(text)
    assert parse_term(str(term)) == term
    assert str(parse_term(str(term))) == str(term)


@given(term_texts(), st.randoms())
def test_order_of_factors_makes_no_difference(text: str, random: object) -> None:
    factors = text.split("*")
    random.shuffle(factors)  # type: ignore[attr-defined]
    assert parse_term("*".join(factors)) == parse_term(text)


@settings(deadline=None)  # the first call compiles
@example("pos(alpha+1.007)*alpha", dict.fromkeys(NAMES, 0.5))
@example("pos(alpha+1.2690007120510032)^2", dict.fromkeys(NAMES, 0.0))
@given(term_texts(), values)
def test_value_is_what_python_makes_of_the_text(text: str, given_values: dict[str, float]) -> None:
    plain = re.sub(r"(?<![\w.])007(?![\w.])", "7", text)  # which Python does not read
    assert_allclose(
        _evaluate(parse_term(text), given_values)[0], term_by_tree(plain, given_values), rtol=1e-9, atol=1e-12
    )


@settings(deadline=None)  # the first call compiles
@given(term_texts(), values)
def test_slopes_are_central_differences(text: str, given_values: dict[str, float]) -> None:
    term = parse_term(text)
    step = 1e-5
    for factor in term.factors:  # away from the corners, where there is no slope
        assume(factor.shape == "plain" or abs(given_values[factor.variable] - factor.offset) > 2 * step)
    slopes = _evaluate(term, given_values)[1]
    for name in NAMES:
        up = _evaluate(term, given_values | {name: given_values[name] + step})[0]
        down = _evaluate(term, given_values | {name: given_values[name] - step})[0]
        scale = max(1.0, abs(up), abs(slopes.get(name, 0.0)))
        assert_allclose(slopes.get(name, 0.0), (up - down) / (2 * step), rtol=1e-4, atol=1e-5 * scale)


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("1", "1"),
        ("1*1^3", "1"),
        ("alpha*alpha", "alpha^2"),
        ("delta_e*alpha", "alpha*delta_e"),
        ("delta_e * alpha * delta_e", "alpha*delta_e^2"),
        ("abs(alpha)*abs(alpha)", "alpha^2"),
        ("abs(q_hat)^3", "q_hat^2*abs(q_hat)"),
        ("pos(alpha-0.20)^2", "pos(alpha - 0.2)^2"),
        ("pos(alpha - 0.0)", "pos(alpha)"),
        ("pos(alpha + 0)", "pos(alpha)"),
        ("pos(alpha - 0.1)*pos(alpha - 0.1)", "pos(alpha - 0.1)^2"),
        ("pos(alpha - 0.1)*pos(alpha - 0.2)", "pos(alpha - 0.1)*pos(alpha - 0.2)"),
        ("flap_lever*alpha", "alpha*flap_lever"),
        ("C_T*alpha", "alpha*C_T"),
    ],
)
def test_canonical_text(text: str, canonical: str) -> None:
    assert str(parse_term(text)) == canonical


@pytest.mark.parametrize(("x", "slope_abs", "slope_pos"), [(-1.0, -1.0, 0.0), (0.0, 0.0, 0.0), (2.0, 1.0, 1.0)])
def test_slopes_at_and_beside_the_corner(x: float, slope_abs: float, slope_pos: float) -> None:
    assert _evaluate(parse_term("abs(alpha)"), {"alpha": x})[1]["alpha"] == slope_abs
    assert _evaluate(parse_term("pos(alpha)"), {"alpha": x})[1]["alpha"] == slope_pos


def test_terms_share_their_products() -> None:
    texts = ("alpha^2", "alpha^3", "alpha^2*q_hat", "alpha^3", "1", "alpha", "abs(alpha)")
    table = build_table([("C_m", parse_term(text)) for text in texts], INPUT_COLUMNS)
    assert table.left.size == 3
    assert table.value[1] == table.value[3]
    assert table.reach.tolist() == [1, 2, 3, 3, 3, 3, 3]


def test_slopes_of_a_sum_are_the_sum_of_slopes() -> None:
    table = build_table([("C_m", parse_term("alpha^3")), ("C_m", parse_term("alpha"))], INPUT_COLUMNS)
    numbers = np.zeros(value_count(table, len(INPUT_COLUMNS)))
    numbers[0] = 2.0
    fill_values(table, 2, numbers)
    slopes = np.zeros((numbers.size, 2))
    slopes[table.value[0]] = [1.0, 0.0]
    slopes[table.value[1]] += [5.0, 7.0]
    pass_slopes(table, 2, numbers, slopes)
    assert slopes[0].tolist() == [17.0, 7.0]
    assert not slopes[1 : len(VARIABLES)].any()


def test_columns_put_the_elevator_first_and_the_others_in_order() -> None:
    terms = [parse_term(text) for text in ("flap", "beta*alpha", "delta_e", "airbrake*flap", "thrust")]
    assert input_columns(terms) == (*INPUT_COLUMNS, "delta_e", "flap", "airbrake")


def test_table_refuses_what_no_column_holds() -> None:
    with pytest.raises(AircraftError, match="flap, which the log does not hold"):
        build_table([("C_m", parse_term("flap"))], INPUT_COLUMNS)
    with pytest.raises(AircraftError, match="'C_n' is unknown"):
        build_table([("C_n", parse_term("alpha"))], INPUT_COLUMNS)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " \t ",
        "alpha*",
        "*alpha",
        "alpha**2",
        "alpha^",
        "alpha^0",
        "alpha^-1",
        "alpha^2.0",
        "alpha^1e1",
        "alpha^10",
        "alpha^" + "9" * 100,
        "alpha^9*alpha",
        "alpha^2^2",
        "2*alpha",
        "-alpha",
        "alpha + q_hat",
        "alpha/q_hat",
        "(alpha)",
        "alpha delta_e",
        "alpha\n",
        "alpha\x00",
        "sin(alpha)",
        "abs alpha",
        "abs()",
        "abs(alpha",
        "abs(alpha - 0.2)",
        "abs(abs(alpha))",
        "pos(0.2 - alpha)",
        "pos(alpha - q_hat)",
        "pos(alpha - -0.2)",
        "pos(alpha - 1e999)",
        "pos(alpha - nan)",
        "pos",
        "(" * 3000 + "alpha" + ")" * 3000,
        "(" * 190,
        "alpha*" * 1000,
        "__import__('os').system('true')",
        "alpha.__class__",
        "lambda: 0",
        "alpha\u00b2",
        "\u03b1",
        "al\u200bpha",
        "\u0430lpha",  # a Cyrillic letter
        "alpha^\u0662",  # an Arabic digit
        "V",
        "V*alpha",
        "q",
        "u",
        "psi",
        "h",
        "q_bar",
        "a_z^2",
        "abs(q_dot)",
        "pos(V - 100)",
        "time",
    ],
)
def test_what_is_no_term_is_refused_with_one_short_sentence(text: str) -> None:
    with pytest.raises(AircraftError) as caught:
        parse_term(text)
    sentence = str(caught.value)
    assert sentence.isprintable()
    assert sentence.isascii()
    assert len(sentence) < 300


@given(st.text(max_size=60))
def test_any_text_is_a_term_or_a_sentence(text: str) -> None:
    try:
        term = parse_term(text)
    except AircraftError as error:
        said = str(error)
    else:
        said = str(term)
        assert parse_term(said) == term
    assert said.isprintable()


@given(st.text(alphabet="1alphposb_de()*^+-. 02", max_size=40))
def test_any_text_of_the_grammars_own_characters_is_a_term_or_a_sentence(text: str) -> None:
    try:
        term = parse_term(text)
    except AircraftError:
        return
    assert parse_term(str(term)) == term


def test_a_term_that_went_to_another_process_is_found_there() -> None:
    """Hashes of texts differ between processes: what was kept of one must not travel."""
    term = Term(parse_term("alpha^2*delta_e").factors)
    assert hash(term) == hash(parse_term("delta_e*alpha^2"))
    term.__dict__["_hash"] = hash(term) + 1  # as another process would have it
    assert pickle.loads(pickle.dumps(term)) in {parse_term("alpha^2*delta_e")}
