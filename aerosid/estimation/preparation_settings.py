"""Settings of how a log becomes arrays: samples, averaging of the air, integration steps."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PreparationSettings:
    """Settings of a manoeuvre's arrays; chosen, found on no recording.

    Attributes
    ----------
    fewest : int
        Samples of a channel from which on it is used.
    slow_air : float
        s; density and speed of sound, which are ratios of noisy channels, are averaged over this time.
    longest_angle : float
        rad; by which the fastest motion may turn in one step: a fourth-order step then errs by 4e-6 of its rate.
    longest_substep : float
        s; of the integration, where the aircraft is slow or the declared model empty.
    shortest_substep : float
        s; no aircraft turns faster than this resolves, but a wrong inertia in its file may say so.
    first : int
        Samples whose mean is the first guess of where a motion begins.
    """

    fewest: int = 5
    slow_air: float = 2.0
    longest_angle: float = 0.15
    longest_substep: float = 0.1
    shortest_substep: float = 0.002
    first: int = 5


PREPARATION = PreparationSettings()
"""The settings of every manoeuvre."""
