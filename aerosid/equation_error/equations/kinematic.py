"""Kinematic equations in integral form: attitude, flow angles, airspeed and height from gyros and accelerometers.

    theta = I[q cos phi - r sin phi]
    phi   = I[p + tan theta (q sin phi + r cos phi)],  psi = I[(q sin phi + r cos phi)/cos theta]
    alpha = I[(u w' - w u')/P^2],  P = I[(u u' + w w')/P],  V = P/cos beta
    beta  = asin(I[v']/V)
    h     = I[u sin theta - v sin phi cos theta - w cos phi cos theta]

with u' = a_x - g sin theta - q w + r v, v' = a_y + g cos theta sin phi - r u + p w and
w' = a_z + g cos phi cos theta + q u - p v (Klein & Morelli, Aircraft System Identification, eqs. 10.3-10.6), I the
running integral, and a constant for each path and record. Each case has the equations of what it integrates; the other
motion is taken as measured. Without a vane, sideslip is that of the path (`sideslip_path`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, StateEffect
from aerosid.equation_error.equations.angular_rates import Rates, forces_at_centre, rates_of
from aerosid.equation_error.equations.complementary_filter import blended, without_gusts
from aerosid.equation_error.equations.derived_forces import with_derived_forces
from aerosid.equation_error.equations.inertial_path import aligned, inertial_path
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.rotary_gust import rotary_gust
from aerosid.equation_error.equations.running_integral import derivative, running_integral
from aerosid.equation_error.equations.sensors import as_read, bias, position, with_unseen_as_measured
from aerosid.equation_error.equations.sideslip_path import (
    LateralPath,
    beta_at_centre,
    detrended,
    mean_gust_correction,
    path_errors,
)
from aerosid.equation_error.equations.term_series import MotionSeries
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.motion_loop import added_along, slope_of
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.constants import GRAVITY, Constants
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.motion_laws import factor_places, offsets_of_unit_size, rate_up_to_now
from aerosid.flight_model.vane import alpha_at_centre
from aerosid.signals.sine_and_cosine import sine_and_cosine

Array = NDArray[np.float64]


CACHED_OFFSETS = 6
"""Numerical: parameter sets of an effect of the motion for which what it adds is cached."""


@dataclass(frozen=True)
class Motion:
    """The motion reconstructed from the sensors, corrected for their errors; all (N,), SI.

    `alpha`, `beta`, `V`: inertial path at high frequency, sensors at low; `alpha_dot` from the accelerometers; `path`
    contains the integrated channels whose sensors are there. `gusts`: difference of each vane from its path, fast gusts
    and its noise. `recording`: the record. `sine`, `cosine`: of alpha. `sideslip_errors`, (N, K): error modes of a
    sideslip without a vane, rad, each of one standard deviation.
    """

    V: Array
    alpha: Array
    beta: Array
    rates: Rates
    phi: Array
    theta: Array
    h: Array
    alpha_dot: Array
    specific_force: Mapping[str, Array]
    path: Mapping[str, Array]
    gusts: Mapping[str, Array]
    recording: Recording
    sine: Array
    cosine: Array
    sideslip_errors: Array

    @cached_property
    def sideslip_errors_in_band(self) -> Array:
        """Effect of usual errors of other sensors on a sideslip without a vane, rad, (n, K), in the band."""
        return self.recording.band(self.sideslip_errors)

    @cached_property
    def course(self) -> MotionSeries:
        """The motion as the coefficient equations take it."""
        measured = self.recording.channels.get("V", self.V)
        level = self.recording.sine_and_cosine("phi", self.phi)[1]
        gravity = GRAVITY * np.cos(self.theta - self.alpha) * level
        attitude = (self.phi, self.theta, self.alpha_dot, self.sine, self.cosine)
        series = (self.V, measured, self.alpha, self.beta, *vars(self.rates).values(), *attitude, gravity)
        return MotionSeries(*map(np.ascontiguousarray, series))

    @cached_property
    def gusts_in_rates(self) -> Mapping[str, Array]:
        """Difference of each vane from its path as the derivatives of sampled rates show it, (N,)."""
        return {name: self.recording.in_rates(gust) if gust.any() else gust for name, gust in self.gusts.items()}

    @cached_property
    def _rotary_gusts(self) -> dict[str, Array]:
        return {}

    def rotary_gust(self, vane: str, constants: Constants) -> Array:
        """The rotary gust that a vane shows as the derivatives of sampled rates show it, as q_hat or r_hat, (N,).

        By the vane's difference from the path itself: that from the blend of both lacks gusts where it follows the
        vane closely.
        """
        if vane not in self._rotary_gusts:
            blend = {"alpha": self.alpha, "beta": self.beta}[vane]
            difference = self.gusts[vane] + blend - self.path.get(vane, blend)
            speed, interval = float(np.mean(self.V)), self.recording.interval
            found = rotary_gust(difference, vane, speed, interval, constants)
            self._rotary_gusts[vane] = self.recording.in_rates(found)
        return self._rotary_gusts[vane]

    @cached_property
    def states(self) -> Array:
        """The motion as the states of the record's case, (N, n); heading, on which nothing depends, is left zero."""
        plane = self.V * np.cos(self.beta)
        known = {
            "u": plane * self.cosine,
            "v": self.V * np.sin(self.beta),
            "w": plane * self.sine,
            "p": self.rates.p,
            "q": self.rates.q,
            "r": self.rates.r,
            "phi": self.phi,
            "theta": self.theta,
            "h": self.h,
            "psi": np.zeros_like(self.V),
        }
        return np.column_stack([known[name] for name in self.recording.manoeuvre.axes.integrated])

    @cached_property
    def _rate_up_to_now(self) -> Array:
        return rate_up_to_now(self.recording.time, np.ascontiguousarray(self.alpha))

    @cached_property
    def _offsets(self) -> dict[tuple[object, ...], tuple[Array, ...]]:
        return {}

    def added_by(self, active: ActiveEffect, model: AerodynamicModel, flight: Flight) -> dict[str, Array]:
        """Contribution of an effect of the motion to each of its input columns, (N,) each; not to be written to.

        One that is not proportional to a coefficient depends on the motion alone but for factors of its columns, and
        is computed once for its other parameters.
        """
        effect, ground = active.effect, self.recording.manoeuvre.ground
        assert isinstance(effect, StateEffect)
        if effect.proportional:
            return added_along(active, model, flight, np.array(model.values), self.states, ground)
        numbers, places = effect.law_numbers(active.values), factor_places(effect.law, len(effect.columns))
        key = (effect.law, places, *(number for place, number in enumerate(numbers) if place not in places))
        found = self._offsets.pop(key, None)
        if found is None:
            course = np.ascontiguousarray(self.alpha), self._rate_up_to_now, self.h - ground
            found = offsets_of_unit_size(effect.law, numbers, len(places), self.recording.time, course)
        self._offsets[key] = found
        if len(self._offsets) > CACHED_OFFSETS:
            del self._offsets[next(iter(self._offsets))]
        slope = slope_of(model, effect)
        by_alpha = 0.0 if slope is None else float(model.values[slope])
        factors = (by_alpha if place is None else numbers[place] for place in places)
        return {name: factor * row for name, factor, row in zip(effect.columns, factors, found, strict=True)}


