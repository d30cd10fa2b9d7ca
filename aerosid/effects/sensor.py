"""Sensor errors: bias, scale factor, time delay, lag."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import EffectParameter, OutputEffect
from aerosid.effects.limits import OFFERED
from aerosid.nomenclature import CHANNELS
from aerosid.signals.delay_and_lag import advanced, delayed, lagged
from aerosid.signals.sensor_dynamics import AT_ONCE, lagging, late, scaled


def sensor_bias(channel: str, unit: str, noise: float) -> OutputEffect:
    """Measured = true + bias."""
    limit = 1e6 * noise
    return OutputEffect(
        "sensor_bias",
        channel,
        (EffectParameter("bias", unit, trials=(0.0,), lowest=-limit, highest=limit, step=noise),),
        lambda _time, values, _p: values,
        lambda p: p[0],
        lambda _time, record, _p: record,
        lambda _p: AT_ONCE,
        "Klein & Morelli, Aircraft System Identification, data compatibility",
    )


def sensor_scale(channel: str) -> OutputEffect:
    """Measured = scale * true."""
    least, greatest = OFFERED.scales
    return OutputEffect(
        "sensor_scale",
        channel,
        (EffectParameter("scale", "1", trials=(1.0,), lowest=least, highest=greatest, step=1e-4, null=1.0),),
        lambda _time, values, p: p[0] * values,
        lambda _p: 0.0,
        lambda _time, record, p: record / p[0],
        lambda p: scaled(p[0]),
        "Klein & Morelli, Aircraft System Identification, data compatibility",
    )


def sensor_delay(channel: str) -> OutputEffect:
    """Measured at t = true at t - delay."""
    earliest, latest = OFFERED.sensor_delays
    return OutputEffect(
        "sensor_delay",
        channel,
        (EffectParameter("delay", "s", trials=(0.02, 0.1, 0.3), lowest=earliest, highest=latest, step=1e-4),),
        lambda time, values, p: delayed(time, values, p[0]),
        lambda _p: 0.0,
        lambda time, record, p: advanced(time, record, p[0]),
        lambda p: late(p[0]),
        "Jategaonkar, Flight Vehicle System Identification, time delays in measurements",
    )


def sensor_lag(channel: str) -> OutputEffect:
    """Measured' = (true - measured)/T."""
    slowest = OFFERED.slowest_sensor
    return OutputEffect(
        "sensor_lag",
        channel,
        (EffectParameter("time_constant", "s", trials=(0.03, 0.1, 0.3), lowest=0.0, highest=slowest, step=1e-4),),
        lambda time, values, p: lagged(time, np.ascontiguousarray(values), p[0]),
        lambda _p: 0.0,
        lambda time, record, p: record + p[0] * np.gradient(record, time),
        lambda p: lagging(p[0]),
        "Jategaonkar, Flight Vehicle System Identification, sensor dynamics",
    )


def sensor_effects(channel: str, unit: str, noise: float) -> tuple[OutputEffect, ...]:
    """All effects of the sensor of one channel."""
    return sensor_bias(channel, unit, noise), sensor_scale(channel), sensor_delay(channel), sensor_lag(channel)


def sensor_offers(noise: Mapping[str, float]) -> Iterator[Offer]:
    """Bias, scale factor, time delay and lag of each channel's sensor, from the standard deviation of its noise, SI."""
    for channel, deviation in noise.items():
        for effect in sensor_effects(channel, CHANNELS[channel].unit, max(deviation, 1e-9)):
            yield Offer(effect.kind, channel, (at_null(effect),))


def _offered(
    flights: tuple[FlightData, ...], _controls: tuple[str, ...], _coefficients: tuple[str, ...]
) -> Iterator[Offer]:
    """Bias, scale factor, time delay and lag of every measured output."""
    for channel in dict.fromkeys(name for flight in flights for name in flight.measured):
        noise = [flight.noise[channel] for flight in flights if channel in flight.measured]
        if noise:
            yield from sensor_offers({channel: float(np.mean(noise))})


FAMILY = Family(
    (
        Kind(
            "sensor_bias",
            "channel",
            "{where} is measured with a bias (measured − true)",
            lambda where, numbers, _interval: sensor_bias(where, CHANNELS[where].unit, abs(numbers["bias"]) or 1.0),
            (Planted("alpha", {"bias": 0.02}),),
            is_bias=True,
        ),
        Kind(
            "sensor_scale",
            "channel",
            "{where} is measured with a scale factor error (measured / true)",
            lambda where, _numbers, _interval: sensor_scale(where),
            (Planted("q", {"scale": 1.08}),),
            negative=False,
        ),
        Kind(
            "sensor_delay",
            "channel",
            "{where} is recorded with a time delay",
            lambda where, _numbers, _interval: sensor_delay(where),
            (Planted("alpha", {"delay": 0.1}),),
            below="{where} is recorded early (negative time delay)",
        ),
        Kind(
            "sensor_lag",
            "channel",
            "{where} is measured with a first-order lag",
            lambda where, _numbers, _interval: sensor_lag(where),
            (Planted("q", {"time_constant": 0.1}), Planted("alpha", {"time_constant": 0.1})),
            negative=False,
            follows_its_score=False,
        ),
    ),
    _offered,
)
