"""A log as the kinematic equations take it: driving and observed channels, in stretches without gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.logs.channel_noise import channel_noise
from aerosid.logs.flight_log import FlightLog, Position

NEEDED = ("a_x", "a_z", "q", "V", "alpha")
"""Without these channels the path cannot be followed; theta and h add to it."""

SEEN = ("V", "alpha", "theta", "h")
"""Channels that see the path."""

LATERAL = ("p", "r", "phi", "beta")

LONGEST_STRETCH = 100.0
"""s; a longer record begins anew: the integral of unknown noise and drift would leave the linear range."""

SHORTEST_STRETCH = 3.0
"""s; less says nothing about any instrument."""

GAP = 2.5
"""Median intervals without a sample that end a stretch."""

MOST_SAMPLES = 4_000
"""Of a longer recording the liveliest stretches are looked at: an instrument does not change within hours."""

PADDING = 10.0
"""s kept on both sides of a stretch: what is late by less still lies in them."""

MARGIN = 0.5
"""s at both ends of a stretch whose outputs are not compared: an instrument that is late looks past them."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Recording:
    """One log as arrays.

    Attributes
    ----------
    log : FlightLog
        Where it came from.
    time : ndarray, shape (N,)
        s.
    inputs : ndarray, shape (N, 7)
        a_x, a_z, q, p, r, phi, beta as recorded, short gaps bridged; zeros where a lateral channel is absent.
    measured : ndarray, shape (N, 8)
        The channels of `SEEN` in the places of the longitudinal outputs; NaN elsewhere and where missing.
    stretches : tuple of slice
        Where the record is whole.
    compared : ndarray, shape (N, 8), bool
        Which samples enter the likelihood.
    noise : mapping of str to float
        Standard deviation of the white noise of each channel, from the log alone.
    positions : mapping of str to (float, float, float)
        Sensor positions from the centre of gravity, m.
    """

    log: FlightLog
    time: Array
    inputs: Array
    measured: Array
    stretches: tuple[slice, ...]
    compared: NDArray[np.bool_]
    noise: dict[str, float]
    positions: dict[str, Position]

    @property
    def outputs(self) -> tuple[str, ...]:
        """The channels that see the path and are there."""
        return tuple(name for name in SEEN if self.compared[:, LONGITUDINAL.outputs.index(name)].any())

    @property
    def compared_samples(self) -> int:
        """How many samples lie in the stretches."""
        return sum(stretch.stop - stretch.start for stretch in self.stretches)

    @property
    def airspeed(self) -> float:
        """Mean true airspeed, m/s."""
        return float(np.nanmean(self.measured[:, 0]))


def lacking(log: FlightLog) -> tuple[str, ...]:
    """The channels that the kinematics need and the log lacks."""
    return tuple(name for name in NEEDED if name not in log or np.isfinite(log[name]).sum() < 20)


def read_recording(log: FlightLog) -> Recording | None:
    """The log as arrays; None where a needed channel or every whole stretch is absent."""
    if lacking(log):
        return None
    time = np.array(log.time)
    driving = [np.array(log[name]) for name in ("a_x", "a_z", "q")]
    lateral = [np.array(log[name]) if name in log else np.zeros(time.size) for name in LATERAL]
    inputs = np.column_stack([*driving, *lateral])
    measured = np.full((time.size, len(LONGITUDINAL.outputs)), np.nan)
    for name in SEEN:
        if name in log and np.isfinite(log[name]).sum() >= 20:
            measured[:, LONGITUDINAL.outputs.index(name)] = log[name]
    stretches = _whole_stretches(time, inputs, measured)
    if not stretches:
        return None
    for j in range(inputs.shape[1]):
        held = np.isfinite(inputs[:, j])
        if not held.all():
            inputs[:, j] = np.interp(time, time[held], inputs[held, j]) if held.any() else 0.0
    compared = np.zeros(measured.shape, dtype=bool)
    for stretch in stretches:
        inside = time[stretch]
        margin = min(MARGIN, 0.05 * float(inside[-1] - inside[0]))
        kept = (inside >= inside[0] + margin) & (inside <= inside[-1] - margin)
        compared[stretch] = np.isfinite(measured[stretch]) & kept[:, None]
    noise = {name: channel_noise(log, name).deviation for name in (*NEEDED, "theta", "h") if name in log}
    return compacted(Recording(log, time, inputs, measured, stretches, compared, noise, dict(log.positions)))


