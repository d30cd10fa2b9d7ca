"""Segmentation of a whole flight into manoeuvres: every detector over every stretch without holes, overlaps settled."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from aerosid.manoeuvres.conditions import steady_turns, trim_points, turns
from aerosid.manoeuvres.found import Rejected, Stretch
from aerosid.manoeuvres.lateral_tests import aileron_tests, rudder_tests
from aerosid.manoeuvres.longitudinal_tests import (
    STANDARD_SHAPES,
    elevator_pulse_before,
    elevator_tests,
    stall_approaches,
)
from aerosid.manoeuvres.oscillations import phugoids, spirals
from aerosid.manoeuvres.record import BoolArray, FlightRecord
from aerosid.manoeuvres.settings import FinderSettings

__all__ = ["stretches"]


def stretches(record: FlightRecord, settings: FinderSettings) -> tuple[list[Stretch], list[Rejected]]:
    """All manoeuvres of a record in order of time, and the lively stretches that are none, each with its reason."""
    elevator, elevator_rejected = elevator_tests(record, settings)
    rudder, rudder_rejected = rudder_tests(record, settings)
    aileron, aileron_rejected = aileron_tests(record, settings)
    free = _without(phugoids(record, settings) + spirals(record, settings), (*elevator, *rudder, *aileron))
    standard = [stretch for stretch in (*elevator, *rudder, *aileron) if stretch.kind in STANDARD_SHAPES]
    stalls = [stall for stall in stall_approaches(record, settings) if not _set_off(record, stall, standard)]
    # An approach to the stall holds the elevator inputs of its recovery.
    inputs = [stretch for stretch in (*elevator, *rudder, *aileron) if not _within_any(stretch, stalls)]
    pulses = [
        pulse
        for stretch in free
        if stretch.kind == "phugoid" and (pulse := elevator_pulse_before(record, stretch, settings)) is not None
    ]
    # The pulse that set off a phugoid is known by what followed: it replaces what its shape alone was taken for, but
    # for an input of a standard shape, which may set off a phugoid as well.
    pulses = [pulse for pulse in pulses if not _within_any(pulse, standard)]
    inputs = [stretch for stretch in inputs if not _within_any(stretch, pulses)]
    dynamic = _apart(settled([*inputs, *stalls, *free, *pulses]))
    untaken = _free_samples(record, dynamic)
    turning = turns(record, untaken, settings)
    conditions = [*turning, *steady_turns(record, untaken, settings)]
    conditions += trim_points(record, untaken & _free_samples(record, turning), settings)
    rejected = [
        entry
        for entry in (*elevator_rejected, *rudder_rejected, *aileron_rejected)
        if not any(stretch.first <= entry.last and entry.first <= stretch.last for stretch in dynamic)
    ]
    return (
        sorted([*dynamic, *conditions], key=lambda stretch: (stretch.first, -stretch.last)),
        sorted(rejected, key=lambda entry: entry.first),
    )


def _set_off(record: FlightRecord, stall: Stretch, standard: Sequence[Stretch]) -> bool:
    """Whether a deceleration is the answer to an input of standard shape, which goes on or begins in its first half."""
    slowest = stall.first + int(np.argmin(record["V"][stall.first : stall.last + 1]))
    middle = (stall.first + slowest) // 2
    return any(entry.first < middle and entry.last > stall.first for entry in standard)


def settled(found: Sequence[Stretch]) -> list[Stretch]:
    """The finds of which none shares most of its span with a stronger one."""
    kept: list[Stretch] = []
    for stretch in sorted(found, key=lambda entry: entry.strength, reverse=True):
        if all(_shared(stretch, other) < 0.5 for other in kept):
            kept.append(stretch)
    return sorted(kept, key=lambda stretch: stretch.first)


def _shared(one: Stretch, other: Stretch) -> float:
    """The common span over the shorter of the two."""
    common = min(one.last, other.last) - max(one.first, other.first) + 1
    return max(0, common) / max(1, min(one.last - one.first, other.last - other.first) + 1)


def _within_any(stretch: Stretch, others: Iterable[Stretch]) -> bool:
    return any(_shared(stretch, other) >= 0.5 for other in others)


def _without(free: Sequence[Stretch], inputs: Sequence[Stretch]) -> list[Stretch]:
    """Free motions that no input with an answer of its own lies in; two of one time: the longer."""
    kept: list[Stretch] = []
    for stretch in sorted(free, key=lambda entry: entry.first - entry.last):
        if not any(_shared(stretch, other) >= 0.5 for other in (*kept, *inputs)):
            kept.append(stretch)
    return kept


def _apart(found: Sequence[Stretch]) -> list[Stretch]:
    """The finds, each ended where the next one begins: an answer lasts until the next deliberate input."""
    apart: list[Stretch] = []
    for stretch in sorted(found, key=lambda entry: entry.first, reverse=True):
        if not apart:
            apart.append(stretch)
        elif stretch.first < apart[-1].first - 1:
            apart.append(replace(stretch, last=min(stretch.last, apart[-1].first - 1)))
    return apart[::-1]


def _free_samples(record: FlightRecord, taken: Iterable[Stretch]) -> BoolArray:
    free = np.ones(record.time.size, dtype=np.bool_)
    for stretch in taken:
        free[stretch.first : stretch.last + 1] = False
    return free
