"""A log as arrays for the kinematic equations: driving and observed channels, in stretches without gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.flight_path import DRIVING, GIVEN, OBSERVED, STATES
from aerosid.estimation.manoeuvre import first_mean, steady_pitch
from aerosid.logs.channel_noise import channel_noise
from aerosid.logs.constant_channels import is_constant
from aerosid.logs.flight_log import FlightLog, Position
from aerosid.signals.resampling import without_gaps

NEEDED = (*DRIVING, "V", "alpha")
"""Required channels of the path; theta and h add to it."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StretchSettings:
    """Division of a log into stretches for flight-path reconstruction; chosen, found on no recording.

    Attributes
    ----------
    longest, shortest : float
        s; a longer record is divided, as the integral of unknown noise and drift would leave the linear range; a
        shorter one determines no instrument error.
    gap : float
        Median sampling intervals, 1, without a sample that end a stretch.
    most_samples : int
        Of a longer recording the stretches with most pitching are used: instrument errors do not change within hours.
    padding : float
        s retained on both sides of a stretch, for channels with a smaller time delay.
    margin : float
        s at both ends of a stretch whose outputs are not compared, as a delayed instrument extends beyond them.
    margin_share : float
        Largest margin as a fraction, 1, of a stretch.
    fewest : int
        Least number of samples of a channel, and of a stretch.
    fewest_seen : int
        Least number of samples of airspeed and angle of attack in a stretch.
    first : int
        Samples whose mean is the start value of a path's initial state.
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
"""The settings of every log."""


@dataclass(frozen=True)
class Recording:
    """One log as arrays.

    Attributes
    ----------
    log : FlightLog
        The log itself.
    time : ndarray, shape (N,)
        s.
    inputs : ndarray, shape (N, 7)
        The channels of `GIVEN` as recorded, short gaps bridged; zeros where a lateral channel is absent.
    measured : ndarray, shape (N, 4)
        The channels of `OBSERVED`; NaN where missing.
    stretches : tuple of slice
        The parts of the record without gaps.
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
        """The observed channels that are present."""
        return tuple(name for name, held in zip(OBSERVED, self.compared.T, strict=True) if held.any())

    @property
    def compared_samples(self) -> int:
        """Number of samples in the stretches."""
        return sum(stretch.stop - stretch.start for stretch in self.stretches)

    @property
    def airspeed(self) -> float:
        """Mean true airspeed, m/s."""
        return float(np.nanmean(self.channel("V")))

    def channel(self, name: str) -> Array:
        """The samples of a driving or observed channel, (N,), SI."""
        return self.measured[:, OBSERVED.index(name)] if name in OBSERVED else self.inputs[:, GIVEN.index(name)]


def missing_channels(log: FlightLog) -> tuple[str, ...]:
    """The required channels that the log lacks; an accelerometer of one value throughout measures no force."""
    absent = (name for name in NEEDED if not _is_present(log, name))
    return *absent, *(name for name in ("a_x", "a_z") if name in log and is_constant(log[name]))


def _is_present(log: FlightLog, name: str) -> bool:
    return name in log and int(np.isfinite(log[name]).sum()) >= STRETCHES.fewest


def read_recording(log: FlightLog) -> Recording | None:
    """The log as arrays; None where a required channel is absent or there is no stretch without gaps."""
    if missing_channels(log):
        return None
    time = np.array(log.time)
    inputs = np.zeros((time.size, len(GIVEN)))
    for j, name in enumerate(GIVEN):
        if name in log:
            inputs[:, j] = log[name]
    measured = np.full((time.size, len(OBSERVED)), np.nan)
    for i, name in enumerate(OBSERVED):
        if _is_present(log, name) and (name in NEEDED or not is_constant(log[name])):
            measured[:, i] = log[name]
    stretches = _whole_stretches(time, inputs, measured)
    if not stretches:
        return None
    for j in range(inputs.shape[1]):
        present = np.isfinite(inputs[:, j])
        if not present.all():
            inputs[:, j] = without_gaps(time, inputs[:, j]) if present.any() else 0.0
    compared = np.zeros(measured.shape, dtype=bool)
    for stretch in stretches:
        inside = time[stretch]
        margin = min(STRETCHES.margin, STRETCHES.margin_share * float(inside[-1] - inside[0]))
        used = (inside >= inside[0] + margin) & (inside <= inside[-1] - margin)
        compared[stretch] = np.isfinite(measured[stretch]) & used[:, None]
    names = dict.fromkeys((*NEEDED, *OBSERVED))
    noise = {name: channel_noise(log, name).deviation for name in names if name in log}
    return compacted(Recording(log, time, inputs, measured, stretches, compared, noise, dict(log.positions)))


