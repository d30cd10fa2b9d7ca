"""Effects of a sensor: it reads late, slowly, with a bias or a wrong scale."""

from __future__ import annotations

from aerosid.effects.kinds import EffectParameter, OutputEffect
from aerosid.effects.operators import delayed, lagged


def sensor_bias(channel: str, unit: str, noise: float) -> OutputEffect:
    """Measured = true + bias."""
    limit = 1e6 * noise
    return OutputEffect(
        "sensor_bias",
        channel,
        (EffectParameter("bias", unit, trials=(0.0,), lowest=-limit, highest=limit, step=noise),),
        lambda _time, values, _p: values,
        lambda p: p[0],
        "Klein & Morelli, Aircraft System Identification, data compatibility",
    )


def sensor_scale(channel: str) -> OutputEffect:
    """Measured = scale * true."""
    return OutputEffect(
        "sensor_scale",
        channel,
        (EffectParameter("scale", "1", trials=(1.0,), lowest=0.2, highest=5.0, step=1e-4, null=1.0),),
        lambda _time, values, p: p[0] * values,
        lambda _p: 0.0,
        "Klein & Morelli, Aircraft System Identification, data compatibility",
    )


def sensor_delay(channel: str) -> OutputEffect:
    """Measured at t = true at t - delay."""
    return OutputEffect(
        "sensor_delay",
        channel,
        (EffectParameter("delay", "s", trials=(0.02, 0.1, 0.3), lowest=-0.5, highest=2.0, step=1e-4),),
        lambda time, values, p: delayed(time, values, p[0]),
        lambda _p: 0.0,
        "Jategaonkar, Flight Vehicle System Identification, time delays in measurements",
    )


def sensor_lag(channel: str) -> OutputEffect:
    """Measured' = (true - measured)/T."""
    return OutputEffect(
        "sensor_lag",
        channel,
        (EffectParameter("time_constant", "s", trials=(0.03, 0.1, 0.3), lowest=0.0, highest=5.0, step=1e-4),),
        lambda time, values, p: lagged(time, values, p[0]),
        lambda _p: 0.0,
        "Jategaonkar, Flight Vehicle System Identification, sensor dynamics",
    )


def sensor_effects(channel: str, unit: str, noise: float) -> tuple[OutputEffect, ...]:
    """All effects of the sensor of one channel."""
    return sensor_bias(channel, unit, noise), sensor_scale(channel), sensor_delay(channel), sensor_lag(channel)
