"""Resampling of several streams to one raster: cut at gaps, fast channels low-passed, switches held."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.recording import FloatArray
from aerosid.logs.settings import READING
from aerosid.logs.stamps import StampSettings, hole_notes, holes
from aerosid.nomenclature import CHANNELS, is_surface
from aerosid.signals.resampling import (
    ResamplingSettings,
    filter_delay,
    hold_to,
    interpolate_to,
    low_pass_to,
    median_step,
    nearest_to_samples,
)

# Channels that follow the aircraft's motion: the slowest of these sets the raster.
MOTION = (
    "V", "alpha", "beta", "u", "v", "w", "p", "q", "r", "phi", "theta", "a_x", "a_y", "a_z", "p_dot", "q_dot", "r_dot",
    "quaternion_w", "quaternion_x", "quaternion_y", "quaternion_z",
)  # fmt: skip
_CIRCLE = ("phi", "psi")  # angles that wrap around in flight


@dataclass(frozen=True)
class RasterSettings:
    """Resampling of streams of different rates to one log.

    Attributes
    ----------
    slowest_control : float
        Least rate of a control relative to the raster; below, the steps and ramps that drive the motion are unknown,
        and the log is refused.
    finest : float
        Rate of the raster relative to a channel's up to which the channel is interpolated; beyond, only its samples
        are kept.
    fewest : int
        Least number of samples of a useful segment.
    too_slow : float
        Hz; a recording below does not resolve the short period, which lies between 0.3 and 2 Hz.
    stamps : StampSettings
        Definition of a gap.
    resampling : ResamplingSettings
        The low-pass filter.
    """

    slowest_control: float = 0.5
    finest: float = 2.0
    fewest: int = 10
    too_slow: float = 2.0
    stamps: StampSettings = field(default_factory=StampSettings)
    resampling: ResamplingSettings = field(default_factory=ResamplingSettings)


DEFAULTS = RasterSettings()


@dataclass(frozen=True)
class Track:
    """One channel on its own time stamps.

    Attributes
    ----------
    name : str
        The channel.
    time : ndarray, shape (N,)
        Its stamps on the log's clock, strictly increasing, s.
    values : ndarray, shape (N,)
        In the log's unit; NaN where a sample is missing.
    held : bool
        Whether a sample holds until the next.
    """

    name: str
    time: FloatArray
    values: FloatArray
    held: bool = False

    @property
    def leads(self) -> bool:
        """Whether the channel determines where the record begins, ends and is cut: motion channels and controls do."""
        return not self.held and (self.name in MOTION or is_surface(self.name))


@dataclass(frozen=True)
class Segment:
    """A stretch without a gap.

    Attributes
    ----------
    time : ndarray, shape (K,)
        The raster, s.
    channels : dict of str to ndarray, shape (K,)
        By name; NaN where nothing was measured.
    """

    time: FloatArray
    channels: dict[str, FloatArray]


def onto_one_raster(
    tracks: list[Track],
    drop_outs: tuple[tuple[float, float], ...],
    raster: float | str | None,
    label: str,
    settings: RasterSettings = DEFAULTS,
) -> tuple[list[Segment], list[str]]:
    """The stretches between gaps, each with all channels on one raster, and the processing, a sentence each.

    Parameters
    ----------
    tracks : list of Track
        The channels.
    drop_outs : tuple of (float, float)
        Start and length, s, of losses reported by the recorder itself.
    raster : float, str or None
        Rate, Hz; or the channel whose stamps are used; None: those of the slowest motion channel.
    label : str
        The file, for messages.
    settings : RasterSettings
        Limits.

    Raises
    ------
    LogError
        If channels do not overlap, a control is too slow, or no stretch is long enough.
    """
    leading = [track for track in tracks if track.leads] or tracks
    start, stop = max(track.time[0] for track in leading), min(track.time[-1] for track in leading)
    if not stop > start:
        late, early = max(leading, key=lambda t: t.time[0]), min(leading, key=lambda t: t.time[-1])
        raise LogError(
            f"{label}: channel {late.name} begins at {late.time[0]:.6g} s, after {early.name} ends at "
            f"{early.time[-1]:.6g} s, so that they do not overlap; map channels of one stretch, or align clocks."
        )
    base = _base(leading, raster, label)
    interval = 1.0 / base if isinstance(base, float) else median_step(base.time)
    _refuse_slow_controls(leading, interval, label, settings)
    cuts = _cuts(leading, drop_outs, start, stop, settings)
    segments = []
    for low, high in _between(cuts, start, stop):
        wanted = _instants(base, low, high)
        if wanted.size >= settings.fewest:
            channels = {t.name: _resampled(t, wanted, interval, settings) for t in tracks}
            segments.append(Segment(wanted, channels))
    if not segments:
        source = base.name if isinstance(base, Track) else "the map's raster"
        raise LogError(
            f"{label}: at the {1.0 / interval:.3g} Hz of {source} no stretch of {settings.fewest} samples lies between "
            f"{start:.6g} and {stop:.6g} s and its {len(cuts)} gaps; record longer, or leave that channel out."
        )
    faster = _faster_note(base, leading, settings) if raster is None else []
    notes = [
        *_raster_notes(base, interval, tracks, settings),
        *faster,
        *hole_notes(cuts, len(segments), settings.fewest),
    ]
    return segments, notes


def _base(leading: list[Track], raster: float | str | None, label: str) -> Track | float:
    """The channel whose stamps are the raster, or the rate of the raster."""
    if isinstance(raster, str):
        found = [track for track in leading if track.name == raster]
        if not found:
            held = ", ".join(track.name for track in leading)
            raise LogError(f"{label}: the map's `raster` is {raster!r}, but the log holds {held}; name one of them.")
        return found[0]
    if raster is not None:
        return float(raster)
    motion = [track for track in leading if track.name in MOTION] or leading
    return max(motion, key=lambda track: median_step(track.time))


def _refuse_slow_controls(leading: list[Track], interval: float, label: str, settings: RasterSettings) -> None:
    for track in leading:
        rate, wanted = 1.0 / median_step(track.time), 1.0 / interval
        if is_surface(track.name) and rate < 0.999 * settings.slowest_control * wanted:
            raise LogError(
                f"{label}: control {track.name} is sampled at {rate:.3g} Hz and the motion at {wanted:.3g} Hz, but a "
                f"control needs at least {settings.slowest_control:g} of the motion's rate, because what moves between "
                f"its samples is not known; record it faster, or set `raster = {rate:.3g}` in the map."
            )


def _cuts(
    leading: list[Track],
    drop_outs: tuple[tuple[float, float], ...],
    start: float,
    stop: float,
    settings: RasterSettings,
) -> list[tuple[float, float]]:
    """All gaps within start..stop, overlapping ones merged."""
    found = [tuple(row) for track in leading for row in holes(track.time, settings.stamps).tolist()]
    found += [(at, at + length) for at, length in drop_outs if length > 0.0]
    merged: list[tuple[float, float]] = []
    for low, high in sorted((low, high) for low, high in found if high > start and low < stop):
        if merged and low < merged[-1][1]:
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged


def _between(cuts: list[tuple[float, float]], start: float, stop: float) -> list[tuple[float, float]]:
    edges = [start, *(edge for cut in cuts for edge in cut), stop]
    return [(low, high) for low, high in zip(edges[::2], edges[1::2], strict=True) if high > low]


def _instants(base: Track | float, low: float, high: float) -> FloatArray:
    if isinstance(base, Track):
        return base.time[(base.time >= low) & (base.time <= high)]
    first, last = int(np.ceil(low * base - 1e-6)), int(np.floor(high * base + 1e-6))
    return np.arange(first, last + 1) / base


def _resampled(track: Track, wanted: FloatArray, interval: float, settings: RasterSettings) -> FloatArray:
    """A channel at the raster's instants, stretch by stretch between its own gaps; shape (K,)."""
    if track.held:
        there = np.isfinite(track.values)
        return hold_to(track.time[there], track.values[there], wanted)
    own = np.searchsorted(track.time, wanted)
    if own[-1] < track.time.size and np.array_equal(track.time[own], wanted):
        return track.values[own]
    there = np.isfinite(track.values)
    time, values = track.time[there], track.values[there]
    found = np.full(wanted.size, np.nan)
    if time.size < 2:
        return found
    cuts = holes(time, settings.stamps)
    edges = [time[0], *cuts.ravel(), time[-1]]
    circle = _turn(track.name, values)
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        here, at = (time >= low) & (time <= high), (wanted >= low) & (wanted <= high)
        if np.count_nonzero(here) > 1 and at.any():
            samples = values[here] if circle is None else np.unwrap(values[here], period=circle)
            found[at] = _stretch(track.name, time[here], samples, wanted[at], interval, settings)
    if circle is not None:
        low = 0.0 if np.min(values) >= 0.0 else -0.5 * circle
        found = (found - low) % circle + low
    return found


