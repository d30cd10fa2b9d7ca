"""A recording with channels altered as one usual error of a channel map or a clock asks, in words after "it agrees"."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.flight_path import GIVEN, OBSERVED
from aerosid.compatibility.noise_levels import plausible_noise
from aerosid.compatibility.recording import Recording
from aerosid.compatibility.remedies import OFFSETS, sign_and_unit_remedies, unit_remedies
from aerosid.compatibility.settings import ContradictionSettings
from aerosid.logs.flight_log import ChannelSource
from aerosid.nomenclature import CHANNELS

Array = NDArray[np.float64]

EXCHANGEABLE = (
    ("a_x", "a_z"),
    ("a_x", "a_y"),
    ("a_y", "a_z"),
    ("p", "q"),
    ("q", "r"),
    ("p", "r"),
    ("phi", "theta"),
    ("theta", "psi"),
    ("phi", "psi"),
    ("alpha", "beta"),
    ("alpha", "theta"),
)
"""Pairs of channels of one unit that a channel map may have taken for each other."""

ACCELERATIONS = ("a_x", "a_z")
"""Channels of one instrument, whose unit is often declared once."""


@dataclass(frozen=True)
class Alteration:
    """What is supposed to be wrong, and the recording with it corrected.

    Attributes
    ----------
    channels : tuple of str
        The channels in error.
    remedy : str
        The correction, in words after "it agrees".
    recording : Recording
        With the correction.
    late : float
        s; time by which the channel is late, negative when early; 0 where the clock is not altered.
    """

    channels: tuple[str, ...]
    remedy: str
    recording: Recording
    late: float = 0.0


def other_signs_and_units(windows: Recording, channels: Iterable[str]) -> Iterator[Alteration]:
    """Each of these channels with another sign, unit or offset."""
    for channel in channels:
        given = windows.channel(channel)
        for factor, words in sign_and_unit_remedies(CHANNELS[channel].unit, source_of(windows, channel)):
            yield Alteration((channel,), words, with_channel(windows, channel, factor * given))
        if channel in ACCELERATIONS:
            for offset, words in OFFSETS:
                yield Alteration((channel,), words, with_channel(windows, channel, given + offset))


def other_units(windows: Recording, channel: str) -> Iterator[Alteration]:
    """A channel in each other unit."""
    for factor, words in unit_remedies(CHANNELS[channel].unit, source_of(windows, channel)):
        yield Alteration((channel,), words, with_channel(windows, channel, factor * windows.channel(channel)))


def other_units_of_both_accelerations(windows: Recording) -> Iterator[Alteration]:
    """a_x and a_z in another unit, where the same one was declared for both."""
    x_units, z_units = (unit_remedies("m/s^2", source_of(windows, channel)) for channel in ACCELERATIONS)
    if x_units != z_units:
        return
    for factor, words in x_units:
        changed = windows
        for channel in ACCELERATIONS:
            changed = with_channel(changed, channel, factor * windows.channel(channel))
        yield Alteration(ACCELERATIONS, words.replace("its", "their", 1), changed)


def exchanged_channels(windows: Recording, settings: ContradictionSettings) -> Iterator[Alteration]:
    """Each pair of channels of one unit exchanged, where the log has both."""
    log = windows.log
    for pair in EXCHANGEABLE:
        if not all(name in log and int(np.isfinite(log[name]).sum()) > 1 for name in pair):
            continue
        changed = windows
        for name, other in (pair, pair[::-1]):
            if name in (*GIVEN, *windows.outputs):
                noise = windows.noise[other] if other in windows.noise else plausible_noise(log, other, settings)
                changed = _replaced(changed, name, _as_recorded(windows, other), noise)
        yield Alteration(pair, "when exchanged with each other", changed)


def moved_in_time(windows: Recording, channel: str, late: float) -> Alteration:
    """A channel that is `late` by so many s, negative when early, on the clock of the others.

    Nothing is compared where the channel was not recorded.
    """
    values = _as_recorded(windows, channel, late)
    present = windows.time[np.isfinite(windows.channel(channel))]
    known = (windows.time + late >= present[0]) & (windows.time + late <= present[-1])
    compared = windows.compared.copy()
    places = [OBSERVED.index(channel)] if channel in OBSERVED else range(len(OBSERVED))
    for place in places:
        compared[:, place] &= known
    words = f"when moved about {round(abs(late), 1):g} s {'earlier' if late > 0.0 else 'later'}"
    changed = _replaced(windows, channel, values, windows.noise.get(channel))
    return Alteration((channel,), words, replace(changed, compared=compared), late)


def still_compared(windows: Recording, changed: Recording) -> float:
    """Share, 1, of an output's compared samples that an alteration leaves, of the output that keeps fewest."""
    before, after = windows.compared.sum(axis=0), changed.compared.sum(axis=0)
    return float(np.min(after[before > 0] / before[before > 0]))


def source_of(recording: Recording, channel: str) -> ChannelSource | None:
    """Where a channel was read with its unit; None where it was computed from others, or handed over as an array."""
    source = recording.log.sources.get(channel)
    is_computed = (
        source is not None and channel not in source.columns and set(source.columns) <= {*recording.log.channels}
    )
    return None if is_computed else source


def with_channel(recording: Recording, name: str, values: Array) -> Recording:
    """The recording with other values of one channel, (N,), whose noise is changed as its standard deviation."""
    factor = float(np.nanstd(values)) / max(float(np.nanstd(recording.channel(name))), 1e-300)
    return _replaced(recording, name, values, recording.noise[name] * factor)


def _replaced(recording: Recording, name: str, values: Array, noise: float | None) -> Recording:
    noises = recording.noise if noise is None else {**recording.noise, name: noise}
    if name in GIVEN:
        inputs = recording.inputs.copy()
        inputs[:, GIVEN.index(name)] = values
        return replace(recording, inputs=inputs, noise=noises)
    measured = recording.measured.copy()
    measured[:, OBSERVED.index(name)] = values
    return replace(recording, measured=measured, noise=noises)


def _as_recorded(windows: Recording, channel: str, late: float = 0.0) -> Array:
    """A channel, (N,), of the path's or of the log's, `late` s after each sample; a line between samples."""
    known: Sequence[str] = (*GIVEN, *OBSERVED)
    time, values = (
        (windows.time, windows.channel(channel)) if channel in known else (windows.log.time, windows.log[channel])
    )
    present = np.isfinite(values)
    return np.interp(windows.time + late, time[present], values[present])
