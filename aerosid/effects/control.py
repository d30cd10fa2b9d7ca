"""Control-system effects: lag, delay, rate limit and dead band between recorded and acting surface."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from aerosid.effects.family import Family, Flown, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import EffectParameter, InputEffect, Signal
from aerosid.effects.limits import OFFERED
from aerosid.signals.delay_and_lag import deadbanded, delayed_linear, lagged, rate_limited
from aerosid.signals.noise import estimate_noise

THRUST_COLUMN = "thrust_change"
"""Thrust beyond the recorded one, N."""

ADDED_IN = {"thrust": THRUST_COLUMN}
"""Columns that take what is added to a recorded input which the kernel reads in a place of its own."""

SLOW = frozenset(ADDED_IN)
"""Inputs that take seconds: an engine runs up in one to ten."""


Transform = Callable[[Signal, Signal, tuple[float, ...]], Signal]
"""An acting signal (N,) of time, recorded signal and numbers."""


def _lateness(channel: str, name: str, lowest: float = 0.0, least: float = 0.0) -> EffectParameter:
    before = (-0.03,) if lowest < 0.0 else ()
    trials, highest = ((0.25, 0.5, 1.0, 2.0, 4.0), 10.0) if channel in SLOW else ((0.03, 0.1, 0.25), 2.0)
    return EffectParameter(name, "s", trials=(*trials, *before), lowest=lowest, highest=highest, step=1e-4, least=least)


def _late(
    kind: str,
    channel: str,
    parameter: EffectParameter,
    transform: Transform,
    noise: Callable[[tuple[float, ...], float], tuple[float, float]],
    source: str,
) -> InputEffect:
    """The effect of a transform of the recorded input, in its place or as what it adds to it."""
    column = ADDED_IN.get(channel, "")
    if not column:
        return InputEffect(kind, channel, (parameter,), transform, noise, source)
    return InputEffect(
        kind,
        channel,
        (parameter,),
        lambda time, recorded, p: transform(time, recorded, p) - recorded,
        lambda _p, _interval: (1.0, 0.0),
        source,
        column=column,
        driven_by=channel,
    )


def control_lag(channel: str) -> InputEffect:
    """The surface follows the recorded control with a first-order lag: d' = (d_recorded - d)/T."""
    return _late(
        "control_lag",
        channel,
        _lateness(channel, "time_constant"),
        lambda time, values, p: lagged(time, np.ascontiguousarray(values)[:, None], p[0])[:, 0],
        lambda p, interval: _lag_noise(p[0], interval),
        "MIL-F-8785C equivalent systems: actuator as a first-order lag",
    )


def control_delay(channel: str, earliest: float = 0.0, least: float = 0.0) -> InputEffect:
    """The surface follows the recorded control after a pure delay.

    `earliest` [s]: the lowest that it may be; below zero the record is late. `least` [s]: what counts as none.
    """
    return _late(
        "control_delay",
        channel,
        _lateness(channel, "delay", earliest, least),
        lambda time, values, p: delayed_linear(time, values, p[0]),
        lambda _p, _interval: (1.0, 0.0),
        "MIL-F-8785C equivalent time delay",
    )


def control_rate_limit(channel: str, fastest: float, widest: float, lasting: int = 1) -> InputEffect:
    """The surface moves no faster than a limit.

    `fastest` [rad/s] is the greatest rate in the record, `widest` [rad] the greatest excursion, `lasting` over how many
    sampling intervals the fastest movement goes. A step's rate depends on the sampling alone: what limit shows itself
    is known from the time that the excursion takes, and one that makes the fastest movement longer by less than the
    time within which a sample places it is none.
    """
    resolved = fastest / (1.0 + OFFERED.least_slowing / lasting)
    highest, lowest = 0.5 * fastest, min(0.05 * fastest, widest / OFFERED.slowest)
    return InputEffect(
        "control_rate_limit",
        channel,
        (
            EffectParameter(
                "limit",
                "rad/s",
                trials=tuple(np.geomspace(lowest, highest, 4).tolist()),
                lowest=0.1 * lowest,
                highest=fastest,
                step=1e-4 * fastest,
                null=fastest,
                least=fastest - resolved,
            ),
        ),
        lambda time, values, p: rate_limited(time, np.ascontiguousarray(values), p[0]),
        lambda _p, _interval: (1.0, 0.0),
        "rate saturation of an actuator",
    )


