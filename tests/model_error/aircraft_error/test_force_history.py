"""The smoothed model error: against a dense Gaussian, on planted terms, and at another sampling rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from problems import BOTH_SQUARES, LIGHT, NOISE, Problem, declaring, entry, with_channels

from aerosid.effects import ActiveEffect
from aerosid.effects.control import control_lag
from aerosid.effects.disturbance import gust
from aerosid.effects.sensor import sensor_bias
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.maximum_likelihood import refine
from aerosid.model_error.aircraft_error.force_history import ForceHistory, smooth_forces, smoothed_histories
from aerosid.signals.delay_and_lag import lagged
from aerosid.signals.input_noise import InputNoise, initial_covariance
from aerosid.signals.sensor_dynamics import SensorDynamics, lagging, scaled, sensor_states
from aerosid.signals.smoothing import smooth_inputs
from aerosid.signals.trace import StateSizes, Trace

Array = NDArray[np.float64]
COEFFICIENTS = ("C_X", "C_Z", "C_m")


def dense_posterior(
    held: Array,
    columns: Array,
    trace: Trace,
    variance: Array,
    noise: InputNoise,
    start: Array,
    sense: Mapping[int, Callable[[Array], Array]],
) -> tuple[Array, Array]:
    """All unknowns of a record at once: initial state and every sample's input errors, by one linear solution.

    `sense` turns the history (N, U) of some outputs into what their sensors record of it.
    """
    samples, _, _ = columns.shape
    extra = noise.variance.size
    unknowns = 5 + samples * extra
    prior = np.zeros((unknowns, unknowns))
    prior[:5, :5] = start
    for j in range(extra):
        steps = np.abs(np.subtract.outer(np.arange(samples), np.arange(samples)))
        prior[5 + j :: extra, 5 + j :: extra] = noise.variance[j] * noise.memory[j] ** steps
    moved = np.zeros((5, unknowns))
    moved[:, :5] = np.eye(5)
    shown = np.zeros((8, samples, unknowns))
    for k in range(samples):
        own = slice(5 + k * extra, 5 + (k + 1) * extra)
        shown[:, k] = trace.outputs_x[k] @ moved
        shown[:, k, own] += trace.outputs_u[k]
        if k + 1 < samples:
            moved = trace.transition[k] @ moved
            moved[:, own] += trace.start[k]
            moved[:, slice(own.stop, own.stop + extra)] += trace.end[k]
    for i, recorded in sense.items():
        shown[i] = recorded(shown[i])
    A, z = shown.swapaxes(0, 1)[held], columns[held]
    R = np.diag(np.broadcast_to(variance, held.shape)[held])
    gain = prior @ A.T @ np.linalg.inv(A @ prior @ A.T + R)
    mean, covariance = gain @ z, prior - gain @ A @ prior
    return mean[5:].reshape(samples, extra, -1), np.diag(covariance)[5:].reshape(samples, extra)


LAGGING = {1: lagging(2.5), 4: scaled(1.3), 6: lagging(0.4).then(scaled(0.8))}
"""Sensors of some outputs, sampled every second."""

RECORDED: Mapping[int, Callable[[Array], Array]] = {
    1: lambda true: lagged(np.arange(14.0), true, 2.5),
    4: lambda true: 1.3 * true,
    6: lambda true: 0.8 * lagged(np.arange(14.0), true, 0.4),
}
"""The same by the operators that simulated outputs go through."""


@pytest.mark.parametrize(("sensors", "sense"), [({}, {}), (LAGGING, RECORDED)])
@pytest.mark.parametrize("seed", range(3))
def test_smoother_is_the_dense_gaussians_posterior(
    seed: int, sensors: Mapping[int, SensorDynamics], sense: Mapping[int, Callable[[Array], Array]]
) -> None:
    rng = np.random.default_rng(seed)
    samples, extra, width = 14, 3, 2
    trace = Trace(
        outputs=np.zeros((samples, 8)),
        block=np.zeros((samples, 8, 1)),
        transition=0.3 * rng.normal(size=(samples, 5, 5)) + 0.6 * np.eye(5),
        start=rng.normal(size=(samples, 5, extra)),
        end=rng.normal(size=(samples, 5, extra)),
        outputs_x=rng.normal(size=(samples, 8, 5)),
        outputs_u=rng.normal(size=(samples, 8, extra)) * rng.integers(0, 2, size=(8, extra)),
        sizes=StateSizes((0, 0, 0, 0), (0,)),
    )
    held = rng.random((samples, 8)) < 0.5
    held[5:7] = False
    columns = rng.normal(size=(samples, 8, width)) * held[:, :, None]
    noise = InputNoise(np.array([0.3, 0.0, 1.2]), np.array([0.0, 0.5, 0.8]))
    variance, start = rng.uniform(0.1, 2.0, size=8), np.diag([0.5, 0.0, 1.0, 0.2, 0.0])
    errors, variances = np.zeros((samples, extra, width)), np.zeros((samples, extra))
    states = sensor_states(sensors.items(), 1.0, 8)
    first = initial_covariance(start, noise, trace, states)
    smooth_inputs(held, columns, trace, variance, noise, states, first, errors, variances)
    mean, spread = dense_posterior(held, columns, trace, variance, noise, start, sense)
    assert_allclose(errors, mean, atol=1e-10)
    assert_allclose(variances, spread, atol=1e-10)


def smoothed(
    problem: Problem, seed: int, numbers: tuple[float, ...] | None = None
) -> tuple[Problem, ForceHistory, Array]:
    """The model error of a problem's undeclared terms, and the angle of attack that was flown."""
    log = problem.fly(seed)
    completed = replace(problem, aircraft=declaring(LIGHT, problem.undeclared), undeclared={})
    model, manoeuvre = completed.prepared(log)
    found = refine(model, [manoeuvre], model.entries)
    lacking = [entry(*key) for key in problem.undeclared]
    (history,) = smooth_forces(found, [manoeuvre], COEFFICIENTS, lacking, numbers)
    return problem, history, replace(problem, noise=dict.fromkeys(NOISE, 0.0)).fly(seed)["alpha"]


