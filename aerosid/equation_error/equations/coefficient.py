"""Coefficient equations: forces from accelerometers, moments from angular accelerations, linear in the model's terms.

    m a_x - T cos(incidence) = q_bar S C_X,   m a_y = q_bar S C_Y,   m a_z + T sin(incidence) = q_bar S C_Z,
    I_xx p' - I_xz (r' + p q) + (I_zz - I_yy) q r = q_bar S b C_l,
    I_yy q' + (I_xx - I_zz) p r + I_xz (p^2 - r^2) - T z_arm = q_bar S c C_m,
    I_zz r' - I_xz (p' - q r) + (I_yy - I_xx) p q = q_bar S b C_n

each as its sensor would read it: the model's side is transformed to the sensor, including the sensor's errors, so that
an error's likelihood is that of the channel as measured. Where inputs are linear between samples, the derivative of a
sampled rate shows less of them than of the motion: they enter the moments accordingly. A case has the equations of the
coefficients that it models. C_L and C_D act as C_X = C_L sin alpha - C_D cos alpha, C_Z = -C_L cos alpha - C_D sin
alpha. Klein & Morelli, Aircraft System Identification, section 5.1 (equation error). Where a term contains lift, as a
drag polar does, that is the lift of the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, StateEffect
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.accelerations import accelerations, stacked, subtract_from_measured
from aerosid.equation_error.equations.channels import MEASURED_BY
from aerosid.equation_error.equations.inertial_coupling import Aircraft
from aerosid.equation_error.equations.kinematic import Motion
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.sensors import as_read, bias, errors_of, position
from aerosid.equation_error.equations.term_series import Body, Terms
from aerosid.estimation.effects_in_flight import acting_model
from aerosid.estimation.motion_loop import slope_of
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import ACCELERATIONS, ACCELEROMETERS, COEFFICIENTS, SIX, Axes, input_columns_of, loads_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.flight import Flight

Array = NDArray[np.float64]


TOUCHED = {"C_L": ("C_X", "C_Z"), "C_D": ("C_X", "C_Z")}
"""The body-axis equations in which a wind-axis coefficient acts; every other acts in its own."""

_KNOWN = -1
"""Layout: index of the known part of an equation, where others are indices of terms."""


class CoefficientEquations:
    """The equations of one record at one point of the search, before they are filtered to the band.

    All in units of the coefficient: measured signals, known part, contribution of one unit of a term.

    Parameters
    ----------
    free : sequence of Entry
        Terms that are estimated.
    values : mapping of Entry to float, optional
        Values with which some of those belong to the known part.
    """

    def __init__(
        self,
        recording: Recording,
        model: AerodynamicModel,
        effects: Sequence[ActiveEffect],
        motion: Motion,
        free: Sequence[Entry],
        values: Mapping[Entry, float] | None = None,
    ) -> None:
        declared, model = model.constants, acting_model(model, effects)
        self._recording, self._effects, self._motion, self._model = recording, effects, motion, model
        flight = recording.acting_flight(model, effects)
        inputs = flight.inputs
        added: list[tuple[int, Array]] = []
        for active in effects:
            if isinstance(active.effect, StateEffect) and active.acts_on(recording.name):
                inputs = self._with_state_effect(active, flight._replace(inputs=inputs), added)
        known = np.array(model.values)
        for entry in free:
            known[model.places[entry]] = 0.0 if values is None else values.get(entry, 0.0)
        self._terms = Terms(
            model.table,
            _places(model.axes),
            len(model.axes.measured),
            np.array(model.values),
            known,
            np.array([series for _, series in added]).reshape(len(added), inputs.shape[0]),
            np.array([index for index, _ in added], dtype=np.int64),
        )
        aircraft = self._aircraft(model.constants, declared)
        self._found = accelerations(motion.course, inputs, self._terms, aircraft, recording.linear_inputs)

    @property
    def names(self) -> tuple[str, ...]:
        """The equations."""
        return self._recording.manoeuvre.axes.coefficients

    def target(self, name: str) -> Array:
        """Measured signal less the known part, (N,)."""
        return self.columns(())[1][:, self.names.index(name)]

    def columns(self, entries: Sequence[Entry]) -> tuple[dict[str, list[Entry]], Array]:
        """Measured signal less the known part, and contribution of one unit of some terms, equation after equation.

        Returns
        -------
        touching : dict of str to list of Entry
            Those of the entries that act in each equation, K of them.
        columns : ndarray, shape (N, sum of 1 + K)
        """
        touching = {
            name: [entry for entry in entries if name in TOUCHED.get(entry[0], (entry[0],))] for name in self.names
        }
        term_indices, equations = [], []
        for name, touched in touching.items():
            term_indices.extend([_KNOWN, *(self._model.places[entry] for entry in touched)])
            equations.extend([COEFFICIENTS.index(name)] * (1 + len(touched)))
        which = np.array(term_indices), np.array(equations)
        linear = self._recording.linear_inputs
        columns = stacked(self._motion.course, self._terms, self._found, *which, linear)
        last = 0
        for name, touched in touching.items():
            first, last = last, last + 1 + len(touched)
            if errors_of(self._effects, self._recording, MEASURED_BY[name]):
                shown = as_read(self._recording, self._effects, MEASURED_BY[name], columns[:, first:last])
                columns[:, first:last] = shown
        subtract_from_measured(columns, self._measured(), self._found.in_units, *which)
        return touching, columns

    def _measured(self) -> Array:
        """The signals of the equations' sensors, (6, N), without their biases."""
        recording = self._recording
        measured = np.zeros((len(SIX.coefficients), recording.time.size))
        for name in self.names:
            channel, row = MEASURED_BY[name], measured[COEFFICIENTS.index(name)]
            if channel not in ACCELERATIONS:
                row[:] = recording.rate_of(channel)
            elif channel in recording.channels:
                np.subtract(recording.channels[channel], bias(recording, self._effects, channel), out=row)
            else:
                row[:] = self._motion.specific_force[channel]
        return measured

    def _aircraft(self, acting: Constants, declared: Constants) -> Aircraft:
        """The aircraft with its accelerometer positions, as compiled code takes it."""
        recording, effects = self._recording, self._effects
        positions, further = np.zeros((3, 3)), np.zeros((3, 3))
        displaced = [active.effect for active in effects if isinstance(active.effect, PositionEffect)]
        for row, channel in enumerate(ACCELEROMETERS):
            if channel in recording.channels:
                positions[row] = recording.position(channel)
                if any(effect.moves(channel) for effect in displaced):
                    further[row] = position(recording, effects, channel) - positions[row]
        axes = recording.manoeuvre.axes
        return Aircraft(_body(acting, axes), _body(declared, axes), _modelled(axes), positions, further)

    def _with_state_effect(self, active: ActiveEffect, flight: Flight, added: list[tuple[int, Array]]) -> Array:
        """The inputs with an effect of the motion; its part of the lift is `added` to that derivative."""
        effect, model = active.effect, self._model
        assert isinstance(effect, StateEffect)
        inputs = flight.inputs.copy()
        slope = slope_of(model, effect)
        for n, (column, series) in enumerate(self._motion.added_by(active, model, flight).items()):
            if n == 0 and slope is not None and not effect.proportional and model.values[slope] != 0.0:
                added.append((slope, series / model.values[slope]))
            else:
                inputs[:, model.columns.index(column)] += series
        return np.asarray(inputs)


@lru_cache(maxsize=16)
def _body(constants: Constants, axes: Axes) -> Body:
    """The constants as compiled code takes them: the same type in every case, so that it is compiled once."""
    c, first = constants, len(input_columns_of(axes))
    columns = (index if index < 0 else first + index for index in (c.thrust_change, c.cg_x, c.cg_y, c.cg_z))
    lengths = (float(c.wing_area), float(c.mean_chord), float(c.span))
    inertia = (float(c.I_xx), float(c.I_yy), float(c.I_zz), float(c.I_xz))
    engine = (float(c.thrust_incidence), float(c.thrust_z_arm))
    return Body(*lengths, *inertia, *engine, float(c.airspeed_of_rates), float(c.airspeed_of_V_hat), *columns)


@cache
def _places(axes: Axes) -> NDArray[np.int64]:
    """Index of each of the model's coefficients among all."""
    return np.array([COEFFICIENTS.index(name) for name in loads_of(axes)])


@cache
def _modelled(axes: Axes) -> NDArray[np.bool_]:
    """Which of the coefficients about body axes have an equation."""
    return np.array([name in axes.coefficients for name in SIX.coefficients])
