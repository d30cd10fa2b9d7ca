"""Simulation begun anew again and again from given states: predictions over a horizon."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.flight_model.layout import output_count
from aerosid.flight_model.terms import TermTable


@njit
def predict_ahead(
    starts: NDArray[np.int64],
    length: int,
    states: NDArray[np.float64],
    flight: Flight,
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
) -> NDArray[np.float64]:
    """The outputs (N, m) predicted from the state at the start before each sample; NaN where there is none.

    Parameters
    ----------
    starts : int64[W]
        Samples at which a simulation begins; each goes on for `length` samples.
    states : float64[N, n]
        The states, of which those at the starts are used.
    parameters : float64[T]
        Values of the terms.
    """
    samples = flight.time.shape[0]
    outputs = np.full((samples, output_count(constants.layout)), np.nan)
    for start in starts:
        stop = min(start + length + 1, samples)
        stretch = Flight(
            flight.time[start:stop], flight.inputs[start:stop], flight.measured[start:stop], flight.positions,
            flight.substeps, flight.input_variance, flight.held, flight.ramp,
        )  # fmt: skip
        seen, _ = simulate_outputs(states[start], stretch, parameters, table, constants)
        for k in range(start + 1, stop):
            for i in range(outputs.shape[1]):
                outputs[k, i] = seen[k - start, i]
    return outputs
