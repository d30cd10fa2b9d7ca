"""Settings of the data compatibility check."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class ContradictionSettings:
    """Limits of a contradiction; found on recorded flights where not chosen.

    Those are the HFB-320, Twin Otter and Citation recordings, which are no evidence for them.

    Attributes
    ----------
    window : float
        s; length of the windows in which the shape of the motion is compared: a bias of 0.005 rad/s, which is large,
        changes theta by 0.02 rad about its mean within it. Chosen.
    most_windows : int
        Largest number of windows compared, those with most pitching. Chosen for time.
    least_theta, least_h : float
        rad, m; least misfit of a contradiction.
    air_alpha, air_V : float
        m/s; largest misfit by gusts. Moderate turbulence is 2 m/s (MIL-F-8785C); V shows that of some seconds only.
    misfit : float
        Unexplained fraction of a channel's variation, 1, from which it contradicts.
    misfit_h : float
        The same of altitude: pressure altitude is slow.
    small_bias : float
        rad; largest bias of theta and alpha: a larger one would turn any climb into a descent.
    agrees : float
        Unexplained fraction, 1, below which a channel agrees.
    doubtful, vanishes : float
        Unexplained fraction, 1, from which a channel contradicts if a remedy reduces it below the second.
    hopeless : float
        Unexplained fraction of a channel's variation, 1, with a remedy after the first round of its fit, from which it
        is not fitted further: twice `doubtful`. With the right unit of airspeed the first round differed from the last
        by less than a tenth wherever that agreed (flights of benchmarks/field_detection.py, seed 300).
    falls, falls_first : float
        Factor, 1, by which the misfits of alpha and V must fall with another unit of airspeed, in the geometric mean:
        half of their squares; and after the first round of the fit. Found on benchmarks/field_detection.py, seed 170,
        with airspeeds in knots.
    beside : float
        Relative change of a ratio of units, 1, that must not do better than it: 3.6 and 3.28 differ by a tenth. Chosen.
    clearly : float
        Ratio of two misfits, 1, from which the smaller one is clearly better. Chosen.
    above_noise : float
        Least misfit over the channel's noise, 1.
    unknown_noise : float
        Noise of a channel that shows none of its own, since its samples were repeated, interpolated or filtered, as a
        fraction, 1, of its standard deviation. Found on fifteen pairs of flights of unmanned aircraft with slow and
        late airspeed and height: none contradicted with 0.03 and 0.1, three of 30 flights with 0.01.
    least_beside : float
        Share, 1, of `unknown_noise` that the noise of the other channels of such a recording has at least. Chosen.
    doubtful_air, doubtful_noise : float
        Least misfit of a suspect channel, as fractions, 1, of that by gusts and of `above_noise`.
    latest : float
        s; largest time delay and lag of an instrument. Chosen.
    largest_scale : float
        Largest scale factor error of an instrument, 1. Chosen.
    shifts : tuple of float
        s; time shifts of a channel that are tried where instrument errors may be present beside it. Chosen.
    ordinary_delay : float
        s; largest time delay and lag with which an ordinary instrument is compared with a gross error. Chosen.
    shift_step, longest_shift, shift_resolution : float
        s; grid of the clock errors that are tried with nothing else free, and the step to which the best is refined.
        Chosen: two channels that agree lose each other within about half a period of the short-period oscillation.
    shifts_refined : int
        Number of the grid's lowest minima that are refined: beside the right time, by half a step, the misfit may be
        larger than where little is left to compare. Chosen.
    least_compared : float
        Least share of the compared samples, 1, that is left with another clock: a path through the rest alone would
        fit by its free initial states. Chosen.
    same_delay : float
        s; largest difference of a clock error and of the time delay that the kinematic equations find of the same
        channel. Chosen.
    gross_falls : float
        Factor, 1, by which the product of the misfits, in multiples of the noise, must fall with a gross error that
        is named; `clearly` is the ratio to the product with any other. Chosen.
    left_by_chance : float
        Share of a sum of ln(misfit/noise), 1, by which two hypotheses differ by chance: the more is left unexplained,
        the further they must lie apart. Found on the tuning flights of docs/limits.md.
    """

    window: float = 8.0
    most_windows: int = 12
    least_theta: float = 0.02
    least_h: float = 10.0
    air_alpha: float = 3.0
    air_V: float = 2.0
    misfit: float = 0.5
    misfit_h: float = 1.0
    small_bias: float = 0.03
    agrees: float = 0.3
    doubtful: float = 0.4
    vanishes: float = 0.12
    hopeless: float = 0.8
    falls: float = 1.5
    falls_first: float = 1.3
    beside: float = 0.1
    clearly: float = 0.7
    above_noise: float = 8.0
    unknown_noise: float = 0.05
    least_beside: float = 0.1
    doubtful_air: float = 0.3
    doubtful_noise: float = 0.5
    latest: float = 1.0
    largest_scale: float = 0.5
    shifts: tuple[float, ...] = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
    ordinary_delay: float = 0.3
    shift_step: float = 0.5
    longest_shift: float = 8.0
    shift_resolution: float = 0.04
    shifts_refined: int = 4
    least_compared: float = 0.6
    same_delay: float = 0.1
    gross_falls: float = 2.0
    left_by_chance: float = 0.12

    def clearly_less(self, total: float) -> float:
        """Difference to another sum of ln(misfit/noise) from which `total`, the smaller one, is clearly better."""
        return self.left_by_chance * total - math.log(self.clearly)

    def worst_fraction(self, output: str) -> float:
        """Unexplained fraction of an output's variation from which it contradicts."""
        return self.misfit_h if output == "h" else self.misfit

    def least(self, output: str, airspeed: float) -> float:
        """Largest misfit of an output by gusts and drift, SI, at an airspeed, m/s."""
        limits = {
            "alpha": self.air_alpha / max(airspeed, 1.0),
            "V": self.air_V,
            "theta": self.least_theta,
            "h": self.least_h,
        }
        return limits[output]


