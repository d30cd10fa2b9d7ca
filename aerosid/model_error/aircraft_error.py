"""Run the continuous estimator (21)-(26) on the aircraft's equations, with every candidate passed through it as well.

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

from aerosid.compiled import njit, njit_inline
from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import initial_state
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import (
    LONGITUDINAL,
    Axes,
    coupled_of,
    fed_of,
    input_columns_of,
    moving_of,
)
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import ALPHA_LIMIT, Flight
from aerosid.flight_model.layout import Layout, input_places, leading_columns, state_count, state_places
from aerosid.flight_model.loads import pressure_area
from aerosid.flight_model.rigid_body import rates_per_unit
from aerosid.flight_model.sampling_interval import Stages, integrate, make_stages
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.workspace import Workspace, make_workspace
from aerosid.model_error.invariant_embedding import estimator_step, gain_step, information
from aerosid.model_error.step_map import transition_step
from aerosid.model_error.step_work import StepWork, cholesky, step_work


@dataclass(frozen=True)
class AircraftError:
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
        -2 ln L of the one-step predictions, but for a constant: what tells good weights from bad; NaN if not asked for.
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
) -> AircraftError:
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

    Notes
    -----
    Parameswaran & Raol 1994, eqs. (21)-(26), with Q1 = R^-1/dt for samples of covariance R every dt.
    V and alpha enter as u and w, with the covariance that goes with them: the observation is then linear. A curved one
    leaves a residual that a high gain mistakes for model error, and a noise-free coefficient came back wrong by its
    own size at large weights.
    """
    axes = model.axes
    start = initial_state(flight, axes)
    fed = measured_states(flight, measurement_variance, axes)
    samples, terms, count = flight.time.size, model.values.size, len(coupled_of(axes))
    width = terms + count if respond else 0
    history = _History(
        states=np.empty((samples, count)),
        d=np.full((samples, count), np.nan),
        columns=np.zeros((samples, count, width)),
        rate_per_unit=np.empty((samples, len(moving_of(axes)))),
        innovations=np.full((samples, count), np.nan),
        riccati=np.empty((samples, count, count)),
    )
    airspeed = 0.0 if "V" in fed_of(axes) else float(flight.inputs[0, _input(axes, "V")])
    riccati = initial_riccati(start, measurement_variance, axes, airspeed)
    values = np.array(model.values)
    reached, cost = _run(
        flight, start, values, model.table, model.constants, fed, error_density, riccati, likelihood, history
    )
    if reached < samples:
        raise EstimationError(
            f"the model-error recursion left the model's range at {flight.time[reached]:.3f} s (sample {reached + 1}); "
            "check units and signs of V, alpha and q around that time."
        )
    return AircraftError(
        history.states,
        history.d,
        history.columns[:, :, :terms],
        history.columns[:, :, terms:],
        history.rate_per_unit,
        history.innovations,
        history.riccati,
        float(cost) if likelihood else np.nan,
    )


class FedStates(NamedTuple):
    """The coupled states as measured, (N, c), NaN where missing; R^-1 and R of each sample, (N, c, c)."""

    states: NDArray[np.float64]
    weights: NDArray[np.float64]
    covariance: NDArray[np.float64]


