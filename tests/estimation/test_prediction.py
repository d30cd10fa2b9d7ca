"""One-step predictions against a dense Gaussian: all samples stacked, one covariance matrix, one Cholesky factor."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.flight import central_difference, dense_gaussian
from oracles.stacked import stacked
from problems import BOTH_SQUARES, LIFT_AND_DRAG, UNSTABLE, Problem

from aerosid.estimation.prediction import predict_stretch, start_carry
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.flight_model.simulation import trim

Array = NDArray[np.float64]
VARIANCE = np.array([0.15, 0.0015, 0.0012, 0.0012, 0.02, 0.05, 0.01, 0.3]) ** 2
POSITIONS = np.zeros((8, 3))
POSITIONS[1] = 3.0, 0.2, -0.4
POSITIONS[4] = 1.0, 0.0, 0.5
POSITIONS[5] = -0.7, 0.1, 0.2


@dataclass(frozen=True)
class Prediction:
    predicted: Array
    white: Array
    columns: Array
    log_sum: float
    inside: bool

    @property
    def squares(self) -> float:
        return float(np.nansum(self.white**2))

    @property
    def information(self) -> Array:
        flat = self.columns.reshape(-1, self.columns.shape[2])
        return flat.T @ flat

    @property
    def gradient(self) -> Array:
        return self.columns.reshape(-1, self.columns.shape[2]).T @ np.nan_to_num(self.white).ravel()


def predict(
    model: AerodynamicModel,
    flight: Flight,
    start: Array,
    variance: Array = VARIANCE,
    free: tuple[int, ...] | None = None,
    cuts: tuple[int, ...] = (),
) -> Prediction:
    """The recursion over a whole record, in as many stretches as there are cuts and one more."""
    places = np.arange(model.values.size) if free is None else np.array(free, dtype=np.int64)
    samples = flight.time.size
    carry = start_carry(start, flight, places.size)
    width = carry.columns.shape[1]
    predicted, white = np.empty((samples, 8)), np.empty((samples, 8))
    columns = np.zeros((samples, 8, width))
    total, inside = 0.0, True
    edges = (0, *cuts, samples)
    for first, last in itertools.pairwise(edges):
        # Each stretch gets arrays of its own: the kernel writes from row 0.
        parts = np.empty((last - first, 8)), np.empty((last - first, 8)), np.zeros((last - first, 8, width))
        good, log_sum = predict_stretch(
            first, last, carry, flight, model.values, places, model.table, model.constants, variance, *parts
        )
        predicted[first:last], white[first:last], columns[first:last] = parts
        total += log_sum
        inside = inside and good
    return Prediction(predicted, white, columns, total, inside)


def make(
    problem: Problem,
    seed: int,
    *,
    input_noise: float = 0.0,
    output_scale: float = 1.0,
    irregular: bool = False,
    ramp: float = 1.0,
) -> tuple[AerodynamicModel, Flight, Array]:
    """A flight with every sensor away from the centre of gravity, with missing samples, and its start.

    `ramp`: part of each interval in which the elevator moves.
    """
    rng = np.random.default_rng(seed)
    model = problem.truth
    level = trim(model, problem.airspeed, problem.aircraft.density, problem.aircraft.mass)
    time = problem.time
    if irregular:
        time = time + rng.uniform(0.0, 0.6 * problem.interval, time.size)
    time.setflags(write=False)  # as a log's: the kernel is compiled once for both
    inputs = np.zeros((time.size, len(model.columns)))
    inputs[:, :4] = problem.aircraft.density, level.thrust, problem.aircraft.mass, 340.0
    inputs[:, 4], inputs[:, 5], inputs[:, 7] = 0.1 * np.sin(time), 0.1 * np.cos(time), 0.03
    true = inputs.copy()
    true[:, 8] = level.delta_e + problem.deflection
    inputs[:, 8] = true[:, 8] + input_noise * rng.standard_normal(time.size)
    start = np.array([100.0 * np.cos(level.alpha), 100.0 * np.sin(level.alpha), 0.0, level.alpha, 900.0])
    input_variance = np.zeros(inputs.shape[1] - 8)
    held = np.array([8] if ramp < 1.0 else [], dtype=np.int64)
    flight = Flight(time, true, np.zeros((0, 8)), POSITIONS, 2, input_variance, held, ramp)
    clean, _ = simulate_outputs(start, flight, model.values, model.table, model.constants)
    measured = clean + output_scale * np.sqrt(VARIANCE) * rng.standard_normal(clean.shape)
    measured[rng.random(measured.shape) < 0.15] = np.nan
    measured[5] = np.nan
    input_variance[0] = input_noise**2
    return model, Flight(time, inputs, measured, POSITIONS, 2, input_variance, held, ramp), start


SMALL = 1e-4
"""Noise this much below real sensors': the nonlinearity that the dense solution omits falls with its square."""


