"""The elevator's deviation from trim: the usual manoeuvres, or one that a file holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import LogError, UsageError
from aerosid.flight_model.input_shapes import Multisine
from aerosid.flight_model.simulation import doublet, three_two_one_one
from aerosid.logs.formats import read_log

Array = NDArray[np.float64]
START = 1.0
"""s of trimmed flight before the manoeuvre."""


@dataclass(frozen=True)
class Manoeuvre:
    """The elevator of a flight.

    Attributes
    ----------
    time : (N,)
        s, evenly spaced, from 0.
    deviation : (N,)
        From trim, rad, linear between the samples.
    name : str
        For titles.
    """

    time: Array
    deviation: Array
    name: str


def manoeuvre(name: str, amplitude: float, unit: float, duration: float, interval: float) -> Manoeuvre:
    """One of `SHAPES`.

    Parameters
    ----------
    name : str
    amplitude : float
        rad.
    unit : float
        s: the width of a doublet's half, the unit of a 3-2-1-1, half the shortest period of sweep and multisine.
    duration, interval : float
        s.

    Raises
    ------
    UsageError
        Where the name is none of `SHAPES`, or a number makes no manoeuvre.
    """
    if name not in SHAPES:
        raise UsageError(f"--input {name!r} is neither a file nor one of {', '.join(SHAPES)}.")
    for label, number in (("--unit", unit), ("--duration", duration), ("--interval", interval)):
        if not 0.0 < number < 1e4:
            raise UsageError(f"{label} is {number:g} s; give a positive time.")
    if duration < START + 4.0 * unit or duration / interval > 1e6 or interval > unit / 2.0:
        raise UsageError(
            f"--duration {duration:g} s, --unit {unit:g} s and --interval {interval:g} s do not make a manoeuvre; give "
            "several units, each of several samples."
        )
    if not abs(amplitude) < 1.0:
        raise UsageError(f"--amplitude is {amplitude:g} rad; give a deflection in radians, such as 0.03.")
    time = interval * np.arange(float(round(duration / interval) + 1))
    return Manoeuvre(time, SHAPES[name](time, unit, amplitude), name)


def recorded(path: Path, interval: float) -> Manoeuvre:
    """The elevator of a log with delta_e, as deviation from its first sample, on even steps of `interval` s.

    Between the samples of the file it is linear.

    Raises
    ------
    LogError
        Where the log cannot be read or holds no complete delta_e.
    """
    log = read_log(path)
    values = log["delta_e"]
    if not np.isfinite(values).all():
        raise LogError(f"{path}: channel delta_e has missing samples, but it is what flies; fill them in.")
    time = interval * np.arange(float(int((log.time[-1] - log.time[0]) / interval + 1e-6) + 1))
    if time.size < 10:
        raise LogError(f"{path}: {log.time[-1] - log.time[0]:g} s are too few for samples every {interval:g} s.")
    return Manoeuvre(time, np.interp(time, log.time - log.time[0], values - values[0]), path.name)


def _sweep(time: Array, unit: float, amplitude: float) -> Array:
    """A sine whose frequency rises from 1/(20 unit) to 1/(2 unit), whole cycles, back to zero at the end."""
    span = time[-1] - 2.0 * START
    slow, fast = 0.05 / unit, 0.5 / unit
    cycles = max(1.0, np.round(0.5 * (slow + fast) * span))
    fast = 2.0 * cycles / span - slow
    passed = np.clip(time - START, 0.0, span)
    return np.asarray(amplitude * np.sin(2.0 * np.pi * (slow * passed + 0.5 * (fast - slow) * passed**2 / span)))


def _multisine(time: Array, unit: float, amplitude: float) -> Array:
    """Harmonics of the manoeuvre's length up to 1/(2 unit)."""
    span = time[-1] - 2.0 * START
    harmonics = tuple(range(1, max(2, int(0.5 / unit * span)) + 1))
    return Multisine("multisine", span, harmonics).deflection(time, START, amplitude, np.inf)


SHAPES: Mapping[str, Callable[[Array, float, float], Array]] = MappingProxyType(
    {
        "doublet": lambda time, unit, amplitude: doublet(time, START, unit, amplitude),
        "3211": lambda time, unit, amplitude: three_two_one_one(time, START, unit, amplitude),
        "sweep": _sweep,
        "multisine": _multisine,
    }
)
"""What --input names, beside files."""