def control_deadband(channel: str, widest: float, noise: float = 0.0) -> InputEffect:
    """Excursions of the recorded control within a band do not move the surface.

    `widest` is the greatest excursion, `noise` the record's standard deviation, rad.
    """
    return InputEffect(
        "control_deadband",
        channel,
        (
            EffectParameter(
                "width",
                "rad",
                trials=(0.05 * widest, 0.2 * widest),
                lowest=0.0,
                highest=0.9 * widest,
                step=1e-4 * widest,
                least=OFFERED.least_band * noise,
            ),
        ),
        lambda _time, values, p: deadbanded(values, p[0]),
        lambda _p, _interval: (1.0, 0.0),
        "free play of a control run",
    )


def control_effects(
    channel: str, time: Signal, values: Signal, earliest: float = 0.0, least: float = 0.0
) -> tuple[InputEffect, ...]:
    """All effects of one control, limits taken from its record; `earliest` and `least` as of `control_delay`."""
    fastest = float(np.max(np.abs(np.diff(values) / np.diff(time))))
    widest = float(np.max(np.abs(values - values[0])))
    if fastest == 0.0 or widest == 0.0:
        return ()
    return (
        control_lag(channel),
        control_delay(channel, earliest, least),
        control_rate_limit(channel, fastest, widest, _lasting(time, values)),
        control_deadband(channel, widest, float(estimate_noise(time, values))),
    )


def _lasting(time: Signal, values: Signal) -> int:
    """Sampling intervals over which the fastest movement of a record goes on at half its rate at least."""
    rates = np.diff(values) / np.diff(time)
    fastest = int(np.argmax(np.abs(rates)))
    quick = rates * np.sign(rates[fastest]) >= 0.5 * abs(rates[fastest])
    before = int(np.argmin(quick[fastest::-1])) if not quick[fastest::-1].all() else fastest + 1
    after = int(np.argmin(quick[fastest:])) if not quick[fastest:].all() else quick.size - fastest
    return before + after - 1


def _lag_noise(constant: float, interval: float) -> tuple[float, float]:
    """White noise through the lag: its variance's factor and its memory over one interval."""
    if constant <= 0.0:
        return 1.0, 0.0
    decay = float(np.exp(-interval / constant))
    ramp = constant * (1.0 - decay) / interval
    now, before = 1.0 - ramp, ramp - decay
    # y_k = now x_k + (before + decay now) x_(k-1) + decay (before + decay now) x_(k-2) + ...
    tail = (before + decay * now) ** 2 / (1.0 - decay**2)
    variance = now**2 + tail
    covariance = now * (before + decay * now) + decay * tail
    return variance, covariance / variance


def _offered(flights: tuple[Flown, ...], controls: tuple[str, ...], _coefficients: tuple[str, ...]) -> Iterator[Offer]:
    """Lag, delay, rate limit and dead band of every control that moves."""
    for channel in controls:
        widest = max(flights, key=lambda flown: float(np.ptp(flown.inputs[channel])))
        sideways = {"p", "r"} <= set(widest.axes.integrated)
        earliest = OFFERED.earliest_control if sideways else 0.0
        least = OFFERED.least_timing * float(np.median(np.diff(widest.time))) if sideways else 0.0
        for effect in control_effects(channel, widest.time, widest.inputs[channel], earliest, least):
            yield Offer(effect.kind, channel, (at_null(effect),))


FAMILY = Family(
    (
        Kind(
            "control_lag",
            "input",
            "{where} acts with a first-order lag",
            lambda where, _numbers, _interval: control_lag(where),
            (Planted("delta_e", {"time_constant": 0.15}),),
            negative=False,
            follows_its_score=False,
        ),
        Kind(
            "control_delay",
            "input",
            "{where} acts with a delay",
            lambda where, numbers, _interval: control_delay(where, min(0.0, 2.0 * numbers["delay"])),
            (Planted("delta_e", {"delay": 0.12}),),
            follows_its_score=False,
            below="{where} acts before it is recorded",
        ),
        Kind(
            "control_rate_limit",
            "input",
            "{where} is limited in rate",
            lambda where, numbers, _interval: control_rate_limit(where, 10.0 * numbers["limit"], numbers["limit"]),
            (Planted("delta_e", {"limit": 0.15}),),
            negative=False,
            follows_its_score=False,
        ),
        Kind(
            "control_deadband",
            "input",
            "{where} has a dead band",
            lambda where, numbers, _interval: control_deadband(where, 2.0 * numbers["width"]),
            (Planted("delta_e", {"width": 0.012}),),
            negative=False,
            follows_its_score=False,
        ),
    ),
    _offered,
)
