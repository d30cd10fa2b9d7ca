"""Flying qualities after MIL-F-8785C: levels of short period, phugoid, Dutch roll, roll and spiral.

The specification is an old one and no longer contractual, but every flight-test engineer knows its figures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from aerosid.errors import UsageError

CATEGORIES = ("A", "B", "C")
CLASSES = ("I", "II", "II-C", "III", "IV")

WORSE_THAN_LEVEL_3 = 4
"""Standard: value for a mode beyond the limits of level 3."""


@dataclass(frozen=True)
class Requirement:
    """Category and class of the requirements.

    Attributes
    ----------
    category : {"A", "B", "C"}
        Flight phase: A rapid manoeuvring and precise tracking, B gradual manoeuvres (climb, cruise, descent), C
        take-off and landing. The default is B, which identification flights are nearest to.
    aircraft_class : {"I", "II", "II-C", "III", "IV"}
        I small and light, II medium weight and manoeuvrability (II-C carrier-based), III large and heavy, IV highly
        manoeuvrable. To the short period it matters in category C only, to lateral modes in A and C. The default is
        II.

    Raises
    ------
    UsageError
        Where either is none of these.
    """

    category: str = "B"
    aircraft_class: str = "II"

    def __post_init__(self) -> None:
        for what, given, known in (
            ("flight-phase category", self.category, CATEGORIES),
            ("aircraft class", self.aircraft_class, CLASSES),
        ):
            if given not in known:
                raise UsageError(f"the {what} is {given!r}, expected one of {', '.join(known)}; correct it.")


@dataclass(frozen=True)
class _Limits:
    """Bounds of one level; None where there is none."""

    cap: tuple[float, float | None]
    damping: tuple[float, float | None]
    least_frequency: float = 0.0
    least_n_alpha: float = 0.0


_LIMITS: dict[str, tuple[_Limits, _Limits, _Limits]] = {
    "A": (
        _Limits((0.28, 3.6), (0.35, 1.30), least_frequency=1.0),
        _Limits((0.16, 10.0), (0.25, 2.00), least_frequency=0.6),
        _Limits((0.16, None), (0.15, None)),
    ),
    "B": (
        _Limits((0.085, 3.6), (0.30, 2.00)),
        _Limits((0.038, 10.0), (0.20, 2.00)),
        _Limits((0.038, None), (0.15, None)),
    ),
    "C": (
        _Limits((0.16, 3.6), (0.35, 1.30), 0.87, 2.7),
        _Limits((0.096, 10.0), (0.25, 2.00), 0.6, 1.8),
        _Limits((0.096, None), (0.15, None)),
    ),
}
_HEAVY_IN_C = (_Limits((0.16, 3.6), (0.35, 1.30), 0.7, 2.0), _Limits((0.096, 10.0), (0.25, 2.00), 0.4, 1.0))
"""Levels 1 and 2 of category C for classes II (land-based) and III."""


def control_anticipation(frequency: float, n_alpha: float) -> float:
    """Control anticipation parameter CAP = omega_sp^2/(n/alpha) [1/(g s^2)]: initial pitch acceleration per g.

    `frequency` [rad/s] of the short period, `n_alpha` [g/rad].
    """
    return frequency**2 / n_alpha


def short_period_level(frequency: float, damping: float, n_alpha: float, requirement: Requirement) -> int:
    """Level 1, 2 or 3 of the short period; 4 where it is worse.

    Parameters
    ----------
    frequency : float
        Undamped natural frequency, rad/s.
    damping : float
        Damping ratio.
    n_alpha : float
        Steady load factor over angle of attack at constant airspeed, g/rad.

    Notes
    -----
    MIL-F-8785C, 3.2.2.1.1 (figures 1-3) and 3.2.2.1.2 (table IV). The reduction of the damping of level 3 above
    20,000 ft, which has to be agreed upon, is not made.
    """
    if n_alpha <= 0.0:
        return WORSE_THAN_LEVEL_3
    levels = _LIMITS[requirement.category]
    if requirement.category == "C" and requirement.aircraft_class in ("II", "III"):
        levels = (*_HEAVY_IN_C, levels[2])
    cap = control_anticipation(frequency, n_alpha)
    for level, limits in enumerate(levels, 1):
        within = all(
            low <= number and (high is None or number <= high)
            for number, (low, high) in ((cap, limits.cap), (damping, limits.damping))
        )
        if within and frequency >= limits.least_frequency and n_alpha >= limits.least_n_alpha:
            return level
    return WORSE_THAN_LEVEL_3


def divergence_level(time_to_double: float) -> int:
    """Level 3 of an aperiodic divergence, 4 where it doubles in less than 6 s (MIL-F-8785C, 3.2.1.1)."""
    return 3 if time_to_double >= 6.0 else WORSE_THAN_LEVEL_3


def phugoid_level(damping: float | None, time_to_double: float | None) -> int:
    """Level 1, 2 or 3 of the phugoid; 4 where it is worse.

    Parameters
    ----------
    damping : float or None
        Damping ratio; None where the phugoid is two real roots of opposite sign.
    time_to_double : float or None
        s; None where it decays.

    Notes
    -----
    MIL-F-8785C, 3.2.1.2: a damping ratio of 0.04, of 0, and 55 s to double amplitude.
    """
    if time_to_double is not None:
        return 3 if time_to_double >= 55.0 else WORSE_THAN_LEVEL_3
    return 1 if damping is not None and damping >= 0.04 else 2


@dataclass(frozen=True)
class _DutchRollLimits:
    """The least damping ratio, product of damping ratio and frequency [rad/s] and frequency [rad/s] of one level."""

    damping: float
    product: float
    frequency: float


_NIMBLE: Mapping[str, tuple[str, ...]] = {"A": ("I", "IV"), "B": (), "C": ("I", "II-C", "IV")}
"""Classes that tables VI and VII hold to more than the others, by category."""

_DUTCH_ROLL_1 = {
    "A": {True: _DutchRollLimits(0.19, 0.35, 1.0), False: _DutchRollLimits(0.19, 0.35, 0.4)},
    "B": {False: _DutchRollLimits(0.08, 0.15, 0.4)},
    "C": {True: _DutchRollLimits(0.08, 0.15, 1.0), False: _DutchRollLimits(0.08, 0.10, 0.4)},
}
_DUTCH_ROLL_2, _DUTCH_ROLL_3 = _DutchRollLimits(0.02, 0.05, 0.4), _DutchRollLimits(0.0, 0.0, 0.4)
_INCREMENTS = (0.014, 0.009, 0.005)
"""Standard: MIL-F-8785C, 3.3.1.1; of each level, 1/s, by which the least product of damping and frequency grows with
frequency^2 |phi/beta| above 20."""

_INCREMENTS_FROM = 20.0
"""Standard: MIL-F-8785C, 3.3.1.1; rad^2/s^2."""

_MOST_OF_CLASS_III = 0.7
"""Standard: MIL-F-8785C, 3.3.1.1; the largest damping ratio, 1, required of class III."""

_ROLL = {True: (1.0, 1.4, 10.0), False: (1.4, 3.0, 10.0)}
"""Standard: MIL-F-8785C, table VII; s, longest roll-mode time constants of the levels, of nimble classes and of
others."""

_SPIRAL = {"A": (12.0, 8.0, 4.0), "B": (20.0, 8.0, 4.0), "C": (12.0, 8.0, 4.0)}
"""Standard: MIL-F-8785C, table VIII; s, shortest times to double of the levels."""

_ROLL_SPIRAL = (0.5, 0.3, 0.15)
"""Standard: MIL-F-8785C, 3.3.1.4; rad/s, least products of damping ratio and frequency of the levels."""


def dutch_roll_level(frequency: float, damping: float, phi_to_beta: float, requirement: Requirement) -> int:
    """Level 1, 2 or 3 of the Dutch roll; 4 where it is worse.

    Parameters
    ----------
    frequency : float
        Undamped natural frequency, rad/s.
    damping : float
        Damping ratio.
    phi_to_beta : float
        Amplitude of bank over that of sideslip in the mode.

    Notes
    -----
    MIL-F-8785C, 3.3.1.1 and table VI. The row for air-to-air combat and ground attack, damping 0.4 of class IV, is not
    taken: category A only requires rapid manoeuvres.
    """
    nimble = requirement.aircraft_class in _NIMBLE[requirement.category]
    levels = (_DUTCH_ROLL_1[requirement.category][nimble], _DUTCH_ROLL_2, _DUTCH_ROLL_3)
    excess = max(frequency**2 * phi_to_beta - _INCREMENTS_FROM, 0.0)
    for level, (limits, increment) in enumerate(zip(levels, _INCREMENTS, strict=True), 1):
        if frequency < limits.frequency:
            continue
        required = max(limits.damping, (limits.product + increment * excess) / frequency)
        if requirement.aircraft_class == "III":
            required = min(required, _MOST_OF_CLASS_III)
        if damping >= required:
            return level
    return WORSE_THAN_LEVEL_3


def roll_level(root: float, requirement: Requirement) -> int:
    """Level 1, 2 or 3 of the roll mode, 4 where it is worse; `root` [1/s] is minus one over its time constant.

    Notes
    -----
    MIL-F-8785C, 3.3.1.2 and table VII.
    """
    longest = _ROLL[requirement.aircraft_class in _NIMBLE[requirement.category]]
    constant = -1.0 / root if root < 0.0 else math.inf
    return next((level for level, limit in enumerate(longest, 1) if constant <= limit), WORSE_THAN_LEVEL_3)


def spiral_level(root: float, requirement: Requirement) -> int:
    """Level 1, 2 or 3 of the spiral, 4 where it is worse; `root` [1/s] is ln 2 over its time to double.

    Notes
    -----
    MIL-F-8785C, 3.3.1.3 and table VIII; a spiral that does not grow is of level 1.
    """
    doubling = math.log(2.0) / root if root > 0.0 else math.inf
    shortest = _SPIRAL[requirement.category]
    return next((level for level, limit in enumerate(shortest, 1) if doubling > limit), WORSE_THAN_LEVEL_3)


def roll_spiral_level(frequency: float, damping: float, requirement: Requirement) -> int:
    """Level 1, 2 or 3 of roll and spiral that are coupled in one oscillation; 4 where it is worse.

    Notes
    -----
    MIL-F-8785C, 3.3.1.4: not permitted where more than gentle manoeuvres are flown, taken for all of category A.
    """
    if requirement.category == "A":
        return WORSE_THAN_LEVEL_3
    product = frequency * damping
    return next((level for level, limit in enumerate(_ROLL_SPIRAL, 1) if product >= limit), WORSE_THAN_LEVEL_3)
