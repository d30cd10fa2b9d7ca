"""The paper's chain: a planted coefficient comes back whatever the weights, the sampling and the filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from problems import BOTH_SQUARES, LIGHT, NOISE, SILENT, Problem, declaring, entry

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.model_error.aircraft_error.forward_estimate import estimate_aircraft_error
from aerosid.model_error.paper_chain.chain import Chain, ChainSettings, choose_error_density, feed, run_chain

SQUARES = [entry(*key) for key in BOTH_SQUARES]


def noisy_by_name(manoeuvre: Manoeuvre, scale: float = 1.0) -> Manoeuvre:
    """A manoeuvre without noise that the chain takes for a noisy one: weights and filter are those of flight."""
    return replace(manoeuvre, noise=scale * np.array([NOISE.get(name, np.nan) for name in LONGITUDINAL.outputs]))


def chain_on(problem: Problem, factor: float, settings: ChainSettings, scale: float = 1.0) -> Chain:
    """The chain with the planted terms in its structure and the density at a multiple of the one it would choose."""
    model, manoeuvre = problem.prepared(problem.fly())
    manoeuvre = noisy_by_name(manoeuvre, scale)
    density = tuple(factor * choose_error_density(model, [manoeuvre], settings))
    model = model.extended(SQUARES)
    return run_chain(model, [manoeuvre], model.entries, replace(settings, error_density=density))


def errors_of(chain: Chain) -> np.ndarray:
    return np.array([chain.model.value(e) / BOTH_SQUARES[e[0], str(e[1])] - 1.0 for e in SQUARES])


@pytest.mark.parametrize("filtering", ["off", "zero-phase", "causal"])
@pytest.mark.parametrize("interval", [0.01, 0.03, 0.1])
@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_planted_coefficients_come_back_within_one_per_cent(filtering: str, interval: float, factor: float) -> None:
    problem = Problem(undeclared=BOTH_SQUARES, noise=SILENT, interval=interval, duration=6.0)
    chain = chain_on(problem, factor, ChainSettings(filtering=filtering))
    assert np.abs(errors_of(chain)).max() < 0.01


def test_a_large_manoeuvre_at_low_gain_comes_back_too() -> None:
    problem = Problem(undeclared=BOTH_SQUARES, noise=SILENT, interval=0.1, amplitude=0.1)
    chain = chain_on(problem, 1e-3, ChainSettings(filtering="off"), scale=5.0)
    assert np.abs(errors_of(chain)).max() < 0.01


def test_the_filter_runs_where_it_is_asked_for() -> None:
    """All channels of an equation, inputs included, pass one filter; the weight is that of the filtered noise."""
    problem = Problem(undeclared=BOTH_SQUARES)
    _, manoeuvre = problem.prepared(problem.fly(seed=1))
    quiet = Problem(undeclared=BOTH_SQUARES, noise=SILENT)
    _, clean = quiet.prepared(quiet.fly())
    raw = feed(manoeuvre, ChainSettings(filtering="off"))
    assert raw.butterworth is None
    assert (raw.flight.measured[:, 1] == manoeuvre.flight.measured[:, 1]).all()
    for filtering in ("zero-phase", "causal"):
        fed = feed(manoeuvre, ChainSettings(filtering=filtering))
        assert fed.butterworth is not None
        assert fed.butterworth.zero_phase == (filtering == "zero-phase")
        assert (fed.flight.inputs[:, 8] != manoeuvre.flight.inputs[:, 8]).any()
        assert (fed.variance < raw.variance).all()
    fed = feed(manoeuvre, ChainSettings())
    inner = slice(30, -30)
    for i in range(4):
        left = (fed.flight.measured - clean.flight.measured)[inner, i]
        # Where the motion passes unchanged, what is left is the noise that the weight says.
        assert np.var(left) / fed.variance[i] == pytest.approx(1.0, abs=0.5), LONGITUDINAL.outputs[i]


def test_the_users_weights_are_used_as_given() -> None:
    problem = Problem(undeclared=BOTH_SQUARES, duration=6.0)
    model, manoeuvre = problem.prepared(problem.fly(seed=1))
    chain = run_chain(model, [manoeuvre], model.entries, ChainSettings(error_density=(1.0, 2.0, 0.03, 0.0)))
    assert chain.error_density.tolist() == [1.0, 2.0, 0.03, 0.0]


def test_the_chosen_weight_is_the_most_likely_of_its_neighbours() -> None:
    settings = ChainSettings()
    for problem in (Problem(undeclared=BOTH_SQUARES), Problem(declaring(LIGHT, {("C_m", "alpha"): -0.68}), {})):
        model, manoeuvre = problem.prepared(problem.fly(seed=4))
        model = model.with_values(model.values * 0.95)
        chosen = choose_error_density(model, [manoeuvre], settings)
        raw = feed(manoeuvre, replace(settings, filtering="off"))

        def cost(factor: float, model=model, raw=raw, chosen=chosen) -> float:
            found = estimate_aircraft_error(
                model, raw.flight, raw.variance, factor * chosen, respond=False, likelihood=True
            )
            return found.cost

        assert cost(1.0) <= min(cost(10.0**-0.5), cost(10.0**0.5))
        assert chosen[3] == 0.0


def test_several_logs_are_one_regression() -> None:
    """Noise-free logs of two manoeuvres agree on the planted values, and their information adds."""
    one = Problem(undeclared=BOTH_SQUARES, noise=SILENT, duration=6.0)
    two = replace(one, elevator="3211", amplitude=0.045, interval=0.05)
    model, first = one.prepared(one.fly(name="one"))
    _, second = two.prepared(two.fly(name="two"))
    model = model.extended(SQUARES)
    settings = ChainSettings(error_density=(0.2, 30.0, 0.08, 0.0))
    both = [noisy_by_name(first), noisy_by_name(second)]
    chain = run_chain(model, both, model.entries, settings)
    assert np.abs(errors_of(chain)).max() < 0.01
    assert len(chain.fed) == 2


def test_without_noise_every_declared_derivative_comes_back_too() -> None:
    problem = Problem(undeclared=BOTH_SQUARES, noise=SILENT)
    model, manoeuvre = problem.prepared(problem.fly())
    start = model.with_values(model.values * (1.0 + 0.05 * (-1.0) ** np.arange(model.values.size)))
    start = start.extended(SQUARES)
    settings = ChainSettings(filtering="off", error_density=(20.0, 3000.0, 8.0, 0.0), iterations=8)
    chain = run_chain(start, [noisy_by_name(manoeuvre)], start.entries, settings)
    assert_allclose(chain.model.values[: model.values.size], model.values, rtol=0.01)


def test_deviations_exist_on_a_deficient_model_at_ten_milliseconds() -> None:
    problem = Problem(undeclared=BOTH_SQUARES, interval=0.01)
    for seed in (1, 2):
        model, manoeuvre = problem.prepared(problem.fly(seed=seed))
        assert np.isfinite(run_chain(model, [manoeuvre], model.entries).std_errors).all()


def test_deviations_cover_terms_that_a_small_manoeuvre_hardly_tells_apart() -> None:
    """Powers of alpha on a doublet of .02 degrees: half the variances were negative, the rest any power of ten off."""
    powers = {(coefficient, f"alpha^{k}"): 0.0 for coefficient in ("C_Z", "C_m") for k in (2, 3, 4)}
    quiet = {name: 0.1 * deviation for name, deviation in NOISE.items()}
    ratios = []
    for seed in range(6):
        problem = Problem(declaring(LIGHT, powers), amplitude=3e-4, noise=quiet)
        model, manoeuvre = problem.prepared(problem.fly(seed=seed))
        chain = run_chain(model, [manoeuvre], model.entries)
        wanted = np.array([problem.truth.value(e) for e in chain.entries])
        ratios.append((np.array([chain.model.value(e) for e in chain.entries]) - wanted) / chain.std_errors)
    steep = [n for n, (coefficient, term) in enumerate(chain.entries) if (coefficient, str(term)) in powers]
    assert 0.5 < float(np.sqrt(np.mean(np.square(ratios)[:, steep]))) < 2.5


@pytest.mark.slow
def test_least_squares_deviations_cover_the_errors() -> None:
    """Over thirty flights with noise: 95 % intervals hold the truth in at least three of four cases, filter or not."""
    for filtering in ("off", "zero-phase"):
        ratios = []
        for seed in range(30):
            problem = Problem(undeclared=BOTH_SQUARES)
            model, manoeuvre = problem.prepared(problem.fly(seed=seed))
            model = model.extended(SQUARES)
            chain = run_chain(model, [manoeuvre], model.entries, ChainSettings(filtering=filtering))
            truth = problem.truth
            wanted = np.array([truth.value(e) for e in chain.entries])
            ratios.append((np.array([chain.model.value(e) for e in chain.entries]) - wanted) / chain.std_errors)
        inside = np.mean(np.abs(np.array(ratios)) < 1.96, axis=0)
        assert inside.min() > 0.75, (filtering, dict(zip([str(e[1]) for e in model.entries], inside, strict=True)))
