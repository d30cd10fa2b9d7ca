"""A validation flight of another loading or aircraft shows other derivatives, and one of the same does not."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided
from problems import BOTH_SQUARES, LIGHT, Problem

from aerosid.equation_error.regression.related_problems import as_compared
from aerosid.equation_error.selection.cross_validation import fits_of
from aerosid.flight_model.terms import parse_term
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings, Method
from aerosid.loop.verdict import Verdict, notes_on_other_derivatives
from aerosid.reporting.result_json import result_text
from aerosid.search.lowered_coefficients import lowered_coefficients
from aerosid.search.other_derivatives import OtherDerivative, compared_derivatives, other_derivatives_by_equations
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

JUDGED = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)
SEED = 88_000
"""Of these flights; the limits were chosen on none."""

BENT = {("C_X", "alpha^2"): 2.0}


def closed(air: float, unseen: Wrong) -> ClosedLoop:
    """Two flights with a bent drag; `unseen`: what the second differs in."""
    body = BODIES[0]
    fitted = flown("fitted", body, SEED, air=air, wrong=Wrong(terms=BENT))
    other = flown("unseen", body, SEED + 1, air=air, wrong=replace(unseen, terms={**BENT, **unseen.terms}))
    return close_loop([fitted], aircraft_of(body, 0.05, np.random.default_rng(SEED)), [other], JUDGED)


def remarks(result: ClosedLoop) -> list[str]:
    return [note for note in result.notes if "other derivatives" in note]


@pytest.mark.parametrize("air", [pytest.param(0.0, marks=pytest.mark.slow), 0.6])
def test_a_validation_flight_of_another_loading_is_told_with_its_derivatives(air: float) -> None:
    """A centre of gravity further ahead: half as much again of static stability."""
    result = closed(air, Wrong(terms={("C_m", "alpha"): -0.4}))
    (remark,) = remarks(result)
    assert remark.startswith("unseen shows other derivatives than the identification: C_m alpha −1.2")
    assert remark.count("(identification ") == 1
    (row,) = json.loads(result_text(result))["other_derivatives"]
    assert (row["log"], row["coefficient"], row["term"]) == ("unseen", "C_m", "alpha")
    assert row["value"] - row["fitted"] == pytest.approx(-0.4, abs=4.0 * row["std_error"])
    assert "unseen shows other derivatives than the identification, as of another" in result.summary
    assert result.verdict is Verdict.PARTLY_EXPLAINED
    assert ("aero_term", "C_X") in {(effect.kind, effect.where) for effect in result.effects}


def test_a_validation_flight_of_the_same_aircraft_is_not() -> None:
    assert not remarks(closed(0.6, NOTHING))


@pytest.mark.parametrize("method", ["evidence", pytest.param("iebmee", marks=pytest.mark.slow)])
def test_in_white_noise_it_is_told_by_the_likelihood(method: Method) -> None:
    """Both of the paper's terms on both flights, and half as much again of static stability on the second."""
    fitted = Problem(undeclared=BOTH_SQUARES, duration=8.0)
    ahead = {**BOTH_SQUARES, ("C_m", "alpha"): -0.4}
    other = Problem(undeclared=ahead, duration=8.0, elevator="3211", amplitude=0.045)
    settings = replace(JUDGED, method=method)
    result = close_loop([fitted.fly(1, "doublet")], LIGHT, [other.fly(2, "3211")], settings)
    assert result.decided_by == ("iebmee" if method == "iebmee" else "likelihood")
    (remark,) = remarks(result)
    assert "C_m alpha −" in remark
    assert result.verdict is Verdict.PARTLY_EXPLAINED
    if method == "evidence":
        assert remark.count("(identification ") == 1
        assert "A significant residual remains" not in result.summary
        same = replace(other, undeclared=BOTH_SQUARES)
        assert not remarks(close_loop([fitted.fly(1, "doublet")], LIGHT, [same.fly(2, "3211")], settings))


def test_a_declared_structure_without_fault_is_not_called_wrong_for_another_flight() -> None:
    fitted, other = Problem(duration=8.0), Problem(undeclared={("C_m", "alpha"): -0.4}, elevator="3211", duration=8.0)
    result = close_loop([fitted.fly(1, "doublet")], LIGHT, [other.fly(2, "3211")], JUDGED)
    assert result.verdict is Verdict.NOTHING_MISSING
    assert "3211 shows other derivatives than the identification" in result.summary
    assert len(remarks(result)) == 1


