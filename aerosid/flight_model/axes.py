"""Axes of an estimation problem: which motion quantities are integrated, which are measured, what is compared.

The equations of motion are those of one rigid body in z = (u v w p q r phi theta h psi). A case says which of z it
integrates; what remains of z is read from the log. Everything here is data: sizes and names of states, outputs and
coefficients anywhere else in the package are taken from these tuples.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOTION = ("u", "v", "w", "p", "q", "r", "phi", "theta", "h", "psi")
"""Motion of a rigid body over a flat earth: velocity [m/s] and rates [rad/s] in body axes, Euler angles [rad], altitude
[m]."""

UNCOUPLED = ("h", "psi")
"""Those of `MOTION` that nothing depends on."""

OUTPUTS = (
    "V",
    "alpha",
    "beta",
    "p",
    "q",
    "r",
    "phi",
    "theta",
    "psi",
    "a_x",
    "a_y",
    "a_z",
    "p_dot",
    "q_dot",
    "r_dot",
    "h",
)
"""What sensors may see, in the order of the rows of every case."""

COEFFICIENTS = ("C_X", "C_Y", "C_Z", "C_l", "C_m", "C_n", "C_L", "C_D")
"""Force and moment coefficients about body axes, and lift and drag, which may stand in place of C_Z and C_X."""

EQUATION = {"C_X": "u", "C_Y": "v", "C_Z": "w", "C_l": "p", "C_m": "q", "C_n": "r", "C_L": "w", "C_D": "u"}
"""The state in whose equation each coefficient acts first."""

ATMOSPHERE_AND_BODY = ("rho", "thrust", "mass", "speed_of_sound")
"""The leading columns of the inputs of every case; the motion that is measured follows them."""


class Axes(NamedTuple):
    """One case of the equations of motion.

    Attributes
    ----------
    name : str
    integrated : tuple of str
        The states, in the order of `MOTION`.
    measured : tuple of str
        Channels from which the rest of the motion is taken, in the order of their input columns.
    coefficients : tuple of str
        The coefficients that are modelled; none where accelerometers drive the path.
    wind_axes : tuple of str
        Coefficients in wind axes that may stand in place of `coefficients`.
    outputs : tuple of str
        What is compared with the log, in the order of `OUTPUTS`.
    required : tuple of str
        Channels without which nothing is estimated.
    """

    name: str
    integrated: tuple[str, ...]
    measured: tuple[str, ...]
    coefficients: tuple[str, ...]
    wind_axes: tuple[str, ...]
    outputs: tuple[str, ...]
    required: tuple[str, ...]

    @property
    def flow_angle(self) -> str:
        """That of the flow whose range a simulation leaves first."""
        return next(name for name in _DOUBTFUL_SIGNS if name in self.outputs)

    @property
    def doubtful_signs(self) -> str:
        """What to look at where a simulation leaves it."""
        return _DOUBTFUL_SIGNS[self.flow_angle]


_DOUBTFUL_SIGNS = {
    "alpha": "delta_e, C_m_alpha and C_m_delta_e, the mass and the units of alpha and q",
    "beta": "delta_a, delta_r, C_n_beta, C_l_p_hat, C_l_delta_a and C_n_delta_r, and the units of beta, p and r",
}


LONGITUDINAL = Axes(
    name="longitudinal",
    integrated=("u", "w", "q", "theta", "h"),
    measured=("phi", "p", "r", "beta"),
    coefficients=("C_X", "C_Z", "C_m"),
    wind_axes=("C_L", "C_D"),
    outputs=("V", "alpha", "q", "theta", "a_x", "a_z", "q_dot", "h"),
    required=("V", "alpha", "q"),
)
"""Pitching motion; bank, roll and yaw rate and sideslip are measured, zero where they are not."""

LATERAL = Axes(
    name="lateral",
    integrated=("v", "p", "r", "phi", "psi"),
    measured=("V", "alpha", "q", "theta"),
    coefficients=("C_Y", "C_l", "C_n"),
    wind_axes=(),
    outputs=("beta", "p", "r", "phi", "psi", "a_y", "p_dot", "r_dot"),
    required=("V", "p", "r"),
)
"""Rolling, yawing and sideslipping motion; airspeed, angle of attack, pitch rate and pitch angle are measured."""

SIX = Axes(
    name="six degrees of freedom",
    integrated=MOTION,
    measured=(),
    coefficients=("C_X", "C_Y", "C_Z", "C_l", "C_m", "C_n"),
    wind_axes=("C_L", "C_D"),
    outputs=OUTPUTS,
    required=("V", "alpha", "p", "q", "r"),
)
"""The whole motion."""


def input_columns_of(axes: Axes) -> tuple[str, ...]:
    """The leading input columns of a case; the channels that terms name follow them."""
    return *ATMOSPHERE_AND_BODY, *axes.measured


def loads_of(axes: Axes) -> tuple[str, ...]:
    """The coefficients that a term may add to, in the order of `TermTable.coefficient`."""
    return *axes.coefficients, *axes.wind_axes


def moving_of(axes: Axes) -> tuple[str, ...]:
    """The states that forces and moments act on, which come first."""
    return tuple(name for name in axes.integrated if name in EQUATION.values())


def coupled_of(axes: Axes) -> tuple[str, ...]:
    """The states that something depends on, which come first."""
    return tuple(name for name in axes.integrated if name not in UNCOUPLED)


def equation_of(axes: Axes, coefficient: str) -> int:
    """The place of the state in whose equation a coefficient acts first."""
    return axes.integrated.index(EQUATION[coefficient])


ACCELEROMETERS = ("a_x", "a_y", "a_z")
"""The outputs of an accelerometer unit."""

ACCELERATIONS = (*ACCELEROMETERS, "p_dot", "q_dot", "r_dot")
"""Those of `OUTPUTS` that forces and moments are in at once; the others follow from the state alone."""


def fed_of(axes: Axes) -> tuple[str, ...]:
    """The outputs that determine the coupled states, as many as these and in their order."""
    return tuple(name for name in axes.outputs if name not in (*ACCELERATIONS, *UNCOUPLED))


def planes_of(axes: Axes) -> tuple[Axes, ...]:
    """The motions in the plane of symmetry and out of it whose coefficients a case models."""
    return tuple(plane for plane in (LONGITUDINAL, LATERAL) if set(plane.coefficients) <= set(axes.coefficients))


def state_vector(axes: Axes, motion: Mapping[str, float]) -> NDArray[np.float64]:
    """The state (n,) of a case from the motion by name, SI; what is not named is zero."""
    return np.array([motion.get(name, 0.0) for name in axes.integrated])
