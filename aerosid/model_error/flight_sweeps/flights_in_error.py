"""Flights of an aircraft with the model error d(t) acting in its coefficients, and the linearisation along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, EffectParameter, InputEffect
from aerosid.effects.step_change import offset_column
from aerosid.errors import EstimationError
from aerosid.estimation.effect_columns import air_columns, with_columns_of, with_moving_air, with_offsets
from aerosid.estimation.effects_in_flight import OutOfRangeError, acting_flight, acting_model
from aerosid.estimation.likelihood import Likelihood, Traced
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import Axes, loads_of
from aerosid.flight_model.flight import Flight, coefficients_along, simulate_outputs
from aerosid.model_error.flight_sweeps.forward_start import forward_forces
from aerosid.model_error.flight_sweeps.swept_model import SweptModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FlownError:
    """One flight of the model with d(t) acting; `offsets` and `air`: d's and the air's places in the extra inputs."""

    part: Traced
    offsets: tuple[int, ...]
    air: tuple[int, ...]


@dataclass(frozen=True)
class FlightsInError:
    """Flights of one joint estimate, and the coefficients in which model error is allowed: the aircraft's.

    Attributes
    ----------
    manoeuvres : tuple of Manoeuvre
    coefficients : tuple of str
    """

    manoeuvres: tuple[Manoeuvre, ...]
    coefficients: tuple[str, ...]

    @property
    def axes(self) -> Axes:
        """The case of the equations of motion."""
        return self.manoeuvres[0].axes

    @property
    def state_count(self) -> int:
        """Of one flight."""
        return len(self.axes.integrated)

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Input column by which d(t) acts in each coefficient."""
        return tuple(offset_column(name) for name in self.coefficients)

    @cached_property
    def airspeeds(self) -> tuple[float, ...]:
        """Mean measured airspeed of each flight, m/s."""
        return tuple(m.mean_airspeed for m in self.manoeuvres)

    @property
    def distances(self) -> tuple[float, ...]:
        """How far each flight went through the air, m."""
        return tuple(float(np.ptp(m.flight.time)) * v for m, v in zip(self.manoeuvres, self.airspeeds, strict=True))

    @cached_property
    def intervals(self) -> tuple[float, ...]:
        """Usual sampling interval of each flight, s."""
        return tuple(m.interval for m in self.manoeuvres)

    def begun(self, start: SweptModel) -> tuple[SweptModel, list[FlownError]]:
        """The start as it flies: with the d(t) given, else with that of the forward estimate, else with none."""
        try:
            return start, self.traced(start)
        except OutOfRangeError:
            pass
        model = self._flying(start.model, start.effects)
        acting = [
            replace(m, flight=acting_flight(model, m, start.effects)[0], columns=model.columns) for m in self.manoeuvres
        ]
        swept = replace(start, forces=forward_forces(model, acting, self.coefficients))
        try:
            return swept, self.traced(swept)
        except OutOfRangeError:
            still = replace(start, forces=tuple(np.zeros_like(force) for force in start.forces))
            return still, self.traced_or_said(still)

    def traced(
        self, swept: SweptModel, entries: Sequence[Entry] = (), effects: Sequence[ActiveEffect] = ()
    ) -> list[FlownError]:
        """Each flight with d(t) acting, and the response to every number: known, d's own, then asked.

        Raises
        ------
        OutOfRangeError
            Where the flown model leaves its range.
        """
        model = self._flying(swept.model.extended(entries), (*swept.effects, *effects))
        offsets = tuple(model.extra_place(name) for name in self.columns)
        air = tuple(model.extra_place(name) for name in air_columns(self.axes))
        likelihood = Likelihood(model, self.manoeuvres, (*swept.free, *entries))
        found = []
        for n, (manoeuvre, force) in enumerate(zip(self.manoeuvres, swept.forces, strict=True)):
            acting = (*swept.effects, *_given_forces(self.columns, force, manoeuvre.name))
            part = next(iter(likelihood.traced(n, model.values, swept.states[n], acting, effects, whole=True)))
            found.append(FlownError(part, offsets, air))
        return found

    def traced_or_said(
        self, swept: SweptModel, entries: Sequence[Entry] = (), effects: Sequence[ActiveEffect] = ()
    ) -> list[FlownError]:
        """As `traced`, for a person: EstimationError with what to check in place of OutOfRangeError."""
        try:
            return self.traced(swept, entries, effects)
        except OutOfRangeError as error:
            names = ", ".join(manoeuvre.name for manoeuvre in self.manoeuvres)
            raise EstimationError(
                f"{names}: the model with its model error d(t) leaves |{self.axes.flow_angle}| < 1.5 rad; check the "
                f"signs of {self.axes.doubtful_signs}, or use --method likelihood."
            ) from error

    def carried(self, flown: SweptModel, other: SweptModel) -> SweptModel:
        """Another structure with the d(t) that keeps the motion of the one that is flown.

        What the other one adds to the coefficients along that motion is taken out of d, what it lacks is put into it;
        the sweeps then begin where the measurements are. Unchanged where the motion cannot be flown.
        """
        forces = []
        for n, force in enumerate(flown.forces):
            acting = (*flown.effects, *_given_forces(self.columns, force, self.manoeuvres[n].name))
            before, flight = self._acting(flown, n, acting)
            _, states = simulate_outputs(flown.states[n], flight, before.values.copy(), before.table, before.constants)
            if not np.isfinite(states).all():
                return other
            given = coefficients_along(states, flight, before.values.copy(), before.table, before.constants)
            places = [loads_of(before.axes).index(name) for name in self.coefficients]
            after, plain = self._acting(other, n, other.effects)
            taken = coefficients_along(states, plain, after.values.copy(), after.table, after.constants)
            forces.append((given - taken)[:, places])
        return replace(other, forces=tuple(forces), states=flown.states)

    def _acting(self, swept: SweptModel, n: int, effects: Sequence[ActiveEffect]) -> tuple[AerodynamicModel, Flight]:
        """The model of the aircraft as it is with columns for all that acts, and a flight with it acting."""
        model = acting_model(self._flying(swept.model, effects), effects)
        return model, acting_flight(model, self.manoeuvres[n], effects)[0]

    def _flying(self, model: AerodynamicModel, effects: Sequence[ActiveEffect]) -> AerodynamicModel:
        """The model with columns for what acts, for d(t) and for the velocity of the air."""
        return with_moving_air(with_offsets(with_columns_of(model, effects), self.coefficients))


def _given_forces(columns: Sequence[str], force: Array, log: str) -> tuple[ActiveEffect, ...]:
    """d(t) of a flight as it acts: one input a column, whose share of one is its response."""
    return tuple(
        ActiveEffect(_given_force(name, np.ascontiguousarray(force[:, i])), (1.0,), log)
        for i, name in enumerate(columns)
    )


def _given_force(column: str, history: Array) -> InputEffect:
    return InputEffect(
        "model_error",
        column,
        (EffectParameter("share", "1", trials=(1.0,), lowest=-1e3, highest=1e3, step=0.5),),
        lambda _time, values, p: np.asarray(values + p[0] * history),
        lambda _p, _interval: (1.0, 0.0),
        "d(t) of Parameswaran & Raol 1994, eq. (16)",
        column=column,
    )
