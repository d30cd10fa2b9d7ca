"""A vane that was late on the identification flight alone: what the validation flight loses by it, and by what."""

from __future__ import annotations

import numpy as np
import pytest
from equations_decided import decided

from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
from aerosid.search.lowered_coefficients import LOWERED, lowered_coefficients
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

SEEDS = 9700
"""Of these tests; published tables and trials begin elsewhere."""

LATE = Wrong(delay={"alpha": 0.15})
JUDGED = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)


def flights(number: int, unseen: Wrong) -> tuple[FlightLog, FlightLog]:
    """A flight of 40 s with a late vane, and one of 15 s for validation."""
    body = BODIES[number]
    fitted = flown("a", body, SEEDS + number, air=0.3, wrong=LATE, seconds=40.0)
    return fitted, flown("b", body, SEEDS + 100 + number, air=0.3, wrong=unseen, seconds=15.0)


def decision_on(number: int, unseen: Wrong) -> EquationErrorDecision:
    fitted, other = flights(number, unseen)
    return decided(aircraft_of(BODIES[number], 0.08, np.random.default_rng(number)), [fitted], [other])


@pytest.mark.parametrize("number", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_each_coefficient_is_listed_with_the_effect_that_lowers_it(number: int) -> None:
    decision = decision_on(number, NOTHING)
    assert [row.hypothesis.label for row in decision.findings] == [("sensor_delay", "alpha", "")]
    rows = lowered_coefficients(decision)
    assert [row.coefficient for row in rows] == ["C_X", "C_Z", "C_m"]
    for row in rows:
        assert row.log == "b"
        assert row.after < row.before - 5.0 * LOWERED.fall
        assert row.significant
        # It is the only effect: without it the structure is the declared one.
        effect = row.effect
        assert effect is not None
        assert effect.label == ("sensor_delay", "alpha", "")
        assert effect.r2 == pytest.approx(row.before, abs=1e-3)
        # The other flight was flown with a vane that is not late.
        assert effect.differs
        assert abs(effect.alone) < 3.0 * effect.alone_std_error


def test_a_vane_that_is_late_on_both_flights_lowers_nothing() -> None:
    decision = decision_on(1, LATE)
    assert [row.hypothesis.kind for row in decision.findings] in (["sensor_delay"], ["sensor_lag"])
    assert lowered_coefficients(decision) == ()


def test_the_user_is_told_and_the_flights_are_not_explained() -> None:
    fitted, unseen = flights(1, NOTHING)
    result = close_loop([fitted], aircraft_of(BODIES[1], 0.08, np.random.default_rng(1)), [unseen], JUDGED)
    assert result.verdict is Verdict.PARTLY_EXPLAINED
    assert "predicts C_X of b, C_Z of b and C_m of b worse than the declared structure" in result.summary
    notes = [note for note in result.notes if "is predicted worse by the completed model" in note]
    assert len(notes) == 3
    assert all("Without a sensor delay of alpha it would be 0.9" in note for note in notes)
    assert all("the flights differ in it" in note for note in notes)
