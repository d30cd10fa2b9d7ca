"""Names of the equations of each case and of the channels that they compare."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, SIX, Axes


class EquationSet(NamedTuple):
    """The equations of one case of the equations of motion.

    Attributes
    ----------
    kinematic : tuple of str
        Channels that kinematics predict by integration.
    rates : tuple of str
        Angular rates on which moments act: their power determines the band of the motion.
    needed : tuple of str
        Channels without which the equations cannot be formed.
    accelerometers : tuple of str
        From which the path of the aircraft is reconstructed. Its sideslip then needs no vane.
    in_their_place : tuple of str
        Further channels from which the specific forces are derived where accelerometers are missing.
    """

    kinematic: tuple[str, ...]
    rates: tuple[str, ...]
    needed: tuple[str, ...]
    accelerometers: tuple[str, ...]
    in_their_place: tuple[str, ...]

    def can_be_formed(self, channels: Collection[str]) -> bool:
        """Whether a record with these channels determines forces and moments."""
        known = set(channels)
        return known.issuperset(self.needed) and (self.has_path(known) or known.issuperset(self.in_their_place))

    def has_path(self, channels: Collection[str]) -> bool:
        """Whether the path of the aircraft can be reconstructed without its air data sensors."""
        return set(channels).issuperset(self.accelerometers)


EQUATION_SETS = {
    LONGITUDINAL.name: EquationSet(
        ("theta", "alpha", "V", "h"), ("q",), ("V", "alpha", "q"), ("a_x", "a_z"), ("theta",)
    ),
    LATERAL.name: EquationSet(("phi", "psi", "beta"), ("p", "r"), ("p", "r", "phi"), ("a_y",), ("beta",)),
    SIX.name: EquationSet(
        ("theta", "phi", "psi", "alpha", "V", "beta", "h"),
        ("p", "q", "r"),
        ("V", "alpha", "p", "q", "r", "phi", "theta"),
        ("a_x", "a_y", "a_z"),
        ("beta",),
    ),
}
"""The equations of each case that the engine handles, by the name of the case."""

KINEMATIC = tuple(dict.fromkeys(name for each in EQUATION_SETS.values() for name in each.kinematic))
"""Channels that kinematics predict by integration, in any case."""

HEIGHT = "h"
"""Channel that is integrated twice from the accelerometers."""

AIRSPEED = "V"
"""Channel whose path contains the mean gust that the vane sees."""

COEFFICIENT = SIX.coefficients
"""Body-axis coefficients, each with the channel that measures it: an accelerometer or the derivative of a rate."""

MEASURED_BY = {"C_X": "a_x", "C_Y": "a_y", "C_Z": "a_z", "C_l": "p", "C_m": "q", "C_n": "r"}
"""The sensor whose errors appear in each coefficient's own equation."""

LATERAL_PATHS = EQUATION_SETS[LATERAL.name].kinematic
"""Kinematic channels out of the plane of symmetry."""

LATERAL_COEFFICIENTS = LATERAL.coefficients
"""The coefficients out of the plane of symmetry."""

VANE_OF = dict.fromkeys(LONGITUDINAL.coefficients, "alpha") | dict.fromkeys(LATERAL_COEFFICIENTS, "beta")
"""The vane that measures the gusts to which each coefficient responds."""


def equations_of(axes: Axes) -> EquationSet:
    """The equations of a case that the engine handles."""
    return EQUATION_SETS[axes.name]
