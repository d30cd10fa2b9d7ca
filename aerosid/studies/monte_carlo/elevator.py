"""The controls of a study's simulated flights: a named shape, a sequence of steps, or the inputs of a file."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import UsageError
from aerosid.flight_model.input_shapes import PATTERNS, Steps
from aerosid.flight_model.simulation import doublet, steps, three_two_one_one
from aerosid.studies.jsbsim.control_inputs import SHAPES as OF_ANY_LENGTH
from aerosid.studies.jsbsim.control_inputs import recorded

FloatArray = NDArray[np.float64]
Shape = Callable[[FloatArray, float, float | None], FloatArray]

START = 1.02
"""Design: s of trimmed flight before the input."""

_BASE = 1.0
"""Design: s, unit of the patterns."""

_HALF_PERIOD = 0.5
"""Design: s, half the shortest period of multisine and sweep."""


def _pattern(shape: Steps) -> Shape:
    def flown(time: FloatArray, amplitude: float, unit: float | None) -> FloatArray:
        scaled = Steps(shape.name, tuple(count * (unit or _BASE) for count in shape.durations), shape.levels)
        return _stepwise(scaled, time, amplitude)

    return flown


def _stepwise(shape: Steps, time: FloatArray, amplitude: float) -> FloatArray:
    """Steps whose ramps last one sample, from one end of the range to the other."""
    if START + shape.duration > time[-1]:
        raise UsageError(
            f"--input {shape.name} ends {START + shape.duration:.3g} s after the flight's begin, but the flight at "
            f"{time[-1]:.3g} s; give more --samples, or a shorter --unit."
        )
    interval = float(np.max(np.diff(time)))
    return shape.deflection(time, START, amplitude, 2.0 * abs(amplitude) / interval)


def _of_any_length(name: str) -> Shape:
    return lambda time, amplitude, unit: OF_ANY_LENGTH[name](time, unit or _HALF_PERIOD, amplitude)


SHAPES: Mapping[str, Shape] = {
    "doublet": lambda time, size, unit: doublet(time, START, unit or START, size),
    "3211": lambda time, size, unit: three_two_one_one(time, START, unit or 0.6, size),
    "step": lambda time, size, _unit: steps(time, START, [(float(np.ptp(time)), size)]),
    "pulse": lambda time, size, unit: steps(time, START, [(unit or 0.6, size)]),
    **{
        name.replace(" ", "-"): _pattern(Steps(name, tuple(durations), tuple(levels)))
        for name, durations, levels in PATTERNS
        if name not in ("doublet", "3-2-1-1")
    },
    "multisine": _of_any_length("multisine"),
    "sweep": _of_any_length("sweep"),
}
"""Elevator inputs by name: deflection from trim (N,) rad at samples (N,) s, of a size in rad and with a base time in s;
None: the shape's own."""


@dataclass(frozen=True)
class RecordedInput:
    """An elevator input from a file, as deviation from its first sample.

    Attributes
    ----------
    name : str
        Name of the file.
    interval : float
        s between its samples, uniform.
    deviation : tuple of float
        rad, linear between the samples.
    """

    name: str
    interval: float
    deviation: tuple[float, ...]

    def at(self, time: FloatArray) -> FloatArray:
        """The deflection (N,) rad at samples (N,) s; constant after its end."""
        return np.interp(time, self.interval * np.arange(len(self.deviation)), self.deviation)

    def describe(self) -> dict[str, str]:
        """Name and content, as a JSON object."""
        content = hashlib.sha256(np.array([self.interval, *self.deviation]).tobytes())
        return {"path": self.name, "content": content.hexdigest()}


def read_input(path: Path, interval: float) -> RecordedInput:
    """The elevator of a log or of `next_input.csv`, at uniform steps of `interval` s.

    Raises
    ------
    LogError
        Where the file cannot be read or contains no complete delta_e.
    """
    manoeuvre = recorded(path, interval)
    return RecordedInput(path.name, interval, tuple(manoeuvre.deviation.tolist()))


def deflection(shape: str | RecordedInput, time: FloatArray, amplitude: float, unit: float | None) -> FloatArray:
    """The elevator's deviation from trim (N,), rad, at samples (N,) s.

    Parameters
    ----------
    shape : str or RecordedInput
        One of `SHAPES`, steps as in 0.8@1,0.6@-1 (seconds at a level of the amplitude), or a file's.
    time : ndarray, shape (N,)
    amplitude : float
        rad; a file contains its own.
    unit : float or None
        s: half a doublet, the 1 of a 3211, half the shortest period of sweep and multisine; None: the shape's own.

    Raises
    ------
    UsageError
        Where the shape is unknown, or does not fit into the flight.
    """
    if isinstance(shape, RecordedInput):
        return shape.at(time)
    if shape in SHAPES:
        return SHAPES[shape](time, amplitude, unit)
    if "@" in shape:
        return _stepwise(_steps_of(shape), time, amplitude)
    raise UsageError(
        f"the input {shape!r} of --input or --validate is unknown; give one of {', '.join(SHAPES)}, steps as in "
        "0.8@1,0.6@-1 (seconds at a level), or a log with delta_e."
    )


def in_turn(
    controls: Sequence[str], shape: str | RecordedInput, time: FloatArray, amplitude: float, unit: float | None
) -> dict[str, FloatArray]:
    """The deviation of each control from trim (N,), rad: the shape in successive parts of the flight.

    Parameters
    ----------
    controls : sequence of str
        At least one.
    shape, time, amplitude, unit
        As for `deflection`; a file contains the elevator only.

    Raises
    ------
    UsageError
        As for `deflection`; and where a file is to be flown by other controls than the elevator.
    """
    if isinstance(shape, RecordedInput) and tuple(controls) != ("delta_e",):
        raise UsageError(
            f"--input {shape.name} holds an elevator, but this aircraft is flown by {', '.join(controls)}; give a "
            f"shape that each of them flies in turn, one of {', '.join(SHAPES)}."
        )
    share = time.size // len(controls)
    moved = {}
    for place, control in enumerate(controls):
        moved[control] = np.zeros(time.size)
        own = slice(place * share, (place + 1) * share)
        moved[control][own] = deflection(shape, time[:share], amplitude, unit)
    return moved


def _steps_of(text: str) -> Steps:
    """Steps as text."""
    durations, levels = [], []
    for word in text.split(","):
        try:
            duration, level = (float(number) for number in word.split("@"))
        except ValueError:
            raise UsageError(f"--input has {word!r}; give seconds at a level, as in 0.8@1,0.6@-1.") from None
        if not (0.0 < duration < 1e4 and abs(level) <= 1.0):
            raise UsageError(f"--input has {word!r}; give positive seconds at a level between -1 and 1.")
        durations.append(duration)
        levels.append(level)
    return Steps(text, tuple(durations), tuple(levels))
