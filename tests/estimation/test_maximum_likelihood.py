"""Maximum likelihood: against scipy's least squares and a dense Gaussian, noise-free recovery, scatter over seeds."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.flight import dense_gaussian
from oracles.stacked import stacked
from problems import BOTH_SQUARES, LIGHT, NOISE, SILENT, UNSTABLE, Problem, declaring, entry
from scipy.optimize import least_squares
from scipy.stats import chi2, norm

from aerosid.compiled.cores import on_cores
from aerosid.effects import ActiveEffect
from aerosid.effects.control import control_delay
from aerosid.errors import EstimationError
from aerosid.estimation.competing_fits import fit_competing_structures
from aerosid.estimation.deviations import deviations
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, Start, refine, whiten
from aerosid.estimation.transferred_fit import TransferredFit
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.flight import simulate_outputs
from aerosid.flight_model.response import trace_stretch

Array = NDArray[np.float64]
DECLARING = declaring(LIGHT, BOTH_SQUARES)
"""The light transport with nothing missing: twelve derivatives."""

VARIANCE = np.array([NOISE.get(name, 1.0) for name in LONGITUDINAL.outputs]) ** 2
AS_GIVEN = RefinementSettings(steps=0)


def disturbed(model: AerodynamicModel, share: float = 0.15) -> AerodynamicModel:
    """Start values with relative errors, up and down in turn."""
    return model.with_values(model.values * (1.0 + share * (-1.0) ** np.arange(model.values.size)))


def output_error(
    model: AerodynamicModel, manoeuvres: list[Manoeuvre], free: list[int], variance: Array
) -> tuple[Array, Array]:
    """The textbook's: scipy's least squares on the simulated outputs; estimate and covariance of all parameters."""
    logs = len(manoeuvres)

    def residual(point: Array) -> Array:
        values = model.values.copy()
        values[free] = point[: len(free)]
        parts = []
        for n, manoeuvre in enumerate(manoeuvres):
            state = point[len(free) + 5 * n : len(free) + 5 * n + 5]
            outputs, _ = simulate_outputs(state, manoeuvre.flight, values, model.table, model.constants)
            held = np.isfinite(manoeuvre.flight.measured)
            parts.append(((manoeuvre.flight.measured - outputs) / np.sqrt(variance))[held])
        return np.concatenate(parts)

    start = np.concatenate([model.values[free], *([[99.0, 1.5, 0.0, 0.015, 1500.0]] * logs)])
    scale = np.concatenate([0.05 * (1.0 + np.abs(model.values[free])), *([[1.0, 0.3, 0.01, 0.01, 1.0]] * logs)])
    fit = least_squares(residual, start, jac="3-point", x_scale=scale, method="trf", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    return fit.x, np.linalg.inv(fit.jac.T @ fit.jac)


@pytest.fixture(scope="module")
def two_flights() -> tuple[AerodynamicModel, list[Manoeuvre]]:
    doublet = Problem(DECLARING, duration=6.0, interval=0.05)
    other = replace(doublet, elevator="3211", amplitude=0.045, interval=0.04)
    model, first = doublet.prepared(doublet.fly(seed=1, name="one"))
    _, second = other.prepared(other.fly(seed=2, name="two"))
    return model, [first, second]


@pytest.mark.parametrize("logs", [1, 2])
def test_estimate_and_covariance_are_output_errors(
    two_flights: tuple[AerodynamicModel, list[Manoeuvre]], logs: int
) -> None:
    model, manoeuvres = two_flights[0], two_flights[1][:logs]
    free = [model.index(entry(*key)) for key in (("C_m", "alpha"), ("C_m", "q_hat"), ("C_Z", "alpha"), ("C_X", "1"))]
    wanted, covariance = output_error(model, manoeuvres, free, VARIANCE)
    found = refine(
        disturbed(model).with_values(np.where(np.isin(np.arange(12), free), disturbed(model).values, model.values)),
        manoeuvres,
        [model.entries[i] for i in free],
        variance=VARIANCE,
        settings=RefinementSettings(hold_variance=True, filtering=False),
    )
    assert found.converged
    spread = np.sqrt(np.diag(covariance))
    estimate = np.concatenate([found.model.values[free], *found.states])
    assert_allclose((estimate - wanted) / spread, 0.0, atol=0.02)
    assert_allclose(np.sqrt(np.diag(found.covariance)) / spread, 1.0, atol=1e-3)
    relation = found.covariance / np.outer(spread, spread)
    assert_allclose(relation, covariance / np.outer(spread, spread), atol=2e-3)


def test_noise_levels_are_the_residuals_root_mean_square(
    two_flights: tuple[AerodynamicModel, list[Manoeuvre]],
) -> None:
    """At the likelihood's maximum over the variances, from any start."""
    model, manoeuvres = two_flights
    found = refine(
        model, manoeuvres, model.entries, variance=VARIANCE * 9.0, settings=RefinementSettings(filtering=False)
    )
    squares, counts = np.zeros(8), np.zeros(8)
    for manoeuvre, state in zip(manoeuvres, found.states, strict=True):
        outputs, _ = simulate_outputs(
            state, manoeuvre.flight, np.array(found.model.values), model.table, model.constants
        )
        error = manoeuvre.flight.measured - outputs
        squares += np.nansum(error**2, axis=0)
        counts += np.isfinite(error).sum(axis=0)
    measured = counts > 0
    assert_allclose(found.variance[measured], (squares / np.maximum(counts, 1))[measured], rtol=3e-3)


