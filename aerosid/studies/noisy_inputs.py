"""Sensitivities of a flight with noisy recorded inputs, transformed to white noise sample by sample.

The noise of each recorded sample affects the motion in the intervals on both sides of it. Along the flight that is a
linear system with the state's deviation, the input's error and the outputs' own noise as its state; its innovations
are white. The filter is applied to every column of sensitivities as to the measurements.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import input_columns_of
from aerosid.studies.many_flights import fly_states, observed, state_steps, stepped, steps_in

FloatArray = NDArray[np.float64]

_INPUT_STEP = 1e-6
"""Numerical: rad, or the unit of the channel, of a difference by an input."""


@dataclass(frozen=True)
class InputPath:
    """The path from the noise of recorded inputs to the outputs, linearised along the flight.

    Attributes
    ----------
    transition : ndarray, shape (N - 1, n, n)
        Transition of the state's deviation from sample to sample.
    start, end : ndarray, shape (N - 1, n, E)
        Effect of a unit error of the input at the interval's two samples on the state at its end.
    outputs_x, outputs_u : ndarray, shape (N, p, n) and (N, p, E)
        Sensitivity of the outputs to both.
    """

    transition: FloatArray
    start: FloatArray
    end: FloatArray
    outputs_x: FloatArray
    outputs_u: FloatArray

    def white(
        self,
        columns: FloatArray,
        held: NDArray[np.bool_],
        output_variance: FloatArray,
        memory: FloatArray,
        input_variance: FloatArray,
    ) -> Iterator[FloatArray]:
        """The rows (p', U) of each sample's sensitivities to unit white noise, p' of its outputs being measured.

        Parameters
        ----------
        columns : ndarray, shape (N, p, U)
            Sensitivities of the outputs.
        held : ndarray of bool, shape (N, p)
            Which samples were measured.
        output_variance, memory : ndarray, shape (p,)
            Of the outputs' noise, SI squared, and its correlation with that of the sample before: AR(1), 0 is white.
        input_variance : ndarray, shape (E,)
            Of each recorded sample of the noisy inputs, white, SI squared.

        Raises
        ------
        ValueError
            Where an output has no noise.
        """
        inputs, outputs, states = input_variance.size, output_variance.size, self.outputs_x.shape[2]
        if not np.all(output_variance > 0.0):
            raise ValueError("an output without noise has no bound")
        size = states + inputs + outputs
        own = slice(states + inputs, size)
        fresh = np.diag(np.concatenate([input_variance, output_variance * (1.0 - memory**2)]))
        mean = np.zeros((size, columns.shape[2]))
        covariance = np.zeros((size, size))
        covariance[states:, states:] = np.diag(np.concatenate([input_variance, output_variance]))
        move, drive, seen = np.zeros((size, size)), np.zeros((size, inputs + outputs)), np.zeros((outputs, size))
        move[own, own] = np.diag(memory)
        drive[states:] = np.eye(inputs + outputs)
        seen[:, own] = np.eye(outputs)
        for k in range(columns.shape[0]):
            seen[:, :states], seen[:, states : states + inputs] = self.outputs_x[k], self.outputs_u[k]
            rows = seen[held[k]]
            if rows.size:
                across = covariance @ rows.T
                root = np.linalg.cholesky(rows @ across)
                innovation = np.linalg.solve(root, columns[k, held[k]] - rows @ mean)
                gain = np.linalg.solve(root, across.T).T
                mean = mean + gain @ innovation
                covariance = covariance - gain @ gain.T
                yield innovation
            if k + 1 < columns.shape[0]:
                move[:states, :states], move[:states, states : states + inputs] = self.transition[k], self.start[k]
                drive[:states, :inputs] = self.end[k]
                mean = move @ mean
                covariance = move @ covariance @ move.T + drive @ fresh @ drive.T


def input_path(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    state: FloatArray,
    inputs: FloatArray,
    noisy: NDArray[np.bool_],
    places: list[int],
) -> InputPath:
    """The path along the flight from `state` (n,) with the extra inputs (N, E): central differences of single steps.

    Parameters
    ----------
    noisy : ndarray of bool, shape (E,)
        Which of the extra inputs are recorded with noise.
    places : list of int
        Which of the outputs are measured.
    """
    flight = manoeuvre.flight
    x = fly_states(model, manoeuvre, model.values, state, inputs)
    fixed, extra, values = flight.inputs[:, : len(input_columns_of(model.axes))].T, inputs.T, model.values[:, None]
    sizes = state_steps(model.axes)
    moves = np.diag(sizes)
    pushes = _INPUT_STEP * np.eye(extra.shape[0])[noisy]
    intervals = np.diff(flight.time)

    def step(x: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
        # Intervals are grouped by their number of integration steps: a gap needs more than its neighbours.
        result = np.empty((state.size, intervals.size))
        counts = steps_in(intervals)
        for count in np.unique(counts):
            k = np.flatnonzero(counts == count)
            result[:, k] = stepped(
                model, x[:, k], values, (fixed[:, k], fixed[:, k + 1]), (before[:, k], after[:, k]), intervals[k]
            )
        return result

    def look(x: FloatArray, extra: FloatArray) -> FloatArray:
        return observed(model, x, values, fixed, extra, flight.positions)[places]

    early, late = extra[:, :-1], extra[:, 1:]
    begun = x[:, :-1]

    def slopes(sides: list[tuple[FloatArray, FloatArray]], widths: list[float]) -> FloatArray:
        """(K, rows, sides) of pairs of (rows, K)."""
        return np.stack(
            [(up - down) / width for (up, down), width in zip(sides, widths, strict=True)], axis=2
        ).transpose(1, 0, 2)

    state_widths, input_widths = [2.0 * size for size in sizes], [2.0 * _INPUT_STEP] * len(pushes)
    transition = [(step(begun + m[:, None], early, late), step(begun - m[:, None], early, late)) for m in moves]
    start = [(step(begun, early + m[:, None], late), step(begun, early - m[:, None], late)) for m in pushes]
    end = [(step(begun, early, late + m[:, None]), step(begun, early, late - m[:, None])) for m in pushes]
    outputs_x = [(look(x + m[:, None], extra), look(x - m[:, None], extra)) for m in moves]
    outputs_u = [(look(x, extra + m[:, None]), look(x, extra - m[:, None])) for m in pushes]
    return InputPath(
        slopes(transition, state_widths),
        slopes(start, input_widths),
        slopes(end, input_widths),
        slopes(outputs_x, state_widths),
        slopes(outputs_u, input_widths),
    )
