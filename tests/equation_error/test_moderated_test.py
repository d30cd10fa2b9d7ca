"""The moderated t-test by Monte Carlo: false alarms in stationary noise and in noise that differs between blocks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from equations_decided import decided
from numpy.typing import NDArray
from scipy.stats import binom, chi2

from aerosid.equation_error.regression.coloured_regression import colour_of
from aerosid.equation_error.regression.design import Design, Weights
from aerosid.equation_error.regression.least_squares import Solution, solve
from aerosid.equation_error.regression.moderated_test import moderated_p_value, usual_freedom
from aerosid.equation_error.settings import DEVIATIONS
from benchmarks.turbulent_false_alarms import pair

Array = NDArray[np.float64]

BLOCKS = 40
LENGTH = DEVIATIONS.lags + 1
SAMPLES = BLOCKS * LENGTH
LEVEL = 0.02
"""Of the false alarms."""

FREEDOM = 4.0
"""Of the inverse chi squared distribution of the blocks' variances."""


def solved(noise: Array) -> tuple[Design, Solution]:
    """A constant and a column that is non-zero in two blocks of a record only, on noise (N,) alone."""
    shown = np.zeros(noise.size)
    shown[20:26], shown[60:64] = 1.0, -0.7
    design = Design(
        segments=((0, "C_m"),),
        groups=(("C_m", 0.3),),
        bounds=np.array([0, noise.size]),
        target=noise,
        columns=np.column_stack([np.ones(noise.size), shown]),
        unknowns=(("one", ("C_m", "1")), ("term", ("C_m", "shown"))),
        inverse_deviations=np.zeros(2),
        floors=np.zeros(1),
        instruments=(None,),
    )
    return design, solve(design, Weights((colour_of(np.ones(1)),), np.array([noise.std()])))


def nonstationary(generator: np.random.Generator, samples: int, freedom: float) -> Array:
    """White noise with a different variance in every block."""
    noise = generator.standard_normal(samples)
    for first, stop in pairwise(range(0, samples + 1, LENGTH)):
        noise[first:stop] *= np.sqrt(freedom / generator.chisquare(freedom))
    return noise


def false_alarms(noises: list[Array]) -> tuple[int, int]:
    """Frequency of p-values below the level, of the moderated test and of least squares."""
    moderated = plain = 0
    for noise in noises:
        design, solution = solved(noise)
        value = float(solution.values[1])
        moderated += moderated_p_value(design, solution, 1, value) < LEVEL
        plain += value**2 > chi2.isf(LEVEL, 1) * float(solution.covariance[1, 1])
    return moderated, plain


def test_the_false_alarm_rate_holds_where_the_noise_of_blocks_differs() -> None:
    generator, trials = np.random.default_rng(5), 600
    moderated, plain = false_alarms([nonstationary(generator, SAMPLES, FREEDOM) for _ in range(trials)])
    # The blocks' own variance is not wholly the usual one's: up to twice the level is possible with so few of them.
    assert moderated <= binom.ppf(0.999, trials, 2.0 * LEVEL)
    assert plain > 2.5 * moderated


def test_the_false_alarm_rate_is_exact_in_stationary_noise() -> None:
    generator, trials = np.random.default_rng(6), 600
    moderated, _ = false_alarms([generator.standard_normal(SAMPLES) for _ in range(trials)])
    assert binom.ppf(0.001, trials, 0.4 * LEVEL) <= moderated <= binom.ppf(0.999, trials, LEVEL)


def test_degrees_of_freedom_are_those_of_the_blocks_scatter() -> None:
    generator = np.random.default_rng(7)
    many = 1200 * LENGTH
    for freedom in (2.0, FREEDOM, 10.0):
        design, solution = solved(nonstationary(generator, many, freedom))
        assert 0.75 * freedom < usual_freedom(design, solution, "C_m") < 1.35 * freedom
    design, solution = solved(generator.standard_normal(many))
    assert usual_freedom(design, solution, "C_m") > 40.0


def test_a_coarsely_sampled_elevator_gives_no_false_term() -> None:
    """At 10 Hz the instants of its steps are unknown: one peak of alpha contains that noise and a hinge."""
    flights = pair(41, 30)
    assert decided(flights.aircraft, [flights.logs[0]], [flights.logs[1]]).findings == ()
