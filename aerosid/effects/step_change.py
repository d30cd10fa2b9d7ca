"""A sudden change of a coefficient: flap, gear, speed brake, ice breaking off, a shifted load."""

from __future__ import annotations

import numpy as np

from aerosid.effects.kinds import ActiveEffect, EffectParameter, InputEffect, Signal
from aerosid.terms import Factor, Term

KIND = "step_change"


def offset_column(coefficient: str) -> str:
    """The input column that adds to a coefficient directly."""
    return f"offset_{coefficient}"


def offset_term(coefficient: str) -> Term:
    """The term of that column."""
    return Term((Factor(offset_column(coefficient), "plain", 0.0, 1),))


def step_change(coefficient: str, time: float, interval: float) -> InputEffect:
    """The coefficient is greater by `jump` from a moment near `time` [s] on; both are estimated.

    A ramp over one sampling `interval` [s], like every input; the sample next to a jump between two samples takes its
    share, so that the moment is known to less than a sample.
    """

    def jumped(instants: Signal, values: Signal, p: tuple[float, ...]) -> Signal:
        return np.asarray(values + p[0] * np.clip((instants - p[1]) / interval + 0.5, 0.0, 1.0))

    return InputEffect(
        KIND,
        coefficient,
        (
            EffectParameter("jump", "1", trials=(0.0,), lowest=-10.0, highest=10.0, step=1e-3),
            # Half a sample: the response to the moment is linear within the ramp.
            EffectParameter("time", "s", (time,), time - 1.0, time + 1.0, step=0.5 * interval, null=time),
        ),
        jumped,
        lambda _p, _interval: (1.0, 0.0),
        "configuration change at an unknown time",
        column=offset_column(coefficient),
    )


def jump_at(coefficient: str, time: float, interval: float) -> InputEffect:
    """As `step_change` with the moment given: what is tested before anything is known of a jump."""
    moving = step_change(coefficient, time, interval)
    return InputEffect(
        KIND,
        coefficient,
        moving.parameters[:1],
        lambda instants, values, p: moving.transform(instants, values, (p[0], time)),
        moving.noise,
        moving.source,
        column=moving.column,
    )


def is_step(active: ActiveEffect) -> bool:
    """Whether an effect is a step change whose moment is a parameter."""
    return active.effect.kind == KIND and len(active.values) == 2


def moment(active: ActiveEffect) -> float:
    """When a step change happens, s of its log."""
    return active.values[1]


def at_moment(active: ActiveEffect, time: float, log: str, interval: float) -> ActiveEffect:
    """The same jump at another moment, on the log of that name."""
    return ActiveEffect(step_change(active.effect.where, time, interval), (active.values[0], time), log)
