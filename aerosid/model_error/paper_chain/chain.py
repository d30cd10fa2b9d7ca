"""The chain of the paper on flight logs: prefilter, d(t), correlation, recursive least squares.

Parameswaran & Raol 1994, section 3.3. The derivatives that it gives stand beside the refined ones, and every verdict
on a term shows the d(t) that the term was seen in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import Axes, coupled_of, fed_of, moving_of
from aerosid.flight_model.flight import Flight
from aerosid.model_error.aircraft_error.forward_estimate import AircraftErrorHistory, estimate_aircraft_error
from aerosid.model_error.aircraft_error.measured_states import measured_states
from aerosid.signals import prefilter
from aerosid.signals.least_squares import recursive_least_squares
from aerosid.signals.prefilter import Butterworth, CutOff
from aerosid.signals.residual_covariance import coloured_covariance_groups


@dataclass(frozen=True)
class ChainSettings:
    """Settings of the chain, each with the reason for its value.

    Attributes
    ----------
    filtering : str
        "zero-phase" (default: no lag between channels), "causal" (as in flight) or "off".
    order : int
        Of the Butterworth filter; fourth, run both ways, is the field's habit.
    iterations : int
        Most passes with corrected derivatives: the regressors are formed on the estimated states, which improve.
    tolerance : float
        Share of a standard error below which a further pass changes nothing.
    error_density : tuple of float or None
        Q2^-1 of the equations of the coupled states, set by the user; None: from the log.
    """

    filtering: str = "zero-phase"
    order: int = 4
    iterations: int = 10
    tolerance: float = 0.02
    error_density: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Fed:
    """The channels as they enter the recursion, and the noise variance there (c,) of those in `fed_of` the case."""

    flight: Flight
    variance: NDArray[np.float64]
    cut_off: CutOff | None
    butterworth: Butterworth | None
    axes: Axes


@dataclass(frozen=True)
class Chain:
    """What the chain found with one structure.

    Attributes
    ----------
    model : AerodynamicModel
        With the values of recursive least squares.
    entries : tuple of Entry
        What was estimated.
    std_errors : ndarray, shape (len(entries),)
        Corrected for coloured residuals.
    fed : tuple of Fed
        The channels that entered, one a log.
    error_density : ndarray, shape (c,)
        Q2^-1 that was used.
    """

    model: AerodynamicModel
    entries: tuple[Entry, ...]
    std_errors: NDArray[np.float64]
    fed: tuple[Fed, ...]
    error_density: NDArray[np.float64]


def feed(manoeuvre: Manoeuvre, settings: ChainSettings) -> Fed:
    """The channels of a log as the recursion takes them: filtered alike, inputs included.

    The measurement weight is that of the filtered data: the noise's standard deviation times the filter's gain on it.
    """
    flight, names = manoeuvre.flight, fed_of(manoeuvre.axes)
    places = {name: manoeuvre.row(name) for name in names}
    noise = {name: float(manoeuvre.noise[i]) for name, i in places.items()}
    variance = np.array([value**2 if np.isfinite(value) else 1.0 for value in noise.values()])
    spread = np.array(
        [np.nanstd(flight.measured[:, i]) if np.isfinite(noise[name]) else 1.0 for name, i in places.items()]
    )
    variance = np.maximum(variance, (1e-4 * spread) ** 2 + 1e-20)
    if settings.filtering == "off":
        return Fed(flight, variance, None, None, manoeuvre.axes)
    channels = {name: flight.measured[:, i] for name, i in places.items() if np.isfinite(noise[name])}
    inputs = dict(zip(manoeuvre.extra_columns, manoeuvre.extra_inputs.T, strict=True))
    cut_off = prefilter.choose_cut_off(
        flight.time,
        {**channels, **inputs},
        {**noise, **{name: float(np.sqrt(flight.input_variance[j])) for j, name in enumerate(inputs)}},
        inputs=tuple(inputs),
    )
    if cut_off.cut_off_hz is None:
        return Fed(flight, variance, cut_off, None, manoeuvre.axes)
    butterworth = Butterworth(settings.order, cut_off.cut_off_hz, settings.filtering == "zero-phase")
    measured = flight.measured.copy()
    for name, i in places.items():
        if name in channels:
            measured[:, i] = prefilter.apply(butterworth, flight.time, measured[:, i])
    driving = flight.inputs.copy()
    for j in range(driving.shape[1]):
        if np.ptp(driving[:, j]) > 0.0:
            driving[:, j] = prefilter.apply(butterworth, flight.time, driving[:, j])
    gain = prefilter.noise_gain(butterworth, float(np.median(np.diff(flight.time))))
    filtered = flight._replace(measured=measured, inputs=driving)
    return Fed(filtered, variance * gain**2, cut_off, butterworth, manoeuvre.axes)


def run_chain(
    model: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    entries: Sequence[Entry],
    settings: ChainSettings = ChainSettings(),
    near: NDArray[np.float64] | None = None,
) -> Chain:
    """The derivatives that IEBMEE and recursive least squares give for a structure.

    Parameters
    ----------
    model : AerodynamicModel
        Start values; entries beyond `entries` are kept.
    manoeuvres : sequence of Manoeuvre
        All are regressed jointly.
    entries : sequence of Entry
        What is estimated.
    near : ndarray, shape (c,), optional
        Density of the model error from which the likeliest one is sought: that of a similar structure.

    Raises
    ------
    EstimationError
        Where the recursion leaves the model's range.
    """
    fed = tuple(feed(manoeuvre, settings) for manoeuvre in manoeuvres)
    places = model.indices(entries)
    density = choose_error_density(model, manoeuvres, settings, near)
    for n in range(settings.iterations):
        histories = [estimate_aircraft_error(model, part.flight, part.variance, density) for part in fed]
        regressors, target, weights = _stack(histories, places)
        fit = recursive_least_squares(regressors, target, weights=weights, end_alone=True)
        step = np.nan_to_num(fit.coefficients[: places.size])
        values = model.values.copy()
        values[places] += step
        model = model.with_values(values)
        scale = np.nan_to_num(fit.standard_errors[: places.size])
        if n > 0 and np.all(np.abs(step) <= settings.tolerance * scale + 1e-9 * np.abs(values[places])):
            break
        if n == 0:
            density = choose_error_density(model, manoeuvres, settings, density)
    residual = target - regressors @ np.nan_to_num(fit.coefficients)
    errors = _std_errors(histories, regressors, residual, weights, places.size)
    return Chain(model, tuple(entries), errors, fed, density)


def choose_error_density(
    model: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    settings: ChainSettings,
    near: NDArray[np.float64] | None = None,
    *,
    coarse: bool = False,
) -> NDArray[np.float64]:
    """Q2^-1 of the coupled states' equations, (c,): the user's, or the most likely one on the unfiltered channels.

    One factor is sought, from 1e-10 to 1 by half decades, on densities in proportion to the mean square of the
    measured state rates in each equation: a model error as large as the motion itself, forgotten within a sample, is
    the upper end. Judged on unfiltered data, whose noise is white; candidates pass through the same estimator, so that
    coefficients do not hang on this number: it sets how closely d(t) is resolved in time. `coarse`: to two decades.
    """
    if settings.error_density is not None:
        return np.array(settings.error_density)
    off = replace(settings, filtering="off")
    raw = [feed(manoeuvre, off) for manoeuvre in manoeuvres]
    shape = np.max([_rate_power(part) for part in raw], axis=0)
    factors = 10.0 ** np.arange(-10.0, 0.25, 0.5)
    costs: dict[int, float] = {}

    def cost(place: int) -> float:
        if place not in costs:
            try:
                costs[place] = sum(
                    estimate_aircraft_error(
                        model, part.flight, part.variance, factors[place] * shape, respond=False, likelihood=True
                    ).cost
                    for part in raw
                )
            except EstimationError:
                costs[place] = np.inf  # too little room for error to follow the flight
        return costs[place]

    # The likelihood has one maximum over the factor: bracket it coarsely, or begin at `near`, then walk to it.
    if near is None:
        best = min(range(0, factors.size, 4), key=cost)
        if not coarse:
            best = min(range(max(best - 3, 0), min(best + 4, factors.size)), key=cost)
    else:
        best = int(np.argmin(np.abs(np.log(factors * shape[0] / near[0]))))
        while (better := min(range(max(best - 1, 0), min(best + 2, factors.size)), key=cost)) != best:
            best = better
    return np.asarray(factors[best] * shape)


def _rate_power(part: Fed) -> NDArray[np.float64]:
    """Mean square of the measured state rates times the sampling interval, (c,); none for attitude."""
    measured = measured_states(part.flight, part.variance, part.axes).states
    interval = float(np.median(np.diff(part.flight.time)))
    power = np.zeros(len(coupled_of(part.axes)))
    for i in range(len(moving_of(part.axes))):
        present = np.isfinite(measured[:, i])
        if not present.any():
            raise EstimationError(f"{part.axes.integrated[i]} was not measured: the model error d(t) has no start.")
        # Over a quarter of a second the noise no longer dominates the difference.
        stride = max(1, round(0.25 / interval))
        values, time = measured[present, i], part.flight.time[present]
        rate = (values[stride:] - values[:-stride]) / (time[stride:] - time[:-stride])
        power[i] = max(float(np.mean(rate**2)), 1e-12) * 0.25
    return power


def _stack(
    histories: Sequence[AircraftErrorHistory], places: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Regressors, target and weights of all equations of all logs, in the order of time within each log.

    d is the gain times an innovation, (23): rows of the first samples, where S and with it the noise of d are many
    times what they become, are divided by that ratio. (The paper leaves its first points out of the least squares.)
    """
    rows, targets, weights = [], [], []
    moving, states = histories[0].rate_per_unit.shape[1], histories[0].d.shape[1]
    steady = [_steadiness(history, moving) for history in histories]
    sized = [part * history.d[:, :moving] for part, history in zip(steady, histories, strict=True)]
    scale = np.sqrt(np.nanmean(np.concatenate(sized) ** 2, axis=0)) + 1e-12
    for n, (history, part, target) in enumerate(zip(histories, steady, sized, strict=True)):
        samples = history.d.shape[0]
        block = np.zeros((samples, moving, places.size + states * len(histories)))
        block[:, :, : places.size] = history.responded[:, :moving, places]
        first = places.size + states * n
        block[:, :, first : first + states] = history.initial[:, :moving, :]
        rows.append((part[:, :, None] * block).reshape(samples * moving, -1))
        targets.append(target.reshape(-1))
        weights.append(np.broadcast_to(scale**-2, (samples, moving)).reshape(-1))
    return np.concatenate(rows), np.concatenate(targets), np.concatenate(weights)


def _steadiness(history: AircraftErrorHistory, moving: int) -> NDArray[np.float64]:
    """The usual gain over that of each sample, (N, moving), at most one; gains are in proportion to S."""
    sizes = np.diagonal(history.riccati, axis1=1, axis2=2)[:, :moving]
    usual = np.median(sizes, axis=0)
    return np.asarray(np.minimum(1.0, usual / np.maximum(sizes, np.finfo(float).tiny)))


def _std_errors(
    histories: Sequence[AircraftErrorHistory],
    regressors: NDArray[np.float64],
    residual: NDArray[np.float64],
    weights: NDArray[np.float64],
    count: int,
) -> NDArray[np.float64]:
    groups = []
    start = 0
    for history in histories:
        moving = history.rate_per_unit.shape[1]
        stop = start + moving * history.d.shape[0]
        for i in range(moving):
            part = slice(start + i, stop, moving)
            groups.append((regressors[part], residual[part], float(weights[start + i])))
        start = stop
    try:
        covariance = coloured_covariance_groups(groups).corrected
    except ValueError:
        return np.full(count, np.inf)
    return np.sqrt(np.diag(covariance))[:count]