def measured_motion(
    flight: Flight, axes: Axes = LONGITUDINAL
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """The coupled states (N, c), angle of attack and sideslip (N,) as measured, the vanes' own velocity taken out."""
    columns = {name: flight.inputs[:, j] for j, name in enumerate(input_columns_of(axes))}
    columns |= {name: flight.measured[:, i] for i, name in enumerate(axes.outputs)}
    p, q, r = (np.nan_to_num(columns[name]) for name in ("p", "q", "r"))
    speed, alpha, beta = columns["V"], columns["alpha"], columns["beta"]
    if "alpha" in axes.outputs:
        arm = flight.positions[axes.outputs.index("alpha")]
        alpha = alpha + (q * arm[0] - p * arm[1]) / speed
    if "beta" in axes.outputs:
        arm = flight.positions[axes.outputs.index("beta")]
        beta = beta - (r * arm[0] - p * arm[2]) / speed
    plane = speed * np.cos(beta)
    columns |= {"u": plane * np.cos(alpha), "v": speed * np.sin(beta), "w": plane * np.sin(alpha)}
    return np.column_stack([columns[name] for name in coupled_of(axes)]), alpha, beta


def measured_states(flight: Flight, variance: NDArray[np.float64], axes: Axes = LONGITUDINAL) -> FedStates:
    """The coupled states as measured, with the covariance R of each sample from that of the outputs fed, (c,).

    All velocity components are missing where one of the air data is that they follow from.
    """
    measured, alpha, beta = measured_motion(flight, axes)
    names, fed = coupled_of(axes), fed_of(axes)
    speed = flight.measured[:, axes.outputs.index("V")] if "V" in fed else flight.inputs[:, _input(axes, "V")]
    speed = np.nan_to_num(speed, nan=1.0)
    plane = speed * np.nan_to_num(np.cos(beta), nan=1.0)
    cos, sin = np.nan_to_num(np.cos(alpha)), np.nan_to_num(np.sin(alpha))
    lean = np.nan_to_num(np.sin(beta)) if "V" in fed and "beta" in fed else np.zeros_like(speed)
    upright = np.sqrt(1.0 - lean * lean)
    # Along the flow, across it in the plane of symmetry, and out of that plane: what V, alpha and beta measure.
    directions = {
        "V": ({"u": cos * upright, "v": lean, "w": sin * upright}, np.ones_like(speed)),
        "alpha": ({"u": -sin, "w": cos}, plane),
        "beta": ({"u": -lean * cos, "v": upright, "w": -lean * sin}, speed),
    }
    if "V" not in fed:
        directions["beta"] = ({"v": np.ones_like(speed)}, plane)
    weights = np.zeros((speed.size, len(names), len(names)))
    covariance = np.zeros_like(weights)
    for place, name in enumerate(fed):
        if name not in directions:
            weights[:, place, place], covariance[:, place, place] = 1.0 / variance[place], variance[place]
            continue
        along, length = directions[name]
        for one, first in along.items():
            for other, second in along.items():
                if one in names and other in names:
                    at = names.index(one), names.index(other)
                    weights[:, at[0], at[1]] += first * second / (length**2 * variance[place])
                    covariance[:, at[0], at[1]] += first * second * length**2 * variance[place]
    return FedStates(measured, weights, covariance)


def _input(axes: Axes, name: str) -> int:
    return input_columns_of(axes).index(name)


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


class _History(NamedTuple):
    """What the recursion writes, sample by sample; the attributes of `AircraftError`, `columns` of all responses."""

    states: NDArray[np.float64]
    d: NDArray[np.float64]
    columns: NDArray[np.float64]
    rate_per_unit: NDArray[np.float64]
    innovations: NDArray[np.float64]
    riccati: NDArray[np.float64]


class _Matrices(NamedTuple):
    """Room for one sample: matrices of the c coupled states, in the letters of `_recur`."""

    spread: NDArray[np.float64]
    factor: NDArray[np.float64]
    S: NDArray[np.float64]
    S_next: NDArray[np.float64]
    F: NDArray[np.float64]
    H: NDArray[np.float64]
    W: NDArray[np.float64]
    Q1: NDArray[np.float64]
    C: NDArray[np.float64]
    HQ: NDArray[np.float64]
    M0: NDArray[np.float64]
    M1: NDArray[np.float64]
    Phi: NDArray[np.float64]
    Gamma0: NDArray[np.float64]
    Gamma1: NDArray[np.float64]


class _Rows(NamedTuple):
    """Room for one sample: vectors of the c coupled states, in the letters of `_recur`; `ahead` (n) of all states."""

    row: NDArray[np.float64]
    r0: NDArray[np.float64]
    r1: NDArray[np.float64]
    weight: NDArray[np.float64]
    here: NDArray[np.float64]
    there: NDArray[np.float64]
    g0: NDArray[np.float64]
    g1: NDArray[np.float64]
    e: NDArray[np.float64]
    ahead: NDArray[np.float64]


@njit
def _run(
    flight: Flight,
    start: NDArray[np.float64],
    theta: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    fed: FedStates,
    density: NDArray[np.float64],
    riccati_start: NDArray[np.float64],
    likelihood: bool,
    history: _History,
) -> tuple[int, float]:
    """The recursion over a whole record; returns the number of samples that it reached, and -2 ln L.

    Arrays are made here, of sizes that the compiler knows, so that the step's code is made for just that many states.
    """
    layout = constants.layout
    n = len(layout.sizes.coupled)
    extra, width = flight.inputs.shape[1] - leading_columns(layout), history.columns.shape[2]
    work, ahead = make_workspace(extra, table, layout), make_workspace(extra, table, layout)
    matrices = _Matrices(
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)),
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)),
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)),
    )  # fmt: skip
    rows = _Rows(
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n),
        np.zeros(n), np.zeros(state_count(layout)),
    )  # fmt: skip
    return _recur(
        flight, start.copy(), theta, table, constants, fed, density, riccati_start, likelihood, history,
        work, ahead, make_stages(extra, layout), matrices, rows, step_work(n, n, n), step_work(n, 2, 2),
        np.zeros((n, width)), np.zeros((2, n, width)),
    )  # fmt: skip


