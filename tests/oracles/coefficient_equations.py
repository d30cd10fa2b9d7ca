"""The coefficient equations by whole series, one numpy operation after another, every term made anew."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, StateEffect
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.angular_rates import Rates
from aerosid.equation_error.equations.channels import MEASURED_BY
from aerosid.equation_error.equations.kinematic import Motion
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.sensors import as_read, bias, position
from aerosid.estimation.effects_in_flight import acting_model
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import ACCELERATIONS
from aerosid.flight_model.constants import GRAVITY, Constants
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.terms import LIFT, Term

Array = NDArray[np.float64]


OF_THRUST = ("C_T", "thrust")
"""Variables that are computed from the thrust, an input."""

TOUCHED = {"C_L": ("C_X", "C_Z"), "C_D": ("C_X", "C_Z")}
"""The body-axis equations that a coefficient of the wind axes touches; every other touches its own."""


def term_variables(model: AerodynamicModel, motion: Motion, inputs: Array) -> dict[str, Array]:
    """Every variable that a term may name, (N,) each, along a motion."""
    constants, rates = model.constants, motion.rates
    columns = dict(zip(model.columns, inputs.T, strict=True))
    rate_speed = constants.airspeed_of_rates if constants.airspeed_of_rates > 0.0 else motion.V
    thrust = _thrust(model, columns)
    return columns | {
        "alpha": motion.alpha,
        "beta": motion.beta,
        "p_hat": rates.p * constants.span / (2.0 * rate_speed),
        "q_hat": rates.q * constants.mean_chord / (2.0 * rate_speed),
        "r_hat": rates.r * constants.span / (2.0 * rate_speed),
        "p": rates.p,
        "r": rates.r,
        "phi": motion.phi,
        "theta": motion.theta,
        "V_hat": motion.V / constants.airspeed_of_V_hat - 1.0,
        "alpha_dot_hat": motion.alpha_dot * constants.mean_chord / (2.0 * rate_speed),
        "C_T": thrust / _force(model, motion, columns),
        "mach": motion.V / columns["speed_of_sound"],
        "thrust": thrust,
    }


def term_series(term: Term, variables: Mapping[str, Array]) -> Array:
    """A term along the variables, (N,)."""
    values: Array | None = None
    for factor in term.factors:
        x = variables[factor.variable]
        if factor.shape == "abs":
            x = np.abs(x)
        elif factor.shape == "pos":
            x = np.maximum(x - factor.offset, 0.0)
        if factor.power != 1:
            x = x**factor.power
        values = x if values is None else values * x
    return np.ones_like(variables["alpha"]) if values is None else values


class CoefficientEquations:
    """The equations of one recording at one point of the search, before they are brought into the band.

    All in units of the coefficient: what is measured, what is known of it, what one unit of a term adds. Series are
    computed once and shared, so that none may be written to.
    """

    def __init__(
        self,
        recording: Recording,
        model: AerodynamicModel,
        effects: Sequence[ActiveEffect],
        motion: Motion,
        free: Sequence[Entry],
    ) -> None:
        declared, model = model.constants, acting_model(model, effects)
        self._recording, self._effects, self._motion = recording, effects, motion
        flight = recording.acting_flight(model, effects)
        inputs = flight.inputs
        self._slopes: dict[Entry, Array] = {}
        self._kept: dict[Entry, Array] = {}
        for active in effects:
            if isinstance(active.effect, StateEffect) and active.acts_on(recording.name):
                inputs = self._with_state_effect(active, model, flight._replace(inputs=inputs))
        columns = dict(zip(model.columns, inputs.T, strict=True))
        self.variables = term_variables(model, motion, inputs)
        self._of_inputs = {*model.columns, *OF_THRUST} - set(recording.manoeuvre.axes.measured)
        held_in_terms = {name for _, term in (*free, *model.entries) for name in term.variables}
        self._fill_lift(model, held_in_terms)
        self._sine, self._cosine = motion.sine, motion.cosine
        self._force = _force(model, motion, columns)
        self._mass = columns["mass"]
        constants = model.constants
        self._weigh(declared, constants)
        thrust = _thrust(model, columns)
        thrusting, thrust = self._thrusting(thrust, constants), recording.in_rates(thrust)
        uses_alpha_dot = "alpha_dot_hat" in held_in_terms
        centre = centre_of(model, columns)
        forces = self._modelled(model, thrusting) if uses_alpha_dot or centre.is_moved else {}
        if uses_alpha_dot:
            self._vary("alpha_dot_hat", self._modelled_alpha_dot(model, forces))
            self._fill_lift(model, held_in_terms)
        known = self._known_forces(thrusting) | self._known_moments(thrust, declared, motion.rates)
        if centre.is_moved:
            for name, moment in levers(forces, centre).items():
                known[name] = known[name] + self._mass * moment / getattr(constants, _INERTIA[name])
        for name, series in self._arms(model, centre, known).items():
            known[name] = known[name] + series
        if constants != declared:
            rates = self._modelled_rates(model, known)
            other, usual = (self._known_moments(thrust, each, rates) for each in (constants, declared))
            known |= {name: known[name] + other[name] - usual[name] for name in other}
        held = set(free)
        fixed = {entry: value for entry, value in _values_of(model) if entry not in held}
        self._known = self._with_terms(known, fixed)

    def _weigh(self, declared: Constants, constants: Constants) -> None:
        """Accelerations that one unit of each coefficient makes, and the unit of its equation."""
        recording, speed = self._recording, self._motion.V
        # Residuals are weighed by airspeed as measured and inertia as declared: others would make them look small.
        reference = self._force * (recording.channels.get("V", speed) / speed) ** 2
        self._force_per_unit: dict[str, Array] = {}
        self._in_units: dict[str, Array] = {}
        for name in recording.manoeuvre.axes.coefficients:
            if name in _INERTIA:
                length = getattr(constants, _LENGTH[name])
                self._force_per_unit[name] = self._force * length / getattr(constants, _INERTIA[name])
                self._in_units[name] = getattr(declared, _INERTIA[name]) / (reference * length)
            else:
                self._force_per_unit[name] = self._force / self._mass
                self._in_units[name] = self._mass / reference

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
        return {name: self._beyond(name, series) for name, series in self._with_terms(self._known, values).items()}

    def _with_terms(self, known: Mapping[str, Array], values: Mapping[Entry, float]) -> dict[str, Array]:
        """What is known of some accelerations, (N,) each, with that of terms of some values.

        Each coefficient is summed first, and turned to body axes once.
        """
        totals: dict[str, Array] = {}
        for entry, value in values.items():
            if value != 0.0:
                series = value * self._series(entry)
                totals[entry[0]] = totals[entry[0]] + series if entry[0] in totals else series
        said = dict(known)
        for coefficient, series in totals.items():
            for name, part in self._body_axes(coefficient, series).items():
                if name in said:
                    said[name] = said[name] + part * self._force_per_unit[name]
        return said

    def _beyond(self, name: str, series: Array) -> Array:
        """What is measured beyond an acceleration, in units of the coefficient."""
        left = self._measured(name) - self._read(name, series[:, None])[:, 0]
        return np.asarray(left * self._in_units[name])

    def _fill_lift(self, model: AerodynamicModel, held_in_terms: Set[str]) -> None:
        """Lift as the model gives it, where a term holds it: as measured it would hold the gusts that drag answers."""
        for lift in LIFT:
            if lift in held_in_terms:
                self._vary(lift, np.zeros_like(self._motion.alpha))
                for entry, value in zip(model.entries, model.values, strict=True):
                    if entry[0] == lift and value != 0.0:
                        self._vary(lift, self.variables[lift] + value * self._series(entry))

    def _vary(self, name: str, series: Array) -> None:
        """Give a variable another course: what was made of the one before is made again."""
        self.variables[name] = series
        self._kept = {entry: known for entry, known in self._kept.items() if name not in entry[1].variables}

    def _series(self, entry: Entry) -> Array:
        if entry not in self._kept:
            series = term_series(entry[1], self.variables)
            if entry[0] in _INERTIA and not self._of_inputs.isdisjoint(entry[1].variables):
                series = self._recording.in_rates(series)
            self._kept[entry] = series + self._slopes[entry] if entry in self._slopes else series
        return self._kept[entry]

    def _at_samples(self, entry: Entry) -> Array:
        """A term as it is at the samples, (N,), and not as the derivatives of sampled rates show it."""
        shown_alike = not (self._recording.linear_inputs and entry[0] in _INERTIA) and entry not in self._slopes
        return self._series(entry) if shown_alike else term_series(entry[1], self.variables)

    def _body_axes(self, coefficient: str, series: Array) -> dict[str, Array]:
        """What a coefficient's term adds to those about body axes, (N,) each; those it does not touch are left out."""
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
        recording, channel = self._recording, MEASURED_BY[name]
        if channel not in ACCELERATIONS:
            return recording.rate_of(channel)
        if channel in recording.channels:
            return recording.channels[channel] - bias(recording, self._effects, channel)
        return self._motion.specific_force[channel]

    def _read(self, name: str, series: Array) -> Array:
        """Series (N, K) as the equation's sensor reads them."""
        return as_read(self._recording, self._effects, MEASURED_BY[name], series)

    def _thrusting(self, thrust: Array, constants: Constants) -> dict[str, Array]:
        """Specific forces of the thrust, m/s^2, of the coefficients that the case models."""
        forces = {
            "C_X": thrust * np.cos(constants.thrust_incidence) / self._mass,
            "C_Y": np.zeros_like(thrust),
            "C_Z": -thrust * np.sin(constants.thrust_incidence) / self._mass,
        }
        return {name: forces[name] for name in self._force_per_unit if name in forces}

    def _known_forces(self, thrusting: Mapping[str, Array]) -> dict[str, Array]:
        """Accelerations at the accelerometers that no free term makes: thrust and declared lever arms."""
        offsets = self._declared_offsets()
        known = dict(thrusting)
        for name in known:
            channel = MEASURED_BY[name]
            if channel in offsets:
                known[name] = known[name] + offsets[channel]
        return known

    def _declared_offsets(self) -> dict[str, Array]:
        recording, rates = self._recording, self._motion.rates
        measured = [name for name in ("a_x", "a_y", "a_z") if name in recording.channels]
        return {name: lever_accelerations(name, recording.position(name).tolist(), rates) for name in measured}

    def _arms(self, model: AerodynamicModel, centre: Centre, given: Mapping[str, Array]) -> dict[str, Array]:
        """What further arms add at the accelerometers: sensors that sit elsewhere, a centre of gravity that moved.

        With the angular accelerations of the model's moments and of what is `given` beside them, rad/s^2. The measured
        ones answer the gusts that the forces answer: an arm would be seen where there is none.
        """
        recording = self._recording
        placed = any(isinstance(active.effect, PositionEffect) for active in self._effects)
        if not (placed or centre.is_moved):
            return {}
        rates = self._modelled_rates(model, given, at_samples=True)
        # Sensors keep their places in the aircraft when the centre of gravity moves.
        moved = (-centre.ahead, -centre.right, -centre.below)
        added = {}
        for name in (name for name in given if MEASURED_BY[name] in ACCELERATIONS):
            channel = MEASURED_BY[name]
            ahead, right, below = moved
            if placed and channel in recording.channels:
                x, y, z = (position(recording, self._effects, channel) - recording.position(channel)).tolist()
                ahead, right, below = ahead + x, right + y, below + z
            added[name] = lever_accelerations(channel, (ahead, right, below), rates)
        return added

    def _modelled_rates(
        self, model: AerodynamicModel, given: Mapping[str, Array], *, at_samples: bool = False
    ) -> Rates:
        """The rates with the angular accelerations of the model: gusts roll and yaw, and would look like I_xz.

        `at_samples`: as they are there, and not as the derivatives of sampled rates show them.
        """
        turned = {name: given[name] for name in given if name in _INERTIA}
        totals: dict[str, Array] = {}
        for entry, value in _values_of(model):
            name = entry[0]
            if name in turned:
                series = value * (self._at_samples(entry) if at_samples else self._series(entry))
                totals[name] = totals[name] + series if name in totals else series
        for name, series in totals.items():
            turned[name] = turned[name] + series * self._force_per_unit[name]
        return replace(self._motion.rates, **{f"{MEASURED_BY[name]}_dot": turned[name] for name in turned})

    def _known_moments(self, thrust: Array, constants: Constants, rates: Rates) -> dict[str, Array]:
        """Angular accelerations that no free term makes: thrust, as rates show it, and the coupling of turning axes."""
        c = constants
        p, q, r = rates.p, rates.q, rates.r
        made: dict[str, Callable[[], Array]] = {
            "C_l": lambda: c.I_xz * (rates.r_dot + p * q) - (c.I_zz - c.I_yy) * q * r,
            "C_m": lambda: thrust * c.thrust_z_arm - (c.I_xx - c.I_zz) * p * r - c.I_xz * (p * p - r * r),
            "C_n": lambda: c.I_xz * (rates.p_dot - q * r) - (c.I_yy - c.I_xx) * p * q,
        }
        return {name: made[name]() / getattr(c, _INERTIA[name]) for name in self._force_per_unit if name in made}

    def _modelled(self, model: AerodynamicModel, thrusting: Mapping[str, Array]) -> dict[str, Array]:
        """Specific forces as the model gives them, m/s^2.

        Measured ones hold the same gusts as the moment: a term or a lever with them in it would explain those.
        """
        lasting = {entry: value for entry, value in _values_of(model) if "alpha_dot_hat" not in entry[1].variables}
        return self._with_terms(thrusting, lasting)

    def _modelled_alpha_dot(self, model: AerodynamicModel, forces: Mapping[str, Array]) -> Array:
        """The rate of alpha by the model's forces, times c/(2 U0)."""
        motion, constants = self._motion, model.constants
        climb = motion.theta - motion.alpha
        normal = forces["C_Z"] * np.cos(motion.alpha) - forces["C_X"] * np.sin(motion.alpha)
        rate = motion.rates.q + (normal + GRAVITY * np.cos(climb) * np.cos(motion.phi)) / motion.V
        rate_speed = constants.airspeed_of_rates if constants.airspeed_of_rates > 0.0 else motion.V
        return np.asarray(rate * constants.mean_chord / (2.0 * rate_speed))

    def _with_state_effect(self, active: ActiveEffect, model: AerodynamicModel, flight: Flight) -> Array:
        """The inputs with what an effect of the motion adds; its share of the lift stays with that derivative."""
        effect = active.effect
        assert isinstance(effect, StateEffect)
        added = self._motion.added_by(active, model, flight)
        inputs = flight.inputs.copy()
        slope = next((e for e in model.entries if e[0] == effect.lift and str(e[1]) == "alpha"), None)
        for n, (column, series) in enumerate(added.items()):
            if n == 0 and slope is not None and not effect.proportional and model.value(slope) != 0.0:
                self._slopes[slope] = self._slopes.get(slope, 0.0) + series / model.value(slope)
            else:
                inputs[:, model.columns.index(column)] += series
        return np.asarray(inputs)


