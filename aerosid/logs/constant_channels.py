"""Channels of one value throughout, and those among them whose quantity moved: the instrument is dead."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from aerosid.logs.flight_log import FlightLog, FloatArray
from aerosid.logs.settings import DEAD, QUALITY
from aerosid.logs.standard_atmosphere import GRAVITY
from aerosid.notation import listed, number
from aerosid.signals.running_trapezoids import integral_from_start

_SHOWN_BY = {
    "V": ("a_x", "a_z", "alpha", "theta"),
    "alpha": ("a_z", "q", "V"),
    "p": ("phi",),
    "q": ("theta",),
    "r": ("psi",),
}
"""Channels from whose motion that of another follows."""

_LEVEL = ("phi", "theta", "psi", "a_x")
"""Channels that count as zero where they are absent and not needed."""


@dataclass(frozen=True)
class DeadChannel:
    """A channel of one value throughout whose quantity moved.

    Attributes
    ----------
    name, unit : str
    value, change : float
        The recorded value, and the change that the others show, SI.
    shown_by : tuple of str
        These others.
    """

    name: str
    unit: str
    value: float
    change: float
    shown_by: tuple[str, ...]

    def __str__(self) -> str:
        """What was found, in words."""
        show = "shows" if len(self.shown_by) == 1 else "show"
        return (
            f"{number(self.value, 4)} {self.unit} throughout, while {listed(self.shown_by)} {show} a change of "
            f"{number(self.change, 2)} {self.unit}"
        )


def is_constant(values: FloatArray) -> bool:
    """Whether all samples of a channel that are numbers are the same one."""
    present = values[np.isfinite(values)]
    return present.size > 0 and bool(present.min() == present.max())


def dead_channel(log: FlightLog, name: str) -> DeadChannel | None:
    """The channel where it holds one value and the quantity changed by far more than an instrument resolves.

    None where it moves, where no other channel shows it, or where they show little: over a short manoeuvre a coarse
    airspeed need not change.

    Notes
    -----
    Airspeed and angle of attack are integrated from the specific forces over windows, without the trend that biases of
    the instruments may leave; angular rates are differences of the attitude.
    """
    if name not in _SHOWN_BY or name not in log or not is_constant(log[name]):
        return None
    shown_by = _SHOWN_BY[name]
    if any(other not in log or is_constant(log[other]) for other in shown_by):
        return None
    zero = np.zeros(log.samples)
    c = {other: log.channels.get(other, zero) for other in dict.fromkeys((name, *shown_by, *_LEVEL))}
    if name in ("V", "alpha"):
        rate = _airspeed_rate(c) if name == "V" else _alpha_rate(c)
        windows = _windows(log.time, rate, DEAD.window[name])
        change = max((_range_without_trend(*part, DEAD.largest_trend[name]) for part in windows), default=0.0)
    else:
        change = _range_of_rate(log.time, name, c)
    if change < max(DEAD.least_change[name], DEAD.steps * log.resolution.get(name, 0.0)):
        return None
    value = float(log[name][np.isfinite(log[name])][0])
    return DeadChannel(name, log.units.get(name, ""), value, change, shown_by)


def _airspeed_rate(c: dict[str, FloatArray]) -> FloatArray:
    """The derivative of airspeed, m/s^2, without sideslip."""
    alpha, theta = c["alpha"], c["theta"]
    gravity = GRAVITY * (np.sin(alpha) * np.cos(theta) * np.cos(c["phi"]) - np.cos(alpha) * np.sin(theta))
    rate: FloatArray = c["a_x"] * np.cos(alpha) + c["a_z"] * np.sin(alpha) + gravity
    return rate


def _alpha_rate(c: dict[str, FloatArray]) -> FloatArray:
    """The derivative of the angle of attack, rad/s, without sideslip."""
    rate: FloatArray = c["q"] + (c["a_z"] + GRAVITY * np.cos(c["theta"]) * np.cos(c["phi"])) / c["V"]
    return rate


def _windows(time: FloatArray, values: FloatArray, length: float) -> Iterator[tuple[FloatArray, FloatArray]]:
    """The samples that are numbers in windows of about a length, s, without gaps."""
    present = np.flatnonzero(np.isfinite(values))
    if present.size < DEAD.fewest:
        return
    steps = np.diff(time[present])
    for run in np.split(present, np.flatnonzero(steps > QUALITY.gap * float(np.median(steps))) + 1):
        count = max(1, round(float(time[run[-1]] - time[run[0]]) / length))
        yield from ((time[part], values[part]) for part in np.array_split(run, count) if part.size >= DEAD.fewest)


def _range_without_trend(time: FloatArray, rate: FloatArray, largest: float) -> float:
    """Range of the integral of a rate without its linear trend, of which no more than the largest is removed."""
    path = integral_from_start(time, rate)
    since = time - time.mean()
    slope = float(since @ path) / float(since @ since)
    return float(np.ptp(path - np.clip(slope, -largest, largest) * since))


def _range_of_rate(time: FloatArray, name: str, c: dict[str, FloatArray]) -> float:
    """Range of an angular rate, rad/s, from mean attitudes of adjacent windows."""
    (angle,) = _SHOWN_BY[name]
    present = np.isfinite(c[angle])
    unwrapped = np.full(time.size, np.nan)
    unwrapped[present] = np.unwrap(c[angle][present])
    parts = [(float(t.mean()), float(v.mean())) for t, v in _windows(time, unwrapped, DEAD.window[name])]
    if len(parts) < DEAD.fewest_windows:
        return 0.0
    at, mean = np.array(parts).T
    return float(np.ptp(np.diff(mean) / np.diff(at)))