@njit_inline
def _recur(
    flight: Flight,
    x: NDArray[np.float64],
    theta: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    fed: FedStates,
    density: NDArray[np.float64],
    riccati_start: NDArray[np.float64],
    likelihood: bool,
    history: _History,
    work: Workspace,
    ahead: Workspace,
    stages: Stages,
    matrices: _Matrices,
    rows: _Rows,
    gains: StepWork,
    corrections: StepWork,
    eps: NDArray[np.float64],
    scratch: NDArray[np.float64],
) -> tuple[int, float]:
    """As `_run`, from `x` and in work arrays that are given."""
    layout = constants.layout
    n, count = len(layout.sizes.coupled), state_count(layout)
    p = n
    measured, weights = fed.states, fed.weights
    states, d, columns, rate_per_unit, innovations, riccati = history
    samples, terms, width = flight.time.shape[0], theta.shape[0], columns.shape[2]
    respond = width > 0
    cost = 0.0
    spread, factor, S, S_next, F, H, W, Q1, C, HQ, M0, M1, Phi, Gamma0, Gamma1 = matrices
    row, r0, r1, weight, here, there, g0, g1, e, ahead_x = rows
    for i in range(n):
        H[i, i] = 1.0
        W[i, i] = 0.5 * density[i]
        for j in range(n):
            S[i, j] = riccati_start[i, j]
        if respond:
            eps[i, terms + i] = 1.0
    for k in range(samples):
        evaluate(x, flight.inputs[k], theta, table, constants, flight.positions, work, True, False)
        if not _within(x, flight.inputs[k], layout):
            return k, cost
        for i in range(n):
            states[k, i] = x[i]
            for j in range(n):
                F[i, j] = work.rates_x[i, j]
                riccati[k, i, j] = S[i, j]
        rates_per_unit(pressure_area(x, flight.inputs[k], constants), flight.inputs[k], constants, rate_per_unit[k])
        dt = flight.time[min(k + 1, samples - 1)] - flight.time[min(k, samples - 2)]
        seen = False
        for i in range(p):
            r0[i] = measured[k, i] - x[i]
            innovations[k, i] = r0[i]
            here[i] = 0.0 if np.isnan(r0[i]) else 1.0
            seen = seen or here[i] > 0.0
            for j in range(p):
                Q1[i, j] = weights[k, i, j] / dt
        # d of the sample, eq. (23): only what is measured here speaks.
        information(H, Q1, here, HQ, C)
        if seen:
            for i in range(n):
                g0[i] = 0.0
                for j in range(p):
                    if here[j] > 0.0:
                        g0[i] += HQ[i, j] * r0[j]
            for i in range(n):
                d[k, i] = 0.0
                for j in range(n):
                    d[k, i] += S[i, j] * g0[j]
            if respond:
                _apply(n, C, eps, scratch[0], 0.0)
                _apply(n, S, scratch[0], columns[k], 0.0)
        if k + 1 == samples:
            return samples, cost
        for i in range(count):
            ahead_x[i] = x[i]
            ahead.rates[i] = work.rates[i]
        integrate(
            ahead_x, flight.inputs[k], flight.inputs[k + 1], dt, 0, flight.substeps, flight.substeps,
            theta, table, constants, flight.positions, ahead, stages,
        )  # fmt: skip
        if not _within(ahead_x, flight.inputs[k + 1], layout):
            return k + 1, cost
        for i in range(p):
            r1[i] = measured[k + 1, i] - ahead_x[i]
            there[i] = 0.0 if np.isnan(r1[i]) else 1.0
            weight[i] = 0.5 * (here[i] + there[i])
            if here[i] == 0.0:
                r0[i] = r1[i] if there[i] > 0.0 else 0.0
            if there[i] == 0.0:
                r1[i] = r0[i]
        if likelihood or respond:
            transition_step(F, dt, Phi, Gamma0, Gamma1, gains)
        if likelihood:
            # How likely the next sample is, predicted from this one: P = 2 (Phi S Phi' + W dt), R from the weights.
            cost += _surprise(S, Phi, W, dt, fed.covariance[k + 1], r1, there, spread, factor, row)
        information(H, Q1, weight, HQ, C)
        for i in range(n):
            g0[i] = 0.0
            g1[i] = 0.0
            for j in range(p):
                g0[i] += HQ[i, j] * r0[j]
                g1[i] += HQ[i, j] * r1[j]
        for i in range(n):
            x[i] = ahead_x[i]
        for i in range(n, count):
            x[i] = ahead_x[i]
        if respond:
            if not gain_step(S, F, W, C, dt, S_next, M0, M1, gains):
                return k + 1, cost
            for i in range(n):
                for a in range(n):
                    x[i] += M0[i, a] * g0[a] + M1[i, a] * g1[a]
            # The candidates' true-minus-estimate: open loop with the candidate's rate, then the same correction.
            evaluate(ahead_x, flight.inputs[k + 1], theta, table, constants, flight.positions, ahead, True, False)
            _apply(n, C, eps, scratch[0], 0.0)
            _apply(n, Phi, eps, scratch[1], 0.0)
            _apply(n, Gamma0, work.rates_p, scratch[1], 1.0)
            _apply(n, Gamma1, ahead.rates_p, scratch[1], 1.0)
            _apply(n, M0, scratch[0], eps, 0.0, -1.0)
            _apply(n, C, scratch[1], scratch[0], 0.0)
            _apply(n, M1, scratch[0], eps, 1.0, -1.0)
            for i in range(n):
                for c in range(width):
                    eps[i, c] += scratch[1, i, c]
        else:
            if not estimator_step(S, F, W, C, g0, g1, dt, S_next, e, corrections):
                return k + 1, cost
            for i in range(n):
                x[i] += e[i]
        for i in range(n):
            for j in range(n):
                S[i, j] = S_next[i, j]
    return samples, cost


