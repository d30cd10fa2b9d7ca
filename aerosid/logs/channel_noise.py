"""Measurement noise of a channel: as declared, or estimated, or the reason why it cannot be estimated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from aerosid.logs.flight_log import FlightLog
from aerosid.logs.sample_patterns import spikes
from aerosid.signals.noise import estimate_noise
from aerosid.signals.reprocessed_samples import doubt_of_noise

__all__ = ["ChannelNoise", "channel_noise", "noise_deviation", "with_declared_noise"]


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
        Why the estimate is not reliable: 'filtered', 'interpolated', 'repeated' or 'quantised', as the end of a
        sentence; empty where it is reliable.
    """

    deviation: float
    declared: bool
    doubt: str


def channel_noise(log: FlightLog, name: str) -> ChannelNoise:
    """The noise of a channel of a log.

    Parameters
    ----------
    log : FlightLog
        Its declared noise and resolution take precedence over the estimate; a resolution r implies a noise of at
        least r / sqrt(12).
    name : str
        The channel.
    """
    estimated = noise_deviation(log, name)
    if name in log.noise or _floor(log, name) > 0.0:
        return ChannelNoise(estimated, True, "")
    values = np.array(log[name])
    # Beside a spike of any height ordinary noise would look like none.
    values[spikes(values, estimated)] = np.nan
    return ChannelNoise(estimated, False, doubt_of_noise(values, estimated))


def noise_deviation(log: FlightLog, name: str) -> float:
    """The standard deviation of `channel_noise` alone."""
    known = log.noise[name] if name in log.noise else float(estimate_noise(log.time, log[name]))
    return max(known, _floor(log, name))


def _floor(log: FlightLog, name: str) -> float:
    """Standard deviation of a channel's rounding, where its resolution is declared."""
    return log.resolution.get(name, 0.0) / math.sqrt(12.0)


def with_declared_noise(log: FlightLog, noise: Mapping[str, float], resolution: Mapping[str, float]) -> FlightLog:
    """The log with the aircraft file's noise and resolution for channels without one in their own channel map."""
    if not noise and not resolution:
        return log
    deviations = {name: value for name, value in noise.items() if name in log}
    steps = {name: value for name, value in resolution.items() if name in log}
    return replace(log, noise={**deviations, **log.noise}, resolution={**steps, **log.resolution})
