"""Plausibility of sensor positions: none is further from the centre of gravity than the aircraft reaches."""

from __future__ import annotations

import math

from aerosid.compatibility.agreement import KinematicConsistency
from aerosid.notation import number

__all__ = ["implausible_positions"]


def implausible_positions(agreement: KinematicConsistency, farthest: float | None) -> tuple[str, ...]:
    """One sentence for each sensor position found that no aircraft of this size has.

    Parameters
    ----------
    agreement : KinematicConsistency
    farthest : float or None
        m from the centre of gravity that a sensor of this aircraft can sit; None: its size is not known, and nothing is
        refused.
    """
    if farthest is None:
        return ()
    names = dict.fromkeys(finding.where for finding in agreement.findings)
    sentences = []
    for name in names:
        arms = [f for f in agreement.findings if f.where == name and f.kind == "sensor_position"]
        distance = math.hypot(*(arm.value for arm in arms)) if arms else 0.0
        if distance > farthest:
            sentences.append(
                f"The position of {name} that kinematics ask for, {number(distance)} m from where it was taken to be, "
                f"cannot be: on an aircraft of this size none lies further than {number(farthest)} m from the centre "
                "of gravity. What is wrong is something else that looks the same, a delay or a scale; measure the "
                "position and give it in the channel map."
            )
    return tuple(sentences)
