"""Section 3.3: the light transport of (33)-(36), flown with both alpha^2 terms and estimated without them.

The equations are written as in the paper, with q c/(2 U0); tests compare them with aerosid's own flight model. The
constants are those of the bundled aircraft file, after Raol; the 1994 paper does not print them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, cast

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.errors import EstimationError
from aerosid.flight_model.simulation import doublet
from aerosid.model_error.estimators.functions import model_functions

Array = NDArray[np.float64]
Rates = Callable[[Array, Array, float], Array]

GRAVITY = 9.80665
"""Standard: m/s^2."""

ALPHA2 = (3.6089, -1.715)
"""Published: C_X_alpha2 and C_m_alpha2, flown and undeclared."""

AIRSPEED = 45.0
"""Design: m/s at trim. Neither this nor the input's size is printed. Here alpha reaches about 0.35 rad on one side of
trim, as required for the ranking of table 3."""

AMPLITUDE = 0.10
"""Design: rad, 1 s each way."""

INTERVAL = 0.03
"""Published: s between samples."""

SAMPLES = 300
"""Published: number of samples."""

STATES = ("u", "w", "q", "theta")


@dataclass(frozen=True)
class Flight:
    """The simulated flight.

    Attributes
    ----------
    rates, observe : callable
        f and h, compiled. f's inputs are delta_e, C_X_alpha2 and C_m_alpha2, so that one function is the true, the
        deficient and the completed model. All four states are measured.
    time : (N,)
        s.
    elevator : (N,)
        rad.
    states : (N, 4)
        True u, w [m/s], q [rad/s], theta [rad].
    force_scale, moment_scale : float
        q_bar S/m and q_bar S c/Iy over V^2: effect of a unit coefficient on u' and q'.
    """

    rates: Rates
    observe: Rates
    time: Array
    elevator: Array
    states: Array
    force_scale: float
    moment_scale: float

    def inputs(self, coefficients: tuple[float, float]) -> Array:
        """Inputs (N, 3) of the model with these alpha^2 coefficients."""
        return np.column_stack([self.elevator, *(np.full(self.time.size, value) for value in coefficients)])

    def candidate(self, states: Array, powers: tuple[int, ...]) -> Array:
        """Sum of these powers of alpha times its q_bar factor, as a rate of u and of q: (N, 4, 2)."""
        square = states[:, 0] ** 2 + states[:, 1] ** 2
        alpha = np.arctan2(states[:, 1], states[:, 0])
        value = square * sum(alpha**power for power in powers)
        columns = np.zeros((len(states), 4, 2))
        columns[:, 0, 0] = self.force_scale * value
        columns[:, 2, 1] = self.moment_scale * value
        return columns


def _equations(aircraft: Aircraft, density: float, thrust: float) -> Rates:
    """(33)-(36) as a compiled function; thrust maintains the trim."""
    value = {(d.coefficient, str(d.term)): d.value for d in aircraft.derivatives}
    CX0, CXa = value["C_X", "1"], value["C_X", "alpha"]
    CZ0, CZa, CZq, CZde = (value["C_Z", term] for term in ("1", "alpha", "q_hat", "delta_e"))
    Cm0, Cma, Cmq, Cmde = (value["C_m", term] for term in ("1", "alpha", "q_hat", "delta_e"))
    U0 = float(aircraft.airspeed or AIRSPEED)
    S, c, m, Iy = aircraft.wing_area, aircraft.mean_chord, aircraft.mass, aircraft.I_yy

    def rates(x: Array, inputs: Array, t: float) -> Array:  # noqa: ARG001
        u, w, q, theta = x[0], x[1], x[2], x[3]
        delta_e, CXa2, Cma2 = inputs[0], inputs[1], inputs[2]
        alpha, q_bar, q_hat = np.arctan2(w, u), 0.5 * density * (u * u + w * w), q * c / (2.0 * U0)
        CX = CX0 + CXa * alpha + CXa2 * alpha**2
        CZ = CZ0 + CZa * alpha + CZq * q_hat + CZde * delta_e
        Cm = Cm0 + Cma * alpha + Cma2 * alpha**2 + Cmq * q_hat + Cmde * delta_e
        out = np.empty(4)
        out[0] = CX * q_bar * S / m - q * w - GRAVITY * np.sin(theta) + thrust / m
        out[1] = CZ * q_bar * S / m + q * u + GRAVITY * np.cos(theta)
        out[2] = Cm * q_bar * S * c / Iy
        out[3] = q
        return out

    compiled: Any = numba.njit(error_model="numpy")(rates)
    return cast(Rates, compiled)


@cache
def reference_flight() -> Flight:
    """The flight of paper.md: trim at 45 m/s, elevator doublet of 0.10 rad, samples every 30 ms, no noise.

    Raises
    ------
    EstimationError
        Where no trim is found.
    """
    aircraft = load_aircraft("light_transport")
    density = float(aircraft.density or 0.0)

    # The trim, from the same equations without thrust: forces at alpha, delta_e and the missing thrust.
    plain = _equations(aircraft, density, 0.0)

    def accelerations(unknown: Array) -> Array:
        alpha, delta_e, thrust_over_m = unknown
        x = np.array([AIRSPEED * np.cos(alpha), AIRSPEED * np.sin(alpha), 0.0, alpha])
        return np.asarray(plain(x, np.array([delta_e, *ALPHA2]), 0.0)[:3] + np.array([thrust_over_m, 0.0, 0.0]))

    solution = root(accelerations, np.array([0.1, 0.0, 1.0]), tol=1e-12)
    if not solution.success:
        raise EstimationError(
            f"no trim was found at {AIRSPEED:g} m/s for the bundled light transport; reinstall aerosid."
        )
    alpha, delta_e, thrust_over_m = (float(number) for number in solution.x)
    rates = _equations(aircraft, density, thrust_over_m * aircraft.mass)

    time = INTERVAL * np.arange(float(SAMPLES))
    elevator = delta_e + doublet(time, 34 * INTERVAL, 34 * INTERVAL, AMPLITUDE)
    observe: Any = numba.njit(lambda x, u, t: x * 1.0)  # noqa: ARG005
    step = model_functions(rates, observe, n=4, p=4, substeps=6).step
    states = [np.array([AIRSPEED * np.cos(alpha), AIRSPEED * np.sin(alpha), 0.0, alpha])]
    true_inputs = np.column_stack([elevator, *(np.full(SAMPLES, value) for value in ALPHA2)])
    for k in range(SAMPLES - 1):
        states.append(step(states[-1], true_inputs[k], true_inputs[k + 1], float(time[k]), INTERVAL))
    force_scale = 0.5 * density * aircraft.wing_area / aircraft.mass
    moment_scale = 0.5 * density * aircraft.wing_area * aircraft.mean_chord / aircraft.I_yy
    return Flight(rates, observe, time, elevator, np.array(states), force_scale, moment_scale)


def noisy(flight: Flight, snr: float | None, seed: int) -> tuple[Array, Array]:
    """Measured u, w, q, theta (N, 4) and the standard deviation of their noise (4,).

    Parameters
    ----------
    flight : Flight
    snr : float or None
        Standard deviation of each channel about its mean over that of its noise; None: no noise.
    seed : int
        Of the noise.
    """
    deviation = np.std(flight.states, axis=0)
    if snr is None:
        # Assumed accuracy of a channel without noise: the weights need a number.
        return flight.states.copy(), deviation * 1e-4
    noise = np.random.default_rng(seed).standard_normal(flight.states.shape) * deviation / snr
    return flight.states + noise, deviation / snr
