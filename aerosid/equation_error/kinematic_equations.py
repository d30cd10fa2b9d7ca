"""Kinematic equations in integral form: attitude, angle of attack, airspeed and height from gyros and accelerometers.

    theta = I[q cos phi - r sin phi]
    alpha = I[(u w' - w u')/P^2],  P = I[(u u' + w w')/P],  V = P/cos beta
    h     = I[u sin theta - v sin phi cos theta - w cos phi cos theta]

with u' = a_x - g sin theta - q w + r v, w' = a_z + g cos phi cos theta + q u - p v (Klein & Morelli, Aircraft System
Identification, eqs. 10.3-10.6), I the running integral, and a constant for each path and recording.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from aerosid.effects import ActiveEffect
from aerosid.equation_error.recording import Recording
from aerosid.equation_error.running_integral import derivative, running_integral
from aerosid.equation_error.sensors import as_read, bias, position
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.terms import INPUT_COLUMNS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """The motion that the sensors, corrected for their faults, show; all (N,), SI.

    `alpha`, `V`: inertial path at high frequency, sensors at low; `alpha_dot` from the accelerometers; `path` holds the
    integrated theta, alpha, V, h as far as their sensors are there. `gust`: what the vane shows beyond `alpha`, fast
    gusts and its noise.
    """

    V: Array
    alpha: Array
    q: Array
    theta: Array
    h: Array
    q_dot: Array
    alpha_dot: Array
    a_x: Array
    a_z: Array
    path: Mapping[str, Array]
    gust: Array


def accelerations_at_centre(
    recording: Recording, effects: Sequence[ActiveEffect], true: Mapping[str, Array], q_dot: Array
) -> dict[str, Array]:
    """a_x and a_z (N,) moved from their sensors to the centre of gravity; p' and r' are taken as zero."""
    p, r = _input(recording, "p"), _input(recording, "r")
    moved = {}
    for name, offset in accelerometer_offsets(recording, effects, true["q"], q_dot, p, r).items():
        if name in true:
            moved[name] = true[name] - offset
    return moved


def accelerometer_offsets(
    recording: Recording, effects: Sequence[ActiveEffect], q: Array, q_dot: Array, p: Array, r: Array
) -> dict[str, Array]:
    """What accelerometers away from the centre of gravity read beyond it, (N,) each."""
    x_x, x_y, x_z = position(recording, effects, "a_x")
    z_x, z_y, z_z = position(recording, effects, "a_z")
    return {
        "a_x": -(q * q + r * r) * x_x + p * q * x_y + (q_dot + p * r) * x_z,
        "a_z": (p * r - q_dot) * z_x + q * r * z_y - (p * p + q * q) * z_z,
    }


def reconstruct(
    recording: Recording, effects: Sequence[ActiveEffect], true: Mapping[str, Array], blend: float
) -> Motion:
    """The motion, from channels corrected for their sensors' faults.

    Parameters
    ----------
    true : mapping of str to ndarray, shape (N,)
        V, alpha and q at least; what of theta, a_x, a_z, h is missing predicts nothing.
    blend : float
        Time over which measured less integrated alpha and V are smoothed, s.
    """
    interval = recording.interval
    q = true["q"]
    q_dot = recording.q_dot if q is recording.channels["q"] else derivative(q, interval)
    phi, p, r, beta = (_input(recording, name) for name in ("phi", "p", "r", "beta"))
    path: dict[str, Array] = {}
    turned = running_integral(q * np.cos(phi) - r * np.sin(phi), interval)
    alpha_vane = _at_centre(recording, effects, true["alpha"], true["V"], q, p)
    theta = true.get("theta")
    if theta is None:
        theta = turned + float(np.mean(alpha_vane - turned))  # level on average
    else:
        path["theta"] = turned + float(np.mean(theta - turned))
    speed, alpha = true["V"], alpha_vane
    accelerations = accelerations_at_centre(recording, effects, true, q_dot)
    plane = speed * np.cos(beta)
    u, w, v = plane * np.cos(alpha), plane * np.sin(alpha), speed * np.sin(beta)
    driven = "a_x" in accelerations and "a_z" in accelerations
    if driven:
        a_x, a_z = accelerations["a_x"], accelerations["a_z"]
        u_dot = a_x - GRAVITY * np.sin(theta) - q * w + r * v
        w_dot = a_z + GRAVITY * np.cos(theta) * np.cos(phi) + q * u - p * v
        alpha_dot = (u * w_dot - w * u_dot) / plane**2
        path["alpha"] = _aligned(running_integral(alpha_dot, interval), alpha)
        path["V"] = _aligned(running_integral((u * u_dot + w * w_dot) / plane, interval), plane) / np.cos(beta)
        alpha = _blended(alpha, path["alpha"], blend / interval)
        speed = _blended(speed, path["V"], blend / interval)
        plane = speed * np.cos(beta)
        u, w, v = plane * np.cos(alpha), plane * np.sin(alpha), speed * np.sin(beta)
    else:
        alpha_dot = derivative(alpha, interval)
        a_x = derivative(u, interval) + GRAVITY * np.sin(theta) + q * w - r * v
        a_z = derivative(w, interval) - GRAVITY * np.cos(theta) * np.cos(phi) - q * u + p * v
        a_x, a_z = accelerations.get("a_x", a_x), accelerations.get("a_z", a_z)
    h = true.get("h", np.zeros_like(q))
    if "h" in true and "theta" in true:
        if driven:
            # The path's own angle of attack: gusts move the vane and not the aircraft.
            u, w = plane * np.cos(path["alpha"]), plane * np.sin(path["alpha"])
        climb = u * np.sin(theta) - v * np.sin(phi) * np.cos(theta) - w * np.cos(phi) * np.cos(theta)
        path["h"] = _aligned(running_integral(climb, interval), h)
    if "theta" not in true:
        path.pop("V", None)
    return Motion(speed, alpha, q, theta, h, q_dot, alpha_dot, a_x, a_z, path, alpha_vane - alpha)


def predicted_records(recording: Recording, effects: Sequence[ActiveEffect], motion: Motion) -> dict[str, Array]:
    """What the sensors of theta, alpha, V and h would read of the integrated path, (N,) each."""
    found = {}
    for name, values in motion.path.items():
        if name == "alpha":
            x, y, z = position(recording, effects, "alpha")
            if x or y or z:
                plane = motion.V * np.cos(_input(recording, "beta"))
                down = plane * np.sin(values) + _input(recording, "p") * y - motion.q * x
                ahead = plane * np.cos(values) + motion.q * z - _input(recording, "r") * y
                values = np.arctan2(down, ahead)
        read = as_read(recording, effects, name, values[:, None])[:, 0]
        found[name] = read + bias(recording, effects, name)
    return found


def _at_centre(
    recording: Recording, effects: Sequence[ActiveEffect], alpha: Array, speed: Array, q: Array, p: Array
) -> Array:
    """Angle of attack at the centre of gravity from that of the vane, to first order in the rates."""
    x, y, z = position(recording, effects, "alpha")
    if not (x or y or z):
        return alpha
    return np.asarray(alpha + (q * x - p * y) / speed * np.cos(alpha) + q * z / speed * np.sin(alpha))


def _aligned(path: Array, measured: Array) -> Array:
    return np.asarray(path + float(np.mean(measured - path)))


def _blended(measured: Array, path: Array, samples: float) -> Array:
    """The path with the smoothed difference of what was measured from it; a Gaussian of that standard deviation."""
    if samples < 0.5:
        return measured
    difference = measured - path
    centred = np.arange(path.size) - 0.5 * (path.size - 1)
    line = difference.mean() + centred * float(centred @ difference) / float(centred @ centred)
    return np.asarray(path + line + gaussian_filter1d(difference - line, samples, mode="nearest"))


def _input(recording: Recording, name: str) -> Array:
    return np.asarray(recording.manoeuvre.flight.inputs[:, INPUT_COLUMNS.index(name)])
