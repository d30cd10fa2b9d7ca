"""Estimate derivatives, initial states and noise levels by maximum likelihood, from all manoeuvres jointly.

With noise-free inputs this is the output-error method; the noise of a measured surface makes it filter error with a
known path of the process noise. Both are one recursion: `aerosid.prediction`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.aerodynamics import AerodynamicModel, Entry
from aerosid.errors import EstimationError
from aerosid.longitudinal import OUTPUT_COUNT
from aerosid.manoeuvre import Manoeuvre, initial_state
from aerosid.prediction import Flight, no_directions, predict_stretch, start_carry

STRETCH = 20_000
"""Samples whose sensitivities are held at once: bounds the memory, linear in the record's length."""


@dataclass(frozen=True)
class RefinementSettings:
    """Settings of the search, each with the reason for its value.

    Attributes
    ----------
    steps : int
        Levenberg-Marquardt steps at given noise levels; five to ten are usual, more means a wrong model.
    rounds : int
        Rounds of noise levels; the fixed point is reached in three where the model is right.
    step_tolerance : float
        A step below this share of the standard deviation of every parameter changes no printed digit.
    variance_tolerance : float
        Relative change of a noise variance that counts as none.
    """

    steps: int = 30
    rounds: int = 12
    step_tolerance: float = 1e-3
    variance_tolerance: float = 1e-3


@dataclass(frozen=True)
class Whitened:
    """Residuals and sensitivities of one stretch of one manoeuvre, in units of their standard deviation.

    `log` its index; `residual` (n, 8), NaN where nothing was measured; `columns` (n, 8, M) with respect to all
    parameters of the estimate; `predicted` (n, 8) in SI; `log_sum` the sum of the logarithms of the innovations'
    variances.
    """

    log: int
    residual: NDArray[np.float64]
    columns: NDArray[np.float64]
    predicted: NDArray[np.float64]
    log_sum: float


