"""Free modes with the surfaces at rest: damped-sinusoid fits of phugoid and Dutch roll, and the spiral's slow bank."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from aerosid.manoeuvres.found import Stretch
from aerosid.manoeuvres.record import BoolArray, FlightRecord, FloatArray, runs
from aerosid.manoeuvres.settings import FinderSettings

__all__ = ["DampedOscillation", "fit_damped_oscillation", "phugoids", "spirals"]


class DampedOscillation(NamedTuple):
    """exp(-decay t) oscillation about a straight line.

    Attributes
    ----------
    period : float
        s.
    damping : float
        Damping ratio; negative where it grows.
    amplitude : float
        At its beginning, in the unit of the signal.
    explained : float
        Share of the variance about the straight line that it explains.
    """

    period: float
    damping: float
    amplitude: float
    explained: float


_FREQUENCIES = 40
"""Numerical: periods of the grid that is searched, a factor of a few per cent apart."""

_DECAYS = (-0.15, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
"""Numerical: damping ratios, 1, that are tried."""

_MOST_FITTED = 400
"""Numerical: samples that are fitted at most; more tell nothing new of a mode of a few cycles."""


def fit_damped_oscillation(time: FloatArray, values: FloatArray, periods: tuple[float, float]) -> DampedOscillation:
    """The damped sine about a straight line that fits a record best in least squares.

    Parameters
    ----------
    time : ndarray, shape (N,)
        s.
    values : ndarray, shape (N,)
    periods : (float, float)
        Between which the period is sought, s.

    Notes
    -----
    Linear least squares for the amplitudes on a grid of period and damping (variable projection), so that no start
    value is needed.
    """
    every = max(1, time.size // _MOST_FITTED)
    t, y = time[::every] - time[0], values[::every]
    line = np.column_stack([np.ones_like(t), t])
    about = y - line @ np.linalg.lstsq(line, y, rcond=None)[0]
    total = float(about @ about)
    best = DampedOscillation(periods[0], 0.0, 0.0, 0.0)
    if total <= 0.0:
        return best
    for period in np.geomspace(*periods, _FREQUENCIES):
        omega = 2.0 * math.pi / float(period)
        for damping in _DECAYS:
            envelope = np.exp(-damping * omega * t)
            design = np.column_stack([line, envelope * np.cos(omega * t), envelope * np.sin(omega * t)])
            solution = np.linalg.lstsq(design, y, rcond=None)[0]
            left = y - design @ solution
            explained = 1.0 - float(left @ left) / total
            if explained > best.explained:
                amplitude = float(np.hypot(solution[2], solution[3]))
                best = DampedOscillation(float(period), damping, amplitude, explained)
    return best


def _held(record: FlightRecord, names: tuple[str, ...]) -> BoolArray:
    """Where the named surfaces rest and the aircraft flies, (N,)."""
    held = record.airborne.copy()
    for name in names:
        if name in record.surfaces:
            held &= record.surfaces[name].still
    return held


def phugoids(record: FlightRecord, settings: FinderSettings) -> list[Stretch]:
    """Oscillations of speed with the elevator at rest and the wings about level."""
    if "delta_e" not in record.surfaces:
        return []
    bank = record.averaged(record.get("phi"), 1.0)
    level = np.abs(bank) < settings.turn_bank
    speed = record.averaged(record["V"], 0.05)
    found = []
    for first, last in runs(_held(record, ("delta_e",)) & level):
        unit = float(record.unit[first])
        shortest, longest = (period * unit for period in settings.phugoid_period)
        seconds = (last - first) * record.interval
        if seconds < settings.phugoid_cycles * shortest:
            continue
        part = slice(first, last + 1)
        fit = fit_damped_oscillation(record.time[part], speed[part], (shortest, longest))
        # With less of it than the window is long, a slow change of speed passes for part of an oscillation.
        if (
            fit.explained >= settings.phugoid_fit
            and fit.amplitude >= settings.phugoid_speed * float(np.mean(speed[part]))
            and fit.damping <= settings.phugoid_damping
            and seconds >= settings.phugoid_cycles * fit.period
            and _exchange(record, part) <= settings.phugoid_exchange
        ):
            detail = {"period": fit.period, "damping_ratio": fit.damping, "speed_amplitude": fit.amplitude}
            found.append(Stretch("phugoid", first, last, detail=detail))
    return found


def _exchange(record: FlightRecord, part: slice) -> float:
    """Correlation of airspeed and altitude about straight lines; -1 where altitude is not recorded."""
    if "h" not in record:
        return -1.0
    time = record.time[part]
    line = np.column_stack([np.ones_like(time), time - time[0]])
    both = np.column_stack([record["V"][part], record["h"][part]])
    left = both - line @ np.linalg.lstsq(line, both, rcond=None)[0]
    size = np.linalg.norm(left, axis=0)
    return float(left[:, 0] @ left[:, 1] / (size[0] * size[1])) if size.all() else 0.0


def spirals(record: FlightRecord, settings: FinderSettings) -> list[Stretch]:
    """Stretches in which bank goes its own way, the surfaces at rest.

    Notes
    -----
    An autopilot or a pilot who turns holds bank; who rolls moves the aileron. Bank that drifts slowly by more than a
    steady turn's tolerance with aileron and elevator at rest is held by nobody; whoever
    captures a bank has done so within V/g, which is therefore left out.
    """
    if "phi" not in record or "delta_a" not in record.surfaces:
        return []
    bank = record.averaged(record["phi"], 0.3)
    slow = np.abs(record.averaged(record.roll, 0.5)) < settings.lively_roll
    free = _held(record, ("delta_e", "delta_a")) & slow & (np.abs(bank) > 0.5 * settings.spiral_bank)
    found = []
    for first, last in runs(free):
        part = bank[first : last + 1]
        if (
            last - first + 1 >= record.samples(settings.spiral_least, first)
            and abs(float(np.mean(part))) >= settings.spiral_bank
            and float(np.ptp(part[record.samples(1.0, first) :])) >= settings.spiral_change
            and float(np.ptp(part[part.size // 2 :])) >= 0.3 * settings.spiral_change
        ):
            seconds = (last - first) * record.interval
            rate = np.polyfit(np.linspace(0.0, seconds, part.size), np.log(np.maximum(np.abs(part), 1e-3)), 1)[0]
            detail = {"bank_from": float(part[0]), "bank_to": float(part[-1]), "growth_rate": float(rate)}
            found.append(Stretch("spiral", first, last, detail=detail))
    return found


def count_half_cycles(values: FloatArray, share: float) -> int:
    """Runs of alternating sign that exceed `share` of the largest deviation from the median."""
    about = values - np.median(values)
    limit = share * float(np.max(np.abs(about)))
    signs = np.sign(np.where(np.abs(about) > limit, about, 0.0))
    kept = signs[signs != 0.0]
    return 1 + int(np.count_nonzero(np.diff(kept))) if kept.size else 0


def decayed(record: FlightRecord, values: FloatArray, first: int, last: int, share: float) -> int:
    """The last sample, at most `last`, at which the range over 0.3 V/g exceeds `share` of the largest from `first`."""
    window = record.samples(0.3, first)
    part = values[first : last + 1]
    spread = maximum_filter1d(part, window) - minimum_filter1d(part, window)
    lively = np.flatnonzero(spread > share * float(spread.max()))
    return first + int(lively[-1])


def smooth(values: FloatArray, window: int) -> FloatArray:
    """Running mean, (N,)."""
    mean: FloatArray = uniform_filter1d(values, max(1, window), mode="nearest")
    return mean
