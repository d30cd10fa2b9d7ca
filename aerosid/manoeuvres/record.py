"""Resampling of a flight log to one even raster between holes, with the signals that every detector needs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from aerosid.flight_model.constants import GRAVITY
from aerosid.logs.flight_log import FlightLog
from aerosid.manoeuvres.settings import FinderSettings
from aerosid.nomenclature import is_surface
from aerosid.signals.noise import estimate_noise
from aerosid.signals.resampling import without_gaps

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

__all__ = ["FlightRecord", "Surface", "flight_records", "longest_run", "runs"]

_NEEDED = ("V", "q")
_FEWEST = 10
"""Numerical: samples of a channel from which on it counts as recorded."""

_MOST_SAMPLES = 2_000_000
"""Numerical: samples of a resampled stretch at most; it bounds the memory."""


@dataclass(frozen=True)
class Surface:
    """A control surface over one record.

    Attributes
    ----------
    name : str
        Its channel.
    deflection : ndarray, shape (N,)
        rad.
    travel : ndarray, shape (N,)
        Largest minus least deflection in a window of one short period about each sample, rad.
    largest : float
        Its 99.95 % quantile over the whole flight in the air, rad.
    rest : float
        rad; travel below it is rest.
    """

    name: str
    deflection: FloatArray
    travel: FloatArray
    largest: float
    rest: float

    @property
    def still(self) -> BoolArray:
        """Where the surface is at rest, (N,)."""
        return self.travel <= self.rest


@dataclass(frozen=True)
class FlightRecord:
    """One stretch without holes, on an even raster.

    Attributes
    ----------
    time : ndarray, shape (N,)
        s, the log's own clock.
    interval : float
        s.
    channels : mapping of str to ndarray, shape (N,)
        SI; only those without a long hole of their own.
    airborne : ndarray of bool, shape (N,)
    unit : ndarray, shape (N,)
        V/g, s: the time in which everything that a wing does happens.
    surfaces : mapping of str to Surface
    speed_of_flight : float
        Median airspeed in the air, m/s.
    """

    time: FloatArray
    interval: float
    channels: Mapping[str, FloatArray]
    airborne: BoolArray
    unit: FloatArray
    surfaces: Mapping[str, Surface]
    speed_of_flight: float

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __getitem__(self, name: str) -> FloatArray:
        """Channel `name`, (N,)."""
        return self.channels[name]

    def get(self, name: str) -> FloatArray:
        """Channel `name`, (N,), or zeros where it is not recorded."""
        return self.channels.get(name, np.zeros(self.time.size))

    def samples(self, units: float, at: int | None = None) -> int:
        """How many samples `units` V/g are, at a sample or at the flight's speed: at least 1."""
        scale = self.speed_of_flight / GRAVITY if at is None else float(self.unit[at])
        return max(1, round(units * scale / self.interval))

    def averaged(self, values: FloatArray, units: float) -> FloatArray:
        """Running mean over `units` V/g, (N,)."""
        smooth: FloatArray = uniform_filter1d(values, min(self.samples(units), values.size), mode="nearest")
        return smooth

    @property
    def pitch(self) -> FloatArray:
        """Q V/g less that of the turn, (N,): the load factor's share of a curved path."""
        turning = self.get("r") * np.tan(np.clip(self.get("phi"), -1.2, 1.2))
        return (self["q"] - turning) * self.unit

    @property
    def roll(self) -> FloatArray:
        """P V/g, (N,), rad."""
        return self.get("p") * self.unit

    @property
    def yaw(self) -> FloatArray:
        """R V/g less sin(phi), that of a level turn, (N,), rad."""
        return self.get("r") * self.unit - np.sin(self.get("phi"))

    @property
    def load_factor(self) -> FloatArray:
        """-a_z/g, or 1 + q V/g where it is not recorded, (N,)."""
        return -self["a_z"] / GRAVITY if "a_z" in self else 1.0 + self.pitch


