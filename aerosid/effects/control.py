"""Control-system effects: lag, delay, rate limit and dead band between recorded and acting surface."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import EffectParameter, InputEffect, Signal
from aerosid.effects.limits import OFFERED
from aerosid.signals.delay_and_lag import deadbanded, delayed, delayed_linear, lagged, rate_limited, refined
from aerosid.signals.noise import estimate_noise, noise_at_rest

PARTS = 4
"""Numerical: lines of each interval by which a smooth control lags; they lose a sixteenth of what one does."""

THRUST_COLUMN = "thrust_change"
"""Thrust beyond the recorded one, N."""

ADDED_IN = {"thrust": THRUST_COLUMN}
"""Columns of additions to a recorded input that the kernel reads from a column of its own."""

SLOW_INPUTS = frozenset(ADDED_IN)
"""Inputs with lags of seconds: an engine takes one to ten to run up."""


Transform = Callable[[Signal, Signal, tuple[float, ...]], Signal]
"""An acting signal (N,) of time, recorded signal and parameters."""


def _delay_parameter(channel: str, name: str, lowest: float = 0.0, least: float = 0.0) -> EffectParameter:
    before = (-0.03,) if lowest < 0.0 else ()
    trials, highest = ((0.25, 0.5, 1.0, 2.0, 4.0), 10.0) if channel in SLOW_INPUTS else ((0.03, 0.1, 0.25), 2.0)
    return EffectParameter(name, "s", trials=(*trials, *before), lowest=lowest, highest=highest, step=1e-4, least=least)


def _delayed_effect(
    kind: str,
    channel: str,
    parameter: EffectParameter,
    transform: Transform,
    noise: Callable[[tuple[float, ...], float], tuple[float, float]],
    source: str,
) -> InputEffect:
    """The effect of a transform of the recorded input, in place of it or as an addition to it."""
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


def control_lag(channel: str, *, is_smooth: bool = False) -> InputEffect:
    """The surface follows the recorded control with a first-order lag: d' = (d_recorded - d)/T.

    `is_smooth`: whether the control is smooth between samples, where others are linear.
    """
    return _delayed_effect(
        "control_lag",
        channel,
        _delay_parameter(channel, "time_constant"),
        _lagged_smooth if is_smooth else _lagged_linear,
        lambda p, interval: _lag_noise(p[0], interval),
        "MIL-F-8785C equivalent systems: actuator as a first-order lag",
    )


def _lagged_linear(time: Signal, values: Signal, p: tuple[float, ...]) -> Signal:
    return lagged(time, np.ascontiguousarray(values)[:, None], p[0])[:, 0]


def _lagged_smooth(time: Signal, values: Signal, p: tuple[float, ...]) -> Signal:
    return _lagged_linear(*refined(time, values, PARTS), p)[::PARTS]


def control_delay(channel: str, earliest: float = 0.0, least: float = 0.0, *, is_smooth: bool = False) -> InputEffect:
    """The surface follows the recorded control after a pure time delay.

    `earliest` [s]: lower limit; below zero the record itself is delayed. `least` [s]: insignificant delay. `is_smooth`:
    as of `control_lag`.
    """
    return _delayed_effect(
        "control_delay",
        channel,
        _delay_parameter(channel, "delay", earliest, least),
        _delayed_smooth if is_smooth else lambda time, values, p: delayed_linear(time, values, p[0]),
        lambda _p, _interval: (1.0, 0.0),
        "MIL-F-8785C equivalent time delay",
    )


def _delayed_smooth(time: Signal, values: Signal, p: tuple[float, ...]) -> Signal:
    return delayed(time, np.ascontiguousarray(values)[:, None], p[0])[:, 0]


def control_rate_limit(channel: str, max_rate: float, max_excursion: float, movement_length: int = 1) -> InputEffect:
    """Rate limit of the surface.

    `max_rate` [rad/s] is the largest rate in the record, `max_excursion` [rad] the largest excursion, `movement_length`
    the sampling intervals of the fastest movement. A step's rate depends on the sampling alone: the range of observable
    limits follows from the time that the excursion takes, and a limit that prolongs the fastest movement by less than
    the time resolution of the samples is insignificant.
    """
    resolved = max_rate / (1.0 + OFFERED.least_slowing / movement_length)
    highest, lowest = 0.5 * max_rate, min(0.05 * max_rate, max_excursion / OFFERED.slowest)
    return InputEffect(
        "control_rate_limit",
        channel,
        (
            EffectParameter(
                "limit",
                "rad/s",
                trials=tuple(np.geomspace(lowest, highest, 4).tolist()),
                lowest=0.1 * lowest,
                highest=max_rate,
                step=1e-4 * max_rate,
                null=max_rate,
                least=max_rate - resolved,
            ),
        ),
        lambda time, values, p: rate_limited(time, np.ascontiguousarray(values), p[0]),
        lambda _p, _interval: (1.0, 0.0),
        "rate saturation of an actuator",
    )


def control_deadband(channel: str, max_excursion: float, noise: float = 0.0, at_rest: float = 0.0) -> InputEffect:
    """Dead band: excursions of the recorded control within it do not move the surface.

    `max_excursion` is the largest excursion, `noise` the standard deviation of the record's white noise, rad; where it
    is not given, it is estimated from the record. `at_rest`: that of all noise, coloured noise included.
    """
    return InputEffect(
        "control_deadband",
        channel,
        (
            EffectParameter(
                "width",
                "rad",
                trials=(0.05 * max_excursion, 0.2 * max_excursion),
                lowest=0.0,
                highest=0.9 * max_excursion,
                step=1e-4 * max_excursion,
                least=OFFERED.least_band * at_rest,
            ),
        ),
        lambda time, values, p: deadbanded(
            values, p[0], OFFERED.at_rest * (noise or float(estimate_noise(time, values)))
        ),
        lambda _p, _interval: (1.0, 0.0),
        "free play of a control run",
    )


def control_effects(
    channel: str,
    time: Signal,
    values: Signal,
    earliest: float = 0.0,
    least: float = 0.0,
    *,
    is_smooth: bool = False,
) -> tuple[InputEffect, ...]:
    """All effects of one control, limits taken from its record; the rest as of `control_delay`."""
    max_rate = float(np.max(np.abs(np.diff(values) / np.diff(time))))
    max_excursion = float(np.max(np.abs(values - values[0])))
    if max_rate == 0.0 or max_excursion == 0.0:
        return ()
    white = estimate_noise(time, values)
    return (
        control_lag(channel, is_smooth=is_smooth),
        control_delay(channel, earliest, least, is_smooth=is_smooth),
        control_rate_limit(channel, max_rate, max_excursion, _movement_length(time, values)),
        control_deadband(channel, max_excursion, white, noise_at_rest(time, values, white)),
    )


def _movement_length(time: Signal, values: Signal) -> int:
    """Sampling intervals over which the fastest movement of a record has at least half its rate."""
    rates = np.diff(values) / np.diff(time)
    peak = int(np.argmax(np.abs(rates)))
    quick = rates * np.sign(rates[peak]) >= 0.5 * abs(rates[peak])
    before = int(np.argmin(quick[peak::-1])) if not quick[peak::-1].all() else peak + 1
    after = int(np.argmin(quick[peak:])) if not quick[peak:].all() else quick.size - peak
    return before + after - 1


def _lag_noise(constant: float, interval: float) -> tuple[float, float]:
    """White noise filtered by the lag: the factor on its variance and its memory over one interval."""
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


def _offered(
    flights: tuple[FlightData, ...], controls: tuple[str, ...], _coefficients: tuple[str, ...]
) -> Iterator[Offer]:
    """Lag, delay, rate limit and dead band of every control that moves."""
    for channel in controls:
        most_moved = max(flights, key=lambda flight: float(np.ptp(flight.inputs[channel])))
        is_lateral = {"p", "r"} <= set(most_moved.axes.integrated)
        earliest = OFFERED.earliest_control if is_lateral else 0.0
        least = OFFERED.least_timing * float(np.median(np.diff(most_moved.time))) if is_lateral else 0.0
        values, is_smooth = most_moved.inputs[channel], channel in most_moved.smooth
        for effect in control_effects(channel, most_moved.time, values, earliest, least, is_smooth=is_smooth):
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
            "{where} acts with a time delay",
            lambda where, numbers, _interval: control_delay(where, min(0.0, 2.0 * numbers["delay"])),
            (Planted("delta_e", {"delay": 0.12}),),
            follows_its_score=False,
            below="{where} acts before it is recorded (negative time delay)",
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