@pytest.mark.parametrize("problem", [Problem(duration=1.8, interval=0.05), Problem(DECLARING, duration=2.4)])
def test_likelihood_with_elevator_noise_is_the_dense_gaussians(problem: Problem) -> None:
    """Through the stage that the loop uses; noise far below real sensors' makes the problem linear."""
    small = 1e-4
    noise = {name: small * value for name, value in NOISE.items()} | {"delta_e": small * 0.004}
    problem = replace(problem, noise=noise)
    log = problem.fly(seed=3)
    model, manoeuvre = problem.prepared(log)
    rng = np.random.default_rng(0)
    measured = manoeuvre.flight.measured.copy()
    measured[rng.random(measured.shape) < 0.1] = np.nan
    flight = manoeuvre.flight._replace(measured=measured, input_variance=np.array([noise["delta_e"] ** 2]))
    manoeuvre = replace(manoeuvre, flight=flight)
    variance = small**2 * VARIANCE
    best = refine(model, [manoeuvre], (), variance=variance, settings=RefinementSettings(hold_variance=True))
    found = refine(
        model,
        [manoeuvre],
        model.entries,
        states=best.states,
        variance=variance,
        settings=replace(AS_GIVEN, hold_variance=True),
    )
    wanted = dense_gaussian(*stacked(model, flight, best.states[0], variance))
    assert found.cost == pytest.approx(wanted.squares + wanted.log_determinant, abs=0.02 + 1e-3 * wanted.squares)
    scale = np.sqrt(np.diag(wanted.information))
    assert_allclose(found.information / np.outer(scale, scale), wanted.information / np.outer(scale, scale), atol=3e-3)
    parts = list(whiten(found, [manoeuvre]))
    residual = np.concatenate([part.residual for part in parts])
    assert np.nansum(residual**2) == pytest.approx(wanted.squares, rel=2e-3)
    assert (np.isfinite(residual) == np.isfinite(measured)).all()


def test_all_twelve_derivatives_come_back_without_noise() -> None:
    problem = Problem(DECLARING, noise=SILENT)
    model, manoeuvre = problem.prepared(problem.fly())
    found = refine(disturbed(model), [manoeuvre], model.entries)
    assert found.converged
    assert model.values.size == 12
    # The log was flown with steps of 5 ms and is estimated with steps of 15 ms.
    assert_allclose(found.model.values, model.values, rtol=3e-5)


def test_a_channel_that_is_missing_or_full_of_holes_is_no_obstacle() -> None:
    problem = Problem(DECLARING, noise=SILENT)
    model, manoeuvre = problem.prepared(problem.fly())
    measured = manoeuvre.flight.measured.copy()
    measured[np.random.default_rng(1).random(measured.shape) < 0.5] = np.nan
    measured[100:140] = np.nan
    manoeuvre = replace(manoeuvre, flight=manoeuvre.flight._replace(measured=measured))
    found = refine(disturbed(model), [manoeuvre], model.entries)
    assert_allclose(found.model.values, model.values, rtol=1e-4)


def test_entries_that_are_not_free_keep_their_values() -> None:
    problem = Problem(DECLARING, noise=SILENT, duration=6.0)
    model, manoeuvre = problem.prepared(problem.fly())
    start = disturbed(model)
    free = model.entries[:3]
    found = refine(start, [manoeuvre], free)
    assert (found.model.values[3:] == start.values[3:]).all()
    assert (found.model.values[:3] != start.values[:3]).all()
    assert found.free == free


