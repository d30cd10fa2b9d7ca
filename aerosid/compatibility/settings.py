"""Settings of the data compatibility check."""

from __future__ import annotations

from dataclasses import dataclass, field

from aerosid.compatibility.contradiction import ContradictionSettings
from aerosid.compatibility.recording import StretchSettings


@dataclass(frozen=True)
class CompatibilitySettings:
    """Settings of the check; what else lets a fault be named is that of the equations (`EquationErrorSettings`).

    Attributes
    ----------
    false_alarm : float
        Share, 1, of flights with nothing wrong in which something may be named, by design. A fifth of that of a loop:
        no coefficient and no other flight is asked here, and of one short flight the residuals' colour is known
        badly. At a loop's share 11 of 400 flights of 12 s alarmed (tests/compatibility/test_consistency.py, seeds 0 to
        399); those seeds are no evidence for it.
    coloured : float
        Probability of white noise, 1, from which a residual is called coloured. Chosen.
    above_the_noise : float
        Times the noise of successive samples, 1, that a flow angle or the airspeed must leave in the band for the air
        to move: white noise leaves at most 1, half as much again is for that of the integrated accelerometers.
    gusts_last : float
        s; how long moving air lasts at least: a vane whose noise keeps 0.8 of each sample looks, sampled at 40 Hz, like
        gusts of 0.4 s. Found on the Twin Otter and Citation recordings, which are no evidence for it.
    longest_scale : float
        m; what wanders over a longer way is no turbulence: Dryden's scale length at altitude (MIL-F-8785C).
    shortest : float
        s; a shorter stretch is left out of the equations beside a longer one: at 0.8 Hz, their lowest band, it holds 13
        samples, and four of them lie at its ends. Chosen.
    stretches : StretchSettings
        How a log is cut.
    contradiction : ContradictionSettings
        Limits of what counts as a contradiction.
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
"""The settings unless told otherwise."""
