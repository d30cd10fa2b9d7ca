"""Spikes of a recording's channels: single samples that would be taken for motion, and the recording without them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.flight_path import GIVEN, OBSERVED
from aerosid.compatibility.recording import Recording
from aerosid.logs.sample_patterns import spike_times, spikes
from aerosid.notation import listed

Places = NDArray[np.intp]


def spikes_of(recording: Recording) -> dict[str, Places]:
    """Indices of the spikes of each driving or observed channel that has any."""
    names = [name for name in dict.fromkeys((*GIVEN, *OBSERVED)) if name in recording.noise]
    found = {name: spikes(recording.channel(name), recording.noise[name]) for name in names}
    return {name: places for name, places in found.items() if places.size}


def without_spikes(recording: Recording, found: Mapping[str, Places]) -> Recording:
    """The recording without these samples: missing in observed channels, bridged by a line in driving ones."""
    inputs, measured, compared = recording.inputs.copy(), recording.measured.copy(), recording.compared.copy()
    for name, places in found.items():
        if name in OBSERVED:
            measured[places, OBSERVED.index(name)] = np.nan
            compared[places, OBSERVED.index(name)] = False
        else:
            others = np.setdiff1d(np.arange(recording.time.size), places)
            column = inputs[:, GIVEN.index(name)]
            column[places] = np.interp(recording.time[places], recording.time[others], column[others])
    return replace(recording, inputs=inputs, measured=measured, compared=compared)


def spikes_told(recording: Recording, found: Mapping[str, Places]) -> str:
    """The channels with number and times of their spikes."""
    return listed([f"{name} ({spike_times(recording.time, places)})" for name, places in found.items()])