def test_planted_terms_are_where_d_is() -> None:
    """Ten flights: the true contribution lies within two deviations of d at 95 % of the samples, within chance."""
    inside = []
    for seed in range(10):
        problem, history, alpha = smoothed(Problem(undeclared=BOTH_SQUARES), seed)
        assert problem.undeclared == BOTH_SQUARES
        for column, key in ((0, ("C_X", "alpha^2")), (2, ("C_m", "alpha^2"))):
            truth = BOTH_SQUARES[key] * alpha**2
            inside.append(np.mean(np.abs(history.d[:, column] - truth) < 2.0 * history.deviation[:, column]))
    # A wandering error is smoother than the squares here and there: cover of one flight scatters by some 5 %.
    assert 0.90 < float(np.mean(inside)) <= 1.0


def test_d_does_not_lag() -> None:
    _, history, alpha = smoothed(Problem(undeclared=BOTH_SQUARES), 3)
    truth = BOTH_SQUARES["C_m", "alpha^2"] * alpha**2
    shifts = range(-4, 5)
    agreement = [np.corrcoef(np.roll(truth, shift)[10:-10], history.d[10:-10, 2])[0, 1] for shift in shifts]
    assert shifts[int(np.argmax(agreement))] == 0


def test_twice_the_samples_of_twice_the_variance_say_the_same() -> None:
    problem = Problem(undeclared=BOTH_SQUARES)
    finer = replace(
        problem,
        interval=problem.interval / 2.0,
        noise={name: value * np.sqrt(2.0) for name, value in NOISE.items()},
    )
    held = (0.002, 0.0005, 0.001, 5.0, 5.0, 5.0)  # slow enough for many samples to speak for one moment
    _, coarse, _ = smoothed(problem, 1, held)
    _, fine, _ = smoothed(finer, 1, held)
    for column in (0, 2):
        assert np.median(fine.deviation[:, column]) == pytest.approx(np.median(coarse.deviation[:, column]), rel=0.1)
        spread = np.hypot(fine.deviation[::2, column], coarse.deviation[:, column])
        assert np.sqrt(np.mean(((fine.d[::2, column] - coarse.d[:, column]) / spread) ** 2)) < 1.5


