"""One record as used by the equations: gaps filled, at a constant interval, in the band of the motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, NoiseEffect
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.band import Band, band_end, band_up_to
from aerosid.equation_error.equations.channels import equations_of
from aerosid.equation_error.equations.running_integral import derivative, linear_as_differentiated
from aerosid.equation_error.settings import TRIALS, EquationErrorSettings
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import input_columns_of
from aerosid.flight_model.flight import Flight

Array = NDArray[np.float64]

IRREGULAR = 0.02
"""Numerical: fraction of the sampling interval, 1, by which samples may deviate from a regular grid before they are
interpolated to one."""


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
        sine, cosine = self._derived_from("turned", name, angle, lambda values: (np.sin(values), np.cos(values)))
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


def read_recordings(
    identification: Sequence[Manoeuvre], validation: Sequence[Manoeuvre], settings: EquationErrorSettings
) -> tuple[Recording, ...]:
    """All records, those to be fitted first, with the band chosen from all of them together."""
    derived = [_regular(m, fitted) for part, fitted in ((identification, True), (validation, False)) for m in part]
    limits = (settings.band_lowest, settings.band_highest, settings.band_share)
    ends: dict[float, float] = {}
    for each in derived:
        if each.interval not in ends:
            alike = [other for other in derived if other.interval == each.interval]
            ends[each.interval] = max(
                band_end(
                    [other.channels[rate] for other in alike],
                    each.interval,
                    settings.band_ratio,
                    settings.band_depth,
                    limits,
                )
                for rate in equations_of(each.manoeuvre.axes).rates
            )
    return tuple(_refined(each, ends[each.interval], settings.coarsest) for each in derived)


def _refined(recording: Recording, end: float, coarsest: float) -> Recording:
    """The record in its band, with samples interpolated by cubic splines where its own are too far apart.

    A time delay is evaluated between samples by linear interpolation, which would attenuate the signal as well.
    """
    factor = int(np.ceil(recording.interval / coarsest - 1e-6))
    if factor <= 1:
        return replace(recording, band=band_up_to(end, recording.interval))
    from scipy.interpolate import CubicSpline  # deferred import: most records are fine enough

    manoeuvre = recording.manoeuvre
    time = manoeuvre.flight.time
    interval = recording.interval / factor
    fine = time[0] + interval * np.arange(factor * (time.size - 1) + 1)
    flight = manoeuvre.flight._replace(
        time=fine,
        inputs=CubicSpline(time, manoeuvre.flight.inputs)(fine),
        measured=np.column_stack([np.interp(fine, time, column) for column in manoeuvre.flight.measured.T]),
    )
    return replace(
        recording,
        manoeuvre=replace(manoeuvre, flight=flight),
        interval=interval,
        channels={name: CubicSpline(time, values)(fine) for name, values in recording.channels.items()},
        # The rounding error of a sample affects all interpolated neighbours.
        resolution={name: step * np.sqrt(factor) for name, step in recording.resolution.items()},
        band=band_up_to(end, interval),
        refinement=factor,
    )


def _regular(manoeuvre: Manoeuvre, fitted: bool) -> Recording:
    flight = manoeuvre.flight
    time = flight.time
    interval = float(np.round(np.median(np.diff(time)), 6))
    # Against the grid between its ends: over a long record the rounding of the interval adds up to a whole sample.
    even = np.linspace(time[0], time[-1], time.size)
    is_irregular = float(np.abs(time - even).max()) > IRREGULAR * interval
    if is_irregular:
        count = int(np.floor((time[-1] - time[0]) / interval + 1e-6)) + 1
        time = time[0] + interval * np.arange(count)
    channels = {}
    for name in manoeuvre.outputs:
        values = flight.measured[:, manoeuvre.axes.outputs.index(name)]
        present = np.isfinite(values)
        channels[name] = np.interp(time, flight.time[present], values[present])
    inputs = flight.inputs
    if is_irregular:
        inputs = np.column_stack([np.interp(time, flight.time, column) for column in flight.inputs.T])
    measured = np.column_stack([channels.get(name, np.full(time.size, np.nan)) for name in manoeuvre.axes.outputs])
    regular = replace(manoeuvre, flight=flight._replace(time=time, inputs=inputs, measured=measured))
    resolution = {name: _step(values) for name, values in channels.items()}
    return Recording(regular, fitted, interval, channels, resolution, Band(1, np.ones(1)))


def _step(values: Array) -> float:
    """The quantisation step of a channel, where it repeats values; else 0."""
    levels = np.unique(values)
    if levels.size > TRIALS.repeated * values.size or levels.size < 2:
        return 0.0
    return float(np.median(np.diff(levels)))
