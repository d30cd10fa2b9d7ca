"""Noise of the inputs of a simulated flight, and what it makes uncertain at the first sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.signals.sensor_dynamics import SensorStates
from aerosid.signals.trace import Trace, among_inputs


class InputNoise(NamedTuple):
    """Noise of the extra inputs: `variance` (E) of each sample, SI squared; `memory` (E) its correlation with the last.

    memory 0 is white (a measured surface); exp(-dt/T) a disturbance with correlation time T that no channel shows.
    """

    variance: NDArray[np.float64]
    memory: NDArray[np.float64]


def noisy_inputs_alone(noise: InputNoise, trace: Trace) -> tuple[InputNoise, Trace]:
    """The noise, and the linearisation along a stretch, without the inputs that are free of noise.

    They change nothing, and the work of whitening grows with the square of how many there are.
    """
    noisy = np.flatnonzero(noise.variance > 0.0)
    if noisy.size == noise.variance.size:
        return noise, trace
    return InputNoise(noise.variance[noisy], noise.memory[noisy]), among_inputs(trace, noisy)


def initial_covariance(
    state_covariance: NDArray[np.float64], noise: InputNoise, trace: Trace, sensors: SensorStates
) -> NDArray[np.float64]:
    """Covariance (S, S) of states, input errors and sensors' states at the first sample, where sensors are at rest."""
    states, extra = state_covariance.shape[0], noise.variance.size
    plain = np.zeros((states + extra, states + extra))
    plain[:states, :states] = state_covariance
    plain[states:, states:] = np.diag(noise.variance)
    if sensors.source.size == 0:
        return plain
    whole = _with_sensors_at_rest(trace, sensors)
    return np.ascontiguousarray(whole @ plain @ whole.T)


def initial_error(trace: Trace, sensors: SensorStates) -> NDArray[np.float64]:
    """What each input's error (E) is among states, input errors and sensors' states (S) at the first sample, (S, E)."""
    return np.ascontiguousarray(_with_sensors_at_rest(trace, sensors)[:, trace.outputs_x.shape[2] :])


def _with_sensors_at_rest(trace: Trace, sensors: SensorStates) -> NDArray[np.float64]:
    """States and input errors with the sensors' states that follow from them at rest, (S, n + E)."""
    shown = np.concatenate([trace.outputs_x[0], trace.outputs_u[0]], axis=1)
    return np.vstack([np.eye(shown.shape[1]), sensors.steady[:, None] * shown[sensors.source]])
