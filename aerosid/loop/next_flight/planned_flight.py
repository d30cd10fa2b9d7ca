"""Rows of the planned flight: steps, peaks, expected histories, questions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PlannedStep:
    """One level of a planned input: from `start` s, the ramp counted in, for `duration` s; `deflection` rad of
    `surface`.
    """

    start: float
    duration: float
    deflection: float
    surface: str


@dataclass(frozen=True)
class PlannedPeak:
    """Least and greatest expected value of one quantity, and its limits; None where it has none.

    `given`: the limit was given in the aircraft file or the call; otherwise it follows from what was flown.
    """

    name: str
    unit: str
    trim: float
    lowest: float
    highest: float
    limit_low: float | None
    limit_high: float | None
    given: bool


@dataclass(frozen=True)
class PlannedHistory:
    """What one channel is expected to show, SI: by the chosen model, and by the closest alternative where there is one.

    `chosen`, `rival`: (N,) at the times of the input.
    """

    unit: str
    chosen: FloatArray
    rival: FloatArray | None


@dataclass(frozen=True)
class PlannedInput:
    """A control input to be flown, as deflections of surfaces from trim, one surface after the other.

    Attributes
    ----------
    name : str
        Name for the pilot: doublet, 3-2-1-1, multistep, multisine, rudder doublet then aileron 2-1-1.
    steps : tuple of PlannedStep
        Empty for a multisine.
    amplitude, rate : float
        Greatest deflection from trim, rad; greatest rate, rad/s.
    time : ndarray, shape (N,)
        s.
    deflections : mapping of str to ndarray, shape (N,)
        Of each surface that is moved, from trim, rad, linear between samples.
    peaks : tuple of PlannedPeak
        Of the motion that is expected, over all models in question.
    airspeed : float
        m/s, at which it begins, in steady flight.
    density : float
        kg/m^3 there.
    expected : mapping of str to PlannedHistory
        By channel.
    rival : str
        The closest alternative; empty where none is in question.
    """

    name: str
    steps: tuple[PlannedStep, ...]
    amplitude: float
    rate: float
    time: FloatArray
    deflections: Mapping[str, FloatArray]
    peaks: tuple[PlannedPeak, ...]
    airspeed: float
    density: float
    expected: Mapping[str, PlannedHistory]
    rival: str


@dataclass(frozen=True)
class Question:
    """An open question, and the result expected from the planned input.

    Attributes
    ----------
    kind : str
        `alternative`: the chosen effect or another; `derivative`: one that is not significant.
    subject, rival : str
        The chosen effect and the other one; the derivative, and nothing.
    present, expected, needed : float or None
        Of alternatives: by how much -2 ln L favours the chosen one now, the difference that the input is expected to
        bring whichever is true, and the one from which they count as distinguished. Of a derivative: its standard
        deviation now (None: unknown), after the input, and the one at which it is significant.
    probability : float or None
        Of distinguishing the alternatives with one flight, in the worse of the two cases.
    repeats : int or None
        Flights of the planned input that decide it; None where many do not.
    elsewhere : str
        What would answer it where this input does not; else empty.
    """

    kind: str
    subject: str
    rival: str
    present: float | None
    expected: float | None
    needed: float
    probability: float | None
    repeats: int | None
    elsewhere: str


@dataclass(frozen=True)
class NextFlight:
    """The next flight; `input` is None where no input within the limits answers a question, `note` the reason."""

    input: PlannedInput | None
    questions: tuple[Question, ...]
    tried: int
    note: str
