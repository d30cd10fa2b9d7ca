"""Deviations of the controls from trim: standard inputs one after another, or the inputs of a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import LogError, UsageError
from aerosid.flight_model.input_shapes import Multisine
from aerosid.flight_model.simulation import doublet, steps, three_two_one_one
from aerosid.logs.formats import read_log

Array = NDArray[np.float64]
START = 1.0
"""Design: s of trimmed flight before the manoeuvre."""
PAUSE = 4.0
"""Design: s from the end of one control's input to the beginning of the next: a Dutch roll of a light aircraft has
decayed."""
ELEVATOR = "delta_e"


@dataclass(frozen=True)
class Manoeuvre:
    """The controls of a flight.

    Attributes
    ----------
    time : (N,)
        s, evenly spaced, from 0.
    deviations : mapping of str to (N,)
        Control -> its deviation from trim, rad, linear between the samples.
    name : str
        Text for titles.
    """

    time: Array
    deviations: Mapping[str, Array]
    name: str

    @property
    def deviation(self) -> Array:
        """Of the elevator (N,), rad."""
        return self.deviations.get(ELEVATOR, np.zeros(self.time.size))


@dataclass(frozen=True)
class ControlInput:
    """One input: its control, its shape, and its start (s; None: after the preceding one).

    `amplitude` in rad, `unit` in s, as `manoeuvre` takes them.
    """

    control: str
    shape: str
    amplitude: float
    unit: float
    start: float | None = None


def manoeuvre(name: str, amplitude: float, unit: float, duration: float, interval: float) -> Manoeuvre:
    """One of `SHAPES` by the elevator.

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
        Where the name is none of `SHAPES`, or a number is out of range.
    """
    return sequence((ControlInput(ELEVATOR, name, amplitude, unit),), duration, interval)


def sequence(inputs: Sequence[ControlInput], duration: float | None, interval: float) -> Manoeuvre:
    """Inputs one after another; those of one control are added.

    Parameters
    ----------
    inputs : sequence of ControlInput
        At least one.
    duration : float or None
        s; None: `PAUSE` longer than the inputs.
    interval : float
        s.

    Raises
    ------
    UsageError
        Where a shape is none of `SHAPES`, or a number is out of range.
    """
    starts, end = [], START - PAUSE
    for entry in inputs:
        if entry.shape not in SHAPES:
            raise UsageError(f"--input {entry.shape!r} is neither a file nor one of {', '.join(SHAPES)}.")
        starts.append(end + PAUSE if entry.start is None else entry.start)
        end = starts[-1] + _UNITS_LONG.get(entry.shape, 0.0) * entry.unit
    if duration is None:
        duration = (
            max(start + _UNITS_LONG.get(e.shape, 20.0) * e.unit for start, e in zip(starts, inputs, strict=True))
            + PAUSE
        )
    for entry in inputs:
        _check(entry, duration, interval)
    time = interval * np.arange(float(round(duration / interval) + 1))
    deviations: dict[str, Array] = {}
    for entry, start in zip(inputs, starts, strict=True):
        last = start + _UNITS_LONG.get(entry.shape, 4.0) * entry.unit
        if len(inputs) > 1 and last > duration:
            raise UsageError(
                f"--duration {duration:g} s ends before the {entry.shape} of {entry.control} that begins at {start:g} "
                f"s; give at least {last:g} s."
            )
        values = SHAPES[entry.shape](time - (start - START), entry.unit, entry.amplitude)
        deviations[entry.control] = deviations.get(entry.control, np.zeros(time.size)) + values
    names = dict.fromkeys(entry.shape for entry in inputs)
    return Manoeuvre(time, deviations, " ".join(names))


def _check(entry: ControlInput, duration: float, interval: float) -> None:
    """Refuse numbers out of range."""
    unit, amplitude = entry.unit, entry.amplitude
    if entry.start is not None and not 0.0 <= entry.start < 1e4:
        raise UsageError(f"--input begins at {entry.start:g} s; give a time from 0 on.")
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


def recorded(path: Path, interval: float, controls: Sequence[str] = (ELEVATOR,)) -> Manoeuvre:
    """The controls of a log, as deviations from their first samples, at uniform steps of `interval` s.

    Between the samples of the file they are linear.

    Parameters
    ----------
    path : Path
    interval : float
        s.
    controls : sequence of str
        Controls that are flown, as far as the log contains them; it must contain the first where it contains no other.

    Raises
    ------
    LogError
        Where the log cannot be read or contains no complete control.
    """
    log = read_log(path)
    held = [name for name in controls if name in log] or [controls[0]]
    moved = {}
    time = interval * np.arange(float(int((log.time[-1] - log.time[0]) / interval + 1e-6) + 1))
    for name in held:
        values = log[name]
        if not np.isfinite(values).all():
            raise LogError(f"{path}: channel {name} has missing samples, but it is what flies; fill them in.")
        moved[name] = np.interp(time, log.time - log.time[0], values - values[0])
    if time.size < 10:
        raise LogError(f"{path}: {log.time[-1] - log.time[0]:g} s are too few for samples every {interval:g} s.")
    return Manoeuvre(time, moved, path.name)


def _sweep(time: Array, unit: float, amplitude: float) -> Array:
    """A sine whose frequency rises from 1/(20 unit) to 1/(2 unit), whole cycles, back to zero at the end."""
    span = time[-1] - 2.0 * START
    slow, fast = 0.05 / unit, 0.5 / unit
    cycles = max(1.0, np.round(0.5 * (slow + fast) * span))
    fast = 2.0 * cycles / span - slow
    passed = np.clip(time - START, 0.0, span)
    return np.asarray(amplitude * np.sin(2.0 * np.pi * (slow * passed + 0.5 * (fast - slow) * passed**2 / span)))


def _multisine(time: Array, unit: float, amplitude: float) -> Array:
    """Harmonics of the manoeuvre's fundamental up to 1/(2 unit)."""
    span = time[-1] - 2.0 * START
    harmonics = tuple(range(1, max(2, int(0.5 / unit * span)) + 1))
    return Multisine("multisine", span, harmonics).deflection(time, START, amplitude, np.inf)


SHAPES: Mapping[str, Callable[[Array, float, float], Array]] = MappingProxyType(
    {
        "doublet": lambda time, unit, amplitude: doublet(time, START, unit, amplitude),
        "3211": lambda time, unit, amplitude: three_two_one_one(time, START, unit, amplitude),
        "sweep": _sweep,
        "multisine": _multisine,
        "211": lambda time, unit, amplitude: steps(
            time, START, [(2.0 * unit, amplitude), (unit, -amplitude), (unit, amplitude)]
        ),
    }
)
"""Values of --input besides files."""

_UNITS_LONG = {"doublet": 2.0, "3211": 7.0, "211": 4.0}
"""Design: duration in units of time of inputs of finite length; the others last as long as the flight."""
