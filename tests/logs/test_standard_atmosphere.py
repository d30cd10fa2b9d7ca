"""The standard atmosphere against the tables of ISO 2533 and of textbooks."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aerosid.logs.standard_atmosphere import (
    SEA_LEVEL_DENSITY,
    calibrated_airspeed,
    density_altitude,
    mach_number,
    pressure,
    temperature,
)

# Altitude, m; temperature, K; pressure, Pa; density, kg/m^3 (ISO 2533:1975, table 1, geopotential altitude).
TABLE = [
    (0.0, 288.15, 101325.0, 1.2250),
    (1000.0, 281.65, 89874.6, 1.11164),
    (5000.0, 255.65, 54019.9, 0.736116),
    (11000.0, 216.65, 22632.1, 0.363918),
    (15000.0, 216.65, 12044.6, 0.193674),
]


@pytest.mark.parametrize(("altitude", "kelvin", "pascal", "density"), TABLE)
def test_the_atmosphere_is_that_of_the_table(altitude: float, kelvin: float, pascal: float, density: float) -> None:
    assert temperature(altitude) == pytest.approx(kelvin, abs=0.005)
    assert pressure(altitude) == pytest.approx(pascal, rel=1e-5)
    assert density_altitude(density) == pytest.approx(altitude, abs=2.0)


def test_calibrated_airspeed_of_a_known_cruise() -> None:
    """Mach 0.80 at FL350 is 271 kt CAS and 461 kt TAS, as on any air data computer."""
    knot = 0.514444
    true = 461.1 * knot
    assert mach_number(true, 35000 * 0.3048) == pytest.approx(0.800, abs=0.001)
    assert calibrated_airspeed(true, 35000 * 0.3048) / knot == pytest.approx(271.4, abs=1.0)


@given(st.floats(20.0, 280.0))
def test_at_sea_level_calibrated_is_true(airspeed: float) -> None:
    assert calibrated_airspeed(airspeed, 0.0) == pytest.approx(airspeed, rel=1e-9)


@given(st.floats(10.0, 60.0), st.floats(0.0, 9000.0))
def test_slow_flight_is_equivalent_airspeed(airspeed: float, altitude: float) -> None:
    """Without compressibility CAS is V sqrt(rho / rho0)."""
    density = pressure(altitude) / (287.05287 * temperature(altitude))
    equivalent = airspeed * (density / SEA_LEVEL_DENSITY) ** 0.5
    assert calibrated_airspeed(airspeed, altitude) == pytest.approx(equivalent, rel=0.005)


@given(st.floats(-500.0, 19000.0))
def test_density_altitude_inverts_the_standard_day(altitude: float) -> None:
    density = pressure(altitude) / (287.05287 * temperature(altitude))
    assert density_altitude(density) == pytest.approx(altitude, abs=0.01)
