"""Whitening: inputs without noise may be left out, and the path for one surface is the one for many."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from aerosid.signals.input_noise import InputNoise, noisy_inputs_alone
from aerosid.signals.sensor_dynamics import no_sensor_states
from aerosid.signals.trace import StateSizes, Trace
from aerosid.signals.whitening import make_whitening_carry, whiten_stretch

SAMPLES, EXTRA, WIDTH = 40, 3, 7


def linearisation(rng: np.random.Generator) -> Trace:
    """A motion that dies away, driven by three inputs."""
    transition = 0.9 * np.eye(5) + 0.05 * rng.standard_normal((SAMPLES, 5, 5))
    transition[:, :, 4] = np.eye(5)[4]
    return Trace(
        np.zeros((SAMPLES, 8)),
        np.zeros((SAMPLES, 8, WIDTH)),
        transition,
        rng.standard_normal((SAMPLES, 5, EXTRA)),
        rng.standard_normal((SAMPLES, 5, EXTRA)),
        rng.standard_normal((SAMPLES, 8, 5)),
        rng.standard_normal((SAMPLES, 8, EXTRA)),
        StateSizes((0, 0, 0, 0), (0,)),
    )


@pytest.mark.parametrize("memory", [0.0, 0.7])
@pytest.mark.parametrize("noisy", [[1], [0, 2], []])
def test_inputs_without_noise_change_nothing(noisy: list[int], memory: float) -> None:
    rng = np.random.default_rng(5)
    trace, sensors = linearisation(rng), no_sensor_states(8)
    variance = np.zeros(EXTRA)
    variance[noisy] = 0.3
    noise = InputNoise(variance, np.full(EXTRA, memory))
    held = rng.random((SAMPLES, 8)) < 0.8
    columns = rng.standard_normal((SAMPLES, 8, WIDTH))
    found = []
    for inputs, along in ((noise, trace), noisy_inputs_alone(noise, trace)):
        white, carry = columns.copy(), make_whitening_carry(inputs, WIDTH, along, sensors)
        total = whiten_stretch(held, white, along, np.full(8, 0.02), inputs, sensors, carry)
        found.append((white, total, carry.covariance[:5, :5]))
    assert noisy_inputs_alone(noise, trace)[1].start.shape == (SAMPLES, 5, len(noisy))
    for one, other in zip(*found, strict=True):
        assert_allclose(other, one, rtol=1e-9, atol=1e-12)
    if noisy:
        # Independent of the filter: the residuals' covariance from the whole history of the inputs' errors.
        whole = dense_covariance(trace, noise, held, np.full(8, 0.02))
        wanted = np.linalg.solve(np.linalg.cholesky(whole), columns[held])
        assert_allclose(found[1][0][held], wanted, rtol=1e-7, atol=1e-9)
        assert found[1][1] == pytest.approx(np.linalg.slogdet(whole)[1], rel=1e-9)


def dense_covariance(trace: Trace, noise: InputNoise, held: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Covariance of all that was measured, with the outputs' variances (8,), each input error being w+ = m w + v."""
    lags = np.abs(np.subtract.outer(np.arange(SAMPLES), np.arange(SAMPLES)))
    by_errors = np.zeros((SAMPLES, 8, SAMPLES, EXTRA))
    state = np.zeros((5, SAMPLES, EXTRA))
    for k in range(SAMPLES):
        by_errors[k] = np.tensordot(trace.outputs_x[k], state, 1)
        by_errors[k, :, k] += trace.outputs_u[k]
        state = np.tensordot(trace.transition[k], state, 1)
        state[:, k] += trace.start[k]
        if k + 1 < SAMPLES:
            state[:, k + 1] += trace.end[k]
    rows = by_errors[held]
    total = np.diag(np.broadcast_to(variance, held.shape)[held])
    for j in range(EXTRA):
        colour = noise.variance[j] * noise.memory[j] ** lags if noise.memory[j] else noise.variance[j] * np.eye(SAMPLES)
        total += rows[:, :, j] @ colour @ rows[:, :, j].T
    return total
