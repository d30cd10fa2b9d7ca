"""Air-relative motion: airspeed, angle of attack and sideslip from the velocity, and their Jacobian.

Velocity components that are not integrated follow from the measured angles: where sideslip is measured, v moves with
u and w; where airspeed and angle of attack are, u and w move with v.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline
from aerosid.flight_model.layout import Layout, input_places, state_places


class Motion(NamedTuple):
    """Velocity [m/s] and rates [rad/s] in body axes, bank and pitch [rad] with sine and cosine."""

    u: float
    v: float
    w: float
    p: float
    q: float
    r: float
    phi: float
    theta: float
    sin_phi: float
    cos_phi: float
    sin_theta: float
    cos_theta: float


class Air(NamedTuple):
    """Airspeed [m/s] and its part in the plane of symmetry, angle of attack and sideslip [rad] with their functions."""

    speed: float
    plane: float
    alpha: float
    beta: float
    sin_alpha: float
    cos_alpha: float
    cos_beta: float
    tan_beta: float


class AirSlopes(NamedTuple):
    """Slopes by the velocity components that are integrated; zero by those that are not.

    Airspeed, angle of attack and sideslip, and those velocity components that follow from measured angles.
    """

    V_u: float
    V_v: float
    V_w: float
    alpha_u: float
    alpha_w: float
    beta_u: float
    beta_v: float
    beta_w: float
    v_u: float
    v_w: float
    u_v: float
    w_v: float


@njit_inline
def air_at(x: NDArray[np.float64], u: NDArray[np.float64], layout: Layout) -> tuple[Motion, Air]:
    """The motion from states and measured inputs, and what it is relative to the air.

    Parameters
    ----------
    x : float64[n]
        States of the case.
    u : float64[I]
        Inputs, the leading columns first.
    """
    there, at, column = layout.motion, state_places(layout), input_places(layout)
    # Most flights hold no bank and no sideslip, and a sine costs like a term.
    cos_beta, tan_beta, sin_phi, cos_phi, phi = 1.0, 0.0, 0.0, 1.0, 0.0
    if len(there.u) > 0:
        forward, down = x[at.u], x[at.w]
        plane = np.sqrt(forward * forward + down * down)
        sin_alpha, cos_alpha = down / plane, forward / plane
        alpha = np.arctan2(down, forward)
        if len(there.v) > 0:
            aside = x[at.v]
            speed = np.sqrt(plane * plane + aside * aside)
            beta = np.arctan2(aside, plane)
            cos_beta, tan_beta = plane / speed, aside / plane
        else:
            beta = u[column.beta]
            if beta != 0.0:
                cos_beta, tan_beta = np.cos(beta), np.tan(beta)
            speed, aside = plane / cos_beta, plane * tan_beta
    else:
        speed, alpha, aside = u[column.V], u[column.alpha], x[at.v]
        plane = np.sqrt(speed * speed - aside * aside)
        sin_alpha, cos_alpha = np.sin(alpha), np.cos(alpha)
        forward, down = plane * cos_alpha, plane * sin_alpha
        beta = np.arctan2(aside, plane)
        cos_beta, tan_beta = plane / speed, aside / plane
    p = x[at.p] if len(there.p) > 0 else u[column.p]
    q = x[at.q] if len(there.q) > 0 else u[column.q]
    r = x[at.r] if len(there.r) > 0 else u[column.r]
    phi = x[at.phi] if len(there.phi) > 0 else u[column.phi]
    if phi != 0.0:
        sin_phi, cos_phi = np.sin(phi), np.cos(phi)
    theta = x[at.theta] if len(there.theta) > 0 else u[column.theta]
    motion = Motion(forward, aside, down, p, q, r, phi, theta, sin_phi, cos_phi, np.sin(theta), np.cos(theta))
    return motion, Air(speed, plane, alpha, beta, sin_alpha, cos_alpha, cos_beta, tan_beta)


@njit_inline
def air_slopes(motion: Motion, air: Air, layout: Layout) -> AirSlopes:
    """How `air_at` moves with the velocity components that are integrated."""
    there = layout.motion
    V_u, V_v, V_w, alpha_u, alpha_w = 0.0, 0.0, 0.0, 0.0, 0.0
    beta_u, beta_v, beta_w, v_u, v_w, u_v, w_v = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if len(there.u) > 0:
        square = air.plane * air.plane
        alpha_u, alpha_w = -motion.w / square, motion.u / square
        if len(there.v) > 0:
            V_u, V_v, V_w = motion.u / air.speed, motion.v / air.speed, motion.w / air.speed
            turned = -motion.v / (air.speed * air.speed)
            beta_u, beta_w = turned * air.cos_alpha, turned * air.sin_alpha
            beta_v = air.plane / (air.speed * air.speed)
        else:
            V_u, V_w = air.cos_alpha / air.cos_beta, air.sin_alpha / air.cos_beta
            v_u, v_w = air.cos_alpha * air.tan_beta, air.sin_alpha * air.tan_beta
    else:
        beta_v = 1.0 / air.plane
        u_v, w_v = -air.tan_beta * air.cos_alpha, -air.tan_beta * air.sin_alpha
    return AirSlopes(V_u, V_v, V_w, alpha_u, alpha_w, beta_u, beta_v, beta_w, v_u, v_w, u_v, w_v)
