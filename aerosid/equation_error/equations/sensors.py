"""Sensor errors in both directions: removed from measured signals, and applied to predicted ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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


def corrected(
    recording: Recording, effects: Sequence[ActiveEffect], paths: Callable[[], Mapping[str, Array]]
) -> dict[str, Array]:
    """Each measured channel (N,) corrected for its sensor's errors; not to be written to: earlier results are cached.

    Parameters
    ----------
    paths : callable
        The record's path by the other sensors, (N,) of each channel that has one. A channel that is late says nothing
        of the last moments: there it follows the path, or is held.

    Notes
    -----
    A sideslip held through the last 0.3 s of a manoeuvre bent a jet's airspeed at its end by 0.6 m/s through r v, ten
    times its residual: a vane late by a dead time was told as a lag with a false scale.
    """

    def without(values: Array, errors: Sequence[ActiveEffect], channel: str) -> Array:
        for n in reversed(range(len(errors))):
            effect = errors[n].effect
            assert isinstance(effect, OutputEffect)
            found = effect.corrected(recording.time, values, errors[n].numbers)
            if not np.isfinite(found).all():
                path = paths().get(channel, np.zeros_like(values))
                path = _read_with(errors[:n], recording, path[:, None])
                shown = _read_with(errors[n : n + 1], recording, path)
                found = with_ends_along(path[:, 0], found, values - shown[:, 0])
            values = found
        return values

    found = {}
    for name in recording.channels:
        errors = errors_of(effects, recording, name)
        found[name] = recording.without_errors(name, errors, partial(without, errors=errors, channel=name))
    return found


def as_read(recording: Recording, effects: Sequence[ActiveEffect], channel: str, values: Array) -> Array:
    """True signals or their derivatives, (N, K), as a channel's sensor reads them, without its bias."""
    return _read_with(errors_of(effects, recording, channel), recording, values)


def _read_with(errors: Sequence[ActiveEffect], recording: Recording, values: Array) -> Array:
    """Signals, (N, K), as a sensor with these errors reads them, without its bias."""
    for active in errors:
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


def with_ends_along(path: Array, values: Array, left: Array) -> Array:
    """The values with missing ends along a path, (N,); `left`: what was read less the path as it would be read.

    By that at the very ends the values vary smoothly with a delay; along a path of zero what was read there is held.
    """
    known = np.flatnonzero(np.isfinite(values))
    filled = values.copy()
    first, after = known[0], known[-1] + 1
    filled[:first] = path[:first] + left[0]
    filled[after:] = path[after:] + left[-1]
    return filled


def with_unseen_as_measured(
    recording: Recording, effects: Sequence[ActiveEffect], channel: str, predicted: Array
) -> Array:
    """A predicted record, (N,), where it shows what was before the record or comes after it: as measured.

    A late channel begins with a motion that no other sensor has recorded, an early one ends with it: there the record
    differs from the prediction by what it does next to that, on average over a sample of the band.
    """
    delay = sum(a.numbers[0] for a in errors_of(effects, recording, channel) if a.effect.kind == "sensor_delay")
    shown, measured = recording.time - delay, recording.channels[channel]
    unseen = (shown < recording.time[0]) | (shown > recording.time[-1])
    if not unseen.any() or unseen.all():
        return predicted
    left, count = (measured - predicted)[~unseen], recording.band.step
    return np.where(unseen, measured - np.mean(left[:count] if delay > 0.0 else left[-count:]), predicted)
