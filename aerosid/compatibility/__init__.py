"""Data compatibility check: a_x, a_z, q, theta, V, alpha and h against each other, without aerodynamics.

`consistency` checks logs; `contradiction` detects channels that cannot belong to one motion, by the `misfits` to the
paths that `window_fit` reconstructs with the equations of `flight_path`, and `gross_errors` names what is wrong with
them, by the `altered_channels` with which they agree; `instrument_agreement` reports the instrument errors
identified by the kinematic equations, in the classes of `agreement`; `recording` is a log as arrays.
"""

from aerosid.compatibility.agreement import (
    Agreement,
    ChannelAgreement,
    Contradiction,
    InstrumentFinding,
    KinematicConsistency,
    MovingAir,
    describe,
)
from aerosid.compatibility.consistency import check_kinematics, contradicting
from aerosid.compatibility.instrument_agreement import agreement_of
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
