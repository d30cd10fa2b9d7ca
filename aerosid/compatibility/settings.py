"""Settings of the data compatibility check."""

from __future__ import annotations

from dataclasses import dataclass, field

from aerosid.compatibility.contradiction import ContradictionSettings
from aerosid.compatibility.recording import StretchSettings


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
    stretches : StretchSettings
        Division of a log into stretches.
    contradiction : ContradictionSettings
        Limits of a contradiction.
    """

    false_alarm: float = 0.002
    coloured: float = 1e-4
    above_the_noise: float = 1.5
    gusts_last: float = 0.5
    longest_scale: float = 533.0
    shortest: float = 8.0
    stretches: StretchSettings = field(default_factory=StretchSettings)
    contradiction: ContradictionSettings = field(default_factory=ContradictionSettings)


USUAL = CompatibilitySettings()
"""The default settings."""
