"""The manoeuvres of a recording: kind, span, movements, condition, turbulence and worth of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from aerosid.aircraft.model import Aircraft
from aerosid.logs.flight_log import FlightLog
from aerosid.manoeuvres.condition import Movement, condition_before, movements, turbulence
from aerosid.manoeuvres.finding import stretches
from aerosid.manoeuvres.found import CONDITIONS, Rejected, Stretch
from aerosid.manoeuvres.information import ExpectedDeviation, expected_deviations
from aerosid.manoeuvres.record import FlightRecord, flight_records, lacking, runs
from aerosid.manoeuvres.settings import FinderSettings

__all__ = ["FlightSegmentation", "FoundManoeuvre", "RejectedStretch", "find_manoeuvres"]


@dataclass(frozen=True)
class FoundManoeuvre:
    """One manoeuvre of a recording.

    Attributes
    ----------
    kind : str
        One of `aerosid.manoeuvres.KINDS`.
    start, stop : float
        s on the recording's own clock: the first sample at which the input (without one, the condition) is seen, and
        the last that belongs to the answer or the condition.
    cut_from, cut_to : float
        The same with the quiet lead-in that an estimate wants: what is to be cut, s.
    surface : str
        What was moved for it; empty for a condition or a free motion.
    moved : tuple of Movement
        All surfaces that moved in it, the one that moved most first.
    condition : mapping of str to float
        Mean of V, h, mach, alpha ... before the input, SI.
    turbulence : float
        Root-mean-square of the fast load factor in the calmest V/g beside it, g; NaN where too little is recorded.
    expected : tuple of ExpectedDeviation
        How well it would determine derivatives; empty for conditions.
    detail : mapping of str to float, str or tuple of float
        What the kind was told by, SI: widths of the pulses, period, damping ratio, bank from and to ...
    """

    kind: str
    start: float
    stop: float
    cut_from: float
    cut_to: float
    surface: str
    moved: tuple[Movement, ...]
    condition: Mapping[str, float]
    turbulence: float
    expected: tuple[ExpectedDeviation, ...] = ()
    detail: Mapping[str, float | str | tuple[float, ...]] = field(default_factory=dict)

    @property
    def is_condition(self) -> bool:
        """Whether it is a trim point or a turn, and no motion."""
        return self.kind in CONDITIONS


@dataclass(frozen=True)
class RejectedStretch:
    """A lively stretch that is no manoeuvre: start and stop, s, what moved, and why it is none."""

    start: float
    stop: float
    surface: str
    reason: str


@dataclass(frozen=True)
class FlightSegmentation:
    """What is in a recording, in order of time; a sequence of its manoeuvres.

    Attributes
    ----------
    log : str
        Name of the log.
    start, stop : float
        First and last time of the recording, s.
    airborne : tuple of (float, float)
        Spans in the air, s.
    holes : tuple of (float, float)
        Start and length of what is missing from the recording, s; nothing is found across.
    manoeuvres : tuple of FoundManoeuvre
    rejected : tuple of RejectedStretch
    lacking : tuple of str
        Channels that the recording does not hold and without which nothing is sought.
    """

    log: str
    start: float
    stop: float
    airborne: tuple[tuple[float, float], ...]
    holes: tuple[tuple[float, float], ...]
    manoeuvres: tuple[FoundManoeuvre, ...]
    rejected: tuple[RejectedStretch, ...]
    lacking: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.manoeuvres)

    def __iter__(self) -> Iterator[FoundManoeuvre]:
        return iter(self.manoeuvres)

    def __getitem__(self, place: int) -> FoundManoeuvre:
        """The manoeuvre at a place, from 0."""
        return self.manoeuvres[place]

    @property
    def dynamic(self) -> tuple[FoundManoeuvre, ...]:
        """The manoeuvres that are motions: no trim points and no turns."""
        return tuple(entry for entry in self.manoeuvres if not entry.is_condition)


USUAL = FinderSettings()


def find_manoeuvres(
    log: FlightLog, aircraft: Aircraft | None = None, settings: FinderSettings = USUAL
) -> FlightSegmentation:
    """The manoeuvres of a recording, from a cut of a few seconds to a whole flight.

    Parameters
    ----------
    log : FlightLog
        V and q at least; with phi, p, r, a_z, theta and h more kinds are told.
    aircraft : Aircraft, optional
        Expected deviations are then those of its coefficients.
    settings : FinderSettings, optional
        What counts as steady, lively, held or free.
    """
    found: list[FoundManoeuvre] = []
    rejected: list[RejectedStretch] = []
    airborne: list[tuple[float, float]] = []
    for record in flight_records(log, settings):
        these, others = stretches(record, settings)
        found += [_described(log, record, stretch, aircraft, settings) for stretch in these]
        rejected += [_why(record, entry) for entry in others]
        airborne += [(float(record.time[first]), float(record.time[last])) for first, last in runs(record.airborne)]
    step = np.diff(log.time)
    cuts = np.flatnonzero(step > settings.hole * log.interval)
    return FlightSegmentation(
        log.name,
        float(log.time[0]),
        float(log.time[-1]),
        tuple(airborne),
        tuple((float(log.time[k]), float(step[k])) for k in cuts),
        tuple(found),
        tuple(rejected),
        lacking(log),
    )


def _described(
    log: FlightLog, record: FlightRecord, stretch: Stretch, aircraft: Aircraft | None, settings: FinderSettings
) -> FoundManoeuvre:
    start, stop = float(record.time[stretch.first]), float(record.time[stretch.last])
    lead = settings.lead_in * float(record.unit[stretch.first])
    condition = stretch.kind in CONDITIONS
    cut_from = start if condition else max(float(record.time[0]), start - lead)
    cut_to = stop if condition else min(float(record.time[-1]), stop + 0.5 * lead)
    rests = {name: surface.rest for name, surface in record.surfaces.items()}
    moved = movements(log, cut_from, start, stop, rests)
    expected: tuple[ExpectedDeviation, ...] = ()
    if stretch.surface and not condition:
        names = _deliberate(record, stretch, settings)
        expected = expected_deviations(log.between(cut_from, cut_to), names, aircraft)
    return FoundManoeuvre(
        stretch.kind,
        start,
        stop,
        cut_from,
        cut_to,
        stretch.surface,
        moved,
        condition_before(log, start, 0.0 if condition else start - cut_from, stop),
        turbulence(record, stretch.first, stretch.last),
        expected,
        dict(stretch.detail),
    )


def _deliberate(record: FlightRecord, stretch: Stretch, settings: FinderSettings) -> tuple[str, ...]:
    """The stretch's surface, and of the same axes those that moved by more than a helping hand."""
    lateral = ("delta_a", "delta_r")
    part = slice(stretch.first, stretch.last + 1)
    others = [
        name
        for name in (lateral if stretch.surface in lateral else ())
        if name in record.surfaces
        and name != stretch.surface
        and float(np.ptp(record.surfaces[name].deflection[part])) > settings.deliberate * record.surfaces[name].largest
    ]
    return (stretch.surface, *others)


def _why(record: FlightRecord, entry: Rejected) -> RejectedStretch:
    last = min(entry.last, record.time.size - 1)
    return RejectedStretch(float(record.time[entry.first]), float(record.time[last]), entry.surface, entry.reason)