def runs(mask: BoolArray) -> Iterator[tuple[int, int]]:
    """First and last index of every run of True."""
    edges = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    yield from zip(np.flatnonzero(edges == 1).tolist(), (np.flatnonzero(edges == -1) - 1).tolist(), strict=True)


def longest_run(mask: BoolArray) -> int:
    """Samples of the longest run of True."""
    return max((last - first + 1 for first, last in runs(mask)), default=0)


def lacking(log: FlightLog) -> tuple[str, ...]:
    """The channels without which nothing is sought and that a log does not hold."""
    return tuple(name for name in _NEEDED if name not in log or np.count_nonzero(np.isfinite(log[name])) < _FEWEST)


def flight_records(log: FlightLog, settings: FinderSettings) -> tuple[FlightRecord, ...]:
    """The stretches of a log between its holes; none where no airspeed or pitch rate is recorded."""
    if lacking(log):
        return ()
    airborne = _airborne(log, settings)
    if not airborne.any():
        return ()
    speed = float(np.median(log["V"][airborne & np.isfinite(log["V"])]))
    interval = max(log.interval, settings.finest_raster * speed / GRAVITY)
    cuts = np.flatnonzero(np.diff(log.time) > settings.hole * log.interval)
    bounds = [0, *(cuts + 1).tolist(), log.samples]
    pieces = []
    for first, stop in pairwise(bounds):
        count = int((log.time[stop - 1] - log.time[first]) / interval) + 1
        if count >= 20 and count <= _MOST_SAMPLES:
            pieces.append(_resampled(log, slice(first, stop), interval, airborne, settings))
    window = max(1, round(settings.still_window * speed / GRAVITY / interval))
    scales = _surface_scales(log, pieces, window, speed / GRAVITY, settings)
    return tuple(_record(time, channels, air, interval, speed, window, scales) for time, channels, air in pieces)


_Piece = tuple[FloatArray, dict[str, FloatArray], BoolArray]


def _airborne(log: FlightLog, settings: FinderSettings) -> BoolArray:
    """Where the log flies: above the ground on which it stood, fast enough to carry itself."""
    speed = _up_to_holes(log.time, log["V"], settings)
    known = np.isfinite(speed)
    if "h_agl" in log and np.isfinite(log["h_agl"]).any():
        return known & (np.nan_to_num(_up_to_holes(log.time, log["h_agl"], settings)) > settings.clear_of_ground)
    flying = known & (speed > settings.flying_share * float(np.nanpercentile(speed, 95.0)))
    if "h" not in log or not flying.any():
        return flying
    first, last = int(np.flatnonzero(flying)[0]), int(np.flatnonzero(flying)[-1])
    index = np.arange(log.samples)
    height = _up_to_holes(log.time, log["h"], settings)
    # Before its first airspeed a recorder stands: the air data computer starts, or its pitot has no pressure yet.
    stood = np.isfinite(height) & (np.nan_to_num(speed) < settings.standing)
    ground = np.full(log.samples, -np.inf)
    at = np.flatnonzero(stood)
    if at.size:
        # Fields differ in elevation: the one where it stood last before, and the one where it stands next.
        before = at[np.clip(np.searchsorted(at, index, side="right") - 1, 0, at.size - 1)]
        after = at[np.clip(np.searchsorted(at, index), 0, at.size - 1)]
        span = settings.climb_out * float(np.median(speed[flying])) / GRAVITY
        near_before = (before <= index) & (log.time - log.time[before] < 10.0 * span)
        near_after = (after >= index) & (log.time[after] - log.time < 10.0 * span)
        ground = np.where(near_before, height[before], ground)
        ground = np.maximum(ground, np.where(near_after, height[after], ground))
    inside = (index >= first) & (index <= last)
    clear: BoolArray = inside & flying & np.isfinite(height) & (height > ground + settings.clear_of_ground)
    return clear


