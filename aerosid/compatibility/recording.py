"""A log as the kinematic equations take it: driving and observed channels, in stretches without gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.flight_path import DRIVING, GIVEN, SEEN, STATES
from aerosid.flight_model.constants import GRAVITY
from aerosid.logs.channel_noise import channel_noise
from aerosid.logs.flight_log import FlightLog, Position
from aerosid.signals.resampling import without_gaps

NEEDED = (*DRIVING, "V", "alpha")
"""Without these channels the path cannot be followed; theta and h add to it."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StretchSettings:
    """How a log is cut into stretches over which its path is followed; chosen, found on no recording.

    Attributes
    ----------
    longest, shortest : float
        s; a longer record begins anew, for the integral of unknown noise and drift would leave the linear range; a
        shorter one says nothing about any instrument.
    gap : float
        Median sampling intervals, 1, without a sample that end a stretch.
    most_samples : int
        Of a longer recording the liveliest stretches are looked at: an instrument does not change within hours.
    padding : float
        s kept on both sides of a stretch: what is late by less still lies in them.
    margin : float
        s at both ends of a stretch whose outputs are not compared: an instrument that is late looks past them.
    margin_share : float
        Share, 1, of a stretch that the margin is at most.
    fewest : int
        Samples of a channel, and of a stretch, from which on it is used.
    fewest_seen : int
        Samples of airspeed and angle of attack that a stretch holds at least.
    first : int
        Samples whose mean is the first guess of where a path begins.
    """

    longest: float = 100.0
    shortest: float = 3.0
    gap: float = 2.5
    most_samples: int = 4_000
    padding: float = 10.0
    margin: float = 0.5
    margin_share: float = 0.05
    fewest: int = 20
    fewest_seen: int = 10
    first: int = 5


STRETCHES = StretchSettings()
"""How every log is cut."""


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
        The channels of `GIVEN` as recorded, short gaps bridged; zeros where a lateral channel is absent.
    measured : ndarray, shape (N, 4)
        The channels of `SEEN`; NaN where missing.
    stretches : tuple of slice
        Where the record is whole.
    compared : ndarray, shape (N, 4), bool
        Which samples of those channels are compared with the path.
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
        return tuple(name for name, held in zip(SEEN, self.compared.T, strict=True) if held.any())

    @property
    def compared_samples(self) -> int:
        """How many samples lie in the stretches."""
        return sum(stretch.stop - stretch.start for stretch in self.stretches)

    @property
    def airspeed(self) -> float:
        """Mean true airspeed, m/s."""
        return float(np.nanmean(self.channel("V")))

    def channel(self, name: str) -> Array:
        """The samples of a channel that drives the path or sees it, (N,), SI."""
        return self.measured[:, SEEN.index(name)] if name in SEEN else self.inputs[:, GIVEN.index(name)]


def lacking(log: FlightLog, settings: StretchSettings = STRETCHES) -> tuple[str, ...]:
    """The channels that the kinematics need and the log lacks."""
    return tuple(name for name in NEEDED if not _is_there(log, name, settings))


def _is_there(log: FlightLog, name: str, settings: StretchSettings) -> bool:
    return name in log and int(np.isfinite(log[name]).sum()) >= settings.fewest


def read_recording(log: FlightLog, settings: StretchSettings = STRETCHES) -> Recording | None:
    """The log as arrays; None where a needed channel or every whole stretch is absent."""
    if lacking(log, settings):
        return None
    time = np.array(log.time)
    inputs = np.zeros((time.size, len(GIVEN)))
    for j, name in enumerate(GIVEN):
        if name in log:
            inputs[:, j] = log[name]
    measured = np.full((time.size, len(SEEN)), np.nan)
    for i, name in enumerate(SEEN):
        if _is_there(log, name, settings):
            measured[:, i] = log[name]
    stretches = _whole_stretches(time, inputs, measured, settings)
    if not stretches:
        return None
    for j in range(inputs.shape[1]):
        present = np.isfinite(inputs[:, j])
        if not present.all():
            inputs[:, j] = without_gaps(time, inputs[:, j]) if present.any() else 0.0
    compared = np.zeros(measured.shape, dtype=bool)
    for stretch in stretches:
        inside = time[stretch]
        margin = min(settings.margin, settings.margin_share * float(inside[-1] - inside[0]))
        kept = (inside >= inside[0] + margin) & (inside <= inside[-1] - margin)
        compared[stretch] = np.isfinite(measured[stretch]) & kept[:, None]
    names = dict.fromkeys((*NEEDED, *SEEN))
    noise = {name: channel_noise(log, name).deviation for name in names if name in log}
    return compacted(Recording(log, time, inputs, measured, stretches, compared, noise, dict(log.positions)), settings)


