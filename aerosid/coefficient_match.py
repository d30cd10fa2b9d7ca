"""The coefficients as the sensors measured them beside those of the model: how much of their variance is explained."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from aerosid import prefilter
from aerosid.aerodynamics import AerodynamicModel
from aerosid.compiled import njit
from aerosid.longitudinal import Constants, evaluate, make_workspace
from aerosid.manoeuvre import Manoeuvre
from aerosid.paper_chain import ChainSettings, feed
from aerosid.prediction import Flight
from aerosid.results import CoefficientRow
from aerosid.terms import TermTable


def explained_shares(before: AerodynamicModel, after: AerodynamicModel, manoeuvre: Manoeuvre) -> list[CoefficientRow]:
    """R^2 of C_X, C_Z and C_m on one log for two models; a coefficient whose sensors are missing has no row.

    Notes
    -----
    C_X and C_Z come from the accelerometers, C_m from q_dot or the derivative of q, all channels low-passed alike;
    the model's coefficients from the measured V, alpha, q and inputs through the same filter. Constants are fitted on
    the log: R^2 is about the mean.
    """
    fed = feed(manoeuvre, ChainSettings())
    flight, filtered = manoeuvre.flight, fed.flight

    def smooth(values: NDArray[np.float64]) -> NDArray[np.float64]:
        if fed.butterworth is None:
            return values
        return prefilter.apply(fed.butterworth, flight.time, values)

    measured = _measured(flight, filtered, before.constants, smooth)
    rows = []
    modelled = []
    for model in (before, after):
        # Columns that only an effect fills are zero here.
        inputs = np.zeros((flight.time.size, len(model.columns)))
        inputs[:, : filtered.inputs.shape[1]] = filtered.inputs
        modelled.append(_modelled(model, filtered._replace(inputs=inputs)))
    for i, name in enumerate(("C_X", "C_Z", "C_m")):
        shares = []
        for coefficients in modelled:
            held = np.isfinite(measured[:, i]) & np.isfinite(coefficients[:, i])
            if held.sum() < 10:
                break
            target = measured[held, i]
            error = target - coefficients[held, i]
            shares.append(1.0 - float(np.var(error) / max(np.var(target), 1e-300)))
        if len(shares) == 2:
            rows.append(CoefficientRow(name, manoeuvre.log.name, shares[0], shares[1]))
    return rows


def _measured(
    flight: Flight,
    filtered: Flight,
    constants: Constants,
    smooth: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> NDArray[np.float64]:
    """C_X, C_Z, C_m (N, 3) from the sensors, NaN where one is missing."""
    density, thrust, mass = flight.inputs[:, 0], flight.inputs[:, 1], flight.inputs[:, 2]
    speed, q = filtered.measured[:, 0], filtered.measured[:, 2]
    p, r = flight.inputs[:, 5], flight.inputs[:, 6]
    force = 0.5 * density * speed**2 * constants.wing_area
    recorded = bool(np.isfinite(flight.measured[:, 6]).any())
    q_dot = smooth(flight.measured[:, 6]) if recorded else np.gradient(q, flight.time)
    x_x, x_y, x_z = flight.positions[4]
    z_x, z_y, z_z = flight.positions[5]
    a_x = smooth(flight.measured[:, 4]) + (q**2 + r**2) * x_x - p * q * x_y - (q_dot + p * r) * x_z
    a_z = smooth(flight.measured[:, 5]) - (p * r - q_dot) * z_x - q * r * z_y + (p**2 + q**2) * z_z
    thrust_x = thrust * np.cos(constants.thrust_incidence)
    thrust_z = -thrust * np.sin(constants.thrust_incidence)
    return np.column_stack(
        [
            (mass * a_x - thrust_x) / force,
            (mass * a_z - thrust_z) / force,
            (constants.I_yy * q_dot - thrust * constants.thrust_z_arm) / (force * constants.mean_chord),
        ]
    )


def _modelled(model: AerodynamicModel, flight: Flight) -> NDArray[np.float64]:
    """C_X, C_Z, C_m (N, 3) of the model at the measured states; NaN where V, alpha or q is missing."""
    coefficients = np.full((flight.time.size, 3), np.nan)
    _evaluate_all(flight, np.array(model.values), model.table, model.constants, coefficients)
    return coefficients


@njit
def _evaluate_all(
    flight: Flight,
    theta: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    out: NDArray[np.float64],
) -> None:
    """Body-axis coefficients at every sample that holds V, alpha and q; theta enters no coefficient but by alphadot."""
    work = make_workspace(flight.inputs.shape[1] - 8, theta.shape[0])
    x = np.zeros(5)
    for k in range(flight.time.shape[0]):
        speed, q, pitch = flight.measured[k, 0], flight.measured[k, 2], flight.measured[k, 3]
        alpha = flight.measured[k, 1]
        if np.isnan(speed) or np.isnan(alpha) or np.isnan(q):
            continue
        alpha += (q * flight.positions[1, 0] - flight.inputs[k, 5] * flight.positions[1, 1]) / speed
        plane = speed * np.cos(flight.inputs[k, 7])
        x[0], x[1], x[2] = plane * np.cos(alpha), plane * np.sin(alpha), q
        x[3] = alpha if np.isnan(pitch) else pitch
        evaluate(x, flight.inputs[k], theta, table, constants, flight.positions, work, False, False)
        c = work.coefficients
        out[k, 0] = c[0] + c[3] * np.sin(alpha) - c[4] * np.cos(alpha)
        out[k, 1] = c[1] - c[3] * np.cos(alpha) - c[4] * np.sin(alpha)
        out[k, 2] = c[2]
