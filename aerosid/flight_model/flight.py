"""Simulate a flight open loop: outputs, states and coefficients along a manoeuvre."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.longitudinal import Constants, Workspace, evaluate, make_workspace
from aerosid.flight_model.sampling_interval import Stages, integrate, make_stages
from aerosid.flight_model.terms import TermTable

ALPHA_LIMIT = 1.5
"""A simulation that leaves this angle of attack [rad] has failed: the model is not meant for tumbling."""


class Flight(NamedTuple):
    """One manoeuvre as plain arrays.

    `time` (N) s; `inputs` (N, 8 + E) in the order of INPUT_COLUMNS and the extra inputs, none missing; `measured`
    (N, 8) outputs, NaN where missing or unused; `positions` (8, 3) of the sensors [m]; `substeps` of the integrator
    in each interval; `input_variance` (E) of the noise of each sample of the extra inputs, SI squared.
    """

    time: NDArray[np.float64]
    inputs: NDArray[np.float64]
    measured: NDArray[np.float64]
    positions: NDArray[np.float64]
    substeps: int
    input_variance: NDArray[np.float64]


@njit
def simulate_outputs(
    state: NDArray[np.float64], flight: Flight, theta: NDArray[np.float64], table: TermTable, constants: Constants
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The open-loop response: outputs (N, 8) and states (N, 5); NaN from where it leaves |alpha| < 1.5 rad."""
    samples = flight.time.shape[0]
    extra = flight.inputs.shape[1] - 8
    outputs = np.full((samples, 8), np.nan)
    states = np.full((samples, 5), np.nan)
    work, stages = make_workspace(extra, table), make_stages(extra)
    _simulate(state.copy(), flight, theta, table, constants, outputs, states, work, stages)
    return outputs, states


@njit_inline
def _simulate(
    x: NDArray[np.float64],
    flight: Flight,
    theta: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    outputs: NDArray[np.float64],
    states: NDArray[np.float64],
    work: Workspace,
    stages: Stages,
) -> None:
    """As `simulate_outputs`, from `x` and into arrays that are given."""
    samples = flight.time.shape[0]
    for k in range(samples):
        evaluate(x, flight.inputs[k], theta, table, constants, flight.positions, work, False, True)
        if not abs(work.outputs[1]) < ALPHA_LIMIT:
            break
        for i in range(8):
            outputs[k, i] = work.outputs[i]
        for a in range(5):
            states[k, a] = x[a]
        if k + 1 < samples:
            integrate(
                x, flight.inputs[k], flight.inputs[k + 1], flight.time[k + 1] - flight.time[k],
                0, flight.substeps, flight.substeps, theta, table, constants, flight.positions, work, stages,
            )  # fmt: skip


@njit
def coefficients_along(
    states: NDArray[np.float64],
    flight: Flight,
    theta: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
) -> NDArray[np.float64]:
    """The coefficients (N, 5), in the order of `COEFFICIENTS`, along simulated states (N, 5)."""
    samples = states.shape[0]
    work = make_workspace(flight.inputs.shape[1] - 8, table)
    found = np.zeros((samples, 5))
    for k in range(samples):
        evaluate(states[k], flight.inputs[k], theta, table, constants, flight.positions, work, False, False)
        found[k] = work.coefficients
    return found
