"""The likelihood of a model with effects on a set of manoeuvres, with its derivatives.

Parameters are, in this order: the free terms, the initial state of each manoeuvre, the parameters of the effects.
Outputs are simulated open loop; the noise of the measured inputs is accounted for by whitening. An aircraft that runs
away in open loop is held to the data by the filter form instead (`aerosid.estimation.prediction`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, OutputEffect, StateEffect
from aerosid.estimation.effect_parameters import direction_places
from aerosid.estimation.effect_responses import apply_sensor_effects, input_directions
from aerosid.estimation.effects_in_flight import (
    OutOfRangeError,
    acting_flight,
    acting_model,
    recording_sensors,
)
from aerosid.estimation.lever_slopes import write_lever_slopes
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.motion_loop import MotionLoop, motion_loop
from aerosid.estimation.prediction import predict_stretch, start_carry
from aerosid.estimation.simulated_slopes import slopes_by_simulation
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import UNCOUPLED
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.response import make_directions, make_trace, make_trace_carry, trace_stretch
from aerosid.signals.column_products import output_products
from aerosid.signals.input_noise import InputNoise, noisy_inputs_alone
from aerosid.signals.sensor_dynamics import SensorStates
from aerosid.signals.trace import Trace
from aerosid.signals.whitening import WhiteningCarry, make_whitening_carry, whiten_stretch

STRETCH = 20_000
"""Numerical: samples whose sensitivities are held at once; bounds the memory, which is linear in the record's
length."""

WHOLE = 5
"""Numerical: stretches up to which a record stays whole where what it shows depends on what went before."""


@dataclass(frozen=True)
class Whitened:
    """Residuals and sensitivities of one stretch of one manoeuvre, in units of their standard deviation.

    `log` its index; `residual` (N, m), NaN where nothing was measured; `columns` (N, m, M) with respect to all
    parameters of the estimate; `predicted` (N, m) in SI; `log_sum` the sum of the logarithms of the innovations'
    variances.
    """

    log: int
    residual: NDArray[np.float64]
    columns: NDArray[np.float64]
    predicted: NDArray[np.float64]
    log_sum: float


class Trial(NamedTuple):
    """Parameter values at which a likelihood is evaluated.

    `values` (T,) of all terms; `states` the initial state (n,) of each manoeuvre; `effects` that act; `variance` (m,)
    of the outputs' noise, SI squared; `tested` effects do not act: only their columns are computed.
    """

    values: NDArray[np.float64]
    states: Sequence[NDArray[np.float64]]
    effects: Sequence[ActiveEffect]
    variance: NDArray[np.float64]
    tested: Sequence[ActiveEffect] = ()


class Block(NamedTuple):
    """As `Whitened`, of one manoeuvre's own parameters; `held` (N, m) where `block` (N, m, 1 + C) is not zero."""

    log: int
    held: NDArray[np.bool_]
    block: NDArray[np.float64]
    predicted: NDArray[np.float64]
    log_sum: float


@dataclass(frozen=True)
class Traced:
    """One stretch of one manoeuvre simulated open loop.

    `held` (N, m) which outputs were measured; `block` (N, m, 1 + M) measured minus simulated, then the response to each
    parameter of that manoeuvre (free terms, initial state, effects), SI; `trace` the linearisation; `noise` of the
    inputs; `sensors` on the way of that noise.
    """

    held: NDArray[np.bool_]
    block: NDArray[np.float64]
    trace: Trace
    noise: InputNoise
    sensors: SensorStates