def test_pictures_add_up_and_follow_d() -> None:
    problem = Problem(declaring(LIGHT, BOTH_SQUARES))
    model, manoeuvre = problem.prepared(problem.fly(5))
    found = refine(model, [manoeuvre], model.entries)
    chosen = [entry(*key) for key in BOTH_SQUARES]
    histories, correlations = smoothed_histories(found, [manoeuvre], COEFFICIENTS, chosen)
    assert [history.coefficient for history in histories] == list(COEFFICIENTS)
    for history in histories:
        assert history.deviation is not None
        left = (history.d - history.explained) / history.deviation
        assert np.sqrt(np.mean(left**2)) < 1.5
    assert set(correlations) == set(chosen)
    assert min(correlations.values()) > 0.98


LAG = 0.12
"""Time constant of an elevator, s."""


class LateElevator(Problem):
    """The elevator that acts follows the wanted one through a first-order lag."""

    @property
    def deflection(self) -> Array:
        return lagged(self.time, super().deflection[:, None], LAG)[:, 0]


def test_without_a_control_lag_d_is_what_the_late_elevator_lacks() -> None:
    """D is the derivative times acting minus recorded elevator, known from the flight and not from the estimate."""
    inside = []
    for seed in range(4):
        late = LateElevator(elevator="3211")
        lacking = late.deflection - Problem(elevator="3211").deflection
        flown = late.fly(seed)
        log = with_channels(flown, delta_e=flown["delta_e"] - lacking)
        model, manoeuvre = late.prepared(log)
        found = refine(model, [manoeuvre], model.entries, effects=[ActiveEffect(control_lag("delta_e"), (0.1,))])
        histories, _ = smoothed_histories(found, [manoeuvre], COEFFICIENTS, (), found.effects)
        assert {history.effects for history in histories} == {("control lag of delta_e",)}
        pitching = histories[2]
        truth = late.truth.value(entry("C_m", "delta_e")) * lacking
        assert pitching.deviation is not None
        assert np.corrcoef(pitching.d, truth)[0, 1] > 0.97
        assert np.std(pitching.d) == pytest.approx(np.std(truth), rel=0.15)
        assert pitching.correlation > 0.97
        inside.append(np.mean(np.abs(pitching.d - truth) < 2.0 * pitching.deviation))
    assert float(np.mean(inside)) > 0.85


def test_statistics_of_the_air_stay_in_the_model_and_are_told() -> None:
    problem = Problem(elevator="3211")
    model, manoeuvre = problem.prepared(problem.fly(2))
    in_gusts = (ActiveEffect(gust(), (0.05, 100.0)),)
    found = refine(with_columns_of(model, in_gusts), [manoeuvre], model.entries)
    in_air = replace(found, effects=in_gusts)
    with_gust, _ = smoothed_histories(in_air, [manoeuvre], COEFFICIENTS, (), in_air.effects)
    for history in with_gust:
        assert history.kept == ("vertical turbulence",)
        assert not history.effects
        assert_allclose(history.explained, 0.0)


def test_effects_without_which_the_motion_is_another_stay_in_the_model() -> None:
    """A lag of 3 s leaves little of a 3-2-1-1: equations linear about this motion are not those of one without it."""
    problem = Problem(elevator="3211", amplitude=0.2)
    model, manoeuvre = problem.prepared(problem.fly(2))
    found = refine(model, [manoeuvre], model.entries)
    late, bias = ActiveEffect(control_lag("delta_e"), (3.0,)), ActiveEffect(sensor_bias("theta", "rad", 0.001), (0.01,))
    refined = replace(found, effects=(late, bias))
    for history in smoothed_histories(refined, [manoeuvre], COEFFICIENTS, (), refined.effects)[0]:
        assert history.kept == ("control lag of delta_e",)
        assert history.effects == ("sensor bias of theta",)
