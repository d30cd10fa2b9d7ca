"""Instrumental variables of the kinematic equations: Laguerre functions of the recorded controls.

Gusts affect the vane, the accelerometers and the gyros of a flight together: the residual of the equation for alpha is
correlated with its own regressors, and least squares finds errors that the sensors do not have. The response to the
controls is not correlated with the gusts. The kinematic equations are therefore compared in the space spanned by
Laguerre functions of the controls (two-stage least squares: Soderstrom & Stoica, System Identification, section 8.2;
Laguerre functions: Wahlberg, IEEE Transactions on Automatic Control 36 (1991) 551). It is consistent as long as the
controls do not respond to the gusts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.channels import equations_of
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.signals.recursive_filter import filtered_from_rest

Array = NDArray[np.float64]

CONTROLS = ("delta_", "thrust")
"""Prefixes of the input columns that a pilot moves; the others are states of the air and the motion."""

TRENDS = 3
"""Numerical: constant, line and parabola; effects of biases, drifts and initial conditions on the integrated paths."""


def laguerre_functions(signal: Array, interval: float, time_constant: float, order: int) -> Array:
    """A signal (N,) filtered by the first Laguerre filters of a time constant, s: (N, order)."""
    pole = float(np.exp(-interval / time_constant))
    low_pass, all_pass = np.array([[[1.0 - pole, 0.0, 0.0, -pole, 0.0]], [[-pole, 1.0, 0.0, -pole, 0.0]]])
    columns = [filtered_from_rest(low_pass, signal)]
    while len(columns) < order:
        columns.append(filtered_from_rest(all_pass, columns[-1]))
    return np.column_stack(columns)


def instrumental_variables(
    recordings: Sequence[Recording], settings: EquationErrorSettings
) -> tuple[Array, ...] | tuple[None, ...]:
    """The instrumental variables of each record in the band, orthonormal, (n, K) each; None without a recorded control.

    The time constant of the settings is chosen that explains most of the angular rates on which moments act, each rate
    by its fraction of variance explained.
    """
    if not any(_moving_controls(recording) for recording in recordings):
        return (None,) * len(recordings)
    trials = [
        [orthonormal(recording.band(_functions(recording, settings, time))) for recording in recordings]
        for time in settings.laguerre_times
    ]
    explained = np.zeros(len(trials))
    for name in equations_of(recordings[0].manoeuvre.axes).rates:
        rates = [recording.band(recording.channels[name]) for recording in recordings]
        whole = max(sum(float(rate @ rate) for rate in rates), 1e-300)
        explained += [
            sum(float(np.sum((basis.T @ rate) ** 2)) for basis, rate in zip(trial, rates, strict=True)) / whole
            for trial in trials
        ]
    return tuple(trials[int(np.argmax(explained))])


def _functions(recording: Recording, settings: EquationErrorSettings, time_constant: float) -> Array:
    """Trends, and fast and slow Laguerre functions of every control that moves, (N, K)."""
    columns = [np.vander(np.linspace(-1.0, 1.0, recording.time.size), TRENDS)]
    for values in _moving_controls(recording):
        columns.extend(
            laguerre_functions(values - values[0], recording.interval, time, settings.laguerre_order)
            for time in (time_constant, settings.laguerre_slower * time_constant)
        )
    return np.hstack(columns)


def _moving_controls(recording: Recording) -> list[Array]:
    """The recorded controls that move, (N,) each."""
    manoeuvre = recording.manoeuvre
    controls = zip(manoeuvre.columns, manoeuvre.flight.inputs.T, strict=True)
    return [values for name, values in controls if name.startswith(CONTROLS) and float(np.ptp(values)) > 0.0]


def orthonormal(functions: Array) -> Array:
    """Orthonormal basis (N, k) of what some functions (N, K) of any size span."""
    size = np.linalg.norm(functions, axis=0)
    left, singular, _ = np.linalg.svd(functions[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    return np.asarray(left[:, singular > 1e-6 * singular[0]])
