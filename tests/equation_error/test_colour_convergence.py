"""Terms and residual colours converge to one estimate, wherever the estimate of the colours began."""

from __future__ import annotations

import numpy as np
import pytest
from equations_decided import declared

from aerosid.equation_error.regression.colour_convergence import converged
from aerosid.equation_error.regression.coloured_regression import colour_of
from aerosid.equation_error.regression.design import Weights
from aerosid.equation_error.regression.estimate import Estimate, estimate
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SEEDS = 7800
"""Of tests; published tables and trials begin elsewhere."""


@pytest.fixture(scope="module")
def in_gusts() -> Estimate:
    aircraft = aircraft_of(BODIES[0], 0.08, np.random.default_rng(SEEDS))
    logs = [flown(name, BODIES[0], SEEDS + n, air=1.0, seconds=24.0) for n, name in enumerate("ab")]
    return declared(aircraft, logs[:1], logs[1:])


def from_colour(found: Estimate, pole: float) -> Estimate:
    """The estimate begun with a first-order colour."""
    weights = found.solution.weights
    colours = (colour_of(np.array([1.0, -pole])),) * len(weights.colours)
    return estimate(found.problem, found.point, Weights(colours, 3.0 * weights.sizes))


def test_estimates_begun_with_different_colours_converge_to_the_same_terms(in_gusts: Estimate) -> None:
    begun = [in_gusts, from_colour(in_gusts, 0.9), from_colour(in_gusts, -0.5)]
    known = np.sqrt(np.diag(in_gusts.solution.covariance))
    apart = [
        np.ptp([each.solution.values for each in group], axis=0) / known for group in (begun, map(converged, begun))
    ]
    assert max(apart[1]) < 0.01
    assert max(apart[0]) > 5.0 * max(apart[1])


def test_the_converged_estimate_is_as_likely_as_its_start(in_gusts: Estimate) -> None:
    assert converged(in_gusts).log_likelihood > in_gusts.log_likelihood - 0.02
