"""Sentences of the report that would repeat one another are joined, and none is lost."""

from __future__ import annotations

import dataclasses

import pytest
from problems_report import closed_loop

from aerosid.loop.derivative_table import notes_on_insignificant_derivatives
from aerosid.loop.effect_rows import Effect, Evidence
from aerosid.loop.result import ClosedLoop
from aerosid.loop.verdict import Verdict
from aerosid.reporting.judgement import DECISIONS, open_points
from aerosid.reporting.page import compose
from aerosid.reporting.remarks import remarks
from aerosid.reporting.words import quantity, short_effect


@pytest.fixture(scope="module")
def result() -> ClosedLoop:
    return closed_loop(samples=60)


def test_what_holds_for_two_flights_is_said_once(result: ClosedLoop) -> None:
    first, second = result.identification[0].name, result.validation[0].name
    notes = (f"{first}: cut.", f"{first}: Density is 1.", "Alone.", f"{second}: Density is 1.")
    told = remarks(dataclasses.replace(result, notes=notes))
    assert told == (f"{first}: cut.", f"{first} and {second}: Density is 1.", "Alone.")


def test_equal_notes_and_logs_called_alike_are_told_apart(result: ClosedLoop) -> None:
    one = result.identification[0]
    logs = tuple(dataclasses.replace(one, name=name) for name in ("a", "a: b"))
    notes = ("a: cut.", "a: cut.", "cut.", "a: b: cut.", "a: b: slow.")
    made = dataclasses.replace(result, identification=logs, validation=(), notes=notes)
    assert remarks(made) == ("a and a: b: cut.", "cut.", "a: b: slow.")


def test_a_value_that_is_contradicted_is_said_of_that_derivative_alone(result: ClosedLoop) -> None:
    row = dataclasses.replace(result.derivatives[0], shown=False, estimate=None, std_error=0.5)
    bare = [dataclasses.replace(row, term=term, value=0.25, declared=0.25) for term in ("q_hat", "delta_e")]
    against = dataclasses.replace(row, term="alpha", value=0.25, declared=0.5)
    rows = (*bare, against)
    made = dataclasses.replace(result, derivatives=rows, notes=tuple(notes_on_insignificant_derivatives(rows)))
    first, second = remarks(made)
    assert "contradict" in first
    assert "alpha" in first
    assert "contradict" not in second


def test_a_contradicted_value_within_its_standard_error_is_said_to_be_so_beside_the_effects(result: ClosedLoop) -> None:
    """0.25 ± 0.5 does not contradict 0.214; with the effects as estimated it is 4.1 standard errors away."""
    row = dataclasses.replace(
        result.derivatives[0], shown=False, term="alpha", value=0.25, declared=0.214, std_error=0.5, declared_away=4.1
    )
    (one,) = remarks(
        dataclasses.replace(result, derivatives=(row,), notes=tuple(notes_on_insignificant_derivatives([row])))
    )
    assert "with the effects as estimated the estimate is 4.1 standard errors from it" in one
    hiding = dataclasses.replace(row, term="q_hat", declared_away=None)
    rows = (row, dataclasses.replace(row, term="delta_e", declared_away=5.2), hiding)
    both, last = remarks(
        dataclasses.replace(result, derivatives=rows, notes=tuple(notes_on_insignificant_derivatives(rows)))
    )
    assert "the estimates are 4.1 and 5.2 standard errors from them" in both
    assert "beside it an identified effect would not be significant" in last


def test_derivatives_that_are_not_significant_share_a_sentence(result: ClosedLoop) -> None:
    row = result.derivatives[0]
    kept = dataclasses.replace(row, shown=False, term="q_hat", estimate=-15.5, std_error=21.0, value=-11.25)
    used = dataclasses.replace(row, shown=False, term="alpha", estimate=None, value=0.25, declared=0.5, std_error=0.5)
    both = dataclasses.replace(used, term="delta_e", value=2.5, declared=3.5, correlation_max=0.999)
    rows = (kept, used, both)
    made = dataclasses.replace(result, derivatives=rows, notes=tuple(notes_on_insignificant_derivatives(rows)))
    first, second = remarks(made)
    assert "−15.5" in first
    assert "keeps the declared value −11.25" in first
    for words in ("alpha (0.250 ± 0.50)", "correlation 0.999", "contradict the declared values 0.5 and 3.5"):
        assert words in second
    alone = dataclasses.replace(result, derivatives=(kept,), notes=tuple(notes_on_insignificant_derivatives([kept])))
    assert remarks(alone) == alone.notes


def test_many_alternatives_are_counted_and_few_are_named(result: ClosedLoop) -> None:
    (other,) = result.alternatives
    powers = [dataclasses.replace(other, term=f"alpha^{n}") for n in range(2, 7)]
    few = open_points(dataclasses.replace(result, alternatives=(*powers[:4], *powers[:2])))
    many = open_points(dataclasses.replace(result, alternatives=(*powers, *powers[:2])))
    assert any("alpha^2" in text and "cannot distinguish" in text for text in few)
    (counted,) = (text for text in many if "cannot distinguish" in text)
    assert f"Each of 5 other effects could stand in the place of {other.instead_of}: " in counted
    assert [s.title for s, _ in compose(result).parts if s.name == "alternatives"] == ["Indistinguishable alternatives"]


def test_an_error_left_on_two_flights_alike_is_told_once(result: ClosedLoop) -> None:
    rows = tuple(dataclasses.replace(row, noise=1e-5 * (row.after or 1.0), trimmed=None) for row in result.errors)
    text = open_points(dataclasses.replace(result, errors=rows, decided_by="equations"))
    names = list(dict.fromkeys(row.log for row in rows))
    assert [t.split(" the error")[0] for t in text if "remains above" in t] == [f"On {names[0]} and {names[1]}"]


def test_a_flight_read_like_another_is_listed_by_its_ranges(result: ClosedLoop) -> None:
    log = result.identification[0]
    again = dataclasses.replace(log, name="again", notes=("cut.",))
    report = compose(dataclasses.replace(result, validation=(again,)))
    (body,) = (str(body) for section, body in report.parts if section.name == "readings")
    assert body.count("column in the file") == 1
    assert f"are those of {log.name}. Changes on reading: cut." in body
    assert body.count("<code>alpha</code>") == 2


def test_a_short_name_holds_time_and_place_once() -> None:
    pushed = Effect(1, "thrust_change", "thrust", "", 3260.0, 670.0, "N", Evidence(None, 1e-9, None, 50.0), time=87.97)
    assert short_effect(pushed) == "thrust change at 87.97 s"
    late = dataclasses.replace(pushed, kind="sensor_delay", where="alpha", time=None)
    assert short_effect(late) == "sensor delay of alpha"


def test_the_standard_deviation_of_a_gust_is_named_whatever_its_axis() -> None:
    """The lateral one of turbulence was called `sigma side`, the words for the other were never reached."""
    assert [quantity(name) for name in ("sigma", "sigma_side", "length", "time_constant")] == [
        "standard deviation", "lateral standard deviation", "scale length", "time constant",
    ]  # fmt: skip


def test_what_to_fly_where_nothing_is_excited_holds_for_every_case_of_motion() -> None:
    assert "elevator" not in DECISIONS[Verdict.NOT_EXCITED]