def test_a_derivative_that_the_validation_flight_does_not_determine_is_not_compared() -> None:
    """A stabiliser that moves on the first flight, to no effect, and is held at 0.01 rad on the second."""
    body, logs = BODIES[0], []
    for n, name in enumerate(("one", "two")):
        log = flown(name, body, SEED + 60 + n, air=0.0)
        moved = 0.01 * (1.0 + np.sin(0.6 * log.time)) if n == 0 else np.full(log.time.size, 0.01)
        channels = {**log.channels, "delta_h": moved}
        logs.append(replace(log, channels=channels, units={**log.units, "delta_h": "rad"}))
    aircraft = aircraft_of(body, 0.05, np.random.default_rng(SEED))
    (slope,) = (d for d in aircraft.derivatives if (d.coefficient, str(d.term)) == ("C_m", "delta_e"))
    stabiliser = replace(slope, term=parse_term("delta_h"))
    found = decided(replace(aircraft, derivatives=(*aircraft.derivatives, stabiliser)), logs[:1], logs[1:])
    compared = {each.entry for each in compared_derivatives(found)}
    assert ("C_m", parse_term("delta_e")) in compared
    assert ("C_m", parse_term("delta_h")) not in compared
    assert not other_derivatives_by_equations(found)


def test_a_step_of_the_validation_flight_is_no_derivative() -> None:
    """The position of the elevator is recorded 0.06 rad off from mid-flight on, as of a trim change."""
    body = BODIES[0]
    logs = [flown(name, body, SEED + 80 + n, air=0.0) for n, name in enumerate(("one", "two"))]
    moved = logs[1]["delta_e"] + np.where(logs[1].time > 0.5 * logs[1].time[-1], 0.06, 0.0)
    logs[1] = replace(logs[1], channels={**logs[1].channels, "delta_e": moved})
    found = decided(aircraft_of(body, 0.05, np.random.default_rng(SEED)), logs[:1], logs[1:])
    assert "two" in found.level_shifts
    assert max(each.distance for each in compared_derivatives(found)) < 4.0
    # Nor is it a prediction that fails: it acts like a constant of that flight, with either structure.
    compared, completed = as_compared(found.completed.problem), found.completed
    reported = {after.coefficient: (before, after) for before, after in found.coefficient_fits if not after.fitted}
    without = {fit.coefficient: fit.r2 for fit in fits_of(compared, completed) if not fit.fitted}
    assert min(fit.r2 for fit in reported["C_m"]) > 0.98
    assert without["C_m"] < 0.8
    assert not lowered_coefficients(found)


@pytest.mark.slow
def test_estimates_of_two_flights_differ_by_their_standard_errors() -> None:
    """Thirty differences of six aircraft in gusts: in units of their standard errors no larger than normal."""
    distances = []
    for n, body in enumerate(BODIES[:6]):
        logs = [flown(name, body, SEED + 20 + 2 * n + i, air=0.5) for i, name in enumerate(("one", "two"))]
        found = decided(aircraft_of(body, 0.08, np.random.default_rng(SEED + n)), logs[:1], logs[1:])
        assert not other_derivatives_by_equations(found)
        distances += [each.distance for each in compared_derivatives(found)]
    assert len(distances) >= 30
    # The standard errors contain more than chance; of 30 normal numbers the mean square exceeds 1.7 once in a hundred.
    assert np.mean(np.square(distances)) < 1.7


def test_a_difference_counts_where_it_is_significant_and_large() -> None:
    entry = ("C_m", parse_term("alpha"))
    assert OtherDerivative("b", entry, -1.5, 0.06, -1.0, 0.08).is_another
    assert not OtherDerivative("b", entry, -1.5, 0.12, -1.0, 0.08).is_another
    assert not OtherDerivative("b", entry, -1.15, 0.01, -1.0, 0.01).is_another
    assert not OtherDerivative("b", entry, -1.5, 0.0, -1.0, 0.0).is_another
    assert not OtherDerivative("b", entry, -1.5, float("inf"), -1.0, 0.1).is_another


def test_a_remark_names_four_derivatives_of_each_flight() -> None:
    rows = [OtherDerivative("b", ("C_m", parse_term(f"alpha^{n}")), n + 1.0, 0.1, n, 0.1) for n in range(1, 7)]
    (one, two) = notes_on_other_derivatives([*rows, replace(rows[0], log="c")])
    assert one.count("(identification ") == 4
    assert " and 2 more. The largest difference is 7.1 standard errors." in one
    assert two.startswith(
        "c shows other derivatives than the identification: C_m alpha 2.00 ± 0.10 (identification 1.00"
    )