def _turn(name: str, values: FloatArray) -> float | None:
    """A full turn in rad for an angle that jumps by nearly one, else None."""
    jumps = bool(np.any(np.abs(np.diff(values)) > np.pi))
    return 2.0 * np.pi if name in _CIRCLE and jumps else None


def _stretch(
    name: str, time: FloatArray, values: FloatArray, wanted: FloatArray, interval: float, settings: RasterSettings
) -> FloatArray:
    step = median_step(time)
    if _falls(step, interval, settings) and time.size > 3:
        return low_pass_to(time, values, wanted, interval, settings.resampling)
    if _rises_too_far(step, interval, settings) and not _drives(name):
        return nearest_to_samples(time, values, wanted)
    return interpolate_to(time, values, wanted, settings.stamps.hole * step)


def _falls(step: float, interval: float, settings: RasterSettings) -> bool:
    return interval > settings.resampling.same_rate * step


def _rises_too_far(step: float, interval: float, settings: RasterSettings) -> bool:
    return step > settings.finest * interval * 1.001


def _drives(name: str) -> bool:
    """Whether the channel is a slow quantity that the equations need at every instant: mass, density, thrust."""
    return name in CHANNELS and CHANNELS[name].kind == "input"


def _raster_notes(base: Track | float, interval: float, tracks: list[Track], settings: RasterSettings) -> list[str]:
    rate = 1.0 / interval
    source = f"the stamps of {base.name}" if isinstance(base, Track) else "as set in the map"
    same = isinstance(base, Track) and all(
        track.time.size == base.time.size and np.array_equal(track.time, base.time) for track in tracks
    )
    notes = [] if same else [f"raster: {rate:.4g} Hz, {source}"]
    if rate < settings.too_slow:
        notes.append(
            f"sampled at {rate:.3g} Hz: too slow for an aircraft's motion, which needs {settings.too_slow:g} Hz"
        )
    for track in () if same else tracks:
        note = _resampling_note(track, base, interval, settings)
        if note:
            notes.append(f"{track.name}: {note}")
    return notes