def reconstruct(
    recording: Recording, effects: Sequence[ActiveEffect], true: Mapping[str, Array], settings: EquationErrorSettings
) -> Motion:
    """Flight-path reconstruction from channels corrected for their sensors' errors.

    Parameters
    ----------
    true : mapping of str to ndarray, shape (N,)
        The compared channels; those of theta, accelerations and h that are missing predict nothing.
    settings : EquationErrorSettings
        Smoothing times of the difference between measured and integrated signals.
    """
    interval, drift = recording.interval, settings.wind_memory / recording.interval
    integrated = recording.manoeuvre.axes.integrated
    rates = rates_of(recording, true)
    q = rates.q

    def held(name: str) -> Array:
        return true[name] if name in true else recording.measured_input(name)

    phi = held("phi")
    speed, alpha_vane, beta_vane = _flow_at_centre(recording, effects, (held("V"), held("alpha"), held("beta")), rates)
    bank = recording.sine_and_cosine("phi", phi)
    theta, pitch, path = _attitude(recording, rates, true, (phi, *bank), alpha_vane)
    forces = forces_at_centre(recording, effects, true, rates)
    alpha, beta, alpha_dot = alpha_vane, beta_vane, np.zeros_like(q)
    aside = recording.sine_and_cosine("beta", beta)
    plane, u, w, v = _velocities(speed, sine_and_cosine(alpha), aside)
    along_path = "u" in integrated and {"a_x", "a_z"} <= forces.keys()
    has_lateral_path = "v" in integrated and "a_y" in forces
    has_beta_vane = has_lateral_path and "beta" in true
    side = forces.get("a_y", np.zeros_like(q)) + GRAVITY * pitch[1] * bank[0]
    lateral = LateralPath(side, rates, interval, has_vane=has_beta_vane)
    if has_lateral_path and not has_beta_vane:
        beta_vane = lateral.path((u, w), v, speed)
        aside = recording.sine_and_cosine("beta", beta_vane)
        plane, u, w, v = _velocities(speed, sine_and_cosine(alpha), aside)
    if along_path:
        flow = (alpha, beta_vane, speed, aside[1])
        found, alpha_dot = _path_in_plane(lateral, forces, (pitch, bank), flow, (plane, u, w, v), drift)
        path |= found
        alpha, speed = blended(np.stack([alpha, speed]), np.stack([*found.values()]), settings.blend / interval)
    elif "u" in integrated:
        alpha_dot = derivative(alpha, interval)
    turn = sine_and_cosine(alpha)
    if has_lateral_path:
        _, u, w, v = _velocities(speed, turn, aside)
        beta_path = lateral.path((u, w), v, speed)
        if has_beta_vane:
            path["beta"] = beta_path
            beta = blended(beta, beta_path, settings.blend_aside / interval)
        else:
            beta = beta_vane = beta_path
        aside = recording.sine_and_cosine("beta", beta)
        _, u, w, v = _velocities(speed, turn, aside)
    forces = with_derived_forces(recording, forces, (u, v, w), rates, (phi, theta))
    h = true.get("h", np.zeros_like(q))
    if "h" in true and "theta" in true:
        if along_path:
            # Angle of attack and speed of the path: gusts move the vane and the pitot tube, and not the aircraft.
            _, u, w, _ = _velocities(path["V"], sine_and_cosine(path["alpha"]), aside)
        path["h"] = aligned(running_integral(_climb((u, v, w), bank, pitch), interval), h)
    if "theta" not in true:
        path.pop("V", None)
    gusts = {"alpha": alpha_vane - alpha, "beta": beta_vane - beta}
    modes = np.zeros((q.size, 0))
    if has_lateral_path and not has_beta_vane:
        modes = path_errors(rates, (phi, theta), speed, interval, settings.path_errors)
    return Motion(speed, alpha, beta, rates, phi, theta, h, alpha_dot, forces, path, gusts, recording, *turn, modes)


