"""One recording as the equations take it: bridged channels at a constant interval, in the band of the motion."""

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
"""Numerical: share of the sampling interval, 1, by which samples may lie off a regular grid before they are
interpolated to one."""


KEPT_FLIGHTS = 4
"""Numerical: flights with some effects' inputs that are kept; a column by difference asks for the same one again."""

KEPT_CHANNELS = 8
"""Numerical: sets of numbers of its sensor's faults for which a channel, and what is made of it, is kept."""

_ON_INPUTS = (InputEffect, NoiseEffect, PositionEffect)
"""Effects that change what a flight holds beside the motion."""


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
        Smallest step of each channel, SI; 0 where none is seen.
    band : Band
        That of all recordings compared together.
    refined : bool
        Whether samples were put between its own, its inputs along splines.
    linear_inputs : bool
        Whether its inputs run along straight lines between samples, as in a simulation, and not smoothly, as behind a
        recorder's filter.
    """

    manoeuvre: Manoeuvre
    fitted: bool
    interval: float
    channels: Mapping[str, Array]
    resolution: Mapping[str, float]
    band: Band
    refined: bool = False
    linear_inputs: bool = False

    @cached_property
    def _rates(self) -> dict[str, Array]:
        rates = equations_of(self.manoeuvre.axes).rates
        return {name: derivative(self.channels[name], self.interval) for name in rates if name in self.channels}

    def rate_of(self, channel: str) -> Array:
        """Derivative of a measured angular rate, rad/s^2, (N,)."""
        return self._rates[channel]

    def in_rates(self, values: Array) -> Array:
        """Inputs or gusts (N, ...) as far as the derivatives of rates show them."""
        return linear_as_differentiated(values) if self.linear_inputs else values

    @cached_property
    def _measured_inputs(self) -> dict[str, Array]:
        leading = input_columns_of(self.manoeuvre.axes)
        return {name: np.asarray(self.manoeuvre.flight.inputs[:, leading.index(name)]) for name in leading}

    @cached_property
    def _made(self) -> dict[tuple[str, str], list[tuple[Array, tuple[Array, ...]]]]:
        return {}

    def _made_of(
        self, what: str, name: str, of: Array, make: Callable[[Array], tuple[Array, ...]]
    ) -> tuple[Array, ...]:
        """What is made of a channel; the same array, as measured or without its faults, comes again and again."""
        known = self._made.setdefault((what, name), [])
        for before, made in known:
            if before is of:
                return made
        known.insert(0, (of, make(of)))
        del known[KEPT_CHANNELS:]
        return known[0][1]

    def sine_and_cosine(self, name: str, angle: Array) -> tuple[Array, Array]:
        """Sine and cosine, (N,) each, of an angle, rad."""
        sine, cosine = self._made_of("turned", name, angle, lambda values: (np.sin(values), np.cos(values)))
        return sine, cosine

    def derivative_of(self, name: str, rate: Array) -> Array:
        """Derivative, rad/s^2, (N,), of an angular rate, rad/s, as measured or without its sensor's faults."""
        if rate is self.channels[name]:
            return self.rate_of(name)
        return self._made_of("derived", name, rate, lambda values: (derivative(values, self.interval),))[0]

    @cached_property
    def _true(self) -> dict[tuple[object, ...], Array]:
        return {}

    def without_errors(self, name: str, faults: Sequence[ActiveEffect], make: Callable[[Array], Array]) -> Array:
        """A measured channel, (N,), as it was before its sensor's faults; made once for their numbers."""
        if not faults:
            return self.channels[name]
        key = (name, *((active.name, active.numbers) for active in faults))
        found = self._true.pop(key) if key in self._true else make(self.channels[name])
        self._true[key] = found
        if len(self._true) > KEPT_CHANNELS * len(self.channels):
            del self._true[next(iter(self._true))]
        return found

    @cached_property
    def _flights(self) -> list[tuple[tuple[str, ...], tuple[ActiveEffect, ...], Flight]]:
        return []

    def acting_flight(self, model: AerodynamicModel, effects: Sequence[ActiveEffect]) -> Flight:
        """The flight with the inputs that act; most points of a search differ in something else."""
        acting = tuple(active for active in effects if isinstance(active.effect, _ON_INPUTS))
        for columns, others, flight in self._flights:
            alike = len(others) == len(acting) and all(a is b for a, b in zip(others, acting, strict=True))
            if alike and columns == model.columns:
                return flight
        flight, _ = acting_flight(model, self.manoeuvre, acting)
        self._flights.insert(0, (model.columns, acting, flight))
        del self._flights[KEPT_FLIGHTS:]
        return flight

    def held(self, name: str) -> Array:
        """A quantity of the motion as measured, (N,), SI, whether the case integrates it or not."""
        return self.channels[name] if name in self.channels else self.measured_input(name)

    def measured_input(self, name: str) -> Array:
        """Motion that the case does not integrate and the log gives, (N,), SI; zero where there is none."""
        known = self._measured_inputs
        return known[name] if name in known else np.zeros(self.time.size)

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
        """Those from the middle of the record, s, (n,)."""
        at = self.time_in_band
        return np.asarray(at - 0.5 * (at[0] + at[-1]))

    def position(self, channel: str) -> Array:
        """Declared position of a sensor from the centre of gravity, m, (3,)."""
        return np.asarray(self.manoeuvre.flight.positions[self.manoeuvre.axes.outputs.index(channel)], dtype=np.float64)