def compacted(recording: Recording) -> Recording:
    """The recording without the samples that are far from every stretch; the time of the others is unchanged."""
    time = recording.time
    retained = np.zeros(time.size, dtype=bool)
    for stretch in recording.stretches:
        first = np.searchsorted(time, time[stretch.start] - STRETCHES.padding)
        retained[first : np.searchsorted(time, time[stretch.stop - 1] + STRETCHES.padding, side="right")] = True
    if retained.all():
        return recording
    place = np.cumsum(retained) - 1
    stretches = tuple(slice(int(place[s.start]), int(place[s.stop - 1]) + 1) for s in recording.stretches)
    return replace(
        recording,
        time=time[retained],
        inputs=recording.inputs[retained],
        measured=recording.measured[retained],
        compared=recording.compared[retained],
        stretches=stretches,
    )


def shows_motion(recording: Recording, piece: slice) -> bool:
    """Whether a piece has enough samples of airspeed and angle of attack for its path to be compared."""
    seen = (recording.channel(name)[piece] for name in ("V", "alpha"))
    return all(int(np.isfinite(values).sum()) >= STRETCHES.fewest_seen for values in seen)


def most_excited(inputs: Array, pieces: Sequence[slice]) -> list[slice]:
    """The pieces in descending order of the standard deviation of pitch rate."""
    q = inputs[:, GIVEN.index("q")]
    return sorted(pieces, key=lambda piece: -float(np.std(q[piece])))


def _whole_stretches(time: Array, inputs: Array, measured: Array) -> tuple[slice, ...]:
    """Runs without gaps in the inputs, in pieces of equal length of at most the longest; those with most pitching."""
    interval = float(np.median(np.diff(time)))
    present = np.flatnonzero(np.isfinite(inputs).all(axis=1))
    if present.size < 2:
        return ()
    breaks = np.flatnonzero(np.diff(time[present]) > STRETCHES.gap * interval) + 1
    seen = np.isfinite(measured[:, [OBSERVED.index("V"), OBSERVED.index("alpha")]])
    pieces: list[slice] = []
    for run in np.split(present, breaks):
        length = float(time[run[-1]] - time[run[0]])
        count = max(1, int(np.ceil(length / STRETCHES.longest - 1e-9)))
        for part in np.array_split(run, count):
            piece = slice(int(part[0]), int(part[-1]) + 1)
            long_enough = float(time[part[-1]] - time[part[0]]) >= STRETCHES.shortest and part.size >= STRETCHES.fewest
            if long_enough and seen[piece].sum(axis=0).min() >= STRETCHES.fewest_seen:
                pieces.append(piece)
    total = 0
    used: list[slice] = []
    for piece in most_excited(inputs, pieces):
        if total == 0 or total + piece.stop - piece.start <= STRETCHES.most_samples:
            used.append(piece)
            total += piece.stop - piece.start
    return tuple(sorted(used, key=lambda piece: piece.start))


def first_states(recording: Recording) -> tuple[Array, ...]:
    """Start value of the path's initial state (4,) of each stretch, from its first samples."""
    return tuple(_first_state(recording, stretch) for stretch in recording.stretches)


def _first_state(recording: Recording, stretch: slice) -> Array:
    speed, alpha, theta, h, a_x, q, beta = (
        first_mean(recording.channel(name)[stretch], STRETCHES.first) for name in (*OBSERVED, "a_x", "q", "beta")
    )
    alpha += q * recording.positions.get("alpha", (0.0, 0.0, 0.0))[0] / speed
    if not np.isfinite(theta):
        theta = steady_pitch(a_x)
    plane = speed * np.cos(beta)
    motion = {"u": plane * np.cos(alpha), "w": plane * np.sin(alpha), "theta": theta}
    return np.array([motion.get(name, h if np.isfinite(h) else 0.0) for name in STATES])