def _values_of(model: AerodynamicModel) -> list[tuple[Entry, float]]:
    """The terms of a model that add anything, with their values."""
    return [pair for pair in zip(model.entries, model.values.tolist(), strict=True) if pair[1] != 0.0]


_INERTIA = {"C_l": "I_xx", "C_m": "I_yy", "C_n": "I_zz"}
_LENGTH = {"C_l": "span", "C_m": "mean_chord", "C_n": "span"}
"""The moment of inertia and the reference length of each moment, fields of `Constants`."""


def _force(model: AerodynamicModel, motion: Motion, columns: Mapping[str, Array]) -> Array:
    """Dynamic pressure times wing area, N, (N,)."""
    return np.asarray(0.5 * columns["rho"] * motion.V**2 * model.constants.wing_area)


def _thrust(model: AerodynamicModel, columns: Mapping[str, Array]) -> Array:
    place = model.constants.thrust_change
    if place < 0:
        return columns["thrust"]
    return np.asarray(columns["thrust"] + columns[model.extra_columns[place]])


@dataclass(frozen=True)
class Centre:
    """How far the centre of gravity lies ahead of, right of and below the declared one, m, (N,) each."""

    ahead: Array
    right: Array
    below: Array

    @property
    def is_moved(self) -> bool:
        """Whether it lies elsewhere at any time."""
        return bool(self.ahead.any() or self.right.any() or self.below.any())


