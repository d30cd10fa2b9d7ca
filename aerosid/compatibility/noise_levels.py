"""Noise levels by which misfits are weighed, also of channels whose samples show no noise of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aerosid.compatibility.recording import Recording
from aerosid.compatibility.settings import ContradictionSettings
from aerosid.logs.channel_noise import channel_noise
from aerosid.logs.flight_log import FlightLog


def with_plausible_noise(recording: Recording, settings: ContradictionSettings) -> Recording:
    """The recording with a plausible noise of each observed channel, where that of some cannot be estimated.

    The differences of repeated, interpolated or filtered samples leave next to none. By that the path would follow the
    channel through every gust, hold and delay, and attitude and flow angle would be bent to it.
    """
    log, estimated = recording.log, recording.noise
    levels = {name: plausible_noise(log, name, settings) for name in recording.outputs}
    if all(levels[name] == estimated[name] for name in levels):
        return recording
    # A channel that passes for a sensor's by a hair would else take the place of those that do not.
    share = settings.least_beside * settings.unknown_noise
    beside = {name: max(level, share * float(np.nanstd(log[name]))) for name, level in levels.items()}
    return replace(recording, noise={**estimated, **beside})


def plausible_noise(log: FlightLog, name: str, settings: ContradictionSettings) -> float:
    """Standard deviation of a channel's noise, SI: as estimated or declared, in doubt a share of its motion."""
    noise = channel_noise(log, name)
    if not noise.doubt:
        return noise.deviation
    return max(noise.deviation, settings.unknown_noise * float(np.nanstd(log[name])))