def compacted(recording: Recording) -> Recording:
    """The recording without the samples that are far from every stretch; what is left keeps its time."""
    time = recording.time
    keep = np.zeros(time.size, dtype=bool)
    for stretch in recording.stretches:
        first = np.searchsorted(time, time[stretch.start] - PADDING)
        keep[first : np.searchsorted(time, time[stretch.stop - 1] + PADDING, side="right")] = True
    if keep.all():
        return recording
    place = np.cumsum(keep) - 1
    stretches = tuple(slice(int(place[s.start]), int(place[s.stop - 1]) + 1) for s in recording.stretches)
    return replace(
        recording,
        time=time[keep],
        inputs=recording.inputs[keep],
        measured=recording.measured[keep],
        compared=recording.compared[keep],
        stretches=stretches,
    )


def _whole_stretches(time: Array, inputs: Array, measured: Array) -> tuple[slice, ...]:
    """Runs without gaps in what drives the path, in pieces of equal length that are not too long; the liveliest."""
    interval = float(np.median(np.diff(time)))
    usable = np.isfinite(inputs).all(axis=1)
    there = np.flatnonzero(usable)
    if there.size < 2:
        return ()
    breaks = np.flatnonzero(np.diff(time[there]) > GAP * interval) + 1
    pieces: list[slice] = []
    for run in np.split(there, breaks):
        length = float(time[run[-1]] - time[run[0]])
        count = max(1, int(np.ceil(length / LONGEST_STRETCH - 1e-9)))
        for part in np.array_split(run, count):
            piece = slice(int(part[0]), int(part[-1]) + 1)
            long_enough = float(time[part[-1]] - time[part[0]]) >= SHORTEST_STRETCH and part.size >= 20
            if long_enough and np.isfinite(measured[piece, :2]).sum(axis=0).min() >= 10:
                pieces.append(piece)
    total = 0
    kept: list[slice] = []
    for piece in sorted(pieces, key=lambda piece: -float(np.std(inputs[piece, 2]))):
        if total == 0 or total + piece.stop - piece.start <= MOST_SAMPLES:
            kept.append(piece)
            total += piece.stop - piece.start
    return tuple(sorted(kept, key=lambda piece: piece.start))


def first_states(recording: Recording) -> tuple[Array, ...]:
    """A first guess of u, w, -, theta, h (5,) where each stretch begins, from its first five samples."""
    return tuple(_first_state(recording, stretch) for stretch in recording.stretches)


def _first_state(recording: Recording, stretch: slice) -> Array:
    speed, alpha, theta, height = (
        _first_mean(recording.measured[stretch, LONGITUDINAL.outputs.index(name)])
        for name in ("V", "alpha", "theta", "h")
    )
    a_x, q, beta = (float(np.mean(recording.inputs[stretch][:5, j])) for j in (0, 2, 6))
    alpha += q * recording.positions.get("alpha", (0.0, 0.0, 0.0))[0] / speed
    if not np.isfinite(theta):
        theta = float(np.arcsin(np.clip(a_x / 9.80665, -0.9, 0.9)))
    plane = speed * np.cos(beta)
    return np.array([plane * np.cos(alpha), plane * np.sin(alpha), 0.0, theta, height if np.isfinite(height) else 0.0])


def _first_mean(values: Array, count: int = 5) -> float:
    held = values[np.isfinite(values)]
    return float(held[:count].mean()) if held.size else float("nan")


def spread(recordings: Sequence[Recording], channel: str) -> float:
    """Mean standard deviation of a channel's white noise over the recordings that hold it; 0 where none does."""
    held = [recording.noise[channel] for recording in recordings if channel in recording.noise]
    return float(np.mean(held)) if held else 0.0
