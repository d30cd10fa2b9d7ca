"""Settings of reading recordings and of the checks of a single log; chosen, where no data set is named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

PLAUSIBLE = MappingProxyType({"alpha": 1.0, "beta": 1.0, "theta": 1.6, "phi": 3.2})
"""rad, by channel: angles that no aircraft exceeds in normal flight, with a margin of a tenth for the sensor."""


@dataclass(frozen=True)
class ReadingSettings:
    """Settings of the conversion of a file's columns to channels on one time base.

    Attributes
    ----------
    fewest_samples : int
        Least number of samples of a log, or of a stretch without a gap.
    largest : float
        SI, or the file's unit: larger numbers are refused. No sensor reads more, and the squares of larger numbers
        exceed the range of doubles.
    uninitialised : float
        The file's unit: smaller non-zero numbers are missing samples. Recorders leave values such as 1e-304 in a
        channel that has not started; no sensor resolves that little.
    numeric_share : float
        Fraction, 1, of a row's filled fields that are numbers or clock times from which on it is a row of data: a
        header has almost none, and an avionics row with names of stations and modes still far more.
    dated : float
        s since 1970: stamps beyond are a date, and time then counts from the recording's first second.
    dated_days : tuple of (float, float)
        s since 1970 of 1990 and 2100, between which a column of stamps of unknown unit is taken for a date.
    unix_clock : float
        s: MAVLink stamps beyond are time since 1970 and not since a start, which never lasts thirty years.
    loose_stamps : float
        s: difference of two stamps of one sample, or its variation, from which on it is reported.
    largest_delay : float
        s between sampling and writing; a larger difference is due to another zero of the clock.
    same_rate : float
        Fraction, 1, by which two rates may differ and count as equal in a note.
    clocks_apart : float
        Standard errors, 1, of the offset from which on two clocks are reported to differ.
    fewest_mapped : int
        Channels of a ready map that a recording must hold before the map is proposed for it.
    moving_control : float
        Range of a control in a stretch without a gap over its largest range in any, 1, from which on it moves there.
    fewest_of_stream : int
        Samples of a stream that counts for the recording's span: streams with fewer are settings and events.
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
    moving_control: float = 0.2
    fewest_mapped: int = 4
    fewest_of_stream: int = 20


@dataclass(frozen=True)
class QualitySettings:
    """Limits of the checks of a single log; each gives a sentence of `check`, and only `degrees` stops a loop.

    Attributes
    ----------
    gap : float
        Time without a sample, in median intervals, 1, that counts as a gap.
    hole : tuple of (float, float)
        Of a control's own median intervals, 1, and s: time without a sample beyond both of which it is not
        interpolated. A short doublet lasts twice as long. Chosen.
    shortest_interval : float
        s between samples below which the time is in another unit: faster than any recorder of flights. Chosen.
    uneven : float
        Range of the intervals over their median, 1, from which sampling is uneven.
    stuck_share, stuck_samples : float, int
        Fraction of the record, 1, and samples without a change, in a channel that otherwise moves; both must be
        exceeded.
    excited : float
        Standard deviation over noise, 1, below which a channel moves too little for its derivatives.
    wrong_answer : float
        Correlation, 1, of the elevator's and the pitch acceleration's changes above which a sign is wrong. The right
        sign gives -0.4 to -0.85 on doublets and 3-2-1-1 of five simulated aircraft, on which it was found.
    most_radians : mapping of str to float
        rad, by channel, bound of 99 % of the samples; beyond, the channel is in degrees.
    most_deflection : float
        rad, the same of any control surface.
    banked : float
        rad of bank from which a manoeuvre is not purely longitudinal.
    opposite : float
        Factor, 1, between theta' and q below which their signs are opposite.
    other_unit : tuple of (float, float)
        Factor, 1, between theta' and q below and above which one of them is in degrees: 1/57 and 57 are.
    most_other_unit : float
        Factor, 1, from which on it is none of degrees: three times theirs. Chosen.
    level_load : tuple of (float, float)
        m/s^2, range of the mean of a_z, about -9.81 in level flight.
    spike : float
        Distance from both neighbours, in standard deviations of the noise, and over that of the neighbourhood, 1.
    spike_share : float
        Fraction of the channel's range, 1, by which a spike must deviate, so that a peak of fast motion is not one.
    saturated_samples : int
        Consecutive samples at the channel's own extreme.
    """

    gap: float = 2.5
    hole: tuple[float, float] = (5.0, 0.2)
    shortest_interval: float = 1e-4
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
    most_other_unit: float = 170.0
    level_load: tuple[float, float] = (-25.0, -4.0)
    spike: float = 10.0
    spike_share: float = 0.1
    saturated_samples: int = 5


@dataclass(frozen=True)
class DeadSettings:
    """What the other channels must show before a channel of one value counts as dead. Chosen.

    Attributes
    ----------
    least_change : mapping of str to float
        SI, by channel: change of the quantity from which on no instrument holds still, several steps of a coarse one:
        4 knots of airspeed, a degree of flow angle, 3 deg/s of a rate.
    steps : float
        The same in steps of the resolution, 1, where the channel map or the aircraft file declares one.
    window : mapping of str to float
        s, by channel, over which the others are integrated, or averaged where they are differentiated: a longer one
        collects their drifts, a shorter one loses the motion.
    largest_trend : mapping of str to float
        SI, by channel: largest constant error of the integrated rate. That of airspeed, m/s^2, is a bias of 0.1 m/s^2
        of a_x and of a hundredth of theta; a flow angle returns within its window, and any trend is removed.
    fewest : int
        Least number of samples in a window.
    fewest_windows : int
        Least number of averages of which differences are taken.
    """

    least_change: Mapping[str, float] = field(
        default_factory=lambda: {"V": 2.0, "alpha": 0.0175, "p": 0.05, "q": 0.05, "r": 0.05}
    )
    steps: float = 3.0
    window: Mapping[str, float] = field(default_factory=lambda: {"V": 20.0, "alpha": 4.0, "p": 0.5, "q": 0.5, "r": 0.5})
    largest_trend: Mapping[str, float] = field(default_factory=lambda: {"V": 0.2, "alpha": float("inf")})
    fewest: int = 5
    fewest_windows: int = 3


@dataclass(frozen=True)
class CoursesSettings:
    """Comparison of two time histories, such as theta and the integral of q.

    Attributes
    ----------
    fewest : int
        Least number of samples of a comparison.
    agreeing : float
        Correlation, 1, from which on two time histories count as equal.
    window : float
        s over which pitch acceleration and elevator are averaged: long compared with the noise and short compared with
        the response in alpha.
    """

    fewest: int = 20
    agreeing: float = 0.7
    window: float = 0.2


@dataclass(frozen=True)
class DuplicateSettings:
    """Criteria for two logs with the same samples.

    Attributes
    ----------
    fewest : int
        Samples of one file in both spans from which on they overlap: adjacent spans share a single sample.
    fewest_rows : int
        Distinct rows in both files from which on they contain the same flight: equal rows do not occur by chance in
        several noisy channels.
    fewest_channels : int
        Channels that must vary in both for rows to be compared: fewer agree by chance where the resolution is coarse.
    digits : int
        Significant digits that are compared: two maps may convert the same decimals to SI with different rounding.
    """

    fewest: int = 2
    fewest_rows: int = 10
    fewest_channels: int = 3
    digits: int = 9


READING = ReadingSettings()
QUALITY = QualitySettings()
DEAD = DeadSettings()
COURSES = CoursesSettings()
DUPLICATES = DuplicateSettings()