def _faster_note(base: Track | float, leading: list[Track], settings: RasterSettings) -> list[str]:
    """A note on how to keep the other channels' rate where one slow motion channel limits them all."""
    motion = [track for track in leading if track.name in MOTION and track is not base]
    if not (isinstance(base, Track) and motion):
        return []
    slowest, following = 1.0 / median_step(base.time), min(1.0 / median_step(track.time) for track in motion)
    if following < settings.finest * slowest:
        return []
    return [f"{base.name} alone is this slow: `raster = {following:.2g}`, the next rate, keeps higher frequencies"]


def _resampling_note(track: Track, base: Track | float, interval: float, settings: RasterSettings) -> str:
    if isinstance(base, Track) and (track is base or np.array_equal(track.time, base.time)):
        return ""
    if track.held:
        return "held from each sample to the next"
    step = median_step(track.time)
    rates = f"from {1.0 / step:.4g} to {1.0 / interval:.4g} Hz"
    if _falls(step, interval, settings):
        edge = settings.resampling.passed / interval
        delay = filter_delay(interval, settings.resampling)
        return (
            f"low-passed above {edge:.3g} Hz and resampled {rates}; the filter's delay of {delay:.2g} s is "
            "compensated, near the ends the filter attenuates less"
        )
    if _rises_too_far(step, interval, settings):
        if _drives(track.name):
            return f"interpolated {rates} as a slow quantity"
        return f"{1.0 / step:.3g} Hz: kept at the instants nearest its own samples, missing between"
    if abs(step - interval) < READING.same_rate * interval:
        return "interpolated between its own samples, of the same rate"
    return f"interpolated {rates}"
