"""Slopes of the likelihood by the noise: those of a dense Gaussian, and of the whitening that they stand in for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from aerosid.signals.input_noise import InputNoise
from aerosid.signals.noise_slopes import noise_slopes
from aerosid.signals.sensor_dynamics import SensorStates, lagging, late, no_sensor_states, sensor_states
from aerosid.signals.trace import Trace
from aerosid.signals.whitening import make_whitening_carry, whiten_stretch
from tests.signals.test_whitening import EXTRA, SAMPLES, dense_covariance, linearisation

OUTPUTS = 8
VARIANCE = np.array([0.3, 1e-4, 0.02])
MEMORY = np.array([0.7, 0.95, 0.2])


@pytest.fixture
def record() -> tuple[Trace, np.ndarray, np.ndarray, np.ndarray]:
    """A linearisation, which outputs were measured, a residual, and the outputs' variances."""
    rng = np.random.default_rng(11)
    trace = linearisation(rng)
    held = rng.random((SAMPLES, OUTPUTS)) < 0.8
    return trace, held, rng.standard_normal((SAMPLES, OUTPUTS)), 0.02 + 0.1 * rng.random(OUTPUTS)


def _differences(cost: Callable[[np.ndarray], float], at: np.ndarray) -> np.ndarray:
    """Central differences, a thousandth of each number to either side, of the logarithm taken back."""
    slopes = []
    for i in range(at.size):
        step = np.zeros(at.size)
        step[i] = 1e-4 * at[i]
        wide, narrow = ((cost(at + f * step) - cost(at - f * step)) / (2.0 * f * step[i]) for f in (2.0, 1.0))
        slopes.append((4.0 * narrow - wide) / 3.0)
    return np.array(slopes)


def test_cost_and_slopes_are_those_of_the_dense_gaussian(
    record: tuple[Trace, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    trace, held, residual, output_variance = record

    def cost(numbers: np.ndarray) -> float:
        by_output, variance, memory = np.split(numbers, [OUTPUTS, OUTPUTS + EXTRA])
        whole = dense_covariance(trace, InputNoise(variance, memory), held, np.zeros(OUTPUTS))
        whole += np.diag(np.broadcast_to(by_output, held.shape)[held])
        return float(np.linalg.slogdet(whole)[1] + residual[held] @ np.linalg.solve(whole, residual[held]))

    numbers = np.concatenate([output_variance, VARIANCE, MEMORY])
    found = noise_slopes(
        held, residual, trace, output_variance, InputNoise(VARIANCE, MEMORY), no_sensor_states(OUTPUTS)
    )
    assert found.cost == pytest.approx(cost(numbers), rel=1e-9)
    slopes = np.concatenate([found.by_output, found.by_variance, found.by_memory])
    assert_allclose(slopes, _differences(cost, numbers), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("slow", [False, True])
def test_cost_and_slopes_are_those_of_whitening_behind_slow_sensors(
    record: tuple[Trace, np.ndarray, np.ndarray, np.ndarray], slow: bool
) -> None:
    trace, held, residual, output_variance = record
    sensors: SensorStates = no_sensor_states(OUTPUTS)
    if slow:
        sensors = sensor_states([(1, lagging(0.2)), (4, late(0.1)), (1, late(0.03))], 0.05, OUTPUTS)

    def cost(numbers: np.ndarray) -> float:
        by_output, variance, memory = np.split(numbers, [OUTPUTS, OUTPUTS + EXTRA])
        noise, column = InputNoise(variance, memory), np.array(residual[:, :, None])
        carry = make_whitening_carry(noise, 1, trace, sensors)
        total = whiten_stretch(held, column, trace, by_output, noise, sensors, carry)
        return float(total + np.sum(column[held] ** 2))

    numbers = np.concatenate([output_variance, VARIANCE, MEMORY])
    found = noise_slopes(held, residual, trace, output_variance, InputNoise(VARIANCE, MEMORY), sensors)
    assert found.cost == pytest.approx(cost(numbers), rel=1e-9)
    slopes = np.concatenate([found.by_output, found.by_variance, found.by_memory])
    assert_allclose(slopes, _differences(cost, numbers), rtol=1e-5, atol=1e-5)
