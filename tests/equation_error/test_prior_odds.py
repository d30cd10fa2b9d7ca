"""Likelihood loss of coefficients by correcting an identified instrument error, and the prior odds of their terms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from equations_decided import identified
from hypothesis import given
from hypothesis import strategies as st

from aerosid.effects import ActiveEffect
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.joint_errors import with_errors_held
from aerosid.equation_error.selection.penalties import criterion_for
from aerosid.equation_error.selection.prior_odds import (
    likelihood_losses,
    log_likelihood_by_coefficient,
    with_raised_odds,
)
from aerosid.flight_model.terms import parse_term
from aerosid.search.hypotheses import term_hypotheses
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

EVEN = 0.5
SEEDS = 5000
"""Of tests; published tables and trials begin elsewhere."""

LATE = Wrong(delay={"alpha": 0.12})


def errors_of(seed: int, air: float, wrong: Wrong) -> InstrumentErrors:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS + seed))
    one, two = (flown(name, body, SEEDS + 10 * seed + n, air=air, wrong=wrong) for n, name in enumerate(("one", "two")))
    return identified(aircraft, [one], [two])


def with_errors_removed(errors: InstrumentErrors, effects: Sequence[ActiveEffect]) -> Estimate:
    """The declared coefficients of all flights with some instrument errors corrected."""
    found = errors.selected.estimate
    whole = RegressionProblem(found.problem.recordings, COEFFICIENT, found.problem.settings, all_fitted=True)
    return estimate(whole, with_errors_held(errors.start, effects))


@pytest.mark.parametrize(("seed", "air"), [(70, 0.0), (71, 0.6)])
def test_correcting_a_true_delay_loses_no_likelihood_and_a_false_one_much(seed: int, air: float) -> None:
    late, clean = errors_of(seed, air, LATE), errors_of(seed, air, NOTHING)
    effects = late.selected.estimate.point.effects
    assert [active.effect.where for active in effects] == ["alpha"]
    assert not clean.selected.chosen
    assert likelihood_losses(with_errors_removed(clean, ()), slice(0, 0)) == {}
    assert likelihood_losses(with_errors_removed(clean, effects), slice(1, 1)) == {}  # declared
    assert (
        sum(likelihood_losses(with_errors_removed(late, effects), slice(0, 1)).values()) < 3.0
    )  # e^-3: 1 flight in 20
    wrong = with_errors_removed(clean, effects)
    assert sum(log_likelihood_by_coefficient(wrong).values()) == pytest.approx(wrong.log_likelihood, rel=1e-12)
    assert likelihood_losses(wrong, slice(0, 1))["C_Z"] > 20.0


TERMS = [("C_X", "alpha^2"), ("C_X", "q_hat"), ("C_m", "alpha^3"), ("C_L", "alpha^2"), ("C_Z", "delta_e^2")]


@given(st.dictionaries(st.sampled_from(["C_X", "C_Z", "C_m"]), st.floats(0.0, 1e4), max_size=3))
def test_odds_rise_by_the_likelihood_loss_up_to_even_odds(falls: dict[str, float]) -> None:
    hypotheses = term_hypotheses([(name, parse_term(term)) for name, term in TERMS])
    before = criterion_for(hypotheses, 500, 0.01, 0.25)
    after = with_raised_odds(before, hypotheses, falls, EVEN)
    for hypothesis in hypotheses:
        (coefficient,) = {name for name, _ in hypothesis.entries}
        touched = ("C_X", "C_Z") if coefficient == "C_L" else (coefficient,)
        lowered = before.penalty(hypothesis) - after.penalty(hypothesis)
        assert -1e-9 <= lowered <= max(falls.get(name, 0.0) for name in touched) + 1e-9
    for name in ("C_X", "C_m"):
        own = [h for h in hypotheses if all(c == name for c, _ in h.entries)]
        together = sum(after.allowed_false_alarm(h) for h in own)
        assert together <= EVEN * (1.0 + 1e-9)
        if falls.get(name, 0.0) > 20.0:
            assert together > 0.1
    assert np.isclose(after.false_alarm, before.false_alarm)
