"""Settings of the sentences and remarks of a report; none of them decides what is found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RemarkSettings:
    """Limits from which on a number is reported in a sentence; chosen.

    Attributes
    ----------
    worse : float
        Error without an effect over error with it, 1, below which the effect is reported to worsen the prediction.
    chance : float
        p-value, 1, from which on a reported effect is described as possible by chance.
    most_named : int
        Alternatives up to which the open points name every one.
    above_noise : float
        Multiple of its noise, 1, from which on a channel's remaining error is reported in a sentence.
    corrected_worse : float
        Multiple of its error as recorded, 1, from which on a corrected channel is reported to fit less well.
    steady : float
        Fraction of its mean, 1, by which a quantity may vary and still be given as a single number.
    calm, light, moderate : float
        Root-mean-square load factor, g, up to which turbulence has this name. Light turbulence peaks at about
        0.2 g, four deviations.
    """

    worse: float = 0.98
    chance: float = 0.05
    most_named: int = 4
    above_noise: float = 1.5
    corrected_worse: float = 1.02
    steady: float = 0.005
    calm: float = 0.01
    light: float = 0.05
    moderate: float = 0.15


@dataclass(frozen=True)
class SimulatorTestSettings:
    """Criteria for the parts of a flight that are a test of 14 CFR Part 60, whose text gives no such numbers; chosen.

    Attributes
    ----------
    longest_input : float
        s from the first to the last movement of the control; a 3-2-1-1 for a transport takes 7 to 12 s.
    before, free : float
        s before a movement, and of free response after it, that belong to the test; closer movements count as one.
    steady_speed : float
        Fraction of the airspeed, 1, by which it may vary in the test of a brief response.
    move, within : float
        A control moves where it changes by more than this fraction of its range, 1, within so many s.
    swing : float
        Least standard deviation of the airspeed, as a fraction of its mean, 1, of a measurable phugoid.
    answer : float
        Multiple of its tolerance, 1, by which a channel must move: a smaller response proves nothing.
    fewest : int
        Least number of samples of a record that is searched for a movement or an oscillation.
    fitted : float
        Fraction of the variance, 1, that a fitted oscillation may leave unexplained.
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
