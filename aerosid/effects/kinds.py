"""Kinds of effect to the estimator: on inputs, on outputs, as noise, from the motion itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.motion_laws import Law
from aerosid.signals.sensor_dynamics import SensorDynamics

Signal = NDArray[np.float64]


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect.

    Attributes
    ----------
    name, unit : str
        As reported.
    trials : tuple of float
        Values from which a fit is started; the likelihood of a delay has more than one maximum.
    lowest, highest : float
        Beyond these the effect means something else.
    step : float
        For differences with respect to it.
    null : float
        The value at which the effect is none.
    least : float
        Distance from `null` below which it is not told from the noise of the record that it acts on.
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
    recorded signal's noise variance and its memory from sample to sample. Of a sudden change `again(time, interval)`
    is the same one at another time, s, in a record with that sampling interval, s. Where `driven_by` names another
    column, the transform takes that one's signal and its result is added. An effect acts on what those found before it
    leave, or, where it `comes_first`, on the recorded signal: a lag of the command and one of the surface are not the
    same beside a limit of the actuator's rate.
    """

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    transform: Callable[[Signal, Signal, tuple[float, ...]], Signal]
    noise: Callable[[tuple[float, ...], float], tuple[float, float]]
    source: str
    column: str = ""
    driven_by: str = ""
    again: Callable[[float, float], InputEffect] | None = None
    comes_first: bool = False

    @property
    def where_acts(self) -> str:
        """The input column that the effect changes."""
        return self.column or self.where


@dataclass(frozen=True)
class OutputEffect:
    """An effect between the true and the recorded response: bias, scale, delay, lag.

    `transform(time, values, parameters)` acts on the simulated output and, being linear but for `offset`, on each of
    its derivatives: (N, C) -> (N, C). `offset(parameters)` is added to the output alone. `undo(time, record,
    parameters)` takes the transform back from a smooth record (N,), NaN where the record does not reach.
    `dynamics(parameters)` is the sensor as noise on its way meets it.
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
        """What the sensor saw (N,), from a smooth record of it (N,)."""
        return self.undo(time, record - self.offset(parameters), parameters)


@dataclass(frozen=True)
class NoiseEffect:
    """A disturbance that no channel shows, known by its statistics alone.

    `noise(parameters, interval, airspeed)` gives variance and memory of each of the input `columns`. Its parameters
    move no output on average; they are found by the likelihood itself.
    """

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    columns: tuple[str, ...]
    noise: Callable[[tuple[float, ...], float, float], tuple[tuple[float, ...], tuple[float, ...]]]
    source: str


@dataclass(frozen=True)
class StateEffect:
    """An effect that depends on the motion itself, and may remember it.

    `law` says how what it adds to the input `columns` follows from the motion, `given` are the law's numbers and
    `places` those of them that the parameters stand for. `lift` is the coefficient whose alpha derivative the law
    takes; where it is `proportional`, the coefficient itself. `whole` is the effect that is fitted where this one, with
    fewer numbers, has shown itself.
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
        """The law's numbers where the parameters have these values."""
        numbers = list(self.given)
        for place, value in zip(self.places, values, strict=True):
            numbers[place] = value
        return tuple(numbers)


@dataclass(frozen=True)
class PositionEffect:
    """A sensor that sits elsewhere than declared: each number, m, along one of the body `axes`, letters of x, y, z.

    To a simulation it is a position of the sensor, and to the motion nothing.
    """

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    axes: str
    source: str


@dataclass(frozen=True)
class BodyEffect:
    """The aircraft itself is another than declared: each number adds to one of the `fields` of its `Constants`."""

    kind: str
    where: str
    parameters: tuple[EffectParameter, ...]
    fields: tuple[str, ...]
    source: str


Effect = InputEffect | OutputEffect | NoiseEffect | StateEffect | PositionEffect | BodyEffect


@dataclass(frozen=True)
class ActiveEffect:
    """An effect with numbers; `log` names the one manoeuvre that it belongs to, empty where it belongs to all.

    `held` are numbers that act and are not estimated: those of a frozen effect.
    """

    effect: Effect
    values: tuple[float, ...]
    log: str = ""
    held: tuple[float, ...] = ()

    @property
    def slopes(self) -> int:
        """How many of its numbers move the outputs: those that a Gauss-Newton step finds."""
        return 0 if isinstance(self.effect, NoiseEffect) else len(self.values)

    def acts_on(self, log: str) -> bool:
        """Whether the effect belongs to the manoeuvre of that name."""
        return not self.log or self.log == log

    def moved(self, step: Sequence[float] | Signal) -> ActiveEffect:
        """The effect after a step in its parameters, kept within their limits."""
        # Python's own min and max: a screening moves thousands of single numbers.
        values = tuple(
            min(max(float(value + change), parameter.lowest), parameter.highest)
            for value, change, parameter in zip(self.values, step, self.effect.parameters, strict=True)
        )
        return ActiveEffect(self.effect, values, self.log, self.held)

    def beside(self, place: int, step: float) -> ActiveEffect:
        """The effect with one parameter moved by `step`, kept within its limits: for differences."""
        return self.moved([step if n == place else 0.0 for n in range(len(self.values))])

    @property
    def numbers(self) -> tuple[float, ...]:
        """All its numbers, estimated or held."""
        return self.values or self.held

    @property
    def name(self) -> tuple[str, str]:
        """Kind and place."""
        return self.effect.kind, self.effect.where


def with_numbers(effects: Iterable[ActiveEffect], numbers: Iterable[tuple[float, ...]]) -> tuple[ActiveEffect, ...]:
    """The effects with other numbers to estimate: of an effect, which holds functions, they alone can be sent."""
    return tuple(replace(active, values=values) for active, values in zip(effects, numbers, strict=True))


def whole(active: ActiveEffect) -> ActiveEffect:
    """The effect with all its numbers, where it was asked for with some of them given."""
    effect = active.effect
    if not isinstance(effect, StateEffect) or effect.whole is None:
        return active
    rest = effect.whole.parameters[len(active.values) :]
    return ActiveEffect(effect.whole, (*active.values, *(p.trials[0] for p in rest)), active.log)


def frozen(active: ActiveEffect) -> ActiveEffect:
    """The effect acting as it is, with no number left to estimate."""
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
