"""Settings of what is read from recordings and of the checks of a log by itself; chosen, where no data set is named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

PLAUSIBLE = MappingProxyType({"alpha": 1.0, "beta": 1.0, "theta": 1.6, "phi": 3.2})
"""rad, by channel: angles that no aircraft exceeds in normal flight, with a tenth for the sensor."""


@dataclass(frozen=True)
class ReadingSettings:
    """Settings of how columns of a file become channels on one time base.

    Attributes
    ----------
    fewest_samples : int
        Samples, of a log or of a stretch without a hole, below which nothing is read from it.
    largest : float
        SI, or the file's unit: numbers beyond are refused. No sensor reads more, and squares of what does leave the
        range of doubles.
    uninitialised : float
        The file's unit: smaller numbers that are not zero are missing samples. Recorders leave words such as 1e-304 in
        a channel that has not started; no sensor resolves that little.
    numeric_share : float
        Share, 1, of a row's filled fields that are numbers or clock times from which on it is a row of data: a header
        has next to none, and an avionics row with its names of stations and modes still far more.
    dated : float
        s since 1970: stamps beyond are a date, and time then counts from the recording's first second.
    dated_days : tuple of (float, float)
        s since 1970 of 1990 and 2100, between which a column of stamps of unknown unit is taken for a date.
    unix_clock : float
        s: MAVLink stamps beyond are time since 1970 and none since a start, which lasts no thirty years.
    loose_stamps : float
        s: two stamps of one sample that differ by more, or vary so much, are worth a sentence.
    largest_delay : float
        s between sampling and writing; more is another clock's zero.
    same_rate : float
        Share, 1, by which two rates may differ and be one in a note.
    clocks_apart : float
        Standard errors, 1, of the offset from which on two clocks are said to differ.
    fewest_mapped : int
        Channels of a ready map that a recording must hold before the map is proposed for it.
    fewest_of_stream : int
        Samples of a stream that counts for the recording's span: less is settings and events.
    """

    fewest_samples: int = 10
    largest: float = 1e30
    uninitialised: float = 1e-200
    numeric_share: float = 0.3
    dated: float = 1e8
    dated_days: tuple[float, float] = (631_152_000.0, 4_102_444_800.0)
    unix_clock: float = 1e9
    loose_stamps: float = 1e-3
    largest_delay: float = 1.0
    same_rate: float = 0.02
    clocks_apart: float = 3.0
    fewest_mapped: int = 4
    fewest_of_stream: int = 20


@dataclass(frozen=True)
class QualitySettings:
    """Limits of the checks of a log by itself; each is a sentence of `check`, and only `degrees` stops a loop.

    Attributes
    ----------
    gap : float
        Median intervals, 1, without a sample that are a gap.
    uneven : float
        Range of the intervals over their median, 1, from which sampling is uneven.
    stuck_share, stuck_samples : float, int
        Of the record, 1, and samples without a change, in a channel that otherwise moves; both must be exceeded.
    excited : float
        Standard deviation over noise, 1, below which a channel moves too little for its derivatives.
    wrong_answer : float
        Correlation, 1, of the elevator's with the pitch acceleration's changes above which a sign is wrong. The right
        sign gives -0.4 to -0.85 on doublets and 3-2-1-1 of five simulated aircraft, on which it was found.
    most_radians : mapping of str to float
        rad, by channel, that 99 % of the samples lie within; beyond, the channel is in degrees.
    most_deflection : float
        rad, the same of any control surface.
    banked : float
        rad of bank from which a manoeuvre is not longitudinal alone.
    opposite : float
        Factor, 1, between theta' and q below which their signs are opposite.
    other_unit : tuple of (float, float)
        Factor, 1, between theta' and q below and above which one of them is in degrees: 1/57 and 57 are.
    level_load : tuple of (float, float)
        m/s^2, range of the mean of a_z, about -9.81 in level flight.
    spike : float
        Standard deviations of the noise off both neighbours, and times what the neighbourhood does, 1.
    spike_share : float
        Of the channel's range, 1, that a spike must stand off, so that a peak of fast motion is none.
    saturated_samples : int
        Samples in a row at the channel's own extreme.
    """

    gap: float = 2.5
    uneven: float = 0.02
    stuck_share: float = 0.2
    stuck_samples: int = 20
    excited: float = 3.0
    wrong_answer: float = 0.3
    most_radians: Mapping[str, float] = field(default_factory=lambda: PLAUSIBLE)
    most_deflection: float = 1.2
    banked: float = 0.17453292519943295
    opposite: float = -0.3
    other_unit: tuple[float, float] = (0.05, 20.0)
    level_load: tuple[float, float] = (-25.0, -4.0)
    spike: float = 10.0
    spike_share: float = 0.1
    saturated_samples: int = 5


@dataclass(frozen=True)
class CoursesSettings:
    """When two courses are compared, as theta and the integral of q.

    Attributes
    ----------
    fewest : int
        Samples that a comparison needs.
    agreeing : float
        Correlation, 1, from which on two courses are one.
    window : float
        s over which pitch acceleration and elevator are averaged: long against the noise and short against the answer
        in alpha.
    """

    fewest: int = 20
    agreeing: float = 0.7
    window: float = 0.2


@dataclass(frozen=True)
class DuplicateSettings:
    """When two logs hold the same samples.

    Attributes
    ----------
    fewest : int
        Samples of one file in both spans from which on they overlap: spans that touch share the one at which they do.
    fewest_rows : int
        Distinct rows in both files from which on they hold the same flight: chance makes none of several noisy
        channels.
    fewest_channels : int
        Channels that must move in both for rows to be compared: fewer agree by chance where a recorder is coarse.
    digits : int
        Significant digits that are compared: two maps may bring the same decimals to SI with different roundings.
    """

    fewest: int = 2
    fewest_rows: int = 10
    fewest_channels: int = 3
    digits: int = 9


READING = ReadingSettings()
QUALITY = QualitySettings()
COURSES = CoursesSettings()
DUPLICATES = DuplicateSettings()
