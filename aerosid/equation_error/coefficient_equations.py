"""Coefficient equations: C_X, C_Z and C_m from accelerometers and pitch acceleration, linear in the model's terms.

    m a_x - T cos(incidence) = q_bar S C_X,   m a_z + T sin(incidence) = q_bar S C_Z,
    I_yy q' - T z_arm = q_bar S c C_m

each as its sensor would read it: the model's side is moved to the sensor and goes through the sensor's faults, so that
a fault's likelihood is that of the channel as measured. C_L and C_D act as C_X = C_L sin alpha - C_D cos alpha,
C_Z = -C_L cos alpha - C_D sin alpha. Klein & Morelli, Aircraft System Identification, section 5.1 (equation error).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, StateEffect
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.kinematic_equations import Motion, accelerometer_offsets
from aerosid.equation_error.recording import Recording
from aerosid.equation_error.sensors import as_read, bias
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.motion_loop import added_along
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.terms import Term

Array = NDArray[np.float64]


TOUCHED = {"C_L": ("C_X", "C_Z"), "C_D": ("C_X", "C_Z")}
"""The body-axis equations that a coefficient of the wind axes touches; every other touches its own."""


def term_variables(model: AerodynamicModel, motion: Motion, inputs: Array) -> dict[str, Array]:
    """Every variable that a term may name, (N,) each, along a motion."""
    constants = model.constants
    columns = dict(zip(model.columns, inputs.T, strict=True))
    rate_speed = constants.airspeed_of_rates if constants.airspeed_of_rates > 0.0 else motion.V
    thrust = _thrust(model, columns)
    return columns | {
        "alpha": motion.alpha,
        "q_hat": motion.q * constants.mean_chord / (2.0 * rate_speed),
        "V_hat": motion.V / constants.airspeed_of_V_hat - 1.0,
        "alpha_dot_hat": motion.alpha_dot * constants.mean_chord / (2.0 * rate_speed),
        "C_T": thrust / _force(model, motion, columns),
        "mach": motion.V / columns["speed_of_sound"],
        "thrust": thrust,
    }


def term_series(term: Term, variables: Mapping[str, Array]) -> Array:
    """A term along the variables, (N,)."""
    values = np.ones_like(variables["alpha"])
    for factor in term.factors:
        x = variables[factor.variable]
        if factor.shape == "abs":
            x = np.abs(x)
        elif factor.shape == "pos":
            x = np.maximum(x - factor.offset, 0.0)
        values = values * x**factor.power
    return values


class CoefficientEquations:
    """The three equations of one recording at one point of the search, before they are brought into the band.

    All in units of the coefficient: what is measured, what is known of it, what one unit of a term adds.
    """

    def __init__(
        self,
        recording: Recording,
        model: AerodynamicModel,
        effects: Sequence[ActiveEffect],
        motion: Motion,
        free: Sequence[Entry],
    ) -> None:
        self._recording, self._effects, self._motion = recording, effects, motion
        flight, _ = acting_flight(model, recording.manoeuvre, effects)
        inputs = flight.inputs
        self._slopes: dict[Entry, Array] = {}
        for active in effects:
            if isinstance(active.effect, StateEffect) and active.acts_on(recording.name):
                inputs = self._with_state_effect(active, model, replace_inputs(flight, inputs))
        columns = dict(zip(model.columns, inputs.T, strict=True))
        self.variables = term_variables(model, motion, inputs)
        self._sine, self._cosine = np.sin(motion.alpha), np.cos(motion.alpha)
        self._force = _force(model, motion, columns)
        self._mass = columns["mass"]
        constants = model.constants
        # Residuals are weighed by the airspeed as measured: one that a fault moved would make them look small.
        reference = self._force * (recording.channels["V"] / motion.V) ** 2
        self._force_per_unit = {
            "C_X": self._force / self._mass,
            "C_Z": self._force / self._mass,
            "C_m": self._force * constants.mean_chord / constants.I_yy,
        }
        self._in_units = {
            "C_X": self._mass / reference,
            "C_Z": self._mass / reference,
            "C_m": constants.I_yy / (reference * constants.mean_chord),
        }
        thrust = _thrust(model, columns)
        thrusting = {
            "C_X": thrust * np.cos(constants.thrust_incidence) / self._mass,
            "C_Z": -thrust * np.sin(constants.thrust_incidence) / self._mass,
        }
        if any("alpha_dot_hat" in term.variables for _, term in (*free, *model.entries)) or ahead_of(model):
            forces = self._modelled(model, thrusting)
            self.variables["alpha_dot_hat"] = self._modelled_alpha_dot(model, forces, columns)
        known = self._known_loads(columns, thrusting)
        known["C_m"] = thrust * constants.thrust_z_arm / constants.I_yy
        ahead, below = _shift(model, columns)
        if ahead.any() or below.any():
            lever = self._mass * (ahead * forces["C_Z"] - below * forces["C_X"])
            known["C_m"] = known["C_m"] + lever / constants.I_yy
        for name, series in self._arms(model, columns, known["C_m"]).items():
            known[name] = known[name] + series
        held = set(free)
        for entry, value in zip(model.entries, model.values, strict=True):
            if entry not in held and value != 0.0:
                for name, series in self._accelerations(entry).items():
                    known[name] = known[name] + value * series
        self._known = known

    @property
    def names(self) -> tuple[str, ...]:
        """The equations."""
        return tuple(self._known)

    def target(self, name: str) -> Array:
        """What is measured less what is known, (N,)."""
        return self._beyond(name, self._known[name])

    def columns(self, name: str, entries: Sequence[Entry]) -> tuple[list[Entry], Array]:
        """The entries that touch an equation, and what one unit of each adds to it, (N, K)."""
        touching = [entry for entry in entries if name in TOUCHED.get(entry[0], (entry[0],))]
        if not touching:
            return [], np.zeros((self._motion.alpha.size, 0))
        stacked = np.column_stack([self._accelerations(entry)[name] for entry in touching])
        return touching, self._read(name, stacked) * self._in_units[name][:, None]

    def left(self, values: Mapping[Entry, float]) -> dict[str, Array]:
        """What terms of some values leave of each equation, (N,)."""
        totals: dict[str, Array] = {}
        for entry, value in values.items():
            if value != 0.0:
                series = value * self._series(entry)
                totals[entry[0]] = totals[entry[0]] + series if entry[0] in totals else series
        said = dict(self._known)
        for coefficient, series in totals.items():
            for name, part in self._body_axes(coefficient, series).items():
                said[name] = said[name] + part * self._force_per_unit[name]
        return {name: self._beyond(name, series) for name, series in said.items()}

    def _beyond(self, name: str, series: Array) -> Array:
        """What is measured beyond an acceleration, in units of the coefficient."""
        left = self._measured(name) - self._read(name, series[:, None])[:, 0]
        return np.asarray(left * self._in_units[name])

    def _series(self, entry: Entry) -> Array:
        series = term_series(entry[1], self.variables)
        return series + self._slopes[entry] if entry in self._slopes else series

    def _body_axes(self, coefficient: str, series: Array) -> dict[str, Array]:
        """What a coefficient's term adds to C_X, C_Z and C_m, (N,) each; those it does not touch are left out."""
        if coefficient == "C_L":
            return {"C_X": series * self._sine, "C_Z": -series * self._cosine}
        if coefficient == "C_D":
            return {"C_X": -series * self._cosine, "C_Z": -series * self._sine}
        return {coefficient: series}

    def _accelerations(self, entry: Entry) -> dict[str, Array]:
        return {
            name: part * self._force_per_unit[name]
            for name, part in self._body_axes(entry[0], self._series(entry)).items()
        }

    def _measured(self, name: str) -> Array:
        recording, motion = self._recording, self._motion
        if name == "C_m":
            return recording.q_dot
        channel = _channel(name)
        if channel in recording.channels:
            return recording.channels[channel] - bias(recording, self._effects, channel)
        return motion.a_x if channel == "a_x" else motion.a_z

    def _read(self, name: str, series: Array) -> Array:
        """Series (N, K) as the equation's sensor reads them."""
        channel = "q" if name == "C_m" else _channel(name)
        return as_read(self._recording, self._effects, channel, series)

    def _known_loads(self, columns: Mapping[str, Array], thrusting: Mapping[str, Array]) -> dict[str, Array]:
        """Accelerations at the accelerometers that no free term makes: thrust and declared lever arms."""
        motion, recording = self._motion, self._recording
        offsets = accelerometer_offsets(recording, (), motion.q, motion.q_dot, columns["p"], columns["r"])
        known = dict(thrusting)
        for name in known:
            if _channel(name) in recording.channels:
                known[name] = known[name] + offsets[_channel(name)]
        return known

    def _arms(self, model: AerodynamicModel, columns: Mapping[str, Array], given: Array) -> dict[str, Array]:
        """What further arms add at the accelerometers: sensors that sit elsewhere, a centre of gravity that moved.

        With the pitch acceleration of the model's moment and of what is `given` beside it, rad/s^2. The measured one
        answers the gusts that the forces answer: an arm would be seen where there is none.
        """
        motion, recording = self._motion, self._recording
        ahead, below = _shift(model, columns)
        placed = any(isinstance(active.effect, PositionEffect) for active in self._effects)
        if not (placed or ahead.any() or below.any()):
            return {}
        turning = given
        for entry, value in zip(model.entries, model.values, strict=True):
            if entry[0] == "C_m" and value != 0.0:
                turning = turning + value * self._accelerations(entry)["C_m"]
        p, q, r = columns["p"], motion.q, columns["r"]
        here = accelerometer_offsets(recording, self._effects, q, turning, p, r)
        declared = accelerometer_offsets(recording, (), q, turning, p, r)
        # Sensors keep their places in the aircraft when the centre of gravity moves.
        shifted = {
            "C_X": (q**2 + r**2) * ahead - (turning + p * r) * below,
            "C_Z": -(p * r - turning) * ahead + (p**2 + q**2) * below,
        }
        for name in shifted:
            channel = _channel(name)
            if channel in recording.channels:
                shifted[name] = shifted[name] + here[channel] - declared[channel]
        return shifted

    def _modelled(self, model: AerodynamicModel, thrusting: Mapping[str, Array]) -> dict[str, Array]:
        """Specific forces along x and z as the model gives them, m/s^2.

        Measured ones hold the same gusts as the moment: a term or a lever with them in it would explain those.
        """
        forces = dict(thrusting)
        for entry, value in zip(model.entries, model.values, strict=True):
            if value != 0.0 and "alpha_dot_hat" not in entry[1].variables:
                for name, series in self._accelerations(entry).items():
                    if name in forces:
                        forces[name] = forces[name] + value * series
        return forces

    def _modelled_alpha_dot(
        self, model: AerodynamicModel, forces: Mapping[str, Array], columns: Mapping[str, Array]
    ) -> Array:
        """The rate of alpha by the model's forces, times c/(2 U0)."""
        motion, constants = self._motion, model.constants
        climb = motion.theta - motion.alpha
        normal = forces["C_Z"] * np.cos(motion.alpha) - forces["C_X"] * np.sin(motion.alpha)
        rate = motion.q + (normal + GRAVITY * np.cos(climb) * np.cos(columns["phi"])) / motion.V
        rate_speed = constants.airspeed_of_rates if constants.airspeed_of_rates > 0.0 else motion.V
        return np.asarray(rate * constants.mean_chord / (2.0 * rate_speed))

    def _with_state_effect(self, active: ActiveEffect, model: AerodynamicModel, flight: object) -> Array:
        """The inputs with what an effect of the motion adds; its share of the lift stays with that derivative."""
        effect, motion = active.effect, self._motion
        assert isinstance(effect, StateEffect)
        states = np.column_stack(
            [motion.V * np.cos(motion.alpha), motion.V * np.sin(motion.alpha), motion.q, motion.theta, motion.h]
        )
        ground = self._recording.manoeuvre.ground
        added = added_along(active, model, flight, np.array(model.values), states, ground)  # type: ignore[arg-type]
        inputs = flight.inputs.copy()  # type: ignore[attr-defined]
        slope = next((e for e in model.entries if e[0] == effect.lift and str(e[1]) == "alpha"), None)
        for n, (column, series) in enumerate(added.items()):
            if n == 0 and slope is not None and not effect.proportional and model.value(slope) != 0.0:
                self._slopes[slope] = self._slopes.get(slope, 0.0) + series / model.value(slope)
            else:
                inputs[:, model.columns.index(column)] += series
        return np.asarray(inputs)


