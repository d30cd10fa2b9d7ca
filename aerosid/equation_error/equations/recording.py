"""One record as used by the equations: gaps filled, at a constant interval, in the band of the motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, NoiseEffect
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.band import Band
from aerosid.equation_error.equations.channels import equations_of
from aerosid.equation_error.equations.running_integral import derivative, linear_as_differentiated
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import input_columns_of
from aerosid.flight_model.flight import Flight
from aerosid.signals.sine_and_cosine import sine_and_cosine

Array = NDArray[np.float64]

CACHED_FLIGHTS = 4
"""Numerical: cached flights with some effects' inputs; a column by finite differences needs the same one again."""

CACHED_CHANNELS = 8
"""Numerical: parameter sets of its sensor's errors for which a channel, and what is derived from it, is cached."""

_ON_INPUTS = (InputEffect, NoiseEffect, PositionEffect)
"""Effects that change a flight's data other than the motion."""


@dataclass(frozen=True)
class Recording:
    """A manoeuvre at a constant interval.

    Attributes
    ----------
    manoeuvre : Manoeuvre
        With its flight on the regular grid and its measured channels without gaps.
    fitted : bool
        Whether coefficients are estimated on it; kinematics are on all.
    interval : float
        s.
    channels : mapping of str to ndarray, shape (N,)
        Measured outputs, SI.
    resolution : mapping of str to float
        Quantisation step of each channel, SI; 0 where none is found.
    band : Band
        That of all records compared together.
    refinement : int
        Samples in place of each of its own: beyond one they are interpolated, its inputs by splines.
    linear_inputs : bool
        Whether its inputs are linear between samples, as in a simulation, instead of smooth, as behind a recorder's
        filter.
    """

    manoeuvre: Manoeuvre
    fitted: bool
    interval: float
    channels: Mapping[str, Array]
    resolution: Mapping[str, float]
    band: Band
    refinement: int = 1
    linear_inputs: bool = False

    @cached_property
    def _rates(self) -> dict[str, Array]:
        rates = equations_of(self.manoeuvre.axes).rates
        return {name: derivative(self.channels[name], self.interval) for name in rates if name in self.channels}

    def rate_of(self, channel: str) -> Array:
        """Derivative of a measured angular rate, rad/s^2, (N,)."""
        return self._rates[channel]

    def in_rates(self, values: Array) -> Array:
        """Inputs or gusts (N, ...) as the derivatives of sampled rates show them."""
        return linear_as_differentiated(values) if self.linear_inputs else values

    @cached_property
    def _measured_inputs(self) -> dict[str, Array]:
        leading = input_columns_of(self.manoeuvre.axes)
        return {name: np.asarray(self.manoeuvre.flight.inputs[:, leading.index(name)]) for name in leading}

    @cached_property
    def _derived(self) -> dict[tuple[str, str], list[tuple[Array, tuple[Array, ...]]]]:
        return {}

    def _derived_from(
        self, quantity: str, name: str, of: Array, compute: Callable[[Array], tuple[Array, ...]]
    ) -> tuple[Array, ...]:
        """Signals derived from a channel; cached, since the same array, as measured or corrected, recurs."""
        known = self._derived.setdefault((quantity, name), [])
        for before, derived in known:
            if before is of:
                return derived
        known.insert(0, (of, compute(of)))
        del known[CACHED_CHANNELS:]
        return known[0][1]

    def sine_and_cosine(self, name: str, angle: Array) -> tuple[Array, Array]:
        """Sine and cosine, (N,) each, of an angle, rad."""
        sine, cosine = self._derived_from("turned", name, angle, sine_and_cosine)
        return sine, cosine

    def derivative_of(self, name: str, rate: Array) -> Array:
        """Derivative, rad/s^2, (N,), of an angular rate, rad/s, as measured or corrected for its sensor's errors."""
        if rate is self.channels[name]:
            return self.rate_of(name)
        return self._derived_from("derived", name, rate, lambda values: (derivative(values, self.interval),))[0]

    @cached_property
    def _true(self) -> dict[tuple[object, ...], Array]:
        return {}

    def without_errors(self, name: str, errors: Sequence[ActiveEffect], compute: Callable[[Array], Array]) -> Array:
        """A measured channel, (N,), corrected for its sensor's errors; computed once for their parameters."""
        if not errors:
            return self.channels[name]
        key = (name, *((active.name, active.numbers) for active in errors))
        found = self._true.pop(key) if key in self._true else compute(self.channels[name])
        self._true[key] = found
        if len(self._true) > CACHED_CHANNELS * len(self.channels):
            del self._true[next(iter(self._true))]
        return found

    @cached_property
    def _paths(self) -> list[Mapping[str, Array]]:
        return []

    def path_as_measured(self, compute: Callable[[], Mapping[str, Array]]) -> Mapping[str, Array]:
        """The integrated channels by all channels as measured, (N,) each; computed once."""
        if not self._paths:
            self._paths.append(compute())
        return self._paths[0]

    @cached_property
    def _flights(self) -> list[tuple[tuple[str, ...], tuple[ActiveEffect, ...], Flight]]:
        return []

    def acting_flight(self, model: AerodynamicModel, effects: Sequence[ActiveEffect]) -> Flight:
        """The flight with the acting inputs; most points of a search differ in other effects."""
        acting = tuple(active for active in effects if isinstance(active.effect, _ON_INPUTS))
        for columns, others, flight in self._flights:
            alike = len(others) == len(acting) and all(a is b for a, b in zip(others, acting, strict=True))
            if alike and columns == model.columns:
                return flight
        flight, _ = acting_flight(model, self.manoeuvre, acting)
        self._flights.insert(0, (model.columns, acting, flight))
        del self._flights[CACHED_FLIGHTS:]
        return flight

    def as_measured(self, name: str) -> Array:
        """A quantity of the motion as measured, (N,), SI, whether the case integrates it or not."""
        return self.channels[name] if name in self.channels else self.measured_input(name)

    def measured_input(self, name: str) -> Array:
        """Motion that the case does not integrate and the log contains, (N,), SI; zero where there is none."""
        known = self._measured_inputs
        return known[name] if name in known else np.zeros(self.time.size)

    @property
    def own_interval(self) -> float:
        """Interval of its own samples, s: that over which their noise is white."""
        return self.interval * self.refinement

    @property
    def name(self) -> str:
        """The log's name."""
        return self.manoeuvre.name

    @property
    def time(self) -> Array:
        """Instants, s, (N,)."""
        return self.manoeuvre.flight.time

    @cached_property
    def time_in_band(self) -> Array:
        """Instants of the samples in the band, s, (n,)."""
        return self.time[self.band.rows(self.time.size)]

    @cached_property
    def from_middle(self) -> Array:
        """Those instants from the middle of the record, s, (n,)."""
        at = self.time_in_band
        return np.asarray(at - 0.5 * (at[0] + at[-1]))

    def position(self, channel: str) -> Array:
        """Declared position of a sensor from the centre of gravity, m, (3,)."""
        return np.asarray(self.manoeuvre.flight.positions[self.manoeuvre.axes.outputs.index(channel)], dtype=np.float64)


def has_inertial_path(recording: Recording) -> bool:
    """Whether the record's path is integrated from accelerometers; else it rests on the air data."""
    return equations_of(recording.manoeuvre.axes).has_path(recording.channels)
