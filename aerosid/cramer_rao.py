"""The Cramer-Rao bound of a manoeuvre: how well any unbiased estimator can know its derivatives.

Nothing here is shared with the estimators: the equations of motion are written out once more, on arrays of many flights
at once; sensitivities are central differences of whole flights; the noise of measured surfaces enters as the covariance
of the outputs that it causes, sample by sample, in one dense matrix.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from aerosid.aerodynamics import AerodynamicModel, Entry
from aerosid.effects import ActiveEffect, InputEffect, OutputEffect
from aerosid.likelihood import acting_flight
from aerosid.longitudinal import OUTPUTS
from aerosid.manoeuvre import Manoeuvre
from aerosid.terms import Term

FloatArray = NDArray[np.float64]

LONGEST_STEP = 0.01
"""s, of the fourth-order Runge-Kutta integration."""

MOST_NUMBERS = 6000
"""Samples times channels up to which the dense covariance is formed: 0.3 GB."""

_GRAVITY = 9.80665
_STATE_STEPS = (1e-3, 1e-3, 1e-6, 1e-6, 1e-2)  # m/s, m/s, rad/s, rad, m
_INPUT_STEP = 1e-6  # rad, or the unit of the channel
_VALUE_STEP = 1e-5


@dataclass(frozen=True)
class Sensitivity:
    """How the measured outputs of a manoeuvre, p of them one after the other, move with what is not known.

    Attributes
    ----------
    unknown : ndarray, shape (p N, F + 5 + K)
        With the free derivatives, the initial state and the numbers of effects.
    by_input : ndarray, shape (p N, E N)
        With each recorded sample of the noisy inputs.
    held : ndarray of bool, shape (p N,)
        Which samples were measured.
    derivatives : int
        F.
    """

    unknown: FloatArray
    by_input: FloatArray
    held: NDArray[np.bool_]
    derivatives: int

    def bound(self, output_noise: FloatArray, input_variance: FloatArray) -> FloatArray:
        """The least standard deviation of each free derivative, (F,), structure known and initial state unknown.

        Parameters
        ----------
        output_noise : ndarray, shape (p, p, N)
            Covariance of the noise of the outputs, SI: [i, j, k] that of output i with output j k samples later.
        input_variance : ndarray, shape (E,)
            Of each recorded sample of the noisy inputs, SI squared.

        Raises
        ------
        ValueError
            Where the covariance is not positive definite: no bound is known without noise on every output.

        Notes
        -----
        (S' C^-1 S)^-1 with the sensitivities S of all outputs to all unknowns and C = R + G Q G': R the covariance of
        the outputs' noise, G their sensitivity to the inputs at each sample, Q the variance of the inputs' noise.
        Maine & Iliff, NASA RP-1168, 1986, chapter 5; the term G Q G' counts that a measured surface is noisy too.
        """
        covariance = _stacked(output_noise)[np.ix_(self.held, self.held)]
        if not np.all(np.diag(covariance) > 0.0):
            raise ValueError("an output without noise has no bound")
        samples = output_noise.shape[2]
        disturbed = self.by_input[self.held] * np.repeat(np.sqrt(input_variance), samples)
        covariance += disturbed @ disturbed.T
        # Channels differ by powers of ten.
        scale = 1.0 / np.sqrt(np.diag(covariance))
        covariance *= scale[:, None] * scale
        try:
            root = scipy.linalg.cholesky(covariance, lower=True, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            raise ValueError("the noise's covariance is not positive definite") from None
        white = scipy.linalg.solve_triangular(root, self.unknown[self.held] * scale[:, None], lower=True)
        size = np.sqrt(np.sum(white**2, axis=0))
        moving = size > 0.0  # altitude acts on nothing where it is not measured
        triangle = np.asarray(np.linalg.qr(white[:, moving] / size[moving], mode="r"))
        inverse = scipy.linalg.solve_triangular(triangle, np.eye(triangle.shape[0]))
        bound = np.full(size.size, np.inf)
        bound[moving] = np.sqrt(np.sum(inverse**2, axis=1)) / size[moving]
        return bound[: self.derivatives]


def _stacked(noise: FloatArray) -> FloatArray:
    """Covariance (p N, p N) of all samples of the first output, then of the second and so on."""
    outputs = noise.shape[0]
    return np.block([[scipy.linalg.toeplitz(noise[j, i], noise[i, j]) for j in range(outputs)] for i in range(outputs)])


def sensitivity(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    state: FloatArray,
    free: Sequence[Entry],
    noisy: NDArray[np.bool_],
    effects: Sequence[ActiveEffect] = (),
) -> Sensitivity | None:
    """The sensitivities of a manoeuvre's outputs to all that an estimator does not know.

    Parameters
    ----------
    model : AerodynamicModel
        The true model.
    manoeuvre : Manoeuvre
        Its true inputs, and which outputs are measured at which samples.
    state : ndarray, shape (5,)
        The true initial state u, w, q, theta, h; unknown to the estimator.
    free : sequence of Entry
        The derivatives that are to be estimated; the numbers of `effects` are as well.
    noisy : ndarray of bool, shape (E,)
        Which of the extra inputs are recorded with noise.
    effects : sequence of ActiveEffect
        What acts on the controls and sensors.

    Returns
    -------
    None where there are none to be had: an effect that depends on the motion or is known by its statistics alone, or
    more than `MOST_NUMBERS` numbers measured.
    """
    flight = manoeuvre.flight
    samples, places = flight.time.size, [OUTPUTS.index(name) for name in manoeuvre.outputs]
    simple = all(isinstance(active.effect, InputEffect | OutputEffect) for active in effects)
    if not simple or samples * len(places) > MOST_NUMBERS:
        return None
    pairs = list(_pairs(model, manoeuvre, state, free, noisy, effects))
    sides = [side for pair in pairs for side in pair.sides]
    nominal = acting_flight(model, manoeuvre, effects)[0].inputs[:, 8:]
    extra = [nominal if side.recorded is None and side.effects is effects else _acting(model, manoeuvre, side)
             for side in sides]  # fmt: skip
    responses = fly_many(
        model,
        manoeuvre,
        np.stack([side.values for side in sides], axis=1),
        np.stack([side.state for side in sides], axis=1),
        np.stack(extra, axis=2),
    )
    for k, side in enumerate(sides):
        for active in side.effects:
            if isinstance(active.effect, OutputEffect) and active.acts_on(manoeuvre.name):
                i = OUTPUTS.index(active.effect.where)
                given = responses[:, i : i + 1, k]
                responses[:, i, k] = active.effect.output(flight.time, given, active.values)[:, 0]
    slopes = (responses[:, places, 0::2] - responses[:, places, 1::2]) / np.array([pair.width for pair in pairs])
    stacked = slopes.transpose(1, 0, 2).reshape(len(places) * samples, -1)
    unknowns = len(pairs) - samples * int(np.count_nonzero(noisy))
    held = np.isfinite(flight.measured[:, places]).T.ravel()
    return Sensitivity(stacked[:, :unknowns], stacked[:, unknowns:], held, len(free))


@dataclass(frozen=True)
class _Side:
    """One of the two flights of a central difference."""

    values: FloatArray
    state: FloatArray
    recorded: FloatArray | None
    effects: Sequence[ActiveEffect]


@dataclass(frozen=True)
class _Pair:
    """Both flights of a central difference, and the distance of what differs in them."""

    sides: tuple[_Side, _Side]
    width: float


def _pairs(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    state: FloatArray,
    free: Sequence[Entry],
    noisy: NDArray[np.bool_],
    effects: Sequence[ActiveEffect],
) -> Iterator[_Pair]:
    """Derivatives, initial state, numbers of effects, then the samples of every noisy input."""
    flight = manoeuvre.flight
    middle = _Side(model.values, state, None, effects)
    for place in model.indices(free):
        step = _VALUE_STEP * max(abs(float(model.values[place])), 0.05)
        move = step * np.eye(model.values.size)[place]
        yield _Pair(
            (replace(middle, values=model.values + move), replace(middle, values=model.values - move)), 2.0 * step
        )
    for move, step in zip(np.diag(_STATE_STEPS), _STATE_STEPS, strict=True):
        yield _Pair((replace(middle, state=state + move), replace(middle, state=state - move)), 2.0 * step)
    for n, active in enumerate(effects):
        for place, parameter in enumerate(active.effect.parameters):
            beside = [active.beside(place, sign * parameter.step) for sign in (1.0, -1.0)]
            upper, lower = (replace(middle, effects=[*effects[:n], other, *effects[n + 1 :]]) for other in beside)
            yield _Pair((upper, lower), beside[0].values[place] - beside[1].values[place])
    for j in np.flatnonzero(noisy):
        for k in range(flight.time.size):
            upper, lower = (replace(middle, recorded=flight.inputs.copy()) for _ in range(2))
            for side, sign in ((upper, 1.0), (lower, -1.0)):
                assert side.recorded is not None
                side.recorded[k, 8 + j] += sign * _INPUT_STEP
            yield _Pair((upper, lower), 2.0 * _INPUT_STEP)


def _acting(model: AerodynamicModel, manoeuvre: Manoeuvre, side: _Side) -> FloatArray:
    """The extra inputs (N, E) that act where these were recorded and these effects lie between."""
    flight = manoeuvre.flight if side.recorded is None else manoeuvre.flight._replace(inputs=side.recorded)
    return acting_flight(model, replace(manoeuvre, flight=flight), side.effects)[0].inputs[:, 8:]


def fly_many(
    model: AerodynamicModel, manoeuvre: Manoeuvre, values: FloatArray, states: FloatArray, extra: FloatArray
) -> FloatArray:
    """Outputs (N, 8, K) of K flights at once, in the order of OUTPUTS, open loop.

    Parameters
    ----------
    model : AerodynamicModel
        Terms and constants.
    manoeuvre : Manoeuvre
        Time, the fixed inputs and the sensors' positions.
    values : ndarray, shape (T, K)
        Of the terms in each flight.
    states : ndarray, shape (5, K)
        The initial ones.
    extra : ndarray, shape (N, E, K)
        The extra inputs of each flight, linear between samples.
    """
    flight = manoeuvre.flight
    time, fixed = flight.time, flight.inputs[:, :8]
    names = model.columns[8:]
    x = np.array(states, dtype=np.float64)
    result = np.empty((time.size, len(OUTPUTS), x.shape[1]))
    for n in range(time.size):
        result[n] = _outputs(model, x, values, fixed[n], dict(zip(names, extra[n], strict=True)), flight.positions)
        if n + 1 == time.size:
            break
        interval = float(time[n + 1] - time[n])
        steps = int(np.ceil(interval / LONGEST_STEP - 1e-9))
        h = interval / steps

        def rates(at: float, x: FloatArray, n: int = n) -> FloatArray:
            held = (1.0 - at) * fixed[n] + at * fixed[n + 1]
            moved = (1.0 - at) * extra[n] + at * extra[n + 1]
            return _rates(model, x, values, held, dict(zip(names, moved, strict=True)))[0]

        for s in range(steps):
            k1 = rates(s / steps, x)
            k2 = rates((s + 0.5) / steps, x + 0.5 * h * k1)
            k3 = rates((s + 0.5) / steps, x + 0.5 * h * k2)
            k4 = rates((s + 1.0) / steps, x + h * k3)
            x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return result


def _rates(
    model: AerodynamicModel, x: FloatArray, values: FloatArray, fixed: FloatArray, extra: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """State rates (5, K) and specific force along x and z (2, K): (33)-(36) with the measured lateral motion."""
    u, w, q, theta = x[0], x[1], x[2], x[3]
    rho, thrust, mass, sound, phi, p, r, beta = (float(number) for number in fixed)
    constants = model.constants
    v = np.hypot(u, w) * np.tan(beta)
    speed = np.sqrt(u**2 + v**2 + w**2)
    alpha = np.arctan2(w, u)
    force = 0.5 * rho * speed**2 * constants.wing_area
    half_chord = constants.mean_chord / (2.0 * (constants.airspeed_of_rates or speed))
    variables = {
        "alpha": alpha,
        "q_hat": q * half_chord,
        "V_hat": speed / constants.airspeed_of_V_hat - 1.0,
        "alpha_dot_hat": np.zeros_like(u),
        "C_T": thrust / force,
        "mach": speed / sound,
        "rho": rho, "thrust": thrust, "mass": mass, "phi": phi, "p": p, "r": r, "beta": beta,
        **extra,
    }  # fmt: skip
    along, down = np.cos(constants.thrust_incidence), -np.sin(constants.thrust_incidence)
    implicit = any("alpha_dot_hat" in term.variables for _, term in model.entries)
    # alpha_dot acts through terms that are small beside inertia: each pass gains two digits or more.
    for _ in range(12 if implicit else 1):
        c_x, c_z, c_m = _coefficients(model, values, variables, alpha)
        a_x = (force * c_x + thrust * along) / mass
        a_z = (force * c_z + thrust * down) / mass
        du = a_x - _GRAVITY * np.sin(theta) - q * w + r * v
        dw = a_z + _GRAVITY * np.cos(theta) * np.cos(phi) + q * u - p * v
        variables["alpha_dot_hat"] = (u * dw - w * du) / (u**2 + w**2) * half_chord
    dq = (force * constants.mean_chord * c_m + thrust * constants.thrust_z_arm) / constants.I_yy
    dtheta = q * np.cos(phi) - r * np.sin(phi)
    dh = u * np.sin(theta) - v * np.sin(phi) * np.cos(theta) - w * np.cos(phi) * np.cos(theta)
    return np.stack([du, dw, dq, dtheta, dh]), np.stack([a_x, a_z])


def _coefficients(
    model: AerodynamicModel, values: FloatArray, variables: Mapping[str, FloatArray | float], alpha: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """C_X, C_Z, C_m (K,), lift and drag turned into body axes."""
    total = {name: np.zeros(alpha.size) for name in ("C_X", "C_Z", "C_m", "C_L", "C_D")}
    for (coefficient, term), value in zip(model.entries, values, strict=True):
        total[coefficient] += value * _term(term, variables)
    sin, cos = np.sin(alpha), np.cos(alpha)
    c_x = total["C_X"] + total["C_L"] * sin - total["C_D"] * cos
    c_z = total["C_Z"] - total["C_L"] * cos - total["C_D"] * sin
    return c_x, c_z, total["C_m"]


def _term(term: Term, variables: Mapping[str, FloatArray | float]) -> FloatArray | float:
    product: FloatArray | float = 1.0
    for factor in term.factors:
        x = variables[factor.variable]
        if factor.shape == "abs":
            x = np.abs(x)
        elif factor.shape == "pos":
            x = np.maximum(x - factor.offset, 0.0)
        product = product * x**factor.power
    return product


def _outputs(
    model: AerodynamicModel,
    x: FloatArray,
    values: FloatArray,
    fixed: FloatArray,
    extra: Mapping[str, FloatArray],
    positions: FloatArray,
) -> FloatArray:
    """What the sensors at their positions see, (8, K)."""
    rates, (a_x, a_z) = _rates(model, x, values, fixed, extra)
    u, w, q, theta, h = x
    p, r, beta = float(fixed[5]), float(fixed[6]), float(fixed[7])
    v = np.hypot(u, w) * np.tan(beta)
    vane, axial, normal = positions[1], positions[4], positions[5]
    wind_u = u + q * vane[2] - r * vane[1]
    wind_w = w + p * vane[1] - q * vane[0]
    # Specific force at a place: that of the centre of gravity, and omega' x place + omega x (omega x place).
    f_x = a_x + rates[2] * axial[2] + q * (p * axial[1] - q * axial[0]) - r * (r * axial[0] - p * axial[2])
    f_z = a_z - rates[2] * normal[0] + p * (r * normal[0] - p * normal[2]) - q * (q * normal[2] - r * normal[1])
    return np.stack([np.sqrt(u**2 + v**2 + w**2), np.arctan2(wind_w, wind_u), q, theta, f_x, f_z, rates[2], h])