def test_a_prior_is_one_more_measurement() -> None:
    """The posterior of a Gaussian prior in the linear regime: information adds, the mean is the weighted one."""
    problem = Problem(DECLARING, duration=6.0)
    model, manoeuvre = problem.prepared(problem.fly(seed=5))
    free = [entry("C_m", "alpha"), entry("C_m", "delta_e")]
    held = {"variance": VARIANCE, "settings": RefinementSettings(hold_variance=True)}
    alone = refine(model, [manoeuvre], free, **held)
    own = np.sqrt(alone.covariance[0, 0])
    value = alone.model.value(free[0]) + 3.0 * own
    joint = refine(model, [manoeuvre], free, priors=[(free[0], value, own)], **held)
    information = alone.information.copy()
    information[0, 0] += own**-2
    assert_allclose(np.diag(joint.covariance), np.diag(np.linalg.inv(information)), rtol=1e-2)
    # Half way: the prior is as sharp as the flight.
    assert (joint.model.value(free[0]) - alone.model.value(free[0])) / own == pytest.approx(1.5, abs=0.05)
    shift = np.linalg.solve(information, np.array([3.0 / own, *np.zeros(information.shape[0] - 1)]))
    moved = joint.model.value(free[1]) - alone.model.value(free[1])
    assert moved == pytest.approx(shift[1], abs=0.05 * np.sqrt(alone.covariance[1, 1]))


def test_competing_fits_converge_like_single_fits(two_flights: tuple[AerodynamicModel, list[Manoeuvre]]) -> None:
    """The best fit equals the single fit; a terminated fit is worse than it as a single fit as well."""
    model, manoeuvres = two_flights
    missing = [model.entries[n] for n in (3, 5, 9)]
    starts = [
        Start(model.without({entry}), tuple(other for other in model.entries if other != entry)) for entry in missing
    ]
    starts.append(Start(disturbed(model), model.entries))
    settings = RefinementSettings(cost_tolerance=0.01)
    alone = [refine(start.model, manoeuvres, start.free, settings=settings) for start in starts]
    together = fit_competing_structures(starts, manoeuvres, settings, [0.0] * len(starts))
    assert together[-1].converged
    assert together[-1].cost == pytest.approx(alone[-1].cost, abs=0.02)
    for own, among in zip(alone[:-1], together[:-1], strict=True):
        assert own.cost > alone[-1].cost + 1.0
        assert among.cost > alone[-1].cost + 1.0
    assert not all(each.converged for each in together)


def test_a_fit_whose_first_step_went_as_predicted_is_given_up_after_it_where_it_cannot_win(
    two_flights: tuple[AerodynamicModel, list[Manoeuvre]],
) -> None:
    model, manoeuvres = two_flights
    settings = RefinementSettings(cost_tolerance=1e-6, step_tolerance=1e-6)
    start = Start(disturbed(model, 0.01), model.entries)
    single = refine(start.model, manoeuvres, start.free, settings=replace(settings, steps=1, rounds=1))
    whole = refine(start.model, manoeuvres, start.free, settings=settings)
    (lost,) = fit_competing_structures([start], manoeuvres, settings, [0.0], whole.cost - 1e4)
    assert not lost.converged
    assert lost.cost == single.cost > whole.cost
    (kept,) = fit_competing_structures([start], manoeuvres, settings, [0.0], whole.cost - 1e-3)
    assert kept.cost == pytest.approx(whole.cost, abs=0.01)


@pytest.mark.parametrize("level", [None, 1e6])
def test_competing_fits_on_two_cores_equal_those_on_one_bit_for_bit(
    two_flights: tuple[AerodynamicModel, list[Manoeuvre]], level: float | None
) -> None:
    model, manoeuvres = two_flights
    late = ActiveEffect(control_delay("delta_e"), (0.02,))
    fewer = (tuple(other for other in model.entries if other != e) for e in model.entries[:3])
    starts = [Start(model, model.entries, (late,)), *(Start(disturbed(model), free) for free in fewer)]
    settings = RefinementSettings(cost_tolerance=0.01)
    alone = fit_competing_structures(starts, manoeuvres, settings, [0.0] * len(starts), level)
    with on_cores(2):
        shared = fit_competing_structures(starts, manoeuvres, settings, [0.0] * len(starts), level)
    assert alone[0].effects == shared[0].effects
    # Work that cannot be transferred is done here: as slow, with the same bits.
    sent = pickle.loads(pickle.dumps(TransferredFit.of(alone[0])))
    assert sent.refinement(starts[0].model, starts[0].free, starts[0].effects).effects == alone[0].effects
    for one, other in zip(alone, shared, strict=True):
        assert (one.cost, one.converged) == (other.cost, other.converged)
        assert one.model.values.tobytes() == other.model.values.tobytes()
        assert one.information.tobytes() == other.information.tobytes()