def compacted(recording: Recording, settings: StretchSettings = STRETCHES) -> Recording:
    """The recording without the samples that are far from every stretch; what is left keeps its time."""
    time = recording.time
    keep = np.zeros(time.size, dtype=bool)
    for stretch in recording.stretches:
        first = np.searchsorted(time, time[stretch.start] - settings.padding)
        keep[first : np.searchsorted(time, time[stretch.stop - 1] + settings.padding, side="right")] = True
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


def shows_motion(recording: Recording, piece: slice, settings: StretchSettings = STRETCHES) -> bool:
    """Whether a piece holds airspeed and angle of attack often enough for its path to be compared."""
    seen = (recording.channel(name)[piece] for name in ("V", "alpha"))
    return all(int(np.isfinite(values).sum()) >= settings.fewest_seen for values in seen)


def liveliest(inputs: Array, pieces: Sequence[slice]) -> list[slice]:
    """The pieces by how much the pitch rate varies in them, most of all first."""
    q = inputs[:, GIVEN.index("q")]
    return sorted(pieces, key=lambda piece: -float(np.std(q[piece])))


def _whole_stretches(time: Array, inputs: Array, measured: Array, settings: StretchSettings) -> tuple[slice, ...]:
    """Runs without gaps in what drives the path, in pieces of equal length that are not too long; the liveliest."""
    interval = float(np.median(np.diff(time)))
    there = np.flatnonzero(np.isfinite(inputs).all(axis=1))
    if there.size < 2:
        return ()
    breaks = np.flatnonzero(np.diff(time[there]) > settings.gap * interval) + 1
    seen = np.isfinite(measured[:, [SEEN.index("V"), SEEN.index("alpha")]])
    pieces: list[slice] = []
    for run in np.split(there, breaks):
        length = float(time[run[-1]] - time[run[0]])
        count = max(1, int(np.ceil(length / settings.longest - 1e-9)))
        for part in np.array_split(run, count):
            piece = slice(int(part[0]), int(part[-1]) + 1)
            long_enough = float(time[part[-1]] - time[part[0]]) >= settings.shortest and part.size >= settings.fewest
            if long_enough and seen[piece].sum(axis=0).min() >= settings.fewest_seen:
                pieces.append(piece)
    total = 0
    kept: list[slice] = []
    for piece in liveliest(inputs, pieces):
        if total == 0 or total + piece.stop - piece.start <= settings.most_samples:
            kept.append(piece)
            total += piece.stop - piece.start
    return tuple(sorted(kept, key=lambda piece: piece.start))


def first_states(recording: Recording) -> tuple[Array, ...]:
    """A first guess of the path's state (4,) where each stretch begins, from its first samples."""
    return tuple(_first_state(recording, stretch) for stretch in recording.stretches)


def _first_state(recording: Recording, stretch: slice) -> Array:
    speed, alpha, theta, h, a_x, q, beta = (
        _first_mean(recording.channel(name)[stretch]) for name in (*SEEN, "a_x", "q", "beta")
    )
    alpha += q * recording.positions.get("alpha", (0.0, 0.0, 0.0))[0] / speed
    if not np.isfinite(theta):
        theta = float(np.arcsin(np.clip(a_x / GRAVITY, -0.9, 0.9)))
    plane = speed * np.cos(beta)
    motion = {"u": plane * np.cos(alpha), "w": plane * np.sin(alpha), "theta": theta}
    return np.array([motion.get(name, h if np.isfinite(h) else 0.0) for name in STATES])


def _first_mean(values: Array, settings: StretchSettings = STRETCHES) -> float:
    present = values[np.isfinite(values)]
    return float(present[: settings.first].mean()) if present.size else float("nan")
