"""Names of the equations of each case and of the channels that they compare."""

from __future__ import annotations

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
        Channels without which no path of the aircraft can be reconstructed. Its sideslip needs no vane.
    """

    kinematic: tuple[str, ...]
    rates: tuple[str, ...]
    needed: tuple[str, ...]


EQUATION_SETS = {
    LONGITUDINAL.name: EquationSet(("theta", "alpha", "V", "h"), ("q",), ("V", "alpha", "q", "a_x", "a_z")),
    LATERAL.name: EquationSet(("phi", "psi", "beta"), ("p", "r"), ("p", "r", "phi", "a_y")),
    SIX.name: EquationSet(
        ("theta", "phi", "psi", "alpha", "V", "beta", "h"),
        ("p", "q", "r"),
        ("V", "alpha", "p", "q", "r", "phi", "theta", "a_x", "a_y", "a_z"),
    ),
}
"""The equations of each case that the engine handles, by the name of the case."""

KINEMATIC = tuple(dict.fromkeys(name for each in EQUATION_SETS.values() for name in each.kinematic))
"""Channels that kinematics predict by integration, in any case."""

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
