"""A validation flight of another loading or aircraft shows other derivatives, and one of the same does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided

from aerosid.flight_model.terms import parse_term
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict, notes_on_other_derivatives
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


@pytest.mark.parametrize("air", [0.0, 0.6])
def test_a_validation_flight_of_another_loading_is_told_with_its_derivatives(air: float) -> None:
    """A centre of gravity further ahead: half as much again of static stability."""
    result = closed(air, Wrong(terms={("C_m", "alpha"): -0.4}))
    (remark,) = remarks(result)
    assert remark.startswith("unseen shows other derivatives: C_m alpha −1.2")
    assert remark.count(" there and ") == 1
    assert result.verdict is not Verdict.EXPLAINED
    assert ("aero_term", "C_X") in {(effect.kind, effect.where) for effect in result.effects}


@pytest.mark.parametrize("air", [0.0, 0.6])
def test_a_validation_flight_of_the_same_aircraft_is_not(air: float) -> None:
    assert not remarks(closed(air, NOTHING))


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
    assert one.count(" there and ") == 4
    assert "2 more" in one
    assert two.startswith("c shows other derivatives: C_m alpha 2.00 ± 0.10 there and 1.00 ± 0.10 on the")
