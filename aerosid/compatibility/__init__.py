"""Data compatibility check: a_x, a_z, q, theta, V, alpha and h against each other, without aerodynamics.

`consistency` gives the answer; `contradiction` sees what cannot belong together, `search` looks for faults of
instruments, `estimate` fits them, `likelihood` whitens what is left, `flight_path` integrates the motion, `faults` is
the catalogue, `recording` a log as arrays; `proved_agreement` tells the same of the equations' faults.
"""

from aerosid.compatibility.consistency import (
    Agreement,
    ChannelAgreement,
    InstrumentFinding,
    KinematicConsistency,
    MovingAir,
    check_kinematics,
    contradicting,
    describe,
    reconciled,
)
from aerosid.compatibility.contradiction import Contradiction
from aerosid.flight_model.axes import LONGITUDINAL

CASES = (LONGITUDINAL,)
"""The cases of the equations of motion whose instruments are compared."""

__all__ = [
    "CASES",
    "Agreement",
    "ChannelAgreement",
    "Contradiction",
    "InstrumentFinding",
    "KinematicConsistency",
    "MovingAir",
    "check_kinematics",
    "contradicting",
    "describe",
    "reconciled",
]
