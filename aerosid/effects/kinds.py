"""Types of effect for the estimator: on inputs, on outputs, process noise, functions of the motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.axes import ACCELEROMETERS
from aerosid.flight_model.motion_laws import Law
from aerosid.signals.sensor_dynamics import SensorDynamics

Signal = NDArray[np.float64]

UNIT = "accelerometers"
"""Format: where the accelerometers of a_x, a_y and a_z are in one unit, the place of its position error."""


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    Attributes
    ----------
    name, unit : str
        As reported.
    trials : tuple of float
        Start values of fits; the likelihood of a time delay has more than one maximum.
    lowest, highest : float
        Limits beyond which the effect is not meaningful.
    step : float
        For finite differences.
    null : float
        The value at which there is no effect.
    least : float
        Distance from `null` below which the noise of the record that it acts on can imitate it.
    """

    name: str
    unit: str
    trials: tuple[float, ...]
    lowest: float
    highest: float
    step: float
    null: float = 0.0
    least: float = 0.0


@dataclass(frozen=True)
class InputEffect:
    """An effect between the recorded control and the one that acts: lag, delay, rate limit, dead band.

    `where` as reported; `where_acts` the input column that changes (a step change of C_m acts on a column of its own).
    `transform(time, values, parameters)` gives the acting signal (N,); `noise(parameters, interval)` the factor on the
    recorded signal's noise variance and its memory from sample to sample. Of a step change `at_time(time, interval)`
    is the same one at another time, s, in a record with that sampling interval, s. Where `driven_by` names another
    column, the transform takes that one's signal and its result is added. An effect acts on the result of those found
    before it, or, where it `comes_first`, on the recorded signal: in the presence of an actuator's rate limit a lag of
    the command and one of the surface are not the same. Of several step changes in one place `ordinal` tells which;
    `rise` is the time that one takes, s.
    """

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    transform: Callable[[Signal, Signal, tuple[float, ...]], Signal]
    noise: Callable[[tuple[float, ...], float], tuple[float, float]]
    source: str
    column: str = ""
    driven_by: str = ""
    at_time: Callable[[float, float], InputEffect] | None = None
    comes_first: bool = False
    ordinal: int = 1
    rise: float = 0.0

    @property
    def where_acts(self) -> str:
        """The input column that the effect changes."""
        return self.column or self.where


@dataclass(frozen=True)
class OutputEffect:
    """An effect between the true and the recorded response: bias, scale factor, time delay, lag.

    `transform(time, values, parameters)` acts on the simulated output and, being linear but for `offset`, on each of
    its derivatives: (N, C) -> (N, C). `offset(parameters)` is added to the output alone. `undo(time, record,
    parameters)` inverts the transform of a smooth record (N,), NaN outside the record. `dynamics(parameters)` is the
    sensor's filter for process noise.
    """

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    transform: Callable[[Signal, Signal, tuple[float, ...]], Signal]
    offset: Callable[[tuple[float, ...]], float]
    undo: Callable[[Signal, Signal, tuple[float, ...]], Signal]
    dynamics: Callable[[tuple[float, ...]], SensorDynamics]
    source: str

    def output(self, time: Signal, values: Signal, parameters: tuple[float, ...]) -> Signal:
        """The recorded signal (N, 1) for a simulated one (N, 1)."""
        return self.transform(time, np.ascontiguousarray(values), parameters) + self.offset(parameters)

    def corrected(self, time: Signal, record: Signal, parameters: tuple[float, ...]) -> Signal:
        """The sensor's input (N,), from a smooth record of it (N,)."""
        return self.undo(time, record - self.offset(parameters), parameters)


@dataclass(frozen=True)
class NoiseEffect:
    """A disturbance without a channel, known by its statistics alone (process noise).

    `noise(parameters, interval, airspeed)` gives variance and memory of each of the input `columns`. Its parameters
    do not change the mean of any output; they are estimated from the likelihood itself.
    """

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    columns: tuple[str, ...]
    noise: Callable[[tuple[float, ...], float, float], tuple[tuple[float, ...], tuple[float, ...]]]
    source: str


@dataclass(frozen=True)
class StateEffect:
    """An effect that depends on the motion itself, possibly with memory.

    `law` gives its additions to the input `columns` as functions of the motion, `given` are the law's constants and
    `places` the indices of those that are parameters. `lift` is the coefficient whose alpha derivative the law uses;
    where it is `proportional`, the coefficient itself. `whole` is the effect with all parameters, fitted once this one,
    with fewer, is significant.
    """

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    law: Law
    given: tuple[float, ...]
    places: tuple[int, ...]
    lift: str
    columns: tuple[str, ...]
    source: str
    proportional: bool = False
    whole: StateEffect | None = None

    def law_numbers(self, values: Sequence[float]) -> tuple[float, ...]:
        """The law's constants for these values of the parameters."""
        numbers = list(self.given)
        for place, value in zip(self.places, values, strict=True):
            numbers[place] = value
        return tuple(numbers)


@dataclass(frozen=True)
class PositionEffect:
    """A sensor position error: each parameter, m, along one of the body `axes`, letters of x, y, z.

    It changes the sensor's reading and not the motion. `where` is a channel, or `UNIT` of the accelerometers together.
    """

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    axes: str
    source: str

    def moves(self, channel: str) -> bool:
        """Whether the sensor of a channel is displaced."""
        return channel == self.where or (self.where == UNIT and channel in ACCELEROMETERS)


