"""International Standard Atmosphere: density altitude, Mach number and calibrated airspeed of a flight condition."""

from __future__ import annotations

import math

SEA_LEVEL_PRESSURE = 101325.0
"""Pa; ISO 2533:1975, with the values below."""
SEA_LEVEL_TEMPERATURE = 288.15
"""K"""
LAPSE_RATE = 0.0065
"""K/m, up to the tropopause."""
TROPOPAUSE = 11000.0
"""m, geopotential; isothermal from there up to 20 km."""
GAS_CONSTANT = 287.05287
"""J/(kg K), of dry air."""
RATIO_OF_HEATS = 1.4
GRAVITY = 9.80665
"""m/s^2"""

SEA_LEVEL_DENSITY = SEA_LEVEL_PRESSURE / (GAS_CONSTANT * SEA_LEVEL_TEMPERATURE)

_PRESSURE_POWER = GRAVITY / (LAPSE_RATE * GAS_CONSTANT)
_DENSITY_POWER = _PRESSURE_POWER - 1.0
DENSITY_ALTITUDE_PER_KELVIN = 1.0 / (LAPSE_RATE * _DENSITY_POWER)
"""m/K by which density altitude rises above pressure altitude with the temperature, below the tropopause: from
d ln(rho)/dh of the standard day and rho T = constant at one pressure."""

_COLD = SEA_LEVEL_TEMPERATURE - LAPSE_RATE * TROPOPAUSE


def temperature(altitude: float) -> float:
    """Temperature, K, at a pressure altitude, m, on a standard day; up to 20 km."""
    return SEA_LEVEL_TEMPERATURE - LAPSE_RATE * min(altitude, TROPOPAUSE)


def pressure(altitude: float) -> float:
    """Static pressure, Pa, at a pressure altitude, m; up to 20 km."""
    below = SEA_LEVEL_PRESSURE * math.pow(temperature(altitude) / SEA_LEVEL_TEMPERATURE, _PRESSURE_POWER)
    return below * math.exp(-GRAVITY * max(altitude - TROPOPAUSE, 0.0) / (GAS_CONSTANT * _COLD))


def density_altitude(density: float) -> float:
    """Altitude, m, at which the standard atmosphere has the density, kg/m^3.

    On a standard day it is the pressure altitude.
    """
    ratio = density / SEA_LEVEL_DENSITY
    at_tropopause = (_COLD / SEA_LEVEL_TEMPERATURE) ** _DENSITY_POWER
    if ratio >= at_tropopause:
        return SEA_LEVEL_TEMPERATURE / LAPSE_RATE * (1.0 - math.pow(ratio, 1.0 / _DENSITY_POWER))
    return TROPOPAUSE - GAS_CONSTANT * _COLD / GRAVITY * math.log(ratio / at_tropopause)


def mach_number(airspeed: float, altitude: float) -> float:
    """Mach number of a true airspeed, m/s, at a pressure altitude, m, on a standard day."""
    return airspeed / math.sqrt(RATIO_OF_HEATS * GAS_CONSTANT * temperature(altitude))


def calibrated_airspeed(airspeed: float, altitude: float) -> float:
    """Calibrated airspeed, m/s, of a true airspeed, m/s, at a pressure altitude, m, on a standard day; subsonic.

    Notes
    -----
    The airspeed that has the same impact pressure at sea level (Gracey, NASA RP-1046, 1980, eqs. 3.16 and 3.19).
    """
    power = RATIO_OF_HEATS / (RATIO_OF_HEATS - 1.0)
    half = 0.5 * (RATIO_OF_HEATS - 1.0)
    impact = pressure(altitude) * ((1.0 + half * mach_number(airspeed, altitude) ** 2) ** power - 1.0)
    mach = math.sqrt(((impact / SEA_LEVEL_PRESSURE + 1.0) ** (1.0 / power) - 1.0) / half)
    return mach * math.sqrt(RATIO_OF_HEATS * GAS_CONSTANT * SEA_LEVEL_TEMPERATURE)