@pytest.mark.parametrize(
    ("problem", "input_noise", "ramp"),
    [
        (Problem(undeclared=BOTH_SQUARES, duration=1.8, interval=0.05), 0.003, 1.0),
        (Problem(undeclared=BOTH_SQUARES, duration=1.8, interval=0.05), 0.05, 1.0),
        (Problem(undeclared=BOTH_SQUARES, duration=1.8, interval=0.05), 0.05, 0.3),
        (Problem(LIFT_AND_DRAG, {("C_m", "alpha_dot_hat"): -5.0}, duration=1.8, interval=0.05), 0.01, 1.0),
        (Problem(UNSTABLE, amplitude=0.01, duration=2.4, interval=0.08), 0.01, 1.0),
    ],
    ids=["elevator noise", "large elevator noise", "held elevator with noise", "alpha dot", "unstable"],
)
def test_likelihood_and_information_are_the_dense_gaussians(problem: Problem, input_noise: float, ramp: float) -> None:
    """Elevator noise acts on both sides of its sample and directly on the accelerometers."""
    variance = VARIANCE * SMALL**2
    noise = input_noise * SMALL
    model, flight, start = make(problem, 1, input_noise=noise, output_scale=SMALL, irregular=True, ramp=ramp)
    found = predict(model, flight, start, variance)
    wanted = dense_gaussian(*stacked(model, flight, start, variance))
    assert found.inside
    assert found.log_sum == pytest.approx(wanted.log_determinant, abs=1e-3)
    assert found.squares == pytest.approx(wanted.squares, rel=1e-3)
    scale = np.sqrt(np.diag(wanted.information))
    assert_allclose(found.information / np.outer(scale, scale), wanted.information / np.outer(scale, scale), atol=2e-3)
    assert_allclose(found.gradient / scale, wanted.gradient / scale, atol=5e-3 * np.sqrt(wanted.squares))


def test_the_dense_solution_depends_on_the_elevators_noise() -> None:
    """Without it the sum of squares is far off, so the agreement above is no accident of small terms."""
    variance = VARIANCE * SMALL**2
    problem = Problem(undeclared=BOTH_SQUARES, duration=1.8, interval=0.05)
    model, flight, start = make(problem, 1, input_noise=0.05 * SMALL, output_scale=SMALL)
    deaf = predict(model, flight._replace(input_variance=np.zeros(1)), start, variance)
    assert deaf.squares > 3.0 * predict(model, flight, start, variance).squares


def test_innovations_are_white_where_the_model_is_true() -> None:
    model, flight, start = make(Problem(undeclared=BOTH_SQUARES, duration=60.0), 2, input_noise=0.002)
    white = predict(model, flight, start).white
    held = np.isfinite(white)
    count = held.sum()
    # Chi-square with some 13,000 degrees of freedom, and lag-one products of variance 1: four standard deviations.
    assert np.sum(white[held] ** 2) / count == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / count))
    for i in range(8):
        pairs = held[1:, i] & held[:-1, i]
        products = (white[1:, i] * white[:-1, i])[pairs]
        assert abs(products.mean()) < 4.0 / np.sqrt(pairs.sum()), i


def test_without_input_noise_it_is_the_open_loop_simulation() -> None:
    model, flight, start = make(Problem(undeclared=BOTH_SQUARES, duration=6.0), 3, irregular=True)
    found = predict(model, flight, start)
    outputs, _ = simulate_outputs(start, flight, model.values, model.table, model.constants)
    assert_allclose(found.predicted, outputs, rtol=1e-13, atol=1e-13)
    assert_allclose(found.white, (flight.measured - outputs) / np.sqrt(VARIANCE), rtol=1e-9, atol=1e-9)
    held = np.isfinite(flight.measured)
    assert found.log_sum == pytest.approx(np.log(np.broadcast_to(VARIANCE, held.shape)[held]).sum(), rel=1e-12)


@pytest.mark.parametrize(
    "problem", [Problem(undeclared=BOTH_SQUARES, duration=3.0), Problem(LIFT_AND_DRAG, duration=3.0)]
)
def test_open_loop_sensitivities_are_those_of_the_simulation(problem: Problem) -> None:
    """Free terms and initial state, in the documented order of columns."""
    model, flight, start = make(problem, 4)
    samples, free = flight.time.size, (1, 4, model.values.size - 1)
    found = predict(model, flight, start, free=free)

    def outputs(point: Array) -> Array:
        values = model.values.copy()
        values[list(free)] += point[:3]
        result, _ = simulate_outputs(start + point[3:], flight, values, model.table, model.constants)
        return result.ravel()

    steps = np.concatenate([np.full(3, 1e-3), [1e-2, 1e-2, 1e-4, 1e-4, 1e-1]])
    slopes = central_difference(outputs, np.zeros(8), steps).reshape(samples, 8, 8) / np.sqrt(VARIANCE)[:, None]
    slopes[~np.isfinite(flight.measured)] = 0.0
    scale = np.abs(slopes).max(axis=(0, 1))
    assert_allclose(found.columns / scale, slopes / scale, atol=1e-6)


@pytest.mark.parametrize("input_noise", [0.0, 0.004])
def test_stretches_are_one_pass(input_noise: float) -> None:
    model, flight, start = make(Problem(undeclared=BOTH_SQUARES, duration=3.0), 5, input_noise=input_noise)
    whole = predict(model, flight, start)
    parts = predict(model, flight, start, cuts=(1, 40, 41, 99))
    assert_allclose(parts.white, whole.white, rtol=0.0, atol=0.0)
    assert_allclose(parts.columns, whole.columns, rtol=0.0, atol=0.0)
    assert_allclose(parts.predicted, whole.predicted, rtol=0.0, atol=0.0)
    assert parts.log_sum == pytest.approx(whole.log_sum, rel=1e-13)


def test_the_initial_state_may_not_be_moved_by_the_caller() -> None:
    model, flight, start = make(Problem(duration=1.0), 6, input_noise=0.002)
    given = start.copy()
    predict(model, flight, start)
    assert (start == given).all()


def test_a_prediction_outside_the_range_is_reported() -> None:
    model, flight, start = make(Problem(UNSTABLE, amplitude=0.01, duration=2.0), 7)
    wild = flight.inputs.copy()
    wild[:, 8] += 0.6
    longer = Flight(
        Problem(duration=15.0, interval=0.05).time,
        np.repeat(wild[:1], 300, axis=0),
        np.repeat(flight.measured[:1], 300, axis=0),
        POSITIONS,
        3,
        np.zeros(1),
    )
    found = predict(model, longer, start)
    assert not found.inside
    assert found.log_sum == np.inf