class Likelihood:
    """The likelihood of a fixed structure on fixed manoeuvres, and its derivatives.

    Parameters
    ----------
    model : AerodynamicModel
        Terms and constants; the values are given anew with each evaluation.
    manoeuvres : tuple of Manoeuvre
        One joint estimate.
    free : tuple of Entry
        Terms whose derivatives are wanted.
    filtering : bool
        Whether the noise of measured inputs is accounted for.
    priors : tuple of (entry, value, standard deviation)
        A-priori knowledge that enters as such.
    """

    def __init__(
        self,
        model: AerodynamicModel,
        manoeuvres: tuple[Manoeuvre, ...],
        free: tuple[Entry, ...],
        filtering: bool = True,
        priors: tuple[tuple[Entry, float, float], ...] = (),
    ) -> None:
        self.model = model
        self.manoeuvres = manoeuvres
        self.state_count, self.output_count = len(model.axes.integrated), len(model.axes.outputs)
        self.free = model.indices(free)
        self.filtering = filtering
        self.held_to_data = 0.0
        """Factor on the inputs' noise in the filter form; 0: open loop."""
        spread = np.array([manoeuvre.spread for manoeuvre in manoeuvres])
        # Numbers of seven digits carry noise of this size even where the simulation that made them had none.
        self.variance_floor = (1e-6 * spread.max(axis=0)) ** 2 + 1e-24
        self.priors = [(int(model.index(entry)), value, sigma) for entry, value, sigma in priors]

    def starting_variance(self) -> NDArray[np.float64]:
        """Noise variances of the logs, their mean over the manoeuvres; 1 for outputs that nobody measured."""
        noise = np.array([manoeuvre.noise for manoeuvre in self.manoeuvres])
        mean = np.array(
            [np.mean(column[np.isfinite(column)] ** 2) if np.isfinite(column).any() else 1.0 for column in noise.T]
        )
        return np.asarray(np.maximum(mean, self.variance_floor))

    def parameter_count(self, effects: Sequence[ActiveEffect]) -> int:
        """Number of parameters M."""
        return self.free.size + self.state_count * len(self.manoeuvres) + sum(active.slopes for active in effects)

    def input_noise(self, flight: Flight, memory: NDArray[np.float64]) -> InputNoise:
        """The noise of the inputs that counts: none in plain output error."""
        return InputNoise(flight.input_variance if self.filtering else np.zeros_like(memory), memory)

    def active(self, effects: Sequence[ActiveEffect]) -> NDArray[np.bool_]:
        """Which parameters the data can move, (M,): altitude and heading act on nothing where not measured."""
        active = np.ones(self.parameter_count(effects), dtype=bool)
        for n, manoeuvre in enumerate(self.manoeuvres):
            for place, name in enumerate(self.model.axes.integrated):
                if name in UNCOUPLED and name not in manoeuvre.outputs:
                    active[self.free.size + self.state_count * n + place] = False
        return active

    def stretches(
        self,
        values: NDArray[np.float64],
        states: Sequence[NDArray[np.float64]],
        effects: Sequence[ActiveEffect],
        variance: NDArray[np.float64],
        tested: Sequence[ActiveEffect] = (),
    ) -> Iterator[Whitened]:
        """Residuals and sensitivities stretch by stretch.

        `tested` effects do not act: only their columns are wanted, after those of the acting ones.

        Raises
        ------
        OutOfRangeError
            Where the simulation leaves the model's range.
        """
        for part in self.whitened(Trial(values, states, effects, variance, tested)):
            residual = np.where(part.held, part.block[:, :, 0], np.nan)
            columns = self._in_joint_places(part.block[:, :, 1:], part.log)
            yield Whitened(part.log, residual, columns, part.predicted, part.log_sum)

    def whitened(self, trial: Trial) -> Iterator[Block]:
        """As `stretches`, of each manoeuvre its own columns alone.

        Raises
        ------
        OutOfRangeError
            Where the simulation leaves the model's range.
        """
        if trial.values.size != self.model.values.size:
            raise ValueError(f"{trial.values.size} values were given for {self.model.values.size} terms")
        for log in range(len(self.manoeuvres)):
            if self.held_to_data > 0.0:
                yield from self._predicted(log, trial)
            else:
                yield from self._simulated(log, trial)

    def _simulated(self, log: int, trial: Trial) -> Iterator[Block]:
        """Open loop, whitened."""
        whitening: WhiteningCarry | None = None
        for part in self.traced(log, trial.values, trial.states[log], trial.effects, trial.tested):
            block = part.block
            noise, trace = noisy_inputs_alone(part.noise, part.trace)
            if whitening is None:
                whitening = make_whitening_carry(noise, block.shape[2], trace, part.sensors)
            log_sum = whiten_stretch(part.held, block, trace, trial.variance, noise, part.sensors, whitening)
            yield Block(log, part.held, block, part.trace.outputs, float(log_sum))

    def traced(
        self,
        log: int,
        values: NDArray[np.float64],
        state: NDArray[np.float64],
        effects: Sequence[ActiveEffect],
        tested: Sequence[ActiveEffect] = (),
        *,
        whole: bool = False,
    ) -> Iterator[Traced]:
        """The open-loop simulation of one log with the response to every parameter, stretch by stretch.

        `whole`: in one piece, however long.

        Raises
        ------
        OutOfRangeError
            Where the simulation leaves the model's range.
        """
        values = _writable(values)
        manoeuvre, model = self.manoeuvres[log], acting_model(self.model, effects)
        flight, memory = acting_flight(model, manoeuvre, effects)
        noise = self.input_noise(flight, memory)
        sensors = recording_sensors(manoeuvre, effects)
        own = self.free.size + self.state_count
        width = 1 + own + sum(active.slopes for active in (*effects, *tested))
        loop: MotionLoop | None = None
        if any(isinstance(active.effect, StateEffect) for active in effects):
            ground = manoeuvre.ground
            loop = motion_loop(model, flight, values, state, effects, ground, self.free, width - 1)
            flight = loop.flight
        moves = input_directions(self.model, manoeuvre, values, state, effects, flight, tested)
        samples, extra = flight.time.size, memory.size
        directions = make_directions(moves, direction_places(1 + own, effects, tested), samples, extra)
        # A delayed output looks back: records of moderate length stay whole, longer ones begin anew each stretch.
        remembers = any(isinstance(active.effect, OutputEffect | StateEffect) for active in effects)
        sides = slopes_by_simulation(self.model, manoeuvre, values, state, effects, tested)
        reach = samples if whole or (remembers and samples <= WHOLE * STRETCH) else STRETCH
        carry = make_trace_carry(state, self.free.size, len(moves))
        present = np.isfinite(flight.measured)
        for begin in range(0, samples, reach):
            stop = min(begin + reach, samples)
            trace = make_trace(stop - begin, extra, width, model.axes)
            arguments = (values, self.free, model.table, model.constants, directions, trace)
            traced = flight if loop is None else loop.traced_flight
            if not trace_stretch(begin, stop, carry, traced, *arguments):
                raise OutOfRangeError
            if loop is not None:
                loop.close(begin, stop, model, values, self.free, directions, trace)
            block = trace.block
            for place, slope in sides.items():
                block[:, :, 1 + own + place] = slope[begin:stop]
            acting = (*effects, *tested)
            write_lever_slopes(block, trace.outputs, flight.inputs[begin:stop], manoeuvre, acting, 1 + own)
            apply_sensor_effects(block, trace.outputs, flight.time[begin:stop], manoeuvre, effects, tested, 1 + own)
            here = present[begin:stop]
            block[:, :, 0] = np.where(here, flight.measured[begin:stop] - trace.outputs, 0.0)
            yield Traced(here, block, trace, noise, sensors)

    def _predicted(self, log: int, trial: Trial) -> Iterator[Block]:
        """One step ahead, the filter's gain holding the prediction to the data; no effect is free, tested or not."""
        model = acting_model(self.model, trial.effects)
        flight, _ = acting_flight(model, self.manoeuvres[log], trial.effects)
        if self.filtering:
            flight = flight._replace(input_variance=flight.input_variance * self.held_to_data)
        else:
            flight = flight._replace(input_variance=np.zeros_like(flight.input_variance))
        samples, free = flight.time.size, self.free.size
        values = _writable(trial.values)
        carry = start_carry(trial.states[log], flight, free)
        parameters = sum(active.slopes for active in (*trial.effects, *trial.tested))
        for begin in range(0, samples, STRETCH):
            stop = min(begin + STRETCH, samples)
            predicted, white = (np.empty((stop - begin, self.output_count)) for _ in range(2))
            columns = np.zeros((stop - begin, self.output_count, free + self.state_count))
            arguments = (values, self.free, model.table, model.constants, trial.variance)
            inside, log_sum = predict_stretch(begin, stop, carry, flight, *arguments, predicted, white, columns)
            if not inside:
                raise OutOfRangeError
            still = np.zeros((stop - begin, self.output_count, parameters))
            block = np.concatenate([np.nan_to_num(white)[:, :, None], columns, still], axis=2)
            yield Block(log, np.isfinite(white), block, predicted, float(log_sum))

    def _in_joint_places(self, columns: NDArray[np.float64], log: int) -> NDArray[np.float64]:
        """The columns of one manoeuvre in the places of the joint parameter vector."""
        logs = len(self.manoeuvres)
        if logs == 1:
            return columns
        count = columns.shape[2] + self.state_count * (logs - 1)
        wide = np.zeros((*columns.shape[:2], count))
        wide[:, :, self.places(log, count)] = columns
        return wide

    def places(self, log: int, count: int) -> NDArray[np.int64]:
        """The places of one manoeuvre's own columns among the `count` joint parameters."""
        size = self.state_count
        first, last = self.free.size + size * log, self.free.size + size * len(self.manoeuvres)
        places = np.arange(count)
        return np.concatenate([places[: self.free.size], places[first : first + size], places[last:]])

    def evaluate(
        self,
        values: NDArray[np.float64],
        states: Sequence[NDArray[np.float64]],
        effects: Sequence[ActiveEffect],
        variance: NDArray[np.float64],
    ) -> Point | None:
        """Likelihood, gradient and information; None where the simulation leaves the model's range."""
        count = self.parameter_count(effects)
        outputs = self.output_count
        normals, gradients = np.zeros((outputs, count, count)), np.zeros((outputs, count))
        squares, counts = np.zeros(outputs), np.zeros(outputs)
        cost = 0.0
        try:
            for part in self.whitened(Trial(values, states, effects, variance)):
                held = np.count_nonzero(part.held, axis=0)
                places = self.places(part.log, count)
                products = output_products(part.block, np.flatnonzero(held))
                squares += products[:, 0, 0]
                gradients[:, places] += products[:, 0, 1:]
                if len(self.manoeuvres) == 1:
                    normals += products[:, 1:, 1:]
                else:
                    normals[:, places[:, None], places] += products[:, 1:, 1:]
                counts += held
                cost += part.log_sum
        except OutOfRangeError:
            return None
        cost += float(squares.sum())
        prior_normal, prior_gradient = np.zeros((count, count)), np.zeros(count)
        for place, value, sigma in self.priors:
            at = int(np.flatnonzero(self.free == place)[0])
            cost += ((values[place] - value) / sigma) ** 2
            prior_normal[at, at] += 1.0 / sigma**2
            prior_gradient[at] += (value - values[place]) / sigma**2
        if not np.isfinite(cost):
            return None
        return Point(
            values=np.array(values),
            states=tuple(np.array(state) for state in states),
            effects=tuple(effects),
            variance=variance,
            cost=cost,
            normals=normals,
            gradients=gradients,
            squares=squares,
            counts=counts,
            prior_normal=prior_normal,
            prior_gradient=prior_gradient,
        )

    def moved(
        self, point: Point, step: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], list[NDArray[np.float64]], tuple[ActiveEffect, ...]]:
        """Term values, initial states and effects after a step in the parameters."""
        free, size = self.free.size, self.state_count
        values = point.values.copy()
        values[self.free] += step[:free]
        states = [state + step[free + size * n : free + size * (n + 1)] for n, state in enumerate(point.states)]
        place = free + size * len(point.states)
        effects = []
        for active in point.effects:
            effects.append(active.moved(step[place : place + active.slopes]) if active.slopes else active)
            place += active.slopes
        return values, states, tuple(effects)


def _writable(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A copy: a model's own values may not be written, and every kernel would be compiled a second time for them."""
    return np.array(values)
