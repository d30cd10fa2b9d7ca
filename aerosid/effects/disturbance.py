"""Disturbances without a channel: gusts and unmodelled forces as coloured process noise with a correlation time."""

from __future__ import annotations

import numpy as np

from aerosid.effects.family import Family, Kind, Planted
from aerosid.effects.kinds import EffectParameter, NoiseEffect
from aerosid.effects.step_change import offset_column
from aerosid.flight_model.axes import LATERAL, SIX, Axes

GUST_COLUMN = "gust_w"
"""Vertical gust velocity, m/s, positive down like w; zero in every simulation, uncertain in the likelihood."""

SIDE_GUST_COLUMN = "gust_v"
"""Lateral gust velocity, m/s, positive to the right like v."""

VANE_IN = {GUST_COLUMN: "alpha", SIDE_GUST_COLUMN: "beta"}
"""The flow angle that each gust velocity changes."""

_LENGTH = EffectParameter("length", "m", trials=(150.0,), lowest=10.0, highest=3000.0, step=0.0)
_SOURCE = "MIL-F-8785C turbulence, first-order"


def _sigma_parameter(name: str) -> EffectParameter:
    return EffectParameter(name, "m/s", trials=(0.2, 1.0), lowest=1e-3, highest=20.0, step=0.0)


def gust() -> NoiseEffect:
    """Vertical turbulence, which acts on the vane and on every force that depends on alpha.

    Exponentially correlated along the flight path with standard deviation sigma and scale length L, the simplest form
    with the low-frequency content of Dryden's spectrum (MIL-F-8785C).
    """
    return NoiseEffect(
        "gust",
        "",
        (_sigma_parameter("sigma"), _LENGTH),
        (GUST_COLUMN,),
        _correlated,
        _SOURCE,
    )


def side_gust() -> NoiseEffect:
    """Lateral turbulence, as the vertical one."""
    return NoiseEffect("side_gust", "", (_sigma_parameter("sigma"), _LENGTH), (SIDE_GUST_COLUMN,), _correlated, _SOURCE)


def turbulence() -> NoiseEffect:
    """Vertical and lateral turbulence of one scale length, independent of each other."""
    parameters = (_sigma_parameter("sigma"), _sigma_parameter("sigma_side"), _LENGTH)
    return NoiseEffect("turbulence", "", parameters, (GUST_COLUMN, SIDE_GUST_COLUMN), _correlated, _SOURCE)


def gusts_of(axes: Axes) -> tuple[NoiseEffect, ...]:
    """Turbulence across the flight path, along each velocity that a case integrates, and along both."""
    possible = {GUST_COLUMN: "w" in axes.integrated, SIDE_GUST_COLUMN: "v" in axes.integrated}
    return tuple(effect for effect in (gust(), side_gust(), turbulence()) if all(possible[c] for c in effect.columns))


def _correlated(p: tuple[float, ...], interval: float, airspeed: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Variance and memory of each column; `p`: standard deviations first, then the one scale length."""
    memory = float(np.exp(-airspeed * interval / p[-1]))
    return tuple(sigma**2 for sigma in p[:-1]), (memory,) * (len(p) - 1)


def unmodelled_forces(coefficients: tuple[str, ...]) -> NoiseEffect:
    """Unmodelled forces and moments: a first-order Gauss-Markov process in each coefficient.

    They explain nothing. A gust must gain more than they do to be named.
    """
    sigmas = tuple(
        EffectParameter(name, "1", trials=(2e-3,), lowest=1e-6, highest=1.0, step=0.0) for name in coefficients
    )
    memories = tuple(
        EffectParameter(f"memory of {name}", "s", trials=(0.3,), lowest=0.03, highest=10.0, step=0.0)
        for name in coefficients
    )

    def noise(p: tuple[float, ...], interval: float, _airspeed: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        sigma, memory = p[: len(coefficients)], p[len(coefficients) :]
        return tuple(value**2 for value in sigma), tuple(float(np.exp(-interval / value)) for value in memory)

    return NoiseEffect(
        "unmodelled_forces",
        "",
        (*sigmas, *memories),
        tuple(offset_column(name) for name in coefficients),
        noise,
        "the model error d(t) of Parameswaran & Raol 1994, with a memory",
    )


FAMILY = Family(
    (
        Kind(
            "gust",
            "nothing",
            "vertical turbulence (standard deviation of the vertical wind)",
            lambda _where, _numbers, _interval: gust(),
            (Planted("", {"sigma": 0.8, "length": 180.0}),),
            negative=False,
            noun="vertical turbulence",
        ),
        Kind(
            "side_gust",
            "nothing",
            "lateral turbulence (standard deviation of the wind from the side)",
            lambda _where, _numbers, _interval: side_gust(),
            (Planted("", {"sigma": 0.8, "length": 180.0}, axes=LATERAL),),
            negative=False,
            noun="lateral turbulence",
        ),
        Kind(
            "turbulence",
            "nothing",
            "vertical and lateral turbulence (standard deviations of the wind)",
            lambda _where, _numbers, _interval: turbulence(),
            (Planted("", {"sigma": 0.8, "sigma_side": 0.8, "length": 180.0}, axes=SIX),),
            negative=False,
            noun="vertical and lateral turbulence",
        ),
    ),
)
