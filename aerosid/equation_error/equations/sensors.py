"""Sensor errors in both directions: removed from measured signals, and applied to predicted ones."""

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
    """The effects on the signal of a channel's sensor in a record, in the order in which they act."""
    return [
        active
        for active in effects
        if isinstance(active.effect, OutputEffect) and active.effect.where == channel and active.acts_on(recording.name)
    ]


def corrected(recording: Recording, effects: Sequence[ActiveEffect]) -> dict[str, Array]:
    """Each measured channel (N,) corrected for its sensor's errors; ends without data due to a delay are held.

    Not to be written to: earlier results are cached.
    """

    def without(values: Array, errors: Sequence[ActiveEffect]) -> Array:
        for active in reversed(errors):
            effect = active.effect
            assert isinstance(effect, OutputEffect)
            values = with_ends_held(effect.corrected(recording.time, values, active.numbers), values)
        return values

    found = {}
    for name in recording.channels:
        errors = errors_of(effects, recording, name)
        found[name] = recording.without_errors(name, errors, partial(without, errors=errors))
    return found


def as_read(recording: Recording, effects: Sequence[ActiveEffect], channel: str, values: Array) -> Array:
    """True signals or their derivatives, (N, K), as a channel's sensor reads them, without its bias."""
    for active in errors_of(effects, recording, channel):
        effect = active.effect
        assert isinstance(effect, OutputEffect)
        values = effect.transform(recording.time, np.ascontiguousarray(values), active.numbers)
    return values


def bias(recording: Recording, effects: Sequence[ActiveEffect], channel: str) -> float:
    """Total bias of a channel's sensor."""
    total = 0.0
    for active in errors_of(effects, recording, channel):
        effect = active.effect
        assert isinstance(effect, OutputEffect)
        # A scale factor error acts on the bias before it as well.
        total = float(effect.transform(recording.time[:1], np.full((1, 1), total), active.numbers)[0, 0])
        total += effect.offset(active.numbers)
    return total


def position(recording: Recording, effects: Sequence[ActiveEffect], channel: str) -> Array:
    """Position of a channel's sensor, m from the declared centre of gravity, (3,)."""
    location = recording.position(channel).copy()
    for active in effects:
        if isinstance(active.effect, PositionEffect) and active.effect.moves(channel):
            for axis, further in zip(active.effect.axes, active.numbers, strict=True):
                location[_AXES.index(axis)] += further
    return location


def with_ends_held(values: Array, before: Array) -> Array:
    """The values with missing ends held at the ends of the original signal, so that they vary smoothly with a delay."""
    known = np.flatnonzero(np.isfinite(values))
    if known.size == values.size:
        return values
    filled = values.copy()
    filled[: known[0]] = before[0]
    filled[known[-1] + 1 :] = before[-1]
    return filled
