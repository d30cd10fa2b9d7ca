"""Data compatibility check: a_x, a_z, q, theta, V, alpha and h against each other, without aerodynamics.

`consistency` checks logs; `contradiction` sees what cannot belong together by the paths that `window_fit` finds with
the equations of `flight_path`; `proved_agreement` tells the faults that the kinematic equations prove, as `agreement`
holds them; `recording` is a log as arrays.
"""

from aerosid.compatibility.agreement import (
    Agreement,
    ChannelAgreement,
    InstrumentFinding,
    KinematicConsistency,
    MovingAir,
    describe,
)
from aerosid.compatibility.consistency import check_kinematics, contradicting
from aerosid.compatibility.contradiction import Contradiction
from aerosid.compatibility.proved_agreement import agreement_of
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
    "agreement_of",
    "check_kinematics",
    "contradicting",
    "describe",
]
