"""All samples of a flight as one Gaussian vector: mean, covariance and slopes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.flight import Flight, simulate_outputs
from oracles.flight import central_difference

Array = NDArray[np.float64]


def stacked(model: AerodynamicModel, flight: Flight, start: Array, variance: Array) -> tuple[Array, Array, Array]:
    """Residual of the flight without input errors, its covariance, and the mean's slopes, held samples only."""
    held = np.isfinite(flight.measured)
    terms = model.values.size

    def outputs(point: Array) -> Array:
        inputs = flight.inputs.copy()
        inputs[:, 8] += point[terms + 5 :]
        moved = flight._replace(inputs=inputs, input_variance=np.zeros(flight.inputs.shape[1] - 8))
        result, _ = simulate_outputs(point[terms : terms + 5], moved, point[:terms], model.table, model.constants)
        return result[held]

    samples = flight.time.size
    point = np.concatenate([model.values, start, np.zeros(samples)])
    steps = np.concatenate(
        [1e-3 * (1.0 + np.abs(model.values)), [1e-2, 1e-2, 1e-4, 1e-4, 1e-1], np.full(samples, 1e-4)]
    )
    slopes = central_difference(outputs, point, steps)
    by_input = slopes[:, terms + 5 :]
    noise = np.broadcast_to(variance, held.shape)[held]
    covariance = flight.input_variance[0] * by_input @ by_input.T + np.diag(noise)
    return (flight.measured[held] - outputs(point)), covariance, slopes[:, : terms + 5]