def _path_in_plane(
    lateral: LateralPath,
    forces: Mapping[str, Array],
    attitude: tuple[tuple[Array, Array], tuple[Array, Array]],
    flow: tuple[Array, Array, Array, Array],
    velocities: tuple[Array, Array, Array, Array],
    drift: float,
) -> tuple[dict[str, Array], Array]:
    """Angle of attack, rad, and airspeed, m/s, of the path in the plane of symmetry, and the angle's rate, (N,) each.

    Parameters
    ----------
    attitude : tuple of tuple of ndarray
        Sine and cosine of the pitch angle, and of the bank angle.
    flow : tuple of ndarray, shape (N,)
        Angle of attack, sideslip and airspeed as measured, and the cosine of sideslip.
    velocities : tuple of ndarray, shape (N,)
        Speed in the plane, and u, w, v of these.
    drift : float
        Samples over which the wind drifts.
    """
    (pitch, bank), (alpha, beta, speed, aside), (plane, u, w, v) = attitude, flow, velocities
    rates, interval = lateral.rates, lateral.interval
    beta_path = beta
    if lateral.has_vane:
        # A side gust moves the vane and not the aircraft: by r v and p v it would bias the path in the plane.
        beta_path = lateral.path((u, w), v, speed)
        v = speed * np.sin(without_gusts(beta[None], beta_path[None], drift)[0])
    ahead = forces["a_x"] - GRAVITY * pitch[0] + rates.r * v
    below = forces["a_z"] + GRAVITY * pitch[1] * bank[1] - rates.p * v
    (path, path_speed), alpha_dot = inertial_path((alpha, plane), rates.q, (ahead, below), interval, drift)
    if lateral.has_vane:
        bent = running_integral(-(u * rates.p + w * rates.r) / plane**2, interval)
        path = path + mean_gust_correction(alpha - path, bent, speed * np.sin(beta - beta_path))
    return {"alpha": path, "V": path_speed / aside}, alpha_dot


def with_height(motion: Motion, h: Array) -> Motion:
    """The motion with another height, m, (N,), of its sensor without its errors."""
    if "h" not in motion.path:
        return replace(motion, h=h)
    return replace(motion, h=h, path={**motion.path, "h": aligned(motion.path["h"], h)})


def _climb(velocities: tuple[Array, Array, Array], bank: tuple[Array, Array], pitch: tuple[Array, Array]) -> Array:
    """Rate of climb, m/s, (N,), of velocities along the body axes, the angles by sine and cosine."""
    u, v, w = velocities
    return np.asarray(u * pitch[0] - v * bank[0] * pitch[1] - w * bank[1] * pitch[1])


