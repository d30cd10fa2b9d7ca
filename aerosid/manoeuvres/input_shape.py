"""Input design recognition: from a surface's deflection to its lobes, and from their widths to doublet, 3-2-1-1 ..."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from aerosid.manoeuvres.record import FloatArray, runs
from aerosid.manoeuvres.settings import FinderSettings

__all__ = ["InputShape", "Lobe", "goes_one_way", "half_cycles", "input_lobes", "input_shape"]


class Lobe(NamedTuple):
    """A pulse of one sign: first and last sample, and its mean deflection, rad."""

    first: int
    last: int
    level: float


@dataclass(frozen=True)
class InputShape:
    """What an input looks like.

    Attributes
    ----------
    name : str
        doublet, 211, 3211, sweep, multisine, steps, pulse, or hand: none of them.
    lobes : tuple of Lobe
    widths : tuple of float
        Of the lobes, s.
    amplitude : float
        rad.
    square : float
        Share of the time within the lobes beyond 0.6 of each lobe's largest deflection.
    held : float
        Share of the time within the lobes within a fifth of each lobe's median: 1 for steps, less for the hand.
    """

    name: str
    lobes: tuple[Lobe, ...]
    widths: tuple[float, ...]
    amplitude: float
    square: float
    held: float


_PATTERNS: dict[str, tuple[tuple[int, ...], ...]] = {
    "doublet": ((1, 1), (1, 1, 1, 1)),
    "211": ((2, 1, 1),),
    "3211": ((3, 2, 1, 1), (2, 1, 1, 1)),
}
"""Standard: widths in units of the shortest; two doublets in a row stay doublets, 2-1-1-1 is a 3-2-1-1 that starts
shorter."""


def input_lobes(deviation: FloatArray, interval: float, unit: float, settings: FinderSettings) -> tuple[Lobe, ...]:
    """The pulses of a deflection from trim, (N,) rad; `unit` is V/g, s."""
    amplitude = float(np.max(np.abs(deviation)))
    if amplitude == 0.0:
        return ()
    join = settings.lobe_join * unit / interval
    lobes: list[tuple[int, int, float]] = []
    level = settings.lobe_level * amplitude
    for sign in (1.0, -1.0):
        joined: list[list[int]] = []
        for first, last in runs(sign * deviation > level):
            # Between two of one sign there may be one of the other, shorter than what is bridged.
            near = joined and first - joined[-1][1] <= join
            if near and float(np.min(sign * deviation[joined[-1][1] : first])) > -level:
                joined[-1][1] = last
            else:
                joined.append([first, last])
        lobes += [(first, last, float(np.mean(deviation[first : last + 1]))) for first, last in joined]
    if not lobes:
        return ()
    # What is far narrower than the rest is an overshoot, or where the levels before and after were joined.
    typical = float(np.median([last - first + 1 for first, last, _ in lobes]))
    return tuple(Lobe(*lobe) for lobe in sorted(lobes) if lobe[1] - lobe[0] + 1 >= settings.narrow * typical)


def input_shape(deviation: FloatArray, interval: float, unit: float, settings: FinderSettings) -> InputShape:
    """The shape of an input.

    Parameters
    ----------
    deviation : ndarray, shape (N,)
        Deflection from trim, rad.
    interval : float
        s.
    unit : float
        V/g, s.
    """
    lobes = input_lobes(deviation, interval, unit, settings)
    widths = tuple((lobe.last - lobe.first + 1) * interval for lobe in lobes)
    amplitude = float(np.max(np.abs(deviation), initial=0.0))
    square = _squareness(deviation, lobes)
    halves = half_cycles(deviation, settings)
    name = _named(lobes, halves, widths, square, unit / interval, settings)
    return InputShape(name, lobes, widths, amplitude, square, _held(deviation, lobes))


def half_cycles(deviation: FloatArray, settings: FinderSettings) -> list[int]:
    """Samples from each change of sign to the next, of deviations of some size."""
    beyond = np.flatnonzero(np.abs(deviation) > settings.half_cycle * float(np.max(np.abs(deviation), initial=0.0)))
    signs = np.sign(deviation[beyond])
    changes = np.flatnonzero(signs[1:] != signs[:-1])
    edges = [beyond[0], *(0.5 * (beyond[changes] + beyond[changes + 1])), beyond[-1]] if beyond.size else [0]
    return [int(after - before) for before, after in pairwise(edges)]


def _named(
    lobes: Sequence[Lobe],
    halves: Sequence[int],
    widths: Sequence[float],
    square: float,
    unit: float,
    settings: FinderSettings,
) -> str:
    """The name of a shape; `unit` is V/g in samples."""
    if not lobes:
        return "hand"
    if len(lobes) == 1:
        return "pulse"
    signs = np.sign([lobe.level for lobe in lobes])
    alternating = bool(np.all(signs[1:] != signs[:-1]))
    levels = np.abs([lobe.level for lobe in lobes])
    even = float(levels.min()) >= settings.like_level * float(levels.max())
    shortest = min(lobe.last - lobe.first + 1 for lobe in lobes)
    pauses = [after.first - before.last - 1 for before, after in pairwise(lobes)]
    if len(halves) >= 2.0 * settings.sweep_cycles:
        return "sweep" if _order(halves) >= settings.sweep_order else "multisine"
    contiguous = alternating and max(pauses) <= settings.pause * max(shortest, 2)
    if contiguous and even and shortest <= settings.longest_unit * unit and square >= settings.square:
        misfit, name = min(
            (_misfit(widths, pattern), name) for name, patterns in _PATTERNS.items() for pattern in patterns
        )
        if misfit <= np.log(settings.width_factor):
            return name
    return "steps" if square >= settings.square else "hand"


def goes_one_way(deviation: FloatArray, settings: FinderSettings) -> bool:
    """Whether an input is a frequency sweep: enough half cycles, and their lengths go one way."""
    halves = half_cycles(deviation, settings)
    return len(halves) >= 2.0 * settings.sweep_cycles and _order(halves) >= settings.sweep_order


def _order(halves: Sequence[int]) -> float:
    """Rank correlation of half periods with time; the first and last are cut where the input begins and ends."""
    from scipy.stats import spearmanr  # late: few inputs have the half cycles of a sweep

    inner = halves[1:-1]
    return abs(float(spearmanr(np.arange(len(inner)), inner).statistic))


def _misfit(widths: Sequence[float], pattern: Sequence[int]) -> float:
    """Largest logarithm by which a width is off its pattern, the unit fitted; infinite where the numbers differ."""
    if len(widths) != len(pattern):
        return float("inf")
    ratio = np.log(np.asarray(widths) / np.asarray(pattern, dtype=np.float64))
    return float(0.5 * np.ptp(ratio))


def _squareness(deviation: FloatArray, lobes: Sequence[Lobe]) -> float:
    beyond = total = 0
    for lobe in lobes:
        part = np.abs(deviation[lobe.first : lobe.last + 1])
        beyond += int(np.count_nonzero(part > 0.6 * part.max()))
        total += part.size
    return beyond / total if total else 0.0


def _held(deviation: FloatArray, lobes: Sequence[Lobe]) -> float:
    near = total = 0
    for lobe in lobes:
        part = np.abs(deviation[lobe.first : lobe.last + 1])
        level = float(np.median(part))
        near += int(np.count_nonzero(np.abs(part - level) <= 0.2 * level))
        total += part.size
    return near / total if total else 0.0
