"""Rotary gusts in pitch and yaw: what a wind that varies along the aircraft adds to its angular rates.

    q_g = dw_g/dx = w_g'/V,  r_g = -dv_g/dx = -v_g'/V,  each behind 1/(1 + s k b/(pi V)),  k = 4 and 3,

frozen turbulence that the aircraft meets at the airspeed V, averaged over its span b (MIL-F-8785C, section 3.7.5). The
moments respond to them as to its own angular rates, in the opposite sense to the vane's: a rising vane shows a gust
whose gradient damps its own nose-up moment. They make the measured rates endogenous, for the aircraft follows the
gust: without them C_m of a trainer in 0.8 m/s was half the true one in all its terms, and a lag of the elevator was
told as a delay of half its size (docs/limits.md). A vane shows the gusts of its plane, and their rate by its own:
w_g/V = -(vane less path). The gust in roll varies across the span, and no vane shows it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.running_integral import derivative
from aerosid.flight_model.constants import Constants
from aerosid.signals.recursive_filter import filtered_from_steady, turned_at_ends

Array = NDArray[np.float64]


class _Gradient(NamedTuple):
    """Span in the time constant of the average, 1/pi; sense of the rate; field of the length of the hat."""

    spans: float
    sense: float
    length: str


GRADIENTS: Mapping[str, _Gradient] = {
    "alpha": _Gradient(4.0, -1.0, "mean_chord"),
    "beta": _Gradient(3.0, 1.0, "span"),
}
"""Standard: MIL-F-8785C, section 3.7.5, by the vane that shows the gust."""

ROTARY = {"C_m": "alpha", "C_l": "beta", "C_n": "beta"}
"""Physical: the vane that shows the rotary gust to which each moment responds."""


BY_GUST_IN_ROLL = ("C_l", "C_n")
"""Physical: moments that respond to the gust in roll, dw_g/dy, which no vane shows. Where yaw shows gradients of the
side gust there are such of the vertical one, as large by their spectra: these moments are then compared in the space of
instrumental variables, the response to the controls and the gusts that the vane shows."""


def rotary_gust(difference: Array, vane: str, airspeed: float, interval: float, constants: Constants) -> Array:
    """The rotary gust that a vane shows, as q_hat or r_hat, 1, (N,).

    Parameters
    ----------
    difference : ndarray, shape (N,)
        Of the vane from the path of the aircraft, rad.
    vane : str
        "alpha" or "beta".
    airspeed : float
        m/s.
    interval : float
        s.
    constants : Constants
        Of the aircraft. Without a span it is that of its area and chord.
    """
    gradient = GRADIENTS[vane]
    span = constants.span or constants.wing_area / constants.mean_chord
    lengths = {"mean_chord": constants.mean_chord, "span": span}
    ratio = 2.0 * gradient.spans * span / (math.pi * airspeed * interval)
    average = np.array([[1.0, 1.0, 0.0, 1.0 - ratio, 0.0]]) / (1.0 + ratio)  # bilinear transform
    # The air before the record is unknown: it is continued by itself, turned about its first value.
    before = min(math.ceil(2.0 * ratio), difference.size - 1)
    continued = turned_at_ends(difference, difference[0], difference[-1], before, 0)
    rate = derivative(filtered_from_steady(average, continued)[before:], interval)
    return np.asarray(gradient.sense * lengths[gradient.length] / (2.0 * airspeed) * rate)
