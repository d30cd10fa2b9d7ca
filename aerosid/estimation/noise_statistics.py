"""Maximum-likelihood noise statistics: disturbances and output noise together.

Without a disturbance the outputs' variances follow from their residuals. With one they do not: process noise and
output noise share the residuals, so that both are estimated jointly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, NoiseEffect, frozen
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.fit_settings import NOISE_SEARCH
from aerosid.estimation.likelihood import Likelihood, Traced
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.signals.factor_search import search_by_slopes
from aerosid.signals.input_noise import InputNoise
from aerosid.signals.noise_slopes import noise_slopes
from aerosid.signals.trace import among_inputs


def estimate_noise_statistics(likelihood: Likelihood, point: Point, *, hold_variance: bool = False) -> Point:
    """The point with the noise at the likelihood's maximum, the simulated motion fixed; itself where none is better.

    Parameters
    ----------
    likelihood : Likelihood
        In open loop.
    point : Point
        With at least one disturbance among its effects.
    hold_variance : bool
        Whether the outputs' variances keep their values.

    Notes
    -----
    The motion does not depend on the noise: it is simulated once, and each trial filters one residual. Quasi-Newton
    steps in the logarithms of the parameters. The slopes by the noise are exact, those of the noise by the parameters,
    which cost no filter, differences.
    """
    places = [n for n, active in enumerate(point.effects) if isinstance(active.effect, NoiseEffect)]
    numbers = [value for n in places for value in point.effects[n].values]
    limits = [(p.lowest, p.highest) for n in places for p in point.effects[n].effect.parameters]
    moving = np.flatnonzero(point.counts > 0.0) if not hold_variance else np.zeros(0, dtype=np.int64)
    if not places or numbers == [] == moving.tolist() or likelihood.held_to_data > 0.0:
        return point
    noisy = _noisy(likelihood, point)
    flights = _simulated(likelihood, point, noisy)

    def unpacked(trial: tuple[float, ...]) -> tuple[list[ActiveEffect], NDArray[np.float64]]:
        values, effects = iter(trial), list(point.effects)
        for n in places:
            effects[n] = replace(effects[n], values=tuple(next(values) for _ in effects[n].values))
        variance = point.variance.copy()
        variance[moving] = list(values)
        return effects, variance

    def cost(trial: tuple[float, ...]) -> tuple[float, NDArray[np.float64]]:
        effects, variance = unpacked(trial)
        total, slopes = 0.0, np.zeros(len(trial))
        for manoeuvre, part in zip(likelihood.manoeuvres, flights, strict=True):
            noise = _noise(likelihood, manoeuvre, effects, noisy)
            found = noise_slopes(part.held, part.block[:, :, 0], part.trace, variance, noise, part.sensors)
            total += found.cost
            slopes[len(numbers) :] += found.by_output[moving]
            for i in range(len(numbers)):
                step = NOISE_SEARCH.difference * trial[i]
                moved = _noise(
                    likelihood, manoeuvre, unpacked((*trial[:i], trial[i] + step, *trial[i + 1 :]))[0], noisy
                )
                slopes[i] += found.by_variance @ (moved.variance - noise.variance) / step
                slopes[i] += found.by_memory @ (moved.memory - noise.memory) / step
        return total, slopes

    now = point.variance[moving]
    lowest = np.minimum(np.maximum(now / NOISE_SEARCH.widest, likelihood.variance_floor[moving]), now)
    limits += list(zip(lowest.tolist(), (now * NOISE_SEARCH.widest).tolist(), strict=True))
    start = (*numbers, *now.tolist())
    found = search_by_slopes(cost, start, limits, NOISE_SEARCH.least_fall, NOISE_SEARCH.turns)
    if found is start:
        return point
    effects, variance = unpacked(found)
    return likelihood.evaluate(point.values, point.states, effects, variance) or point


def _noisy(likelihood: Likelihood, point: Point) -> NDArray[np.int64]:
    """The extra inputs with noise in some manoeuvre; the others have no effect."""
    variances = [
        acting_flight(likelihood.model, each, point.effects)[0].input_variance for each in likelihood.manoeuvres
    ]
    return np.flatnonzero(np.any(np.array(variances) > 0.0, axis=0))


def _noise(
    likelihood: Likelihood, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect], noisy: NDArray[np.int64]
) -> InputNoise:
    noise = likelihood.input_noise(*acting_flight(likelihood.model, manoeuvre, effects))
    return InputNoise(noise.variance[noisy], noise.memory[noisy])


def _simulated(likelihood: Likelihood, point: Point, noisy: NDArray[np.int64]) -> list[Traced]:
    """Every manoeuvre's motion, without columns, and its sensitivities to the noisy inputs."""
    plain = Likelihood(likelihood.model, likelihood.manoeuvres, (), likelihood.filtering)
    effects = [active if isinstance(active.effect, NoiseEffect) else frozen(active) for active in point.effects]
    whole = [next(plain.traced(n, point.values, state, effects, whole=True)) for n, state in enumerate(point.states)]
    return [replace(part, trace=among_inputs(part.trace, noisy)) for part in whole]
