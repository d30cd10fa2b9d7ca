"""Settings of the preparation of a log: samples, averaging of the air data, integration steps."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PreparationSettings:
    """Settings of a manoeuvre's arrays; chosen, found on no recording.

    Attributes
    ----------
    fewest : int
        Samples of a channel from which it is used.
    slow_air : float
        s; density and speed of sound, which are ratios of noisy channels, are averaged over this time.
    longest_angle : float
        rad; largest phase of the fastest motion in one step: the error of a fourth-order step is then 4e-6 of its rate.
    longest_substep : float
        s; of the integration, where the aircraft is slow or the declared model empty.
    shortest_substep : float
        s; shorter steps are never needed, except formally by a wrong inertia in the aircraft file.
    rounding : float
        SI; a channel that varies by less holds still: errors of a simulation's arithmetic move it.
    first : int
        Samples whose mean is the start value of the initial state.
    """

    fewest: int = 5
    slow_air: float = 2.0
    longest_angle: float = 0.15
    longest_substep: float = 0.1
    shortest_substep: float = 0.002
    rounding: float = 1e-9
    first: int = 5


PREPARATION = PreparationSettings()
"""The settings of every manoeuvre."""
