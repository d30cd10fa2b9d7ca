"""Step changes at an unknown instant: the grid of instants and its refinement."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from aerosid.effects.family import FlightData, Offer, at_null
from aerosid.effects.kinds import ActiveEffect, EffectParameter, InputEffect, Signal
from aerosid.effects.limits import OFFERED


def step_input(
    kind: str, where: str, column: str, size: EffectParameter, source: str, time: float, interval: float
) -> InputEffect:
    """A step of an input column at an instant near `time` [s]; size and instant are estimated.

    A ramp over one sampling `interval` [s], like every input; the sample next to a step between two samples takes its
    fraction, so that the instant is determined within less than a sample.
    """

    def stepped(instants: Signal, values: Signal, p: tuple[float, ...]) -> Signal:
        return np.asarray(values + p[0] * np.clip((instants - p[1]) / interval + 0.5, 0.0, 1.0))

    return InputEffect(
        kind,
        where,
        (
            size,
            # Half a sample: the response to the instant is linear within the ramp.
            EffectParameter("time", "s", (time,), time - 1.0, time + 1.0, step=0.5 * interval, null=time),
        ),
        stepped,
        lambda _p, _interval: (1.0, 0.0),
        source,
        column=column,
        at_time=lambda moved, sampling: step_input(kind, where, column, size, source, moved, sampling),
        rise=interval,
    )


def rise_among(numbers: Mapping[str, float], interval: float) -> float:
    """The time that a declared step takes, s: its `rise`, or one sampling interval as by default."""
    return max(numbers.get("rise", interval), interval)


def with_fixed_instant(effect: InputEffect, time: float | None = None) -> InputEffect:
    """A step change with its instant fixed, s, by default where it was made: for the test of a hypothesis."""
    time = effect.parameters[1].null if time is None else time
    return replace(
        effect,
        parameters=effect.parameters[:1],
        transform=lambda instants, values, p: effect.transform(instants, values, (p[0], time)),
    )


def offered_on_grid(
    flights: tuple[FlightData, ...], made: Callable[[float, float], tuple[InputEffect, ...]]
) -> Iterator[Offer]:
    """The step changes `made(time, interval)` together, on each flight at the instants of a grid."""
    for flight in flights:
        time = flight.time
        interval = float(np.median(np.diff(time)))
        for moment in time[0] + (time[-1] - time[0]) * np.linspace(0.06, 0.94, OFFERED.grid):
            changes = made(float(moment), interval)
            effects = tuple(at_null(with_fixed_instant(change), flight.log) for change in changes)
            yield Offer(changes[0].kind, flight.log, effects, time=float(moment))


def is_step_change(active: ActiveEffect) -> bool:
    """Whether an effect is a step change whose instant is one of its parameters."""
    effect = active.effect
    return isinstance(effect, InputEffect) and effect.at_time is not None and len(active.numbers) == 2


def step_changes_on(effects: Iterable[ActiveEffect], log: str) -> list[ActiveEffect]:
    """The step changes among some effects that belong to the log of that name."""
    return [active for active in effects if active.log == log and is_step_change(active)]


def instant_of(active: ActiveEffect) -> float:
    """Instant of a step change, s of its log."""
    return active.numbers[1]


def instant_if_step(active: ActiveEffect | None) -> float | None:
    """Instant of a step change, s of its log; None of any other effect, or of none."""
    return instant_of(active) if active is not None and is_step_change(active) else None


def rise_of(active: ActiveEffect) -> float:
    """Time that a step change takes, s."""
    assert isinstance(active.effect, InputEffect)
    return active.effect.rise


def at_instant(active: ActiveEffect, time: float, log: str, interval: float) -> ActiveEffect:
    """The same step change at another instant, on the log of that name; the instant is one of its parameters."""
    assert isinstance(active.effect, InputEffect)
    assert active.effect.at_time is not None
    moved = replace(active.effect.at_time(time, interval), ordinal=active.ordinal)
    return ActiveEffect(moved, (active.numbers[0], time), log)