def read_recordings(
    identification: Sequence[Manoeuvre], validation: Sequence[Manoeuvre], settings: EquationErrorSettings
) -> tuple[Recording, ...]:
    """All recordings, those to be fitted first, with the band chosen from all of them together."""
    made = [_regular(m, fitted) for part, fitted in ((identification, True), (validation, False)) for m in part]
    limits = (settings.band_lowest, settings.band_highest, settings.band_share)
    ends: dict[float, float] = {}
    for each in made:
        if each.interval not in ends:
            alike = [other for other in made if other.interval == each.interval]
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
    return tuple(_refined(each, ends[each.interval], settings.coarsest) for each in made)


def _refined(recording: Recording, end: float, coarsest: float) -> Recording:
    """The recording in its band, with samples between its own by cubic splines where they lie too far apart.

    What is late is found between samples along straight lines, which would make it too small as well.
    """
    factor = int(np.ceil(recording.interval / coarsest - 1e-6))
    if factor <= 1:
        return replace(recording, band=band_up_to(end, recording.interval))
    from scipy.interpolate import CubicSpline  # late: most recordings are fine enough

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
        # The rounding of a sample is in all that lie beside it.
        resolution={name: step * np.sqrt(factor) for name, step in recording.resolution.items()},
        band=band_up_to(end, interval),
        refined=True,
    )


def _regular(manoeuvre: Manoeuvre, fitted: bool) -> Recording:
    flight = manoeuvre.flight
    interval = float(np.round(np.median(np.diff(flight.time)), 6))
    count = int(np.floor((flight.time[-1] - flight.time[0]) / interval + 1e-6)) + 1
    time = flight.time[0] + interval * np.arange(count)
    off = count != flight.time.size or float(np.abs(time - flight.time[:count]).max()) > IRREGULAR * interval
    if not off:
        time = flight.time
    channels = {}
    for name in manoeuvre.outputs:
        values = flight.measured[:, manoeuvre.axes.outputs.index(name)]
        present = np.isfinite(values)
        channels[name] = np.interp(time, flight.time[present], values[present])
    inputs = flight.inputs
    if off:
        inputs = np.column_stack([np.interp(time, flight.time, column) for column in flight.inputs.T])
    measured = np.column_stack([channels.get(name, np.full(time.size, np.nan)) for name in manoeuvre.axes.outputs])
    regular = replace(manoeuvre, flight=flight._replace(time=time, inputs=inputs, measured=measured))
    resolution = {name: _step(values) for name, values in channels.items()}
    return Recording(regular, fitted, interval, channels, resolution, Band(1, np.ones(1)))


def _step(values: Array) -> float:
    """The smallest step that a channel takes, where it repeats values; else 0."""
    levels = np.unique(values)
    if levels.size > TRIALS.repeated * values.size or levels.size < 2:
        return 0.0
    return float(np.median(np.diff(levels)))
