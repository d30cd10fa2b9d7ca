"""Shapes of a control input: steps as a pilot flies them, and a multisine, as deflections from trim.

Steps take the time that the surface's rate allows: a step is a ramp, and one that is too short for its size a triangle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Steps:
    """Levels that are held one after the other.

    Attributes
    ----------
    name : str
        What a pilot calls it.
    durations : tuple of float
        s, of each level, its ramp counted in.
    levels : tuple of float
        Of the amplitude, -1 to 1.
    """

    name: str
    durations: tuple[float, ...]
    levels: tuple[float, ...]

    @property
    def duration(self) -> float:
        """s, until the surface is called back to trim."""
        return sum(self.durations)

    def corners(self, start: float, amplitude: float, rate: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Times [s] and deflections [rad] between which the input is linear.

        Parameters
        ----------
        start : float
            s, when the first step begins.
        amplitude : float
            rad, of level 1.
        rate : float
            rad/s, greatest.
        """
        times, values = [start], [0.0]
        moment = start
        for duration, level in zip((*self.durations, np.inf), (*self.levels, 0.0), strict=True):
            aim, now = level * amplitude, values[-1]
            needed = abs(aim - now) / rate
            if needed > 0.0:
                taken = min(needed, duration)
                times.append(moment + taken)
                values.append(now + (aim - now) * taken / needed)
            moment += duration
            if np.isfinite(moment) and moment > times[-1]:
                times.append(moment)
                values.append(values[-1])
        return np.array(times), np.array(values)

    def deflection(self, time: NDArray[np.float64], start: float, amplitude: float, rate: float) -> NDArray[np.float64]:
        """The input at the samples `time` (N,) s: (N,) rad, zero before `start`."""
        times, values = self.corners(start, amplitude, rate)
        return np.interp(time, times, values)

    def mirrored(self) -> Steps:
        """The same with every level reversed."""
        return replace(self, levels=tuple(-level for level in self.levels))


@dataclass(frozen=True)
class Multisine:
    """Harmonics of one period with equal power, phased for a low peak, from zero to zero.

    Attributes
    ----------
    name : str
        As reported.
    duration : float
        s, one period of the lowest frequency.
    harmonics : tuple of int
        Multiples of 1/duration.

    References
    ----------
    Schroeder, IEEE Trans. Information Theory 16 (1), 1970: phases -pi k (k - 1)/n of n equal harmonics. The period is
    turned to begin at an upward zero of the sum, so that the surface leaves from and returns to trim.
    """

    name: str
    duration: float
    harmonics: tuple[int, ...]

    def deflection(self, time: NDArray[np.float64], start: float, amplitude: float, rate: float) -> NDArray[np.float64]:
        """The input at the samples `time` (N,) s: (N,) rad, its peak `amplitude` or what `rate` [rad/s] allows."""
        fine = np.linspace(0.0, 1.0, 4001)
        wave, slope = self._wave(fine)
        upward = np.flatnonzero((wave[:-1] <= 0.0) & (wave[1:] > 0.0))
        first = int(upward[0])
        # Where the chord between the two samples crosses zero: exact to the square of the step.
        turn = fine[first] - wave[first] * (fine[1] - fine[0]) / (wave[first + 1] - wave[first])
        peak, steepest = float(np.max(np.abs(wave))), float(np.max(np.abs(slope))) / self.duration
        size = float(np.sign(amplitude)) * min(abs(amplitude) / peak, rate / steepest)
        phase = (time - start) / self.duration
        inside = (phase >= 0.0) & (phase <= 1.0)
        return np.asarray(np.where(inside, size * self._wave(phase + turn)[0], 0.0))

    def mirrored(self) -> Multisine:
        """Itself: its levels are symmetric already."""
        return self

    def _wave(self, phase: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The sum and its derivative by the phase, a period being 1."""
        wave, slope = np.zeros_like(phase), np.zeros_like(phase)
        for place, harmonic in enumerate(self.harmonics, start=1):
            shift = -np.pi * place * (place - 1) / len(self.harmonics)
            angle = 2.0 * np.pi * harmonic * phase + shift
            wave += np.cos(angle)
            slope -= 2.0 * np.pi * harmonic * np.sin(angle)
        return wave, slope


InputShape = Steps | Multisine

PATTERNS: tuple[tuple[str, Sequence[float], Sequence[float]], ...] = (
    ("doublet", (1, 1), (1.0, -1.0)),
    ("2-1-1", (2, 1, 1), (1.0, -1.0, 1.0)),
    ("3-2-1-1", (3, 2, 1, 1), (1.0, -1.0, 1.0, -1.0)),
    ("doublets of two sizes", (1, 1, 1, 1), (1.0, -1.0, 0.5, -0.5)),
    ("staircase", (1, 1, 1, 1, 1), (0.5, 1.0, -0.5, -1.0, 0.5)),
)
"""Names, durations in units of the base time, and levels."""


def patterns(base_times: Sequence[float], longest: float) -> tuple[InputShape, ...]:
    """Every pattern with every base time [s], both ways round, and multisines; none longer than `longest` s."""
    shapes: list[InputShape] = []
    for name, durations, levels in PATTERNS:
        for base in base_times:
            steps = Steps(name, tuple(round(count * base, 3) for count in durations), tuple(levels))
            if steps.duration <= longest + 1e-9:
                shapes += [steps, steps.mirrored()]
    for count in (4, 8):
        shapes.append(Multisine("multisine", round(longest, 1), tuple(range(1, count + 1))))
    return tuple(shapes)


def neighbours(shape: InputShape, stretch: float, change: float, longest: float) -> tuple[InputShape, ...]:
    """The shape with one duration or one level moved: durations by the factor `stretch`, levels by `change`.

    Durations are whole tenths of a second, levels whole twentieths within -1 to 1, as a pilot can fly them. A multisine
    has none.
    """
    if isinstance(shape, Multisine):
        return ()
    found: list[InputShape] = []
    for place, duration in enumerate(shape.durations):
        for aim in (duration * stretch, duration / stretch):
            moved = max(round(aim, 1), 0.2)
            durations = (*shape.durations[:place], moved, *shape.durations[place + 1 :])
            if moved != duration and sum(durations) <= longest + 1e-9:
                found.append(Steps("multistep", durations, shape.levels))
    for place, level in enumerate(shape.levels):
        for aim in (level + change, level - change):
            moved = float(np.clip(round(20.0 * aim) / 20.0, -1.0, 1.0))
            levels = (*shape.levels[:place], moved, *shape.levels[place + 1 :])
            if moved != level and max(map(abs, levels)) >= 0.5:
                found.append(Steps("multistep", shape.durations, levels))
    return tuple(found)
