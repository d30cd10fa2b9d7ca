"""d(t) of the coefficients by fixed-interval smoothing, with its standard deviation.

The fixed-interval solution: every sample of the record speaks for every moment, so that d(t) does not lag. All outputs
take part for what they are: accelerometers and q_dot see the forces of d(t) directly, the others through the motion.
What the smoother does to the flight it does to the response of a candidate term, so that the two can be compared.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.disturbance import unmodelled_forces
from aerosid.effects.kinds import NoiseEffect, OutputEffect, PositionEffect
from aerosid.effects.names import listed_name
from aerosid.effects.step_change import offset_column
from aerosid.estimation.effect_columns import with_offsets
from aerosid.estimation.effects_in_flight import OutOfRangeError
from aerosid.estimation.likelihood import Likelihood, Traced
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.flight_model.aerodynamics import Entry
from aerosid.signals.correlation import correlation
from aerosid.signals.factor_search import search_by_slopes
from aerosid.signals.input_noise import InputNoise, initial_covariance
from aerosid.signals.noise_slopes import noise_slopes
from aerosid.signals.smoothing import smooth_inputs
from aerosid.signals.trace import among_inputs


@dataclass(frozen=True)
class ErrorHistory:
    """The model error d(t) of one equation on one identification log, and what was identified over it.

    `coefficient` names the equation (C_X, C_Z, C_m); `d` (N,) is d(t) in units of that coefficient from the structure
    without the found terms and effects; `explained` (N,) their share through the same estimator; `correlation` of both;
    `deviation` (N,) the standard deviation of d, None where d is the filter's, as for an aircraft that runs away.
    `effects` are the found effects of other kinds that it is without, `kept` those that it holds.
    """

    log: str
    coefficient: str
    time: NDArray[np.float64]
    d: NDArray[np.float64]
    explained: NDArray[np.float64]
    correlation: float
    terms: tuple[str, ...]
    deviation: NDArray[np.float64] | None = None
    effects: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()

    @property
    def left_its_range(self) -> bool:
        """Whether d(t) somewhere is larger than any coefficient can be off: what follows it there says nothing."""
        present = self.d[np.isfinite(self.d)]
        return bool(present.size and np.max(np.abs(present)) > LARGEST)


LARGEST = 1.0
"""Physical: of a force or moment coefficient, 1; no declared model is off by as much in flight."""

LONGEST = 100_000
"""Numerical: samples of a record whose d(t) is drawn; the smoother holds some 2 kB for each."""


@dataclass(frozen=True)
class ForceHistory:
    """The model error of one log, smoothed over the whole record; E coefficients, K terms.

    Attributes
    ----------
    d : ndarray, shape (N, E)
        What the model lacks, in units of the coefficient.
    deviation : ndarray, shape (N, E)
        Its standard deviation, given the spread and the memory that the flights make most likely.
    responded : ndarray, shape (N, E, K)
        The d that each lacking term of unit value would have produced through the same smoother.
    without : ndarray, shape (N, E)
        The d that the lacking effects of other kinds produce through it; part of `d`.
    """

    d: NDArray[np.float64]
    deviation: NDArray[np.float64]
    responded: NDArray[np.float64]
    without: NDArray[np.float64]


def smooth_forces(
    refinement: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    coefficients: Sequence[str],
    lacking: Sequence[Entry],
    numbers: Sequence[float] | None = None,
    without: Sequence[ActiveEffect] = (),
) -> tuple[ForceHistory, ...]:
    """The d(t) of a model without some of its terms and effects, one history a log.

    Parameters
    ----------
    refinement : Refinement
        The completed estimate, in open loop; its motion is where everything is linear about.
    manoeuvres : sequence of Manoeuvre
        Those of the estimate.
    coefficients : sequence of str
        Where model error is allowed.
    lacking : sequence of Entry
        Free terms of the estimate that the model is to be without.
    numbers : sequence of float, optional
        Spread of each coefficient's error, then the memory of each, s; by default the flights' likeliest.
    without : sequence of ActiveEffect
        Effects of the estimate that the model is to be without: what they change in the simulated outputs is left to d.

    Raises
    ------
    OutOfRangeError
        Where the simulation, with or without these effects, leaves the model's range, or that without them the motion
        about which everything is linear.

    Notes
    -----
    Parameswaran & Raol 1994, eqs. (6)-(8), with a model error that has a memory: each coefficient's error wanders with
    a spread and a correlation time at the maximum of the flights' likelihood, so that doubling the sampling rate
    changes neither d nor its deviation.
    """
    model = with_offsets(refinement.model, coefficients)
    likelihood = Likelihood(model, tuple(manoeuvres), refinement.free)
    effects = [frozen(active) for active in refinement.effects]
    values = np.array(model.values)
    places = [1 + refinement.free.index(entry) for entry in lacking]
    sizes = np.array([refinement.model.value(entry) for entry in lacking])
    offsets = [model.extra_place(offset_column(name)) for name in coefficients]
    flights = [
        next(iter(likelihood.traced(n, values, state, effects, whole=True)))
        for n, state in enumerate(refinement.states)
    ]
    remaining = [frozen(active) for active in refinement.effects if active not in without]
    asked = []
    for n, (part, state) in enumerate(zip(flights, refinement.states, strict=True)):
        residual, terms = part.block[:, :, :1], part.block[:, :, places]
        lost = np.zeros_like(residual)
        if without:
            bare = next(iter(likelihood.traced(n, values, state, remaining, whole=True)))
            if not (_on_instruments(without) or _is_near(part.trace.outputs, bare.trace.outputs, manoeuvres[n])):
                raise OutOfRangeError
            lost = bare.block[:, :, :1] - residual
        asked.append(np.concatenate([residual + lost + (terms @ sizes)[:, :, None], terms, lost], axis=2))
    intervals = [manoeuvre.interval for manoeuvre in manoeuvres]
    if numbers is None:
        numbers = _likeliest(flights, asked, intervals, offsets, tuple(coefficients), refinement.variance)
    covariance = np.nan_to_num(refinement.covariance, posinf=0.0)
    histories = []
    for n, (part, columns, interval) in enumerate(zip(flights, asked, intervals, strict=True)):
        states = refinement.states[n].size
        first = len(refinement.free) + states * n
        samples, extra = columns.shape[0], part.noise.variance.size
        errors, variances = np.zeros((samples, extra, columns.shape[2])), np.zeros((samples, extra))
        noise = _with_forces(part.noise, offsets, tuple(coefficients), numbers, interval)
        of_state = covariance[first : first + states, first : first + states]
        smooth_inputs(
            part.held,
            np.ascontiguousarray(columns),
            part.trace,
            refinement.variance,
            noise,
            part.sensors,
            initial_covariance(of_state, noise, part.trace, part.sensors),
            errors,
            variances,
        )
        d, terms, lost = errors[:, offsets, 0], errors[:, offsets, 1:-1], errors[:, offsets, -1]
        histories.append(ForceHistory(d, np.sqrt(variances[:, offsets]), terms, lost))
    return tuple(histories)


_NEAR = {"alpha": 0.1, "beta": 0.1, "theta": 0.5, "phi": 0.5}
"""Physical: rad by which a motion may be off another one and its equations be linear about that."""

_NEAR_SPEED = 0.2
"""Physical: fraction by which its airspeed may be."""


def _is_near(motion: NDArray[np.float64], other: NDArray[np.float64], manoeuvre: Manoeuvre) -> bool:
    """Whether one motion, by its outputs (N, m), is near enough to another for equations that are linear about that."""
    limits = {"V": _NEAR_SPEED * manoeuvre.mean_airspeed, **_NEAR}
    rows = [(manoeuvre.row(name), limit) for name, limit in limits.items() if name in manoeuvre.axes.outputs]
    return all(float(np.max(np.abs(motion[:, row] - other[:, row]))) < limit for row, limit in rows)


def _on_instruments(effects: Sequence[ActiveEffect]) -> bool:
    """Whether all of these change what is recorded of a motion, and not the motion."""
    return all(isinstance(active.effect, OutputEffect | PositionEffect) for active in effects)


def _with_forces(
    noise: InputNoise, offsets: Sequence[int], coefficients: tuple[str, ...], numbers: Sequence[float], interval: float
) -> InputNoise:
    """The inputs' noise with that of the coefficients."""
    variance, memory = noise.variance.copy(), noise.memory.copy()
    variance[offsets], memory[offsets] = unmodelled_forces(coefficients).noise(tuple(numbers), interval, 0.0)
    return InputNoise(variance, memory)


