"""International Standard Atmosphere, and airspeeds by the impact pressure of compressible flow."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Quantity = TypeVar("Quantity", float, NDArray[np.float64])
"""A number, or an array with one per sample."""

SEA_LEVEL_PRESSURE = 101325.0
"""Standard: Pa; ISO 2533:1975, with the values below."""
SEA_LEVEL_TEMPERATURE = 288.15
"""Standard: K."""
LAPSE_RATE = 0.0065
"""Standard: K/m, up to the tropopause."""
TROPOPAUSE = 11000.0
"""Standard: m, geopotential; isothermal from there up to 20 km."""
GAS_CONSTANT = 287.05287
"""Standard: J/(kg K), of dry air."""
RATIO_OF_HEATS = 1.4
"""Standard: ratio of specific heats of air, 1."""

GRAVITY = 9.80665
"""Standard: acceleration of free fall, m/s^2, ISO 80000-3."""

SEA_LEVEL_DENSITY = SEA_LEVEL_PRESSURE / (GAS_CONSTANT * SEA_LEVEL_TEMPERATURE)

_PRESSURE_POWER = GRAVITY / (LAPSE_RATE * GAS_CONSTANT)
_DENSITY_POWER = _PRESSURE_POWER - 1.0
DENSITY_ALTITUDE_PER_KELVIN = 1.0 / (LAPSE_RATE * _DENSITY_POWER)
"""m/K by which density altitude rises above pressure altitude with the temperature, below the tropopause: from
d ln(rho)/dh of the standard day and rho T = constant at one pressure."""

_HEAT_POWER, _HALF = RATIO_OF_HEATS / (RATIO_OF_HEATS - 1.0), 0.5 * (RATIO_OF_HEATS - 1.0)
_COLD = SEA_LEVEL_TEMPERATURE - LAPSE_RATE * TROPOPAUSE


def temperature(altitude: Quantity) -> Quantity:
    """Temperature, K, at a pressure altitude, m, on a standard day; up to 20 km."""
    standard: Quantity = SEA_LEVEL_TEMPERATURE - LAPSE_RATE * np.minimum(altitude, TROPOPAUSE)
    return standard


def pressure(altitude: Quantity) -> Quantity:
    """Static pressure, Pa, at a pressure altitude, m; up to 20 km.

    By definition of pressure altitude, whatever the temperature is.
    """
    below = SEA_LEVEL_PRESSURE * np.power(temperature(altitude) / SEA_LEVEL_TEMPERATURE, _PRESSURE_POWER)
    above = np.maximum(altitude - TROPOPAUSE, 0.0)
    static: Quantity = below * np.exp(-GRAVITY * above / (GAS_CONSTANT * _COLD))
    return static


def density_altitude(density: float) -> float:
    """Altitude, m, at which the standard atmosphere has the density, kg/m^3.

    On a standard day it is the pressure altitude.
    """
    ratio = density / SEA_LEVEL_DENSITY
    at_tropopause = (_COLD / SEA_LEVEL_TEMPERATURE) ** _DENSITY_POWER
    if ratio >= at_tropopause:
        return float(SEA_LEVEL_TEMPERATURE / LAPSE_RATE * (1.0 - ratio ** (1.0 / _DENSITY_POWER)))
    return float(TROPOPAUSE - GAS_CONSTANT * _COLD / GRAVITY * np.log(ratio / at_tropopause))


def speed_of_sound(temperature: Quantity) -> Quantity:
    """Speed of sound, m/s, in dry air of a static temperature, K."""
    speed: Quantity = np.sqrt(RATIO_OF_HEATS * GAS_CONSTANT * temperature)
    return speed


def impact_ratio(mach: Quantity) -> Quantity:
    """Impact over static pressure, 1, of subsonic flow at a Mach number, 1.

    Notes
    -----
    W. Gracey, NASA RP-1046 (1980), eq. (3.16).
    """
    ratio: Quantity = np.power(1.0 + _HALF * np.square(mach), _HEAT_POWER) - 1.0
    return ratio


def mach_of_impact(ratio: Quantity) -> Quantity:
    """Mach number, 1, of subsonic flow with a ratio of impact to static pressure, 1: `impact_ratio` solved for it."""
    mach: Quantity = np.sqrt((np.power(ratio + 1.0, 1.0 / _HEAT_POWER) - 1.0) / _HALF)
    return mach


def mach_number(airspeed: float, altitude: float) -> float:
    """Mach number of a true airspeed, m/s, at a pressure altitude, m, on a standard day."""
    return float(airspeed / speed_of_sound(temperature(altitude)))


def calibrated_airspeed(airspeed: float, altitude: float) -> float:
    """Calibrated airspeed, m/s, of a true airspeed, m/s, at a pressure altitude, m, on a standard day; subsonic.

    Notes
    -----
    The airspeed with the same impact pressure at sea level (Gracey, NASA RP-1046, 1980, eqs. 3.16 and 3.19).
    """
    ratio = impact_ratio(mach_number(airspeed, altitude)) * pressure(altitude) / SEA_LEVEL_PRESSURE
    return float(mach_of_impact(ratio) * speed_of_sound(SEA_LEVEL_TEMPERATURE))


def true_airspeed(calibrated: Quantity, altitude: Quantity, static_temperature: Quantity) -> Quantity:
    """True airspeed, m/s, of a calibrated airspeed, m/s, at a pressure altitude, m, and static temperature, K.

    Notes
    -----
    The impact pressure that defines calibrated airspeed at sea level, then the Mach number with this impact pressure at
    the static pressure; subsonic, the same source.
    """
    at_sea_level: Quantity = calibrated / speed_of_sound(SEA_LEVEL_TEMPERATURE)
    ratio: Quantity = impact_ratio(at_sea_level) * SEA_LEVEL_PRESSURE / pressure(altitude)
    speed: Quantity = mach_of_impact(ratio) * speed_of_sound(static_temperature)
    return speed


def density(altitude: Quantity, static_temperature: Quantity) -> Quantity:
    """Air density, kg/m^3, at a pressure altitude, m, and static temperature, K."""
    rho: Quantity = pressure(altitude) / (GAS_CONSTANT * static_temperature)
    return rho