def test_an_unstable_aircraft_is_estimated_from_wrong_start_values() -> None:
    problem = Problem(UNSTABLE, amplitude=0.02, duration=4.0)
    model, manoeuvre = problem.prepared(problem.fly(seed=2))
    pressure = 0.5 * LIGHT.density * 100.0**2 * LIGHT.wing_area
    lift = pressure * 5.68 / (LIGHT.mass * 100.0)
    stiffness = pressure * LIGHT.mean_chord * 0.53 / LIGHT.I_yy
    damping = pressure * LIGHT.mean_chord**2 * 16.3 / (LIGHT.I_yy * 200.0)
    short_period = np.linalg.eigvals(np.array([[-lift, 1.0], [stiffness, -damping]])).real.max()
    assert np.log(2.0) / short_period == pytest.approx(1.0, abs=0.1)
    found = refine(disturbed(model), [manoeuvre], model.entries)
    ratio = (found.model.values - model.values) / np.sqrt(np.diag(found.covariance))[: model.values.size]
    # Ten normal numbers within 4.5: one false alarm in 15,000.
    assert np.abs(ratio).max() < 4.5
    assert abs(found.model.value(entry("C_m", "alpha")) - 0.53) < 0.03


def test_unusable_start_values_are_refused_with_a_sentence() -> None:
    problem = Problem(DECLARING, duration=6.0)
    model, manoeuvre = problem.prepared(problem.fly())
    wild = model.with_values(np.where(model.values == model.value(entry("C_m", "alpha")), 1e9, model.values * 1e3))
    with pytest.raises(EstimationError, match=r"leaves \|alpha\| < 1.5 rad.*check the signs"):
        refine(wild, [manoeuvre], model.entries)


def scatter(problem: Problem, seeds: range) -> tuple[Array, Array, list[Refinement]]:
    """Errors over reported standard errors, corrected and white, one row per seed."""
    corrected, white, estimates = [], [], []
    for seed in seeds:
        model, manoeuvre = problem.prepared(problem.fly(seed=seed))
        found = refine(model, [manoeuvre], model.entries)
        spread = deviations(found, [manoeuvre])
        error = found.model.values - model.values
        corrected.append(error / spread.corrected)
        white.append(error / spread.white)
        estimates.append(found)
    return np.array(corrected), np.array(white), estimates


def calibrated(ratios: Array, false_alarm: float, widening: float) -> None:
    """Bias and scatter of errors over standard errors, Bonferroni over the derivatives.

    `widening` is the tolerated relative error of the standard errors themselves, in addition to chance.
    """
    seeds, count = ratios.shape
    share = false_alarm / (2 * count)
    bias = ratios.mean(axis=0) * np.sqrt(seeds)
    assert np.abs(bias).max() < widening * norm.isf(share / 2)
    squares = (ratios**2).sum(axis=0)
    assert squares.max() < widening**2 * chi2.isf(share / 2, seeds)
    assert squares.min() > chi2.ppf(share / 2, seeds) / widening**2


QUICK = Problem(DECLARING, duration=8.0)


def test_deviations_are_the_scatter_over_forty_seeds() -> None:
    """False alarms: one in 1000 runs, were the standard errors exact; they may be 15 % off."""
    corrected, white, _ = scatter(QUICK, range(40))
    calibrated(corrected, 1e-3, 1.15)
    calibrated(white, 1e-3, 1.15)


@pytest.mark.slow
@pytest.mark.parametrize("interval", [0.02, 0.03, 0.1])
def test_deviations_are_the_scatter_over_four_hundred_seeds(interval: float) -> None:
    """False alarms: one in 1000 runs, were the standard errors exact; they may be 7 % off."""
    corrected, _, estimates = scatter(replace(QUICK, interval=interval), range(1000, 1400))
    calibrated(corrected, 1e-3, 1.07)
    levels = np.sqrt(np.mean([found.variance for found in estimates], axis=0))
    for i, name in enumerate(LONGITUDINAL.outputs):
        if name in NOISE:
            assert levels[i] / NOISE[name] == pytest.approx(1.0, abs=0.03), name


def test_no_kernel_is_compiled_again_for_values_that_may_not_be_written() -> None:
    """The largest kernel takes ten seconds; a model's own values are held against writing."""
    model, manoeuvre = Problem(duration=2.0).prepared(Problem(duration=2.0).fly(1))
    likelihood = Likelihood(model, (manoeuvre,), ())
    next(likelihood.traced(0, np.array(model.values), manoeuvre.first_state, ()))
    known = len(trace_stretch.signatures)  # type: ignore[attr-defined]
    assert not model.values.flags.writeable
    next(likelihood.traced(0, model.values, manoeuvre.first_state, ()))
    assert len(trace_stretch.signatures) == known  # type: ignore[attr-defined]
