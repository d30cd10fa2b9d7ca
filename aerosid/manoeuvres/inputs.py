"""Detection of deliberate control inputs: a lively answer of one axis, and what its surface did for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from aerosid.manoeuvres.input_shape import goes_one_way, half_cycles
from aerosid.manoeuvres.record import FlightRecord, FloatArray, Surface, runs
from aerosid.manoeuvres.settings import FinderSettings

__all__ = ["PITCH", "ROLL", "YAW", "Axis", "Excursion", "excursions"]


class Axis(NamedTuple):
    """One axis of control: its surface, its answer in the record, and the settings for lively and clear answers."""

    surface: str
    answer: str
    lively: str
    clear: str


PITCH = Axis("delta_e", "pitch", "lively_pitch", "clear_answer")
ROLL = Axis("delta_a", "roll", "lively_roll", "clear_roll")
YAW = Axis("delta_r", "yaw", "lively_yaw", "clear_yaw")


@dataclass(frozen=True)
class Excursion:
    """A surface that leaves its level, and the answer of its axis.

    Attributes
    ----------
    axis : Axis
    first, last : int
        First sample at which the surface has left its level before; last before it keeps the level after.
    answer_last : int
        Last sample at which the answer is lively.
    deflection : ndarray, shape (last - first + 1,)
        rad.
    before, after : float
        Its levels before and after, rad.
    nearest : float
        By how much it stays off its level before, over half a lead-in after its largest movement, rad.
    lead_travel : float
        Range of the surface in the lead-in, rad.
    answer : float
        Largest answer, in units of V/g.
    lead_answer : float
        Largest answer in the lead-in.
    """

    axis: Axis
    first: int
    last: int
    answer_last: int
    deflection: FloatArray
    before: float
    after: float
    nearest: float
    lead_travel: float
    answer: float
    lead_answer: float

    @cached_property
    def deviation(self) -> FloatArray:
        """Deflection from the straight line between the levels before and after, rad."""
        return self.deflection - np.linspace(self.before, self.after, self.deflection.size)

    @property
    def amplitude(self) -> float:
        """Largest deviation, rad."""
        return float(np.max(np.abs(self.deviation)))

    @property
    def left_over(self) -> float:
        """How near the surface comes back to its level before, over its largest movement."""
        return self.nearest / max(float(np.max(np.abs(self.deflection - self.before))), 1e-12)


def excursions(record: FlightRecord, axis: Axis, settings: FinderSettings) -> list[Excursion]:
    """Every lively stretch of an axis for which its surface moved."""
    surface = record.surfaces.get(axis.surface)
    if surface is None:
        return []
    answer = np.abs(record.averaged(getattr(record, axis.answer), 0.03))
    lively = (answer > getattr(settings, axis.lively)) & record.airborne
    found: list[Excursion] = []
    for first, last in _stretches(record, surface, list(runs(lively)), settings):
        excursion = _measured(record, surface, axis, answer, first, last, settings)
        if excursion is None:
            continue
        # A lively answer to something else may end where this input begins, and finds its surface too.
        if found and found[-1].first == excursion.first:
            found[-1] = max(found[-1], excursion, key=lambda entry: entry.answer)
        else:
            found.append(excursion)
    return found


def _stretches(
    record: FlightRecord, surface: Surface, lively: list[tuple[int, int]], settings: FinderSettings
) -> list[tuple[int, int]]:
    """Lively runs, joined where the pause is short or the surface is held away from where it was before."""
    joined: list[tuple[int, int]] = []
    for run in lively:
        relation = _relation(record, surface, joined[-1], run, settings) if joined else "apart"
        if relation == "one input":
            joined[-1] = joined[-1][0], run[1]
        elif relation == "apart":
            joined.append(run)
    return joined


def _relation(
    record: FlightRecord, surface: Surface, run: tuple[int, int], following: tuple[int, int], settings: FinderSettings
) -> str:
    """What a lively run is to the one before it: one input, apart, or aside: the air's, while the surface is held."""
    pause = following[0] - run[1]
    if pause > record.samples(settings.longest_hold, run[0]):
        return "apart"
    before = _level_before(record, surface, run[0], settings)
    moved = float(np.abs(surface.deflection[run[0] : run[1] + 1] - before).max())
    # An answer lags its input by up to half the lead-in.
    early = max(run[1], following[0] - record.samples(settings.lead_in, run[0]) // 2)
    moves = float(np.ptp(surface.deflection[early : following[1] + 1]))
    held = abs(float(np.median(surface.deflection[run[1] : following[0] + 1])) - before)
    away = held > settings.lead_share * moved and held > surface.rest
    near = pause <= record.samples(settings.still_window, run[0]) and moved > surface.rest
    # Hands and air make small movements before a test; they are no part of it.
    if not (away or near) or moved < settings.like_level * moves:
        return "apart"
    least = settings.lead_share if near else settings.like_level
    return "one input" if moves >= least * moved else "aside"


def _nearest(away: FloatArray, window: int) -> float:
    """Least largest distance from the level before in a window after the largest movement."""
    after = np.abs(away[int(np.argmax(np.abs(away))) :])
    if after.size <= window:
        return float(after.max(initial=0.0))
    return float(np.lib.stride_tricks.sliding_window_view(after, window).max(axis=1).min())


def _first_moved(record: FlightRecord, surface: Surface, first: int) -> int:
    """Where the surface began to move before an answer: a slow sweep moves long before it is answered."""
    earliest = max(0, first - record.samples(1.0, first))
    half = record.samples(0.15, first)
    rested = np.flatnonzero(surface.still[earliest : first + 1])
    return min(first, earliest + (int(rested[-1]) + half if rested.size else 0))


def _last_moved(surface: Surface, onset: int, last: int, settings: FinderSettings) -> int:
    """Where a sweep ends: at its fast end the aircraft answers less and less, the surface goes on as before."""
    least = settings.like_level * float(surface.travel[onset : last + 1].max())
    rested = np.flatnonzero(surface.travel[last:] <= max(least, surface.rest))
    until = last + int(rested[0]) if rested.size else surface.deflection.size - 1
    longer = surface.deflection[onset : until + 1]
    return until if until > last and goes_one_way(longer - np.median(longer), settings) else last


def _level_before(record: FlightRecord, surface: Surface, first: int, settings: FinderSettings) -> float:
    """The surface's level before the answer: an answer lags its input by up to half the lead-in."""
    lead = max(2, record.samples(settings.lead_in, first))  # of stamps as coarse as the lead-in too
    begin = max(0, first - 2 * lead)
    return float(np.median(surface.deflection[begin : max(begin + 1, first - lead // 2)]))


def _measured(
    record: FlightRecord,
    surface: Surface,
    axis: Axis,
    answer: FloatArray,
    first: int,
    last: int,
    settings: FinderSettings,
) -> Excursion | None:
    """The surface's part in a lively stretch; None where it rested."""
    size = record.time.size
    lead = max(2, record.samples(settings.lead_in, first))  # of stamps as coarse as the lead-in too
    onset = first
    early = _first_moved(record, surface, first)
    whole = surface.deflection[early : last + 1]
    # A sweep begins slower than it is answered; what else moves before an answer was not for it.
    if early < first and len(half_cycles(whole - np.median(whole), settings)) >= 2.0 * settings.sweep_cycles:
        onset = early
    last = _last_moved(surface, onset, last, settings)
    begin, end = max(0, onset - lead), min(size - 1, last + lead // 2)
    before = _level_before(record, surface, onset, settings)
    away = np.abs(surface.deflection[begin : end + 1] - before)
    amplitude = float(away.max())
    if amplitude <= surface.rest:
        return None
    reached = int(np.argmax(away > settings.lobe_level * amplitude))
    rested = np.flatnonzero(away[: reached + 1] <= settings.started * amplitude)
    start = begin + (int(rested[-1]) + 1 if rested.size else 0)
    after = float(np.median(surface.deflection[end : min(size, end + lead)]))
    left = np.abs(surface.deflection[start : end + 1] - after) > settings.started * amplitude
    stop = start + int(np.flatnonzero(left)[-1]) if left.any() else end
    stop = max(stop, start + 1)
    before_it = slice(max(0, start - lead), max(1, start - 1))
    return Excursion(
        axis,
        start,
        min(stop, size - 1),
        last,
        surface.deflection[start : stop + 1],
        before,
        after,
        _nearest(surface.deflection[start : min(size, end + lead)] - before, max(1, lead // 2)),
        float(np.ptp(surface.deflection[before_it])),
        float(answer[first : last + 1].max()),
        float(answer[before_it].max()),
    )