@dataclass(frozen=True)
class BodyEffect:
    """An error of the aircraft's constants: each parameter adds to one of the `fields` of its `Constants`."""

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    fields: tuple[str, ...]
    source: str


Effect = InputEffect | OutputEffect | NoiseEffect | StateEffect | PositionEffect | BodyEffect


@dataclass(frozen=True)
class ActiveEffect:
    """An effect with values of its parameters; `log` names the one manoeuvre that it belongs to, empty: all.

    `held` are values that act and are not estimated: those of a frozen effect.
    """

    effect: Effect
    values: tuple[float, ...]
    log: str = ""
    held: tuple[float, ...] = ()

    @property
    def slopes(self) -> int:
        """Number of its parameters with output sensitivities, which a Gauss-Newton step estimates."""
        return 0 if isinstance(self.effect, NoiseEffect) else len(self.values)

    def acts_on(self, log: str) -> bool:
        """Whether the effect belongs to the manoeuvre of that name."""
        return not self.log or self.log == log

    def moved(self, step: Sequence[float] | Signal) -> ActiveEffect:
        """The effect after a step in its parameters, kept within their limits."""
        # Python's own min and max: a screening changes thousands of single values.
        values = tuple(
            min(max(float(value + change), parameter.lowest), parameter.highest)
            for value, change, parameter in zip(self.values, step, self.effect.parameters, strict=True)
        )
        return ActiveEffect(self.effect, values, self.log, self.held)

    def perturbed(self, place: int, step: float) -> ActiveEffect:
        """The effect with one parameter changed by `step`, kept within its limits: for finite differences."""
        return self.moved([step if n == place else 0.0 for n in range(len(self.values))])

    @property
    def numbers(self) -> tuple[float, ...]:
        """The values of all its parameters, estimated or held."""
        return self.values or self.held

    @property
    def name(self) -> tuple[str, str]:
        """Kind and place."""
        return self.effect.kind, self.effect.where

    @property
    def ordinal(self) -> int:
        """Which of several step changes in one place it is; 1 of any other effect."""
        return self.effect.ordinal if isinstance(self.effect, InputEffect) else 1

    @property
    def key(self) -> tuple[str, str, int, str]:
        """Kind, place, ordinal and log: which effect it is, whatever its values."""
        return *self.name, self.ordinal, self.log

    @property
    def identity(self) -> tuple[object, ...]:
        """What tells the effect with its values from others, also after it was sent between processes."""
        return *self.identity_at_any_values, self.values, self.held

    @property
    def identity_at_any_values(self) -> tuple[object, ...]:
        """What tells the effect from others of its structure, the values left out."""
        return *self.key, axes_of(self), getattr(self.effect, "comes_first", False)


def at_first_trials(effect: Effect) -> ActiveEffect:
    """The effect with the first of the values from which each parameter is tried."""
    return ActiveEffect(effect, tuple(parameter.trials[0] for parameter in effect.parameters))


def axes_of(active: ActiveEffect | None) -> str:
    """The body axes of a sensor position; empty of any other effect, or of none."""
    return active.effect.axes if active is not None and isinstance(active.effect, PositionEffect) else ""


def with_numbers(effects: Iterable[ActiveEffect], numbers: Iterable[tuple[float, ...]]) -> tuple[ActiveEffect, ...]:
    """The effects with other parameter values, which alone of an effect can be transferred between processes."""
    return tuple(replace(active, values=values) for active, values in zip(effects, numbers, strict=True))


def with_all_parameters(active: ActiveEffect) -> ActiveEffect:
    """The effect with all its parameters free, where some of them were fixed for its test."""
    effect = active.effect
    if not isinstance(effect, StateEffect) or effect.whole is None:
        return active
    rest = effect.whole.parameters[len(active.values) :]
    return ActiveEffect(effect.whole, (*active.values, *(p.trials[0] for p in rest)), active.log)


def frozen(active: ActiveEffect) -> ActiveEffect:
    """The effect with its parameters held at their values."""
    values, effect = active.values, active.effect
    if active.held:
        return active
    if isinstance(effect, InputEffect):
        bound = replace(
            effect,
            parameters=(),
            transform=lambda time, signal, _p: effect.transform(time, signal, values),
            noise=lambda _p, interval: effect.noise(values, interval),
        )
        return ActiveEffect(bound, (), active.log, values)
    if isinstance(effect, NoiseEffect):
        still = replace(
            effect, parameters=(), noise=lambda _p, interval, airspeed: effect.noise(values, interval, airspeed)
        )
        return ActiveEffect(still, (), active.log, values)
    if isinstance(effect, StateEffect):
        held = replace(effect, parameters=(), given=effect.law_numbers(values), places=())
        return ActiveEffect(held, (), active.log, values)
    if isinstance(effect, PositionEffect | BodyEffect):
        return ActiveEffect(replace(effect, parameters=()), (), active.log, values)
    fixed = replace(
        effect,
        parameters=(),
        transform=lambda time, signal, _p: effect.transform(time, signal, values),
        offset=lambda _p: effect.offset(values),
        undo=lambda time, record, _p: effect.undo(time, record, values),
        dynamics=lambda _p: effect.dynamics(values),
    )
    return ActiveEffect(fixed, (), active.log, values)