def _likeliest(
    flights: Sequence[Traced],
    asked: Sequence[NDArray[np.float64]],
    intervals: Sequence[float],
    offsets: Sequence[int],
    coefficients: tuple[str, ...],
    output_variance: NDArray[np.float64],
) -> tuple[float, ...]:
    """Spread and memory of each coefficient's error at the maximum of the likelihood."""
    parameters = unmodelled_forces(coefficients).parameters
    start = tuple(parameter.trials[0] for parameter in parameters)
    # The other inputs' errors change nothing, and take as much time as these.
    noisy = [np.union1d(np.flatnonzero(part.noise.variance > 0.0), offsets) for part in flights]
    traces = [among_inputs(part.trace, places) for part, places in zip(flights, noisy, strict=True)]

    def cost(numbers: tuple[float, ...]) -> tuple[float, NDArray[np.float64]]:
        total, by_numbers = 0.0, np.zeros(len(numbers))
        spreads, memories = np.split(np.array(numbers), 2)
        for part, trace, places, columns, interval in zip(flights, traces, noisy, asked, intervals, strict=True):
            whole = _with_forces(part.noise, offsets, coefficients, numbers, interval)
            noise = InputNoise(whole.variance[places], whole.memory[places])
            found = noise_slopes(part.held, columns[:, :, 0], trace, output_variance, noise, part.sensors)
            total += found.cost
            own = np.searchsorted(places, offsets)
            by_numbers[: len(offsets)] += 2.0 * spreads * found.by_variance[own]
            by_numbers[len(offsets) :] += found.by_memory[own] * noise.memory[own] * interval / memories**2
        return total, by_numbers

    limits = [(parameter.lowest, parameter.highest) for parameter in parameters]
    return search_by_slopes(cost, start, limits, least_fall=0.1, settled=0.01)