@dataclass(frozen=True)
class CompatibilitySettings:
    """Settings of the check; the other limits of significance are those of equation error (`EquationErrorSettings`).

    Attributes
    ----------
    false_alarm : float
        False alarm rate, 1: fraction of flights without instrument errors in which one may be named, by design. A fifth
        of that of a loop: no coefficient and no other flight is tested here, and the colour of a short flight's
        residuals is poorly known. At a loop's rate 11 of 400 flights of 12 s alarmed
        (tests/compatibility/test_consistency.py, seeds 0 to 399); those seeds are no evidence for it.
    coloured : float
        Probability under white noise, 1, below which a residual is coloured. Chosen.
    above_the_noise : float
        Ratio of the residual of a flow angle or the airspeed in the band to the noise of successive samples, 1, from
        which there is turbulence: white noise gives at most 1, half as much again allows for the integrated
        accelerometers.
    gusts_last : float
        s; least correlation time of turbulence: a vane whose noise has a correlation of 0.8 between samples at 40 Hz
        resembles gusts of 0.4 s. Found on the Twin Otter and Citation recordings, which are no evidence for it.
    longest_scale : float
        m; a drift of longer scale is no turbulence: Dryden's scale length at altitude (MIL-F-8785C).
    shortest : float
        s; a shorter stretch is left out of the equations where there is a longer one: at 0.8 Hz, their lowest band, it
        has 13 samples, four of them at its ends. Chosen.
    contradiction : ContradictionSettings
        Limits of a contradiction.
    """

    false_alarm: float = 0.002
    coloured: float = 1e-4
    above_the_noise: float = 1.5
    gusts_last: float = 0.5
    longest_scale: float = 533.0
    shortest: float = 8.0
    contradiction: ContradictionSettings = field(default_factory=ContradictionSettings)


USUAL = CompatibilitySettings()
"""The default settings."""
