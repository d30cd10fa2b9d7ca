"""Measurement noise of a channel: as declared, or estimated, or why it cannot be estimated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from aerosid.logs.flight_log import FlightLog, FloatArray
from aerosid.signals.noise import estimate_noise

__all__ = ["ChannelNoise", "NoiseSettings", "channel_noise", "with_declared_noise"]


@dataclass(frozen=True)
class NoiseSettings:
    """When an estimate of noise is not to be believed.

    Attributes
    ----------
    finest : float
        Of the channel's range: a sensor whose noise is less does not exist; 16 bits over the range leave 1.5e-5, and
        their quantum over sqrt(12) is 4e-6. Effect: below it the channel counts as filtered.
    held_share : float
        Of the steps of a channel that moves: with more of them zero, samples are repeated.
    straight_share : float
        Of the second differences of a channel that moves: with more of them zero within rounding, it is interpolated.
    rounding : float
        Of the channel's range: differences below it are zero. Seven printed digits leave 1e-7.
    """

    finest: float = 2e-5
    held_share: float = 0.4
    straight_share: float = 0.4
    rounding: float = 2e-7


@dataclass(frozen=True)
class ChannelNoise:
    """The noise of one channel.

    Attributes
    ----------
    deviation : float
        Standard deviation, in the channel's unit.
    declared : bool
        Whether the channel map or the aircraft file gives it.
    doubt : str
        Why the estimate is not to be believed: 'filtered', 'interpolated', 'repeated' or 'quantised' in a sentence's
        end; empty where it is.
    """

    deviation: float
    declared: bool
    doubt: str


USUAL = NoiseSettings()


def channel_noise(log: FlightLog, name: str, settings: NoiseSettings = USUAL) -> ChannelNoise:
    """The noise of a channel of a log.

    Parameters
    ----------
    log : FlightLog
        Its declared noise and resolution win over what is estimated; a resolution is a noise of at least its
        twelfth part's root.
    name : str
        The channel.
    """
    floor = log.resolution.get(name, 0.0) / math.sqrt(12.0)
    if name in log.noise:
        return ChannelNoise(max(log.noise[name], floor), True, "")
    estimated = float(estimate_noise(log.time, log[name]))
    if floor > 0.0:
        return ChannelNoise(max(estimated, floor), True, "")
    return ChannelNoise(estimated, False, _doubt(log[name], estimated, settings))


def _doubt(values: FloatArray, estimated: float, settings: NoiseSettings) -> str:
    held = values[np.isfinite(values)]
    excursion = float(np.ptp(held)) if held.size else 0.0
    if held.size < 20 or excursion == 0.0:
        return ""
    step = np.abs(np.diff(held))
    nothing = settings.rounding * excursion
    # At rest a channel repeats itself rightly: only where it moves can repetition be told.
    moving = _moving(held, excursion)
    repeated = step[moving[1:] & moving[:-1]] <= nothing
    if repeated.size > 20 and float(np.mean(repeated)) > settings.held_share:
        levels = np.unique(held).size
        if levels < 0.1 * held.size:
            # The quantum over sqrt(12) is then the estimate; without even that nothing is known.
            return "" if estimated > 0.0 else "it is quantised: its steps hide the noise"
        return "samples are repeated: it was recorded more slowly than the log"
    bend = np.abs(np.diff(held, 2))
    straight = bend[moving[2:] & moving[:-2]] <= nothing
    if straight.size > 20 and float(np.mean(straight)) > settings.straight_share:
        return "it lies on straight lines: it was interpolated"
    if estimated < settings.finest * excursion:
        return "it is smoother than any sensor: it was filtered, or computed"
    return ""


def _moving(held: FloatArray, excursion: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Where the channel travels by a hundredth of its range within 21 samples, (N,)."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    travel = maximum_filter1d(held, 21) - minimum_filter1d(held, 21)
    return np.asarray(travel > 0.01 * excursion)


def with_declared_noise(log: FlightLog, noise: Mapping[str, float], resolution: Mapping[str, float]) -> FlightLog:
    """The log with an aircraft file's noise and resolution for the channels whose own map gives none."""
    if not noise and not resolution:
        return log
    held = {name: value for name, value in noise.items() if name in log}
    steps = {name: value for name, value in resolution.items() if name in log}
    return replace(log, noise={**held, **log.noise}, resolution={**steps, **log.resolution})