def smoothed_histories(
    refinement: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    coefficients: Sequence[str],
    chosen: Sequence[Entry],
    identified: Sequence[ActiveEffect] = (),
) -> tuple[tuple[ErrorHistory, ...], dict[Entry, float]]:
    """The d(t) of the model without what was identified, with that over it, and |rho| for each chosen term.

    Parameters
    ----------
    refinement : Refinement
        The completed estimate.
    coefficients : sequence of str
        The aircraft's three.
    chosen : sequence of Entry
        The terms that the declared model lacks.
    identified : sequence of ActiveEffect
        The effects of other kinds that it lacks. Those of the air, statistics without a time history, are kept in the
        model, and so is what acts on the motion where that is far off without it.

    Returns
    -------
    One history per log and coefficient, none where the record is too long or the aircraft runs away in open loop; and
    for each chosen term the correlation of what all others leave of d with its own picture in d.
    """
    if refinement.held_to_data > 0.0 or max(manoeuvre.flight.time.size for manoeuvre in manoeuvres) > LONGEST:
        return (), {}
    sizes = np.array([refinement.model.value(entry) for entry in chosen])
    possible = [active for active in identified if not isinstance(active.effect, NoiseEffect)]
    for without in (possible, [active for active in possible if _on_instruments([active])], []):
        try:
            smoothed = smooth_forces(refinement, manoeuvres, coefficients, chosen, without=without)
        except OutOfRangeError:
            continue
        break
    else:
        return (), {}
    rows = []
    for manoeuvre, history in zip(manoeuvres, smoothed, strict=True):
        for e, name in enumerate(coefficients):
            own = [entry for entry in chosen if entry[0] == name]
            explained = history.responded[:, e, :] @ sizes + history.without[:, e]
            acting = [active for active in identified if active.acts_on(manoeuvre.name)]
            rows.append(
                ErrorHistory(
                    log=manoeuvre.log.name,
                    coefficient=name,
                    time=manoeuvre.log.time,
                    d=history.d[:, e],
                    deviation=history.deviation[:, e],
                    explained=explained,
                    correlation=correlation(history.d[:, e], explained) if own or without else 0.0,
                    terms=tuple(str(entry[1]) for entry in own),
                    effects=_names(active for active in acting if active in without),
                    kept=_names(active for active in acting if active not in without),
                )
            )
    correlations = {}
    for k, entry in enumerate(chosen):
        e = list(coefficients).index(entry[0])
        d = np.concatenate([history.d[:, e] - history.without[:, e] for history in smoothed])
        pictures = np.concatenate([history.responded[:, e, :] for history in smoothed]) * sizes
        correlations[entry] = abs(correlation(d - pictures.sum(axis=1) + pictures[:, k], pictures[:, k]))
    return tuple(rows), correlations


def _names(effects: Iterable[ActiveEffect]) -> tuple[str, ...]:
    """The effects in the names of the files, each once: `control lag of delta_r`."""
    return tuple(dict.fromkeys(listed_name(*active.name) for active in effects))
