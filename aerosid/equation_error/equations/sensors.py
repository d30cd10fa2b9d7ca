"""Sensor faults in both directions: taken off what is measured, and put on what is predicted."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, OutputEffect
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.recording import Recording

Array = NDArray[np.float64]

_AXES = "xyz"


def errors_of(effects: Sequence[ActiveEffect], recording: Recording, channel: str) -> list[ActiveEffect]:
    """Those of the effects that change what the sensor of a channel reads on a recording, in the order they act."""
    return [
        active
        for active in effects
        if isinstance(active.effect, OutputEffect) and active.effect.where == channel and active.acts_on(recording.name)
    ]


def corrected(recording: Recording, effects: Sequence[ActiveEffect]) -> dict[str, Array]:
    """Each measured channel (N,) as it was before its sensor's faults; ends that a delay leaves bare are held.

    Not to be written to: what was made before is kept.
    """

    def without(values: Array, faults: Sequence[ActiveEffect]) -> Array:
        for active in reversed(faults):
            effect = active.effect
            assert isinstance(effect, OutputEffect)
            values = with_ends_held(effect.corrected(recording.time, values, active.numbers), values)
        return values

    found = {}
    for name in recording.channels:
        faults = errors_of(effects, recording, name)
        found[name] = recording.without_errors(name, faults, partial(without, faults=faults))
    return found


def as_read(recording: Recording, effects: Sequence[ActiveEffect], channel: str, values: Array) -> Array:
    """What the sensor of a channel makes of true signals or of their derivatives, (N, K), without its bias."""
    for active in errors_of(effects, recording, channel):
        effect = active.effect
        assert isinstance(effect, OutputEffect)
        values = effect.transform(recording.time, np.ascontiguousarray(values), active.numbers)
    return values


def bias(recording: Recording, effects: Sequence[ActiveEffect], channel: str) -> float:
    """What the sensor of a channel adds to everything."""
    total = 0.0
    for active in errors_of(effects, recording, channel):
        effect = active.effect
        assert isinstance(effect, OutputEffect)
        # A scale acts on the bias before it as on all else.
        total = float(effect.transform(recording.time[:1], np.full((1, 1), total), active.numbers)[0, 0])
        total += effect.offset(active.numbers)
    return total


def position(recording: Recording, effects: Sequence[ActiveEffect], channel: str) -> Array:
    """Where the sensor of a channel sits, m from the declared centre of gravity, (3,)."""
    place = recording.position(channel).copy()
    for active in effects:
        if isinstance(active.effect, PositionEffect) and active.effect.where == channel:
            for axis, further in zip(active.effect.axes, active.numbers, strict=True):
                place[_AXES.index(axis)] += further
    return place


def with_ends_held(values: Array, before: Array) -> Array:
    """The values with bare ends held at the ends of what they were made of, so that they move smoothly with a delay."""
    known = np.flatnonzero(np.isfinite(values))
    if known.size == values.size:
        return values
    filled = values.copy()
    filled[: known[0]] = before[0]
    filled[known[-1] + 1 :] = before[-1]
    return filled
