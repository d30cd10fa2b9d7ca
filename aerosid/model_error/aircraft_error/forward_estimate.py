"""Continuous invariant embedding (21)-(26) on an aircraft's equations, every candidate through the same gains.

The estimator's d(t) is a filtered picture of the true model error: what its gain and its step do to the error they do
to a candidate too. So each term's contribution is sent through the same gains, sample by sample, and d(t) is compared
with that. Model error is allowed in the equations on which forces and moments act; those of attitude are kinematics.
Altitude acts on nothing and carries no model error. The states are compared with what determines them: specific forces
contain d itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import initial_state
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL, Axes, coupled_of, fed_of, moving_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.terms import TermTable
from aerosid.model_error.aircraft_error.measured_states import input_place, measured_states
from aerosid.model_error.aircraft_error.recursion import History, RecursionWeights, run


@dataclass(frozen=True)
class AircraftErrorHistory:
    """What the estimator made of one log.

    Attributes
    ----------
    states : ndarray, shape (N, c)
        The coupled states of the case, c of them: u, w, q, theta of the longitudinal one.
    d : ndarray, shape (N, c)
        Model error (23) in their equations, in units of the state per second; NaN where a sample had no measurement.
    responded : ndarray, shape (N, c, T)
        The d that each term of unit value would have produced through the same estimator.
    initial : ndarray, shape (N, c, c)
        The d that an error of each initial state would have produced.
    rate_per_unit : ndarray, shape (N, v)
        State rate that a unit of its coefficient causes in the equation of each of the v moving states.
    innovations : ndarray, shape (N, c)
        Measured states minus the estimate.
    riccati : ndarray, shape (N, c, c)
        S of (22).
    cost : float
        -2 ln L of the one-step predictions, up to a constant: the criterion of the weights; NaN if not requested.
    """

    states: NDArray[np.float64]
    d: NDArray[np.float64]
    responded: NDArray[np.float64]
    initial: NDArray[np.float64]
    rate_per_unit: NDArray[np.float64]
    innovations: NDArray[np.float64]
    riccati: NDArray[np.float64]
    cost: float


def estimate_aircraft_error(
    model: AerodynamicModel,
    flight: Flight,
    measurement_variance: NDArray[np.float64],
    error_density: NDArray[np.float64],
    *,
    respond: bool = True,
    likelihood: bool = False,
) -> AircraftErrorHistory:
    """The model error of `model` on a flight, and what each of its terms looks like through the same estimator.

    Parameters
    ----------
    model : AerodynamicModel
        Candidates are terms of zero value.
    flight : Flight
        Channels as fed to the recursion, filtered or not.
    measurement_variance : ndarray, shape (c,)
        Variance of each sample of the outputs of `fed_of` the case as fed to the recursion, SI squared.
    error_density : ndarray, shape (c,)
        Diagonal of Q2^-1 in (22), spectral density of the model error, (state/s)^2 s; an entry may be zero.
    respond : bool
        Whether the terms' responses are wanted; without, `responded` and `initial` are empty.
    likelihood : bool
        Whether the cost is wanted.

    Raises
    ------
    EstimationError
        Where the recursion cannot be formed: the estimate left the model's range.
    ValueError
        Where the flight does not hold the model's input columns: the kernel would read and write beside them.

    Notes
    -----
    Parameswaran & Raol 1994, eqs. (21)-(26), with Q1 = R^-1/dt for samples of covariance R every dt.
    V and alpha enter as u and w, with the covariance that goes with them: the observation is then linear. A curved one
    leaves a residual that a high gain mistakes for model error, and a noise-free coefficient came back wrong by its
    own size at large weights.
    """
    recursion = prepared_recursion(model, flight, measurement_variance, error_density, respond, likelihood)
    history, samples, terms = recursion.history, flight.time.size, model.values.size
    reached, cost = run(*recursion)
    if reached < samples:
        raise EstimationError(
            f"the model-error recursion left the model's range at {flight.time[reached]:.3f} s (sample {reached + 1}); "
            "check units and signs of V, alpha and q around that time."
        )
    return AircraftErrorHistory(
        history.states,
        history.d,
        history.columns[:, :, :terms],
        history.columns[:, :, terms:],
        history.rate_per_unit,
        history.innovations,
        history.riccati,
        float(cost) if likelihood else np.nan,
    )


class PreparedRecursion(NamedTuple):
    """The arguments of the compiled recursion in their order; `history` is what it fills."""

    flight: Flight
    start: NDArray[np.float64]
    parameters: NDArray[np.float64]
    table: TermTable
    constants: Constants
    measured: NDArray[np.float64]
    given: RecursionWeights
    likelihood: bool
    history: History


def prepared_recursion(
    model: AerodynamicModel,
    flight: Flight,
    measurement_variance: NDArray[np.float64],
    error_density: NDArray[np.float64],
    respond: bool,
    likelihood: bool,
) -> PreparedRecursion:
    """What the recursion is run on, as the parameters of `estimate_aircraft_error`.

    Raises
    ------
    ValueError
        Where the flight does not hold the model's input columns.
    """
    axes = model.axes
    if flight.inputs.shape[1] != len(model.columns):
        raise ValueError(f"the flight has {flight.inputs.shape[1]} input columns, the model {len(model.columns)}")
    start = initial_state(flight, axes)
    fed = measured_states(flight, measurement_variance, axes)
    samples, terms, count = flight.time.size, model.values.size, len(coupled_of(axes))
    width = terms + count if respond else 0
    history = History(
        states=np.empty((samples, count)),
        d=np.full((samples, count), np.nan),
        columns=np.zeros((samples, count, width)),
        rate_per_unit=np.empty((samples, len(moving_of(axes)))),
        innovations=np.full((samples, count), np.nan),
        riccati=np.empty((samples, count, count)),
    )
    airspeed = 0.0 if "V" in fed_of(axes) else float(flight.inputs[0, input_place(axes, "V")])
    riccati = initial_riccati(start, measurement_variance, axes, airspeed)
    weights = RecursionWeights(fed.weights, fed.covariance, error_density, riccati)
    values = np.array(model.values)
    return PreparedRecursion(
        flight, start, values, model.table, model.constants, fed.states, weights, likelihood, history
    )


def initial_riccati(
    start: NDArray[np.float64], variance: NDArray[np.float64], axes: Axes = LONGITUDINAL, airspeed: float = 0.0
) -> NDArray[np.float64]:
    """S(0): the initial state is known as well as one sample of each channel measures it, S = covariance / 2."""
    motion = dict(zip(axes.integrated, start.tolist(), strict=True))
    square = sum(motion[name] ** 2 for name in ("u", "w")) if "u" in motion else airspeed**2
    diagonal = []
    for place, (name, output) in enumerate(zip(coupled_of(axes), fed_of(axes), strict=True)):
        scale = square if output in ("alpha", "beta") else 1.0
        diagonal.append(scale * variance[place] + (1e-12 if name in ("u", "v", "w") else 1e-14))
    return 0.5 * np.diag(diagonal)
