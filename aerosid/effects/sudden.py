"""Sudden changes at an unknown moment: the grid of moments and its refinement."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from aerosid.effects.family import Flown, Offer, at_null
from aerosid.effects.kinds import ActiveEffect, EffectParameter, InputEffect, Signal
from aerosid.effects.limits import OFFERED


def sudden(
    kind: str, where: str, column: str, jump: EffectParameter, source: str, time: float, interval: float
) -> InputEffect:
    """An input column is greater by a jump from a moment near `time` [s] on; both are estimated.

    A ramp over one sampling `interval` [s], like every input; the sample next to a jump between two samples takes its
    share, so that the moment is known to less than a sample.
    """

    def jumped(instants: Signal, values: Signal, p: tuple[float, ...]) -> Signal:
        return np.asarray(values + p[0] * np.clip((instants - p[1]) / interval + 0.5, 0.0, 1.0))

    return InputEffect(
        kind,
        where,
        (
            jump,
            # Half a sample: the response to the moment is linear within the ramp.
            EffectParameter("time", "s", (time,), time - 1.0, time + 1.0, step=0.5 * interval, null=time),
        ),
        jumped,
        lambda _p, _interval: (1.0, 0.0),
        source,
        column=column,
        again=lambda moved, sampling: sudden(kind, where, column, jump, source, moved, sampling),
    )


def at_given_moment(moving: InputEffect) -> InputEffect:
    """A sudden change with its moment given: what is tested before anything is known of a jump."""
    time = moving.parameters[1].null
    return replace(
        moving,
        parameters=moving.parameters[:1],
        transform=lambda instants, values, p: moving.transform(instants, values, (p[0], time)),
    )


def offered_on_a_grid(
    flights: tuple[Flown, ...], made: Callable[[float, float], tuple[InputEffect, ...]]
) -> Iterator[Offer]:
    """The sudden changes `made(time, interval)` together, on each flight at the moments of a grid."""
    for flown in flights:
        time = flown.time
        interval = float(np.median(np.diff(time)))
        for moment in time[0] + (time[-1] - time[0]) * np.linspace(0.06, 0.94, OFFERED.grid):
            changes = made(float(moment), interval)
            effects = tuple(at_null(at_given_moment(change), flown.log) for change in changes)
            yield Offer(changes[0].kind, flown.log, effects, time=float(moment))


def is_sudden(active: ActiveEffect) -> bool:
    """Whether an effect is a sudden change whose moment is one of its numbers."""
    effect = active.effect
    return isinstance(effect, InputEffect) and effect.again is not None and len(active.numbers) == 2


def moment(active: ActiveEffect) -> float:
    """When a sudden change happens, s of its log."""
    return active.numbers[1]


def at_moment(active: ActiveEffect, time: float, log: str, interval: float) -> ActiveEffect:
    """The same jump at another moment, on the log of that name; its moment is one of its numbers."""
    assert isinstance(active.effect, InputEffect)
    assert active.effect.again is not None
    return ActiveEffect(active.effect.again(time, interval), (active.numbers[0], time), log)
