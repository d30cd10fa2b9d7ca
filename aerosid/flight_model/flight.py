"""Open-loop simulation of a manoeuvre: outputs, states and coefficients."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.layout import Layout, leading_columns, load_places, output_count, output_places, state_count
from aerosid.flight_model.sampling_interval import Stages, inputs_at_end, integrate, make_stages
from aerosid.flight_model.settings import SIMULATION
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.workspace import Workspace, make_workspace
from aerosid.signals.array_elements import copy_row

ALPHA_LIMIT = SIMULATION.flow_angle


NONE_HELD = np.zeros(0, dtype=np.int64)
"""Numerical: every input is linear between samples."""


class Flight(NamedTuple):
    """One manoeuvre as plain arrays.

    `time` (N) s; `inputs` (N, I), the leading columns of the case and the E extra inputs, none missing; `measured`
    (N, m) outputs, NaN where missing or unused; `positions` (m, 3) of the sensors [m]; `substeps` of the integrator
    in each interval; `input_variance` (E) of the noise of each sample of the extra inputs, SI squared; `held` the input
    columns that stay at each sample and move to the next in the last `ramp` of the interval, 1; the others are linear.
    """

    time: NDArray[np.float64]
    inputs: NDArray[np.float64]
    measured: NDArray[np.float64]
    positions: NDArray[np.float64]
    substeps: int
    input_variance: NDArray[np.float64]
    held: NDArray[np.int64] = NONE_HELD
    ramp: float = 0.0


@njit_inline
def within_limit(outputs: NDArray[np.float64], layout: Layout) -> bool:
    """Whether angle of attack and sideslip, as far as they are simulated, are within the limit."""
    there, row = layout.outputs, output_places(layout)
    inside = True
    if len(there.alpha) > 0:
        inside = abs(outputs[row.alpha]) < ALPHA_LIMIT
    if len(there.beta) > 0:
        inside = inside and abs(outputs[row.beta]) < ALPHA_LIMIT
    return inside


@njit
def simulate_outputs(
    state: NDArray[np.float64], flight: Flight, parameters: NDArray[np.float64], table: TermTable, constants: Constants
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The open-loop response: outputs (N, m) and states (N, n); NaN from where it leaves |alpha| < 1.5 rad."""
    samples = flight.time.shape[0]
    acting = parameters.shape[0]
    while acting > 0 and parameters[acting - 1] == 0.0:
        acting -= 1  # a catalogue's candidates, ten times the terms that act: every evaluation would pass them over
    layout = constants.layout
    extra = flight.inputs.shape[1] - leading_columns(layout)
    outputs = np.full((samples, output_count(layout)), np.nan)
    states = np.full((samples, state_count(layout)), np.nan)
    work, stages = make_workspace(extra, table, layout), make_stages(extra, layout)
    _simulate(state.copy(), flight, parameters[:acting], table, constants, outputs, states, work, stages)
    return outputs, states


@njit_inline
def _simulate(
    x: NDArray[np.float64],
    flight: Flight,
    parameters: NDArray[np.float64],
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
        evaluate(x, flight.inputs[k], parameters, table, constants, flight.positions, work, False, True)
        if not within_limit(work.outputs, constants.layout):
            break
        for i in range(output_count(constants.layout)):
            outputs[k, i] = work.outputs[i]
        for a in range(state_count(constants.layout)):
            states[k, a] = x[a]
        if k + 1 < samples:
            inputs_at_end(flight.inputs[k], flight.inputs[k + 1], flight.held, flight.ramp, stages.last)
            integrate(
                x, flight.inputs[k], stages.last, flight.time[k + 1] - flight.time[k],
                0, flight.substeps, flight.substeps, parameters, table, constants, flight.positions, work, stages,
            )  # fmt: skip


@njit
def coefficients_along(
    states: NDArray[np.float64],
    flight: Flight,
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
) -> NDArray[np.float64]:
    """The coefficients (N, K), in the order of `loads_of` the case, along simulated states (N, n)."""
    samples, layout = states.shape[0], constants.layout
    work = make_workspace(flight.inputs.shape[1] - leading_columns(layout), table, layout)
    found = np.zeros((samples, load_places(layout).total))
    for k in range(samples):
        evaluate(states[k], flight.inputs[k], parameters, table, constants, flight.positions, work, False, False)
        copy_row(found[k], work.coefficients)
    return found
