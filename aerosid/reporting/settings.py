"""Settings of what a report says of numbers in words; none of them decides what is found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RemarkSettings:
    """When a number is worth a sentence; chosen.

    Attributes
    ----------
    worse : float
        Error without an effect over error with it, 1, below which the effect is told to predict worse.
    chance : float
        p-value, 1, of its number from which a named effect is told to be possible by chance.
    above_noise : float
        Times its noise, 1, from which a channel's remaining error is worth a sentence.
    corrected_worse : float
        Times its error as recorded, 1, from which on a corrected channel is told to fit less well.
    steady : float
        Share of its mean, 1, by which a quantity may vary and still be told as one number.
    calm, light, moderate : float
        Root-mean-square load factor of the turbulence, g, up to which air is called so. Light turbulence peaks at about
        0.2 g, four deviations.
    """

    worse: float = 0.98
    chance: float = 0.05
    above_noise: float = 1.5
    corrected_worse: float = 1.02
    steady: float = 0.005
    calm: float = 0.01
    light: float = 0.05
    moderate: float = 0.15


@dataclass(frozen=True)
class SimulatorTestSettings:
    """Which parts of a flight are a test of 14 CFR Part 60, whose text gives no such numbers; chosen.

    Attributes
    ----------
    longest_input : float
        s from the first to the last move of the control; a 3-2-1-1 for a transport takes 7 to 12 s.
    before, free : float
        s before a movement, and of free response after it, that belong to the test; movements closer are one.
    steady_speed : float
        Share of the airspeed, 1, that it may vary by in the test of a brief response.
    move, within : float
        A control moves where it changes by more than this share of its range, 1, within so many s.
    swing : float
        Least standard deviation of the airspeed, share of its mean, 1, of a phugoid that can be measured.
    answer : float
        Times its tolerance, 1, by which a channel must move: a response that is no larger proves nothing.
    fewest : int
        Samples of a record in which a movement, or an oscillation, is looked for.
    fitted : float
        Share of the variance, 1, that an oscillation may leave unexplained and be one.
    """

    longest_input: float = 15.0
    before: float = 1.0
    free: float = 5.0
    steady_speed: float = 0.15
    move: float = 0.1
    within: float = 0.2
    swing: float = 0.005
    answer: float = 2.0
    fewest: int = 10
    fitted: float = 0.5


REMARKS = RemarkSettings()
SIMULATOR_TESTS = SimulatorTestSettings()
