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
from aerosid.nomenclature import is_surface
from aerosid.signals.recursive_filter import filtered_from_rest

Array = NDArray[np.float64]

TRENDS = 3
"""Numerical: constant, line and parabola; effects of biases, drifts and initial conditions on the integrated paths."""


def is_control(column: str) -> bool:
    """Whether the pilot moves an input column: a surface or thrust; the others are states of the air and the motion."""
    return is_surface(column) or column.startswith("thrust")


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
    trials = _trials(recordings, settings)
    return tuple(trials[_most_explained(recordings, trials)])


def responses_to_controls(
    recordings: Sequence[Recording], settings: EquationErrorSettings, shifts: Sequence[float]
) -> tuple[list[Array], ...] | tuple[None, ...]:
    """Functions of the controls of each record in the band, (n, K) for each shift; None without a recorded control.

    The functions are those of the instrumental variables, without trends, and the squares of the low-pass ones, which a
    force or moment follows that is even in a control or in the motion.

    Parameters
    ----------
    shifts : sequence of float
        Fractions of a record, 1, by which its controls are late, those of its end at its beginning.
    """
    if not any(_moving_controls(recording) for recording in recordings):
        return (None,) * len(recordings)
    time_constant = settings.laguerre_times[_most_explained(recordings, _trials(recordings, settings))]
    return tuple(
        [recording.band(_with_squares(recording, settings, time_constant, shift)) for shift in shifts]
        for recording in recordings
    )


def _with_squares(recording: Recording, settings: EquationErrorSettings, time_constant: float, shift: float) -> Array:
    """Laguerre functions of the controls and squares of the first of each set, (N, K)."""
    sets = _laguerre_sets(recording, settings, time_constant, round(shift * recording.time.size))
    return np.hstack([np.empty((recording.time.size, 0)), *sets, *(functions[:, :1] ** 2 for functions in sets)])


def trends_in_band(recording: Recording) -> Array:
    """Constant, line and parabola over a record in the band, (n, 3)."""
    return recording.band(_trends(recording))


def _trials(recordings: Sequence[Recording], settings: EquationErrorSettings) -> list[list[Array]]:
    """The instrumental variables of each record by each time constant of the settings."""
    return [
        [orthonormal(recording.band(_functions(recording, settings, time))) for recording in recordings]
        for time in settings.laguerre_times
    ]


def _most_explained(recordings: Sequence[Recording], trials: Sequence[Sequence[Array]]) -> int:
    """Index of the trial that explains most of the angular rates, each by its fraction of variance."""
    explained = np.zeros(len(trials))
    for name in equations_of(recordings[0].manoeuvre.axes).rates:
        rates = [recording.band(recording.channels[name]) for recording in recordings]
        whole = max(sum(float(rate @ rate) for rate in rates), 1e-300)
        explained += [
            sum(float(np.sum((basis.T @ rate) ** 2)) for basis, rate in zip(trial, rates, strict=True)) / whole
            for trial in trials
        ]
    return int(np.argmax(explained))


def _functions(recording: Recording, settings: EquationErrorSettings, time_constant: float) -> Array:
    """Trends, and fast and slow Laguerre functions of every control that moves, (N, K)."""
    return np.hstack([_trends(recording), *_laguerre_sets(recording, settings, time_constant)])


def _trends(recording: Recording) -> Array:
    """Constant, line and parabola over a record, (N, 3)."""
    return np.vander(np.linspace(-1.0, 1.0, recording.time.size), TRENDS)


def _laguerre_sets(
    recording: Recording, settings: EquationErrorSettings, time_constant: float, shift: int = 0
) -> list[Array]:
    """Fast and slow Laguerre functions of every control that moves, `shift` samples late, (N, order) each."""
    return [
        laguerre_functions(np.roll(values - values[0], shift), recording.interval, time, settings.laguerre_order)
        for values in _moving_controls(recording)
        for time in (time_constant, settings.laguerre_slower * time_constant)
    ]


def _moving_controls(recording: Recording) -> list[Array]:
    """The recorded controls that move, (N,) each."""
    manoeuvre = recording.manoeuvre
    controls = zip(manoeuvre.columns, manoeuvre.flight.inputs.T, strict=True)
    return [values for name, values in controls if is_control(name) and float(np.ptp(values)) > 0.0]


def orthonormal(functions: Array) -> Array:
    """Orthonormal basis (N, k) of what some functions (N, K) of any size span."""
    size = np.linalg.norm(functions, axis=0)
    left, singular, _ = np.linalg.svd(functions[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    return np.asarray(left[:, singular > 1e-6 * singular[0]])
