"""Plausibility of sensor positions: none is further from the centre of gravity than the aircraft is long."""

from __future__ import annotations

import math

from aerosid.compatibility.consistency import KinematicConsistency

__all__ = ["LENGTH_IN_CHORDS", "implausible_positions"]

LENGTH_IN_CHORDS = 8.0
"""Fuselage length over mean chord at most: Citation II 7, VFW-614 6.5, DHC-6 8 (Jane's), model aircraft less. Effect: a
sensor position beyond it is refused. Found on none of the recordings that are judged with it."""


def implausible_positions(agreement: KinematicConsistency, longest: float | None) -> tuple[str, ...]:
    """One sentence for each sensor position found that no aircraft of this size has.

    Parameters
    ----------
    agreement : KinematicConsistency
    longest : float or None
        Length of the aircraft, m; None: its size is not known, and nothing is refused.
    """
    if longest is None:
        return ()
    names = dict.fromkeys(finding.where for finding in agreement.findings)
    sentences = []
    for name in names:
        arms = [f for f in agreement.findings if f.where == name and f.kind == "sensor_position"]
        distance = math.hypot(*(arm.value for arm in arms)) if arms else 0.0
        if distance > longest:
            sentences.append(
                f"The position of {name} that kinematics ask for, {distance:.3g} m from where it was taken to be, "
                f"cannot be: the aircraft is at most {longest:.3g} m long. What is wrong is something else that looks "
                "the same, a delay or a scale; measure the position and give it in the channel map."
            )
    return tuple(sentences)
