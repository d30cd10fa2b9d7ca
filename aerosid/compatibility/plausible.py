"""Plausibility of sensor positions: none is further from the centre of gravity than the aircraft reaches."""

from __future__ import annotations

import math

from aerosid.compatibility.agreement import KinematicConsistency
from aerosid.effects.sensor_position import farthest_place
from aerosid.notation import number

__all__ = ["implausible_positions"]


def implausible_positions(
    agreement: KinematicConsistency, mean_chord: float, length: float | None = None
) -> tuple[str, ...]:
    """One sentence for each sensor position found that no aircraft of this size has.

    Parameters
    ----------
    agreement : KinematicConsistency
    mean_chord, length : float
        Of the aircraft, m; None: its length is taken from its chord.
    """
    names = dict.fromkeys(finding.where for finding in agreement.findings)
    sentences = []
    for name in names:
        arms = [f for f in agreement.findings if f.where == name and f.kind == "sensor_position"]
        distance = math.hypot(*(arm.value for arm in arms)) if arms else 0.0
        farthest = farthest_place(name, mean_chord, length)
        if distance > farthest:
            sentences.append(
                f"The position of {name} that kinematics ask for, {number(distance)} m from where it was taken to be, "
                f"cannot be: on an aircraft of this size none lies further than {number(farthest)} m from the centre "
                "of gravity. What is wrong is something else that looks the same, a delay or a scale; measure the "
                "position and give it in the channel map."
            )
    return tuple(sentences)