@dataclass(frozen=True)
class Refinement:
    """The maximum-likelihood estimate.

    Attributes
    ----------
    model : AerodynamicModel
        The model with the estimated values.
    free : tuple of Entry
        The entries that were estimated, in the order of the first parameters.
    states : tuple of ndarray, shape (5,)
        The initial state of each manoeuvre.
    variance : ndarray, shape (8,)
        Noise variance of each output, SI squared; of unmeasured outputs 1.
    cost : float
        -2 ln L but for a constant.
    information : ndarray, shape (M, M)
        Fisher information of the parameters: free entries, then the initial states of each manoeuvre.
    converged : bool
        Whether the last step was within the tolerance.
    """

    model: AerodynamicModel
    free: tuple[Entry, ...]
    states: tuple[NDArray[np.float64], ...]
    variance: NDArray[np.float64]
    cost: float
    information: NDArray[np.float64]
    converged: bool

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Cramer-Rao bound for white residuals, of all parameters (M, M)."""
        return _scaled_inverse(self.information)


def refine(
    model: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    free: Sequence[Entry],
    *,
    states: Sequence[NDArray[np.float64]] | None = None,
    variance: NDArray[np.float64] | None = None,
    hold_variance: bool = False,
    filtering: bool = True,
    priors: Sequence[tuple[Entry, float, float]] = (),
    settings: RefinementSettings = RefinementSettings(),
) -> Refinement:
    """The maximum-likelihood estimate of the free entries and of every manoeuvre's initial state.

    Parameters
    ----------
    model : AerodynamicModel
        Start values; entries that are not free keep theirs.
    manoeuvres : sequence of Manoeuvre
        All of them are one joint estimate.
    free : sequence of Entry
        What is estimated; may be empty (initial states alone).
    states : sequence of ndarray, shape (5,), optional
        Start values of the initial states; by default from the first samples.
    variance : ndarray, shape (8,), optional
        Noise variances to start from; by default those of the logs.
    hold_variance : bool
        Keep `variance` instead of estimating it.
    filtering : bool
        Whether the noise of measured inputs is accounted for; otherwise plain output error.
    priors : sequence of (entry, value, standard deviation)
        A-priori knowledge that is to enter as such.

    Raises
    ------
    EstimationError
        Where the simulation with the start values leaves the model's range, so that there is nothing to improve.

    Notes
    -----
    Levenberg-Marquardt on the whitened residuals at given noise variances, alternating with variances at their
    likelihood's maximum. Maine & Iliff, NASA RP-1168, 1986; Jategaonkar, Flight Vehicle System Identification,
    chapters 4 and 5.
    """
    problem = _Problem(model, tuple(manoeuvres), tuple(free), filtering, tuple(priors))
    variance = problem.starting_variance() if variance is None else np.array(variance)
    if states is None:
        states = [initial_state(manoeuvre.flight) for manoeuvre in manoeuvres]
    point = problem.evaluate(model.values, states, variance)
    if point is None:
        point = _led_in(problem, model.values, states, variance, settings)
    converged = False
    for _ in range(settings.rounds):
        point, converged = _levenberg_marquardt(problem, point, settings)
        if hold_variance:
            break
        updated = np.maximum(point.variance * point.mean_square, problem.variance_floor)
        if np.allclose(updated, point.variance, rtol=settings.variance_tolerance, atol=0.0):
            break
        again = problem.evaluate(point.values, point.states, updated)
        if again is None:
            break
        point = again
    return Refinement(
        model=model.with_values(point.values),
        free=tuple(free),
        states=tuple(point.states),
        variance=point.variance,
        cost=point.cost,
        information=point.normal,
        converged=converged,
    )


def whiten(
    refinement: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    *,
    model: AerodynamicModel | None = None,
    columns: Sequence[Entry] | None = None,
    filtering: bool = True,
) -> Iterator[Whitened]:
    """The whitened residuals of an estimate and their sensitivities, stretch by stretch.

    Parameters
    ----------
    refinement : Refinement
        The estimate at which they are wanted.
    manoeuvres : sequence of Manoeuvre
        Those of the estimate.
    model : AerodynamicModel, optional
        The estimate's model, possibly extended by candidates of value zero.
    columns : sequence of Entry, optional
        The entries whose sensitivities come first; by default the free ones. The initial states follow.
    """
    model = refinement.model if model is None else model
    free = refinement.free if columns is None else columns
    problem = _Problem(model, tuple(manoeuvres), tuple(free), filtering, ())
    return problem.stretches(model.values, refinement.states, refinement.variance)


@dataclass(frozen=True)
class _Point:
    """A set of parameters with everything that the search asks about it."""

    values: NDArray[np.float64]
    states: tuple[NDArray[np.float64], ...]
    variance: NDArray[np.float64]
    cost: float
    normal: NDArray[np.float64]
    gradient: NDArray[np.float64]
    mean_square: NDArray[np.float64]


class _Problem:
    """The likelihood of a fixed structure on fixed manoeuvres, and its derivatives."""

    def __init__(
        self,
        model: AerodynamicModel,
        manoeuvres: tuple[Manoeuvre, ...],
        free: tuple[Entry, ...],
        filtering: bool,
        priors: tuple[tuple[Entry, float, float], ...],
    ) -> None:
        self.model = model
        self.free = model.indices(free)
        self.noise = np.array([manoeuvre.noise for manoeuvre in manoeuvres])
        self.flights = [m.flight if filtering else _without_input_noise(m.flight) for m in manoeuvres]
        self.parameters = len(free) + 5 * len(manoeuvres)
        # Altitude acts on nothing: where it is not measured its initial value has no information.
        self.active = np.ones(self.parameters, dtype=bool)
        for n, manoeuvre in enumerate(manoeuvres):
            self.active[len(free) + 5 * n + 4] = "h" in manoeuvre.outputs
        spread = np.array([[_spread_of(column) for column in flight.measured.T] for flight in self.flights])
        # Numbers of seven digits carry noise of this size even where the simulation that made them had none.
        self.variance_floor = (1e-6 * spread.max(axis=0)) ** 2 + 1e-24
        self.priors = [(int(model.index(entry)), value, sigma) for entry, value, sigma in priors]

    def starting_variance(self) -> NDArray[np.float64]:
        """Noise variances of the logs, their mean over the manoeuvres; 1 for outputs that nobody measured."""
        mean = np.array(
            [np.mean(column[np.isfinite(column)] ** 2) if np.isfinite(column).any() else 1.0 for column in self.noise.T]
        )
        return np.asarray(np.maximum(mean, self.variance_floor))

    def stretches(
        self,
        values: NDArray[np.float64],
        states: Sequence[NDArray[np.float64]],
        variance: NDArray[np.float64],
        input_noise_factor: float = 1.0,
    ) -> Iterator[Whitened]:
        """Residuals and sensitivities stretch by stretch; ends early where a prediction leaves the model's range."""
        free_count = self.free.size
        for log, flight in enumerate(self.flights):
            if input_noise_factor != 1.0:
                flight = flight._replace(input_variance=flight.input_variance * input_noise_factor)
            samples = flight.time.size
            directions = no_directions(samples, flight.input_variance.size)
            carry = start_carry(states[log], flight, free_count, directions)
            for start in range(0, samples, STRETCH):
                stop = min(start + STRETCH, samples)
                predicted = np.empty((stop - start, OUTPUT_COUNT))
                white = np.empty((stop - start, OUTPUT_COUNT))
                columns = np.zeros((stop - start, OUTPUT_COUNT, free_count + 5))
                inside, log_sum = predict_stretch(
                    start,
                    stop,
                    carry,
                    flight,
                    values,
                    self.free,
                    self.model.table,
                    self.model.constants,
                    variance,
                    directions,
                    predicted,
                    white,
                    columns,
                )
                if not inside:
                    raise _OutOfRange
                yield Whitened(log, white, self._spread(columns, log), predicted, float(log_sum))

    def _spread(self, columns: NDArray[np.float64], log: int) -> NDArray[np.float64]:
        """The columns of one manoeuvre in the places of the joint parameter vector."""
        if len(self.flights) == 1:
            return columns
        free_count = self.free.size
        wide = np.zeros((*columns.shape[:2], self.parameters))
        wide[:, :, :free_count] = columns[:, :, :free_count]
        place = free_count + 5 * log
        wide[:, :, place : place + 5] = columns[:, :, free_count:]
        return wide

    def evaluate(
        self,
        values: NDArray[np.float64],
        states: Sequence[NDArray[np.float64]],
        variance: NDArray[np.float64],
        input_noise_factor: float = 1.0,
    ) -> _Point | None:
        """Likelihood, gradient and information; None where the prediction leaves the model's range."""
        normal = np.zeros((self.parameters, self.parameters))
        gradient = np.zeros(self.parameters)
        squares, counts = np.zeros(OUTPUT_COUNT), np.zeros(OUTPUT_COUNT)
        cost = 0.0
        try:
            for part in self.stretches(values, states, variance, input_noise_factor):
                held = np.isfinite(part.residual)
                residual = np.where(held, part.residual, 0.0)
                flat = part.columns.reshape(-1, self.parameters)
                normal += flat.T @ flat
                gradient += flat.T @ residual.ravel()
                squares += np.sum(residual**2, axis=0)
                counts += held.sum(axis=0)
                cost += part.log_sum
        except _OutOfRange:
            return None
        cost += float(squares.sum())
        for place, value, sigma in self.priors:
            at = int(np.flatnonzero(self.free == place)[0])
            cost += ((values[place] - value) / sigma) ** 2
            normal[at, at] += 1.0 / sigma**2
            gradient[at] += (value - values[place]) / sigma**2
        if not np.isfinite(cost):
            return None
        mean_square = np.where(counts > 0, squares / np.maximum(counts, 1), 1.0)
        return _Point(
            np.array(values), tuple(np.array(s) for s in states), variance, cost, normal, gradient, mean_square
        )

    def moved(self, point: _Point, step: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
        """Term values and initial states after a step in the parameters."""
        values = point.values.copy()
        values[self.free] += step[: self.free.size]
        states = [
            state + step[self.free.size + 5 * n : self.free.size + 5 * n + 5] for n, state in enumerate(point.states)
        ]
        return values, states


class _OutOfRange(Exception):
    """A prediction left the angle-of-attack limit; the search shortens its step."""


def _levenberg_marquardt(
    problem: _Problem, point: _Point, settings: RefinementSettings, input_noise_factor: float = 1.0
) -> tuple[_Point, bool]:
    """The best point at given noise variances, and whether the search came to rest."""
    damping = 1e-3
    active = problem.active
    for _ in range(settings.steps):
        scale = np.sqrt(np.diag(point.normal))[active]
        scale[scale == 0.0] = 1.0
        matrix = point.normal[np.ix_(active, active)] / np.outer(scale, scale)
        slope = point.gradient[active] / scale
        while True:
            scaled = np.linalg.solve(matrix + damping * np.eye(scale.size), slope)
            step = np.zeros(active.size)
            step[active] = scaled / scale
            trial = problem.evaluate(*problem.moved(point, step), point.variance, input_noise_factor)
            if trial is not None and trial.cost <= point.cost + 1e-9 * abs(point.cost):
                break
            damping *= 10.0
            if damping > 1e10:
                return point, True
        damping = max(damping * 0.1, 1e-12)
        point = trial
        # Scaled by the information alone: at most a standard deviation per unit, less where parameters correlate.
        if np.max(np.abs(scaled)) < settings.step_tolerance:
            return point, True
    return point, False


def _led_in(
    problem: _Problem,
    values: NDArray[np.float64],
    states: Sequence[NDArray[np.float64]],
    variance: NDArray[np.float64],
    settings: RefinementSettings,
) -> _Point:
    """A start where the plain prediction runs away: follow the data closely at first, then ever less.

    The inputs' noise is taken much larger than it is, which gives the recursion a gain that holds it to the
    measurements even for an unstable aircraft; the factor then falls to one while the parameters follow.
    """
    for factor in (1e8, 1e6, 1e4, 1e3, 1e2, 1e1, 1.0):
        point = problem.evaluate(values, states, variance, factor)
        if point is not None and factor > 1.0:
            point, _ = _levenberg_marquardt(problem, point, settings, factor)
            values, states = point.values, point.states
    if point is None:
        raise EstimationError(
            "the simulation leaves |alpha| < 1.5 rad with every start value that was tried; check the signs of "
            "delta_e, C_m_alpha and C_m_delta_e, the mass and the trim constants in the aircraft file."
        )
    return point


def _spread_of(values: NDArray[np.float64]) -> float:
    held = values[np.isfinite(values)]
    return float(held.std()) if held.size else 1.0


def _without_input_noise(flight: Flight) -> Flight:
    return flight._replace(input_variance=np.zeros_like(flight.input_variance))


def _scaled_inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric semi-definite matrix after scaling to unit diagonal; rows without information give inf.

    Directions that hold no information to rounding are left to the pseudo-inverse's cut-off at 1e-13.
    """
    scale = np.sqrt(np.diag(matrix))
    held = scale > 0.0
    inverse = np.zeros_like(matrix)
    scaled = matrix[np.ix_(held, held)] / np.outer(scale[held], scale[held])
    part = np.linalg.pinv(scaled, rcond=1e-13, hermitian=True) / np.outer(scale[held], scale[held])
    inverse[np.ix_(held, held)] = part
    inverse[~held, ~held] = np.inf
    return inverse