@njit_inline
def _within(x: NDArray[np.float64], u: NDArray[np.float64], layout: Layout) -> bool:
    """Whether the angle of attack, or the sideslip where it alone is estimated, is within the limit."""
    at = state_places(layout)
    inside: bool
    if len(layout.motion.u) > 0:
        inside = abs(np.arctan2(x[at.w], x[at.u])) < ALPHA_LIMIT
    else:
        inside = abs(x[at.v]) < u[input_places(layout).V]
    return inside


@njit_inline
def _apply(
    n: int, A: NDArray[np.float64], B: NDArray[np.float64], out: NDArray[np.float64], keep: float, sign: float = 1.0
) -> None:
    """`sign` A B, plus `keep` times what was there, into out: A (c, c), B and out of c rows or more."""
    for i in range(n):
        for j in range(B.shape[1]):
            value = 0.0
            for k in range(n):
                value += A[i, k] * B[k, j]
            out[i, j] = sign * value if keep == 0.0 else keep * out[i, j] + sign * value


@njit_inline
def _surprise(
    S: NDArray[np.float64],
    Phi: NDArray[np.float64],
    W: NDArray[np.float64],
    dt: float,
    covariance: NDArray[np.float64],
    residual: NDArray[np.float64],
    held: NDArray[np.float64],
    spread: NDArray[np.float64],
    factor: NDArray[np.float64],
    row: NDArray[np.float64],
) -> float:
    """Ln det B + r' B^-1 r of the predicted residual r with B = 2 (Phi S Phi' + W dt) + R; rows not held left out."""
    n = S.shape[0]
    for i in range(n):
        for b in range(n):
            factor[i, b] = 0.0
            for a in range(n):
                factor[i, b] += 2.0 * Phi[i, a] * S[a, b]
        for j in range(n):
            value = 2.0 * W[i, j] * dt + covariance[i, j]
            for b in range(n):
                value += factor[i, b] * Phi[j, b]
            spread[i, j] = value
    total = 0.0
    for i in range(n):
        if held[i] == 0.0:
            for j in range(n):
                spread[i, j] = 0.0
                spread[j, i] = 0.0
            spread[i, i] = 1.0
    cholesky(spread, factor, n)
    for i in range(n):
        row[i] = residual[i] if held[i] > 0.0 else 0.0
        for j in range(i):
            row[i] -= factor[i, j] * row[j]
        row[i] /= factor[i, i]
        total += row[i] * row[i] + 2.0 * np.log(factor[i, i])
    return total
