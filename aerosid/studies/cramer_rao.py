"""The Cramer-Rao bound of a manoeuvre: the least standard error of its derivatives by any unbiased estimator.

No code is shared with the estimators: the equations of motion are implemented again, on arrays of many flights at once;
sensitivities are central differences of whole flights. The noise of measured surfaces enters by the output noise that
it causes: exactly, and at a cost that grows with the length of the record.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, OutputEffect
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import input_columns_of
from aerosid.flight_model.flight import Flight
from aerosid.signals.stationary_noise import StationaryNoise
from aerosid.studies.many_flights import fly_many, state_steps
from aerosid.studies.noisy_inputs import InputPath, input_path

FloatArray = NDArray[np.float64]

MOST_NUMBERS = 6000
"""Numerical: samples times channels up to which the dense covariance is formed, 0.3 GB: where an effect acts on noisy
inputs."""

_INPUT_STEP = 1e-6
"""Numerical: rad, or the unit of the channel, of a difference by an input."""

_VALUE_STEP = 1e-5
"""Numerical: fraction, 1, of a value used as the step of a difference."""


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivities of the p measured outputs of a manoeuvre to the unknowns.

    Attributes
    ----------
    unknown : ndarray, shape (N, p, F + n + K)
        To the free derivatives, the initial state and the parameters of effects.
    path : InputPath, ndarray of shape (N, p, E N), or None
        To errors of the noisy inputs: sample by sample, or to every recorded sample where an effect acts in between;
        None where no input is noisy.
    held : ndarray of bool, shape (N, p)
        Which samples were measured.
    derivatives : int
        Number F of free derivatives.
    """

    unknown: FloatArray
    path: InputPath | FloatArray | None
    held: NDArray[np.bool_]
    derivatives: int

    def bound(self, output_noise: FloatArray, input_variance: FloatArray) -> FloatArray:
        """The least standard error of each free derivative, (F,), with known structure and unknown initial state.

        Parameters
        ----------
        output_noise : ndarray, shape (p, p, N)
            Covariance of the noise of the outputs, SI: [i, j, k] that of output i with output j k samples later. Where
            inputs are noisy: of outputs independent of each other, white or AR(1).
        input_variance : ndarray, shape (E,)
            Of each recorded sample of the noisy inputs, SI squared.

        Raises
        ------
        ValueError
            Where the covariance is not positive definite: the bound requires noise on every output.

        Notes
        -----
        (S' C^-1 S)^-1 with the sensitivities S of all outputs to all unknowns and C = R + G Q G': R the covariance of
        the outputs' noise, G their sensitivity to the inputs at each sample, Q the variance of the inputs' noise.
        Maine & Iliff, NASA RP-1168, 1986, chapter 5; the term G Q G' accounts for the noise of measured surfaces. C is
        not formed: with noisy inputs a filter whitens S sample by sample, without them R is a convolution.
        """
        size = np.sqrt(np.sum(np.where(self.held[:, :, None], self.unknown, 0.0) ** 2 / _levels(output_noise), (0, 1)))
        moving = size > 0.0  # altitude affects nothing where it is not measured
        columns = self.unknown[:, :, moving] / size[moving]
        if self.path is None or not np.any(input_variance > 0.0):
            inverse = self._without_input_noise(columns, output_noise)
        elif isinstance(self.path, InputPath):
            variance, memory = _first_order(output_noise)
            rows = self.path.white(columns, self.held, variance, memory, input_variance)
            inverse = _inverse_root(_triangle(rows, columns.shape[2]))
        else:
            inverse = self._dense(columns, output_noise, np.repeat(np.sqrt(input_variance), self.held.shape[0]))
        bound = np.full(size.size, np.inf)
        bound[moving] = np.sqrt(np.sum(inverse**2, axis=1)) / size[moving]
        return bound[: self.derivatives]

    def _without_input_noise(self, columns: FloatArray, noise: FloatArray) -> FloatArray:
        rows = np.where(self.held[:, :, None], columns, 0.0).transpose(1, 0, 2)
        weighed = StationaryNoise(noise, self.held.T).solve(rows)
        information = np.einsum("ikm,ikn->mn", rows, weighed)
        try:
            root = scipy.linalg.cholesky(0.5 * (information + information.T), lower=False)
        except np.linalg.LinAlgError:
            raise ValueError("the record does not tell the unknowns apart") from None
        return _inverse_root(root)

    def _dense(self, columns: FloatArray, noise: FloatArray, deviation: FloatArray) -> FloatArray:
        present = self.held.T.ravel()
        covariance = _stacked(noise)[np.ix_(present, present)]
        assert isinstance(self.path, np.ndarray)
        disturbed = _by_output(self.path)[present] * deviation
        covariance += disturbed @ disturbed.T
        # Columns are scaled, since channels differ by orders of magnitude.
        scale = 1.0 / np.sqrt(np.diag(covariance))
        covariance *= scale[:, None] * scale
        try:
            root = scipy.linalg.cholesky(covariance, lower=True, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            raise ValueError("the noise's covariance is not positive definite") from None
        white = scipy.linalg.solve_triangular(root, _by_output(columns)[present] * scale[:, None], lower=True)
        return _inverse_root(np.asarray(np.linalg.qr(white, mode="r")))


def _levels(noise: FloatArray) -> FloatArray:
    """Variances (p, 1) of the outputs' noise."""
    level = np.diagonal(noise[:, :, 0])[:, None]
    if not np.all(level > 0.0):
        raise ValueError("an output without noise has no bound")
    return level


def _first_order(noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Variance and correlation (p,) of outputs whose noise is AR(1) or white, independent of each other."""
    variance = np.diagonal(noise[:, :, 0])
    own = np.diagonal(noise).T / variance[:, None]
    memory = own[:, min(1, own.shape[1] - 1)]
    apart = noise.copy()
    apart[np.arange(variance.size), np.arange(variance.size)] = 0.0
    shaped = np.max(np.abs(own - memory[:, None] ** np.arange(own.shape[1]))) < 1e-9
    if not shaped or np.any(apart != 0.0):
        raise ValueError("beside noisy inputs the outputs' noise must be white or AR(1), each output's by itself")
    return variance, memory


def _triangle(rows: Iterable[FloatArray], width: int) -> FloatArray:
    """R of the QR decomposition of many rows, (width, width), with a few thousand rows in memory at a time."""
    triangle = np.zeros((0, width))
    waiting: list[FloatArray] = []
    for block in rows:
        waiting.append(block)
        if len(waiting) == 500:
            triangle = np.asarray(np.linalg.qr(np.vstack([triangle, *waiting]), mode="r"))
            waiting = []
    return np.asarray(np.linalg.qr(np.vstack([triangle, *waiting]), mode="r"))


def _inverse_root(triangle: FloatArray) -> FloatArray:
    """Inverse of an upper triangle: the norms of its rows are the standard errors."""
    return np.asarray(scipy.linalg.solve_triangular(triangle, np.eye(triangle.shape[0])))


def _by_output(columns: FloatArray) -> FloatArray:
    """All samples of the first output, then of the second and so on: (p N, U) of (N, p, U)."""
    return columns.transpose(1, 0, 2).reshape(-1, columns.shape[2])


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
    """The sensitivities of a manoeuvre's outputs to all unknowns of the estimator.

    Parameters
    ----------
    model : AerodynamicModel
        The true model.
    manoeuvre : Manoeuvre
        Its true inputs, and the outputs measured at each sample.
    state : ndarray, shape (n,)
        The true initial state u, w, q, theta, h; unknown to the estimator.
    free : sequence of Entry
        The derivatives to be estimated; the parameters of `effects` are estimated as well.
    noisy : ndarray of bool, shape (E,)
        Which of the extra inputs are recorded with noise.
    effects : sequence of ActiveEffect
        Effects on the controls and sensors.

    Returns
    -------
    None where they cannot be computed: an effect that depends on the motion or is random, or more than `MOST_NUMBERS`
    measured values where an effect other than a bias acts between a noisy input and the log.
    """
    flight = manoeuvre.flight
    samples, places = flight.time.size, [manoeuvre.row(name) for name in manoeuvre.outputs]
    between = bool(noisy.any()) and any(active.effect.kind != "sensor_bias" for active in effects)
    simple = all(isinstance(active.effect, InputEffect | OutputEffect) for active in effects)
    if not simple or (between and samples * len(places) > MOST_NUMBERS):
        return None
    present = np.isfinite(flight.measured[:, places])
    slopes = _slopes(model, manoeuvre, list(_pairs(model, state, free, effects)), effects, places)
    path: InputPath | FloatArray | None = None
    if between:
        path = _slopes(model, manoeuvre, list(_input_pairs(model, manoeuvre, state, noisy, effects)), effects, places)
    elif noisy.any():
        path = input_path(model, manoeuvre, state, manoeuvre.extra_inputs, noisy, places)
    return Sensitivity(slopes, path, present, len(free))


def _slopes(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    pairs: Sequence[_Pair],
    effects: Sequence[ActiveEffect],
    places: list[int],
) -> FloatArray:
    """Central differences of the measured outputs, (N, p, pairs)."""
    sides = [side for pair in pairs for side in pair.sides]
    nominal = _extra(model, acting_flight(model, manoeuvre, effects)[0])
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
                i = manoeuvre.row(active.effect.where)
                given = responses[:, i : i + 1, k]
                responses[:, i, k] = active.effect.output(manoeuvre.flight.time, given, active.values)[:, 0]
    widths = np.array([pair.width for pair in pairs])
    return np.asarray((responses[:, places, 0::2] - responses[:, places, 1::2]) / widths)


@dataclass(frozen=True)
class _Side:
    """One of the two flights of a central difference."""

    values: FloatArray
    state: FloatArray
    recorded: FloatArray | None
    effects: Sequence[ActiveEffect]


@dataclass(frozen=True)
class _Pair:
    """Both flights of a central difference, and the step between them."""

    sides: tuple[_Side, _Side]
    width: float


def _pairs(
    model: AerodynamicModel,
    state: FloatArray,
    free: Sequence[Entry],
    effects: Sequence[ActiveEffect],
) -> Iterator[_Pair]:
    """Derivatives, initial state, parameters of effects."""
    middle = _Side(model.values, state, None, effects)
    for place in model.indices(free):
        step = _VALUE_STEP * max(abs(float(model.values[place])), 0.05)
        move = step * np.eye(model.values.size)[place]
        yield _Pair(
            (replace(middle, values=model.values + move), replace(middle, values=model.values - move)), 2.0 * step
        )
    sizes = state_steps(model.axes)
    for move, step in zip(np.diag(sizes), sizes, strict=True):
        yield _Pair((replace(middle, state=state + move), replace(middle, state=state - move)), 2.0 * step)
    for n, active in enumerate(effects):
        for place, parameter in enumerate(active.effect.parameters):
            beside = [active.perturbed(place, sign * parameter.step) for sign in (1.0, -1.0)]
            upper, lower = (replace(middle, effects=[*effects[:n], other, *effects[n + 1 :]]) for other in beside)
            yield _Pair((upper, lower), beside[0].values[place] - beside[1].values[place])


def _input_pairs(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    state: FloatArray,
    noisy: NDArray[np.bool_],
    effects: Sequence[ActiveEffect],
) -> Iterator[_Pair]:
    """Every sample of every noisy input."""
    flight, first = manoeuvre.flight, len(input_columns_of(manoeuvre.axes))
    middle = _Side(model.values, state, None, effects)
    for j in np.flatnonzero(noisy):
        for k in range(flight.time.size):
            upper, lower = (replace(middle, recorded=flight.inputs.copy()) for _ in range(2))
            for side, sign in ((upper, 1.0), (lower, -1.0)):
                assert side.recorded is not None
                side.recorded[k, first + j] += sign * _INPUT_STEP
            yield _Pair((upper, lower), 2.0 * _INPUT_STEP)


def _acting(model: AerodynamicModel, manoeuvre: Manoeuvre, side: _Side) -> FloatArray:
    """The extra inputs (N, E) that act where these were recorded and these effects act in between."""
    flight = manoeuvre.flight if side.recorded is None else manoeuvre.flight._replace(inputs=side.recorded)
    return _extra(model, acting_flight(model, replace(manoeuvre, flight=flight), side.effects)[0])


def _extra(model: AerodynamicModel, flight: Flight) -> FloatArray:
    """The inputs (N, E) after the leading ones."""
    extra: FloatArray = flight.inputs[:, len(model.columns) - len(model.extra_columns) :]
    return extra