def _velocities(
    speed: Array, alpha: tuple[Array, Array], beta: tuple[Array, Array]
) -> tuple[Array, Array, Array, Array]:
    """Speed in the plane of symmetry, and u, w, v, m/s, (N,) each, the angles by sine and cosine."""
    plane = speed * beta[1]
    return plane, plane * alpha[1], plane * alpha[0], speed * beta[0]


def _attitude(
    recording: Recording, rates: Rates, true: Mapping[str, Array], bank: tuple[Array, Array, Array], alpha: Array
) -> tuple[Array, tuple[Array, Array], dict[str, Array]]:
    """Pitch angle (N,), its sine and cosine, and the integrated angles whose sensors are there.

    `bank`: phi, its sine and its cosine.
    """
    phi, phi_sine, phi_cosine = bank
    interval, integrated = recording.interval, recording.manoeuvre.axes.integrated
    p, q, r = rates.p, rates.q, rates.r
    path: dict[str, Array] = {}
    if "theta" not in integrated:
        theta = recording.measured_input("theta")
    else:
        turned = running_integral(q * phi_cosine - r * phi_sine, interval)
        if "theta" in true:
            theta = true["theta"]
            path["theta"] = turned + float(np.mean(theta - turned))
        else:
            theta = turned + float(np.mean(alpha - turned))  # level on average
    pitch = recording.sine_and_cosine("theta", theta)
    turn = q * phi_sine + r * phi_cosine
    if "phi" in integrated and "phi" in true:
        path["phi"] = aligned(running_integral(p + np.tan(theta) * turn, interval), phi)
    if "psi" in integrated and "psi" in true:
        path["psi"] = aligned(running_integral(turn / pitch[1], interval), true["psi"])
    return theta, pitch, path


def predicted_records(recording: Recording, effects: Sequence[ActiveEffect], motion: Motion) -> dict[str, Array]:
    """Predicted signals of the sensors of the integrated channels, (N,) each."""
    found = {}
    rates = motion.rates
    for name, values in motion.path.items():
        x, y, z = position(recording, effects, name)
        if name == "V" and z:
            values = values + z * rates.q
        elif name == "alpha" and (x or y or z):
            plane = motion.V * np.cos(motion.beta)
            down = plane * np.sin(values) + rates.p * y - rates.q * x
            ahead = plane * np.cos(values) + rates.q * z - rates.r * y
            values = np.arctan2(down, ahead)
        elif name == "beta":
            values = values + (x * rates.r - z * rates.p) / motion.V
        read = as_read(recording, effects, name, values[:, None])[:, 0]
        found[name] = with_unseen_as_measured(recording, effects, name, read + bias(recording, effects, name))
    return found


def path_as_measured(recording: Recording, settings: EquationErrorSettings) -> Mapping[str, Array]:
    """The integrated channels, (N,) each, reconstructed from all channels as measured; computed once."""
    return recording.path_as_measured(lambda: reconstruct(recording, (), recording.channels, settings).path)


def inconsistent_heading(recording: Recording, settings: EquationErrorSettings) -> tuple[str, ...]:
    """Heading, where inconsistent with the rates: a magnetic one that swings, or another quantity under its name."""
    if "psi" not in recording.channels:
        return ()
    path = path_as_measured(recording, settings)["psi"]
    measured, left = (detrended(values) for values in (recording.channels["psi"], recording.channels["psi"] - path))
    return () if left @ left < (1.0 - settings.followed) * (measured @ measured) else ("psi",)


def _flow_at_centre(
    recording: Recording, effects: Sequence[ActiveEffect], read: tuple[Array, Array, Array], rates: Rates
) -> tuple[Array, Array, Array]:
    """Airspeed, angle of attack and sideslip of the centre of gravity from those at their sensors."""
    speed = _speed_at_centre(recording, effects, read[0], rates)
    alpha = _alpha_at_centre(recording, effects, read[1], speed, rates)
    return speed, alpha, beta_at_centre(recording, effects, read[2], speed, rates)


def _speed_at_centre(recording: Recording, effects: Sequence[ActiveEffect], speed: Array, rates: Rates) -> Array:
    """Airspeed of the centre of gravity from that of a pitot tube below or above it, flow along the fuselage."""
    if "V" not in recording.channels:
        return speed
    return np.asarray(speed - position(recording, effects, "V")[2] * rates.q)


def _alpha_at_centre(
    recording: Recording, effects: Sequence[ActiveEffect], alpha: Array, speed: Array, rates: Rates
) -> Array:
    """Angle of attack at the centre of gravity from that of the vane, to first order in the rates."""
    if "alpha" not in recording.channels:
        return alpha  # a measured input is corrected on reading
    ahead, right, below = position(recording, effects, "alpha").tolist()
    return alpha_at_centre(alpha, (ahead, right, below), rates.p, rates.q, rates.r, speed)
