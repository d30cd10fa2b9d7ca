"""Flight condition, movements and turbulence of a stretch of flight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aerosid.logs.flight_log import FlightLog, FloatArray
from aerosid.manoeuvres.record import FlightRecord
from aerosid.nomenclature import CHANNELS

__all__ = ["CONDITION_CHANNELS", "Movement", "condition_before", "movements", "turbulence"]

CONDITION_CHANNELS = ("V", "h", "mach", "alpha", "theta", "phi", "q_bar", "rho", "mass", "delta_f", "thrust")
"""What says at which condition a manoeuvre begins, as far as it is recorded, SI."""


@dataclass(frozen=True)
class TurbulenceSettings:
    """Where and how the air beside a manoeuvre is judged; chosen, found on no recording.

    Attributes
    ----------
    window : float
        V/g; length of one window.
    reach : float
        V/g to either side within which the calmest window is taken.
    least : float
        Share of that window, 1: less beside a manoeuvre says nothing of the air.
    slowest : float
        V/g; slower changes of load factor are flown, faster ones are the air's.
    """

    window: float = 1.0
    reach: float = 5.0
    least: float = 0.25
    slowest: float = 0.25


TURBULENCE = TurbulenceSettings()
"""The settings of every flight."""


@dataclass(frozen=True)
class Movement:
    """What a surface did within a manoeuvre, from its level at the beginning.

    Attributes
    ----------
    channel : str
    least, greatest : float
        Largest deflections to either side, in `unit`.
    unit : str
    """

    channel: str
    least: float
    greatest: float
    unit: str


def condition_before(log: FlightLog, start: float, lead: float, stop: float) -> dict[str, float]:
    """Mean of each recorded quantity over the lead-in, or over the whole where there is none.

    Parameters
    ----------
    log : FlightLog
    start, stop : float
        The manoeuvre, s.
    lead : float
        s before the start over which is averaged; 0: from start to stop.
    """
    low, high = (start - lead, start) if lead > 0.0 else (start, stop)
    within = (log.time >= low) & (log.time <= high)
    found = {}
    for name in CONDITION_CHANNELS:
        if name not in log:
            continue
        present = log[name][within]
        present = present[np.isfinite(present)]
        if present.size:
            found[name] = float(present.mean())
    return found


def movements(
    log: FlightLog, cut_from: float, start: float, stop: float, rests: dict[str, float]
) -> tuple[Movement, ...]:
    """The surfaces that moved by more than their rest, largest first in units of their rest.

    Parameters
    ----------
    log : FlightLog
    cut_from, start, stop : float
        s; from `cut_from` to `start` is the lead-in, whose median is the level that deflections are counted from.
    rests : dict of str to float
        Travel, rad, below which each surface rests.
    """
    within = (log.time >= start) & (log.time <= stop)
    lead = (log.time >= cut_from) & (log.time < start)
    found = []
    for name, rest in rests.items():
        values = log[name][within]
        values = values[np.isfinite(values)]
        if values.size < 3 or float(np.ptp(values)) <= rest:
            continue
        before = log[name][lead]
        before = before[np.isfinite(before)]
        about = values - (float(np.median(before)) if before.size else values[0])
        unit = CHANNELS[name].unit if name in CHANNELS else log.units.get(name, "")
        movement = Movement(name, float(about.min()), float(about.max()), unit)
        found.append((float(np.ptp(values)) / max(rest, 1e-12), movement))
    return tuple(movement for _, movement in sorted(found, key=lambda entry: -entry[0]))


def turbulence(record: FlightRecord, first: int, last: int) -> float:
    """Root-mean-square of the fast part of the load factor in the calmest V/g beside a stretch, g.

    NaN where too little is recorded beside it. Vibration counts as well.
    """
    load = record.load_factor
    fast: FloatArray = load - record.averaged(load, TURBULENCE.slowest)
    reach, window = record.samples(TURBULENCE.reach, first), record.samples(TURBULENCE.window, first)
    sides = (fast[max(0, first - reach) : first], fast[last + 1 : last + 1 + reach])
    values = []
    for side in sides:
        if side.size < TURBULENCE.least * window:
            continue
        squares = np.concatenate([[0.0], np.cumsum(side**2)])
        size = min(window, side.size)
        values.append(float(np.sqrt(np.min(squares[size:] - squares[:-size]) / size)))
    return min(values, default=float("nan"))