def _up_to_holes(time: FloatArray, values: FloatArray, settings: FinderSettings) -> FloatArray:
    """A channel between its own samples, which may be rarer than the log's, but not across a hole in them; (N,)."""
    at = np.flatnonzero(np.isfinite(values))
    if at.size < 2 or at.size == values.size:
        return values
    steps = np.diff(time[at])
    reach = settings.hole * float(np.median(steps))
    filled = np.interp(time, time[at], values[at])
    filled[(time < time[at[0]] - reach) | (time > time[at[-1]] + reach)] = np.nan
    for k in np.flatnonzero(steps > reach):
        filled[at[k] + 1 : at[k + 1]] = np.nan
    return filled


def _resampled(log: FlightLog, part: slice, interval: float, airborne: BoolArray, settings: FinderSettings) -> _Piece:
    """Every channel that is there throughout, averaged over the raster's interval where the log is finer."""
    time = log.time[part]
    raster = time[0] + interval * np.arange(int((time[-1] - time[0]) / interval + 1e-9) + 1)
    width = max(1, round(interval / float(np.median(np.diff(time)))))
    channels: dict[str, FloatArray] = {}
    for name in log.channels:
        values = _up_to_holes(time, log[name][part], settings)
        present = np.isfinite(values)
        # A channel that is mostly missing says nothing between its samples.
        if (np.count_nonzero(present) < 0.5 * time.size and name not in _NEEDED) or not present.any():
            continue
        filled = without_gaps(time, values)
        channels[name] = np.interp(raster, time, uniform_filter1d(filled, width, mode="nearest"))
    there = np.interp(raster, time, airborne[part].astype(np.float64)) > 0.5
    for name in _NEEDED:
        if name not in channels:
            there[:] = False
            channels[name] = np.zeros(raster.size)
    return raster, channels, there


def travel(values: FloatArray, window: int) -> FloatArray:
    """The range of the samples in the window centred at each, (N,)."""
    span: FloatArray = maximum_filter1d(values, window) - minimum_filter1d(values, window)
    return span


def _surface_scales(
    log: FlightLog, pieces: list[_Piece], window: int, unit: float, settings: FinderSettings
) -> dict[str, tuple[float, float]]:
    """Largest travel and rest of each surface over the whole flight."""
    scales = {}
    for name in log.channels:
        if not is_surface(name) or name in ("delta_f", "delta_h"):
            continue
        recorded = [(channels, air) for _, channels, air in pieces if name in channels and air.any()]
        if not recorded:
            continue
        largest = _largest([travel(channels[name], window)[air] for channels, air in recorded])
        noise = estimate_noise(log.time, log[name])
        rest = settings.rest_share * largest
        rate, lively = _ANSWERS.get(name, ("", ""))
        answers = [np.abs(channels[rate][air]) for channels, air in recorded if rate in channels]
        if answers and (most := _largest(answers) * unit) > 0.0:
            rest = min(rest, settings.rest_answer * getattr(settings, lively) / most * largest)
        scales[name] = largest, min(max(rest, settings.rest_noise * noise), largest)
    return scales


_ANSWERS: dict[str, tuple[str, str]] = {
    "delta_e": ("q", "lively_pitch"),
    "delta_a": ("p", "lively_roll"),
    "delta_r": ("r", "lively_yaw"),
}
"""The rate that a surface makes, and the setting that says from which on it is lively."""


def _largest(parts: list[FloatArray]) -> float:
    """The value that half a sample in a thousand exceeds: spikes are rarer, manoeuvres are not."""
    return float(np.quantile(np.concatenate(parts), 0.9995))


def _record(
    time: FloatArray,
    channels: dict[str, FloatArray],
    air: BoolArray,
    interval: float,
    speed: float,
    window: int,
    scales: Mapping[str, tuple[float, float]],
) -> FlightRecord:
    surfaces = {
        name: Surface(name, channels[name], travel(channels[name], window), *scale)
        for name, scale in scales.items()
        if name in channels
    }
    slow = uniform_filter1d(channels["V"], max(1, round(speed / GRAVITY / interval)), mode="nearest")
    unit = np.maximum(np.where(air, slow, speed), 0.2 * speed) / GRAVITY
    return FlightRecord(time, interval, channels, air, unit, surfaces, speed)