def centre_of(model: AerodynamicModel, columns: Mapping[str, Array]) -> Centre:
    """Where the centre of gravity lies."""
    zero = np.zeros_like(columns["rho"])
    places = (model.constants.cg_x, model.constants.cg_y, model.constants.cg_z)
    return Centre(*(zero if place < 0 else columns[model.extra_columns[place]] for place in places))


def levers(forces: Mapping[str, Array], centre: Centre) -> dict[str, Array]:
    """Moment over mass that modelled forces make about a centre of gravity elsewhere, m^2/s^2, (N,) each."""
    x, y, z = (forces.get(name) for name in ("C_X", "C_Y", "C_Z"))
    found = {}
    if x is not None and z is not None:
        found["C_m"] = centre.ahead * z - centre.below * x
    if y is not None and z is not None:
        found["C_l"] = centre.below * y - centre.right * z
    if x is not None and y is not None:
        found["C_n"] = centre.right * x - centre.ahead * y
    return found


def lever_accelerations(channel: str, place: Sequence[float] | Sequence[Array], rates: Rates) -> Array:
    """What an accelerometer at a place, m from the centre of gravity, reads beyond one there, (N,) m/s^2."""
    x, y, z = place
    p, q, r = rates.p, rates.q, rates.r
    if channel == "a_x":
        return np.asarray(-(q * q + r * r) * x + (p * q - rates.r_dot) * y + (rates.q_dot + p * r) * z)
    if channel == "a_y":
        return np.asarray((rates.r_dot + p * q) * x - (p * p + r * r) * y + (q * r - rates.p_dot) * z)
    return np.asarray((p * r - rates.q_dot) * x + (q * r + rates.p_dot) * y - (p * p + q * q) * z)