def replace_inputs(flight: object, inputs: Array) -> object:
    """The flight with other inputs."""
    return flight._replace(inputs=inputs)  # type: ignore[attr-defined]


def _channel(name: str) -> str:
    return {"C_X": "a_x", "C_Z": "a_z"}[name]


def _force(model: AerodynamicModel, motion: Motion, columns: Mapping[str, Array]) -> Array:
    """Dynamic pressure times wing area, N, (N,)."""
    return np.asarray(0.5 * columns["rho"] * motion.V**2 * model.constants.wing_area)


def _thrust(model: AerodynamicModel, columns: Mapping[str, Array]) -> Array:
    place = model.constants.thrust_change
    if place < 0:
        return columns["thrust"]
    return np.asarray(columns["thrust"] + columns[model.extra_columns[place]])


def ahead_of(model: AerodynamicModel) -> bool:
    """Whether the model's centre of gravity may move."""
    return model.constants.cg_x >= 0 or model.constants.cg_z >= 0


def _shift(model: AerodynamicModel, columns: Mapping[str, Array]) -> tuple[Array, Array]:
    """How far the centre of gravity lies ahead of and below the declared one, m, (N,) each."""
    zero = np.zeros_like(columns["rho"])
    ahead, below = (
        zero if place < 0 else columns[model.extra_columns[place]]
        for place in (model.constants.cg_x, model.constants.cg_z)
    )
    return ahead, below
