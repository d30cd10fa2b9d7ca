"""Constants of one aircraft, as the kernels take them."""

from __future__ import annotations

from typing import NamedTuple

from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.layout import Layout, layout_of

GRAVITY = 9.80665
"""Standard: acceleration of free fall, m/s^2, ISO 80000-3."""

_LONGITUDINAL = layout_of(LONGITUDINAL)


class Constants(NamedTuple):
    """Geometry, inertia and reference speeds of one aircraft (SI), and the case of the equations that it flies."""

    wing_area: float
    mean_chord: float
    I_yy: float
    thrust_incidence: float
    thrust_z_arm: float
    airspeed_of_rates: float
    """U0 of p_hat, q_hat, r_hat and alpha_dot_hat [m/s]; 0 where the current airspeed is meant."""
    airspeed_of_V_hat: float
    """U0 of V_hat [m/s]."""
    gust: int = -1
    """Which of the extra inputs is the vertical gust velocity [m/s], positive down; -1: none."""
    thrust_change: int = -1
    """Which of them is thrust [N] beyond the thrust input; -1: none."""
    cg_x: int = -1
    """Which of them is the centre of gravity's position ahead of the declared one [m]; -1: none."""
    cg_z: int = -1
    """Which of them is its position below the declared one [m]; -1: none."""
    side_gust: int = -1
    """Which of them is the lateral gust velocity [m/s], positive to the right; -1: none."""
    cg_y: int = -1
    """Which of them is the centre of gravity's position to the right of the declared one [m]; -1: none."""
    span: float = 0.0
    """Whole span [m], the length of p_hat, r_hat, C_l and C_n."""
    I_xx: float = 0.0
    I_zz: float = 0.0
    I_xz: float = 0.0
    """Moments and product of inertia [kg m^2]; zero where none is declared, and then without inertial coupling."""
    layout: Layout = _LONGITUDINAL
    """The case of the equations of motion."""
